#!/usr/bin/env python3
"""Gives `spartan` damaged and hostile input files of every format and prints how the trials ended.

    mutate_inputs.py --program SPARTAN --small-runs FOLDER [--trials N] [--seed N] [--only FORMAT]…

Every trial must end with a documented exit code (0, 2 to 6), within a time and a memory limit: never by a signal, and never
with 1, which is a bug of the program. Exits with 1 otherwise; the input is then kept and named.
"""
import argparse
import collections
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import mutations

REPOSITORY = Path(__file__).resolve().parents[2]
DOCUMENTED = {0, 2, 3, 4, 5, 6}
TIME_LIMIT_S = 60
MEMORY_LIMIT_BYTES = 6 << 30
FEW_FRAMES = ["--max-frames", "3", "--threads", "1"]


class Format:
    """An input: a file inside a tree, which is copied, and the commands that read it."""

    def __init__(self, tree, file, commands, is_text=True, is_database=False):
        self.tree, self.file, self.commands = Path(tree), file, commands
        self.is_text, self.is_database = is_text, is_database


def formats(program, small_runs, folder):
    """Name -> Format. `{}` in a command stands for the copied tree, OUT for a folder to write."""
    drive, run = small_runs / "drive", small_runs / "drive_run"
    rec, whole = small_runs / "stops" / "rec", small_runs / "stops" / "whole"
    run_drive = ["run", "{}", "-o", "OUT", *FEW_FRAMES]
    stereo = ["stereo", "{}/image_0/000000.png", "{}/image_1/000000.png", "-o", "OUT", "--max-disparity", "31"]
    found = {
        "KITTI calib.txt": Format(drive, "calib.txt", [run_drive, ["rig", "inspect", "{}/calib.txt"]]),
        "KITTI times.txt": Format(drive, "times.txt", [run_drive]),
        "PNG": Format(drive, "image_0/000000.png", [run_drive, stereo], is_text=False),
        "trajectory": Format(run, "trajectory_odometry.tum", [["evaluate", "{}", "--truth", f"{drive}/poses.txt"]]),
        "KITTI poses": Format(drive, "poses.txt", [["evaluate", str(run), "--truth", "{}/poses.txt"]]),
        "configuration": Format(run, "config.yaml", [["config", "check", "{}/config.yaml"]]),
        "PFM": Format(run, None, [["stereo", f"{drive}/image_0/000000.png", f"{drive}/image_1/000000.png", "-o", "OUT",
                                   "--max-disparity", "31", "--truth", "{}/FILE"]], is_text=False),
        "run.sqlite, bytes": Format(run, "run.sqlite", [["export", "{}", "--format", "csv", "-o", "OUT"],
                                                        ["run", str(drive), "-o", "{}", "--resume", "--set",
                                                         "terrain.every_m=0.15", "--threads", "1"]], is_text=False),
        "run.sqlite, content": Format(run, "run.sqlite", [["export", "{}", "--format", "csv", "-o", "OUT"],
                                                          ["run", str(drive), "-o", "{}", "--resume", "--set",
                                                           "terrain.every_m=0.15", "--threads", "1"]], is_database=True),
        "requirements": Format(REPOSITORY / "config" / "requirements", "rover.yaml", [["rig", "design", "{}/rover.yaml"]]),
    }
    terrain = next((run / "terrain").glob("*.pfm"))
    found["PFM"].file = f"terrain/{terrain.name}"
    found["PFM"].commands[0][-1] = f"{{}}/terrain/{terrain.name}"
    calibrations = folder / "calibrations"
    calibrations.mkdir()
    for name in ("euroc", "kalibr", "opencv", "ros", "mrcal", "tsai", "cahvor", "kitti-raw", "spartan"):
        target = calibrations / name
        target.mkdir()
        done = subprocess.run([program, "rig", "convert", str(drive / "calib.txt"), str(target / "rig"), "--to", name, "--force"],
                              capture_output=True, check=False)
        files = [path for path in sorted(target.rglob("*")) if path.is_file()]
        if done.returncode == 0 and files:
            names = ",".join(f"{{}}/{path.relative_to(target)}" for path in files[:2])
            asked = names if len(files) == 2 else "{}" if len(files) > 2 else names
            found[f"calibration, {name}"] = Format(target, str(files[0].relative_to(target)), [["rig", "inspect", asked]])
    if rec.is_dir():
        run_rec = ["run", "{}", "-o", "OUT", *FEW_FRAMES]
        found |= {
            "recording.yaml": Format(rec, "recording.yaml", [run_rec]),
            "rig.yaml": Format(rec, "rig.yaml", [run_rec, ["rig", "inspect", "{}/rig.yaml"]]),
            "frames.csv": Format(rec, "frames.csv", [run_rec]),
            "scenario": Format(small_runs / "stops", "small.yaml", [["simulate", "{}/small.yaml", "-o", "OUT"]]),
        }
        for table in sorted((rec / "sensors").glob("*.csv")):
            found[f"sensors/{table.name}"] = Format(rec, f"sensors/{table.name}", [run_rec])
        maps = folder / "maps"
        maps.mkdir()
        subprocess.run([program, "map", "export", str(whole), "-o", str(maps / "a.map")], check=True, capture_output=True)
        reads = [["map", "info", "{}/a.map"], ["map", "export", "{}/a.map", "-o", "OUT.tif"],
                 ["map", "merge", "{}/a.map", str(maps / "a.map"), "-o", "OUT.map"]]
        found["map, bytes"] = Format(maps, "a.map", reads, is_text=False)
        found["map, content"] = Format(maps, "a.map", reads, is_database=True)
    return found


def execute(command):
    """The exit code, or what went wrong."""
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIME_LIMIT_S, check=False, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return "hang", ""
    return done.returncode, done.stderr.decode(errors="replace").strip().splitlines()[-1:]


class Trials:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.failures = 0

    def run(self, name, command, tree, codes):
        out = self.folder / "out"
        for left in self.folder.glob("out*"):
            shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink()
        words = [word.replace("{}", str(tree)).replace("OUT", str(out)) for word in command]
        code, message = execute([self.program, *words])
        codes[code] += 1
        if code in DOCUMENTED:
            return
        self.failures += 1
        kept = Path(tempfile.mkdtemp(prefix="spartan_input_"))
        shutil.copytree(tree, kept / "input")
        print(f"  {name}: {code} {message}: {' '.join(words)}; the input is kept in {kept}", flush=True)

    def mutated(self, name, form, draw, codes):
        tree = self.folder / "input"
        mutations.copy_tree(form.tree, tree)
        target = tree / form.file
        if form.is_database:
            mutations.mutate_database(target, draw)
        else:
            target.write_bytes(mutations.mutate_bytes(target.read_bytes(), draw, form.is_text))
        self.run(name, draw.choice(form.commands), tree, codes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--small-runs", required=True)
    parser.add_argument("--trials", type=int, default=3, help="mutations of each format")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", help="only this format")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="spartan_mutations_"))
    trials = Trials(options.program, folder)
    total = 0
    print(f"{'format':28} {'trials':>6}  exit codes")
    try:
        every = formats(options.program, Path(options.small_runs), folder)
        attacked = {name: form for name, form in every.items() if form.file and form.file.endswith(".yaml")}
        unknown = [name for name in options.only or [] if name not in every and name != "YAML attacks"]
        if unknown:
            sys.exit(f"no such format: {unknown}; known: {sorted(every)}")
        for name, form in every.items():
            if options.only and name not in options.only:
                continue
            draw, codes = random.Random(f"{options.seed} {name}"), collections.Counter()
            # A mutated scenario is seldom invalid, and a valid one is rendered: only its reading is of interest.
            count = options.trials if name != "scenario" else 0
            for _ in range(count):
                trials.mutated(name, form, draw, codes)
            total += count
            if count:
                print(f"{name:28} {count:6}  {dict(codes)}", flush=True)
        if not options.only or "YAML attacks" in options.only:
            codes = collections.Counter()
            for name, form in attacked.items():
                for attack, text in mutations.yaml_attacks().items():
                    tree = folder / "input"
                    mutations.copy_tree(form.tree, tree)
                    (tree / form.file).write_bytes(text)
                    trials.run(f"YAML attack '{attack}' on {name}", form.commands[0], tree, codes)
                    total += 1
            print(f"{'YAML attacks':28} {sum(codes.values()):6}  {dict(codes)}", flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{'total':28} {total:6}  {trials.failures} not as documented")
    sys.exit(1 if trials.failures or not total else 0)


if __name__ == "__main__":
    main()
