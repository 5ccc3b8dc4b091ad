"""Every format that the program reads: an example, its mutations, and the commands that read it."""
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import mutations

CALIBRATIONS = ("euroc", "kalibr", "opencv", "ros", "mrcal", "tsai", "cahvor", "kitti-raw", "rig.yaml")
_ENDINGS = {"kalibr": ".yaml", "opencv": ".yml", "ros": ".yaml", "mrcal": ".cameramodel", "tsai": ".tsai",
            "cahvor": ".cahvor", "kitti": ".txt", "kitti-raw": ".txt", "rig.yaml": ".yaml"}
EXTREME_ARGUMENTS = ("2147483647", "2147483648", "-1", "0", "1e300", "1e-300", "nan", "inf", "9" * 400, "",
                     "0x7f", "1,2,3")


@dataclass
class Format:
    """`trial(folder, rng)` makes a mutated input in an empty folder and returns the command that reads it."""

    trial: Callable
    long_trials: int
    may_take_long: bool = False


def _mutated_file(tree, file, mutate, commands):
    """A trial: a copy of a tree, one file of it mutated. In the commands IN stands for the copy, OUT for a new path."""
    def trial(folder, rng):
        copy = folder / "in"
        shutil.copytree(tree, copy)
        name = rng.choice(file) if isinstance(file, (list, tuple)) else file
        target = copy / name
        if mutate in (mutations.of_database, mutations.of_stage_memory):
            mutate(target, rng)
        else:
            target.write_bytes(mutate(target.read_bytes(), rng))
        return _filled(rng.choice(commands), copy, folder / "out", name)

    return trial


def _filled(command, tree, out, file=""):
    return [str(word).replace("IN", str(tree)).replace("OUT", str(out)).replace("FILE", str(file)) for word in command]


def _fixed_files(files, commands):
    """A trial: one of several hostile files. In the commands IN stands for its path."""
    def trial(folder, rng):
        name, content = rng.choice(list(files.items()))
        (folder / name).write_bytes(content)
        return _filled(rng.choice(commands), folder / name, folder / "out")

    return trial


def _run(path, *more):
    return ("run", path, "-o", "OUT", "--threads", "1", "--max-frames", "3", *more)


def _stereo(left, right, *more):
    return ("stereo", left, right, "-o", "OUT", "--threads", "1", "--max-disparity", "31", *more)


def formats_of(lab):
    drive, source = lab.recordings["drive"], lab.source
    left, right = drive.path / "image_0/000000.png", drive.path / "image_1/000000.png"
    text, table, binary = mutations.of_text, mutations.of_table, mutations.of_bytes
    seeds = source / "tests/fuzz/seeds"
    rigs = sorted(file.name for file in (source / "config/rigs").glob("*.yaml"))
    resume = ("run", drive.path, "-o", "IN", "--resume", "--threads", "1", *drive.options)
    reads_run = [("export", "IN", "--format", "csv", "-o", "OUT"), ("map", "info", "IN"),
                 ("evaluate", "IN", "--truth", drive.path), resume, resume]
    terrain = next((drive.run / "terrain").glob("*.pfm"))
    found = {
        "KITTI calib.txt": Format(_mutated_file(drive.path, "calib.txt", text, [
            _run("IN"), ("rig", "inspect", "IN/calib.txt"), _stereo(left, right, "--calib", "IN/calib.txt")]), 70),
        "KITTI times.txt": Format(_mutated_file(drive.path, "times.txt", table, [_run("IN")]), 45),
        "shipped rigs": Format(_mutated_file(source / "config/rigs", rigs, text, [
            ("rig", "inspect", "IN/FILE"), ("rig", "inspect", "IN/FILE", "--json")]), 80),
        "rig.yaml of a run": Format(_mutated_file(drive.run, "rig.yaml", text, [
            _run(drive.path, "--rig", "IN/rig.yaml")]), 60),
        "calibrations, single": Format(_mutated_file(
            seeds / "calibration", _names(seeds / "calibration"), text, [
                ("rig", "inspect", "IN/FILE"), ("rig", "convert", "IN/FILE", "OUT.yaml", "--size-px", "640,480")]), 60),
        "PNG of a recording": Format(_mutated_file(drive.path, "image_0/000000.png", binary, [
            _run("IN"), _stereo("IN/image_0/000000.png", right)]), 60),
        "images": Format(_mutated_file(seeds / "image", _names(seeds / "image"), binary, [
            _stereo("IN/FILE", "IN/FILE")]), 90),
        "image headers": Format(_fixed_files(mutations.image_attacks(), [
            _stereo("IN", "IN"), _stereo(left, right, "--truth", "IN"), 
            _stereo(left, right, "--truth", terrain, "--mask", "IN")]), 60),
        "PFM": Format(_mutated_file(drive.run / "terrain", terrain.name, binary, [
            _stereo(left, right, "--truth", f"IN/{terrain.name}")]), 30),
        "requirements.yaml": Format(_mutated_file(source / "config/requirements", "rover.yaml", text, [
            ("rig", "design", "IN/rover.yaml", "-o", "OUT")]), 30, may_take_long=True),
        "trajectories": Format(_mutated_file(seeds / "trajectory", _names(seeds / "trajectory"), table, [
            ("evaluate", "IN/FILE", "--truth", "IN/FILE"), ("evaluate", drive.run, "--truth", "IN/FILE")]), 50),
        "TUM of a run": Format(_mutated_file(drive.run, "trajectory_odometry.tum", table, [
            ("evaluate", "IN/trajectory_odometry.tum", "--truth", drive.path / "poses.txt")]), 30),
        "run.sqlite, bytes": Format(_mutated_file(drive.run, "run.sqlite", binary, reads_run), 60),
        "run.sqlite, content": Format(_mutated_file(drive.run, "run.sqlite", mutations.of_database, reads_run), 210),
        "stage memory": Format(_mutated_file(drive.run, "run.sqlite", mutations.of_stage_memory, [resume]), 50),
        "configuration": Format(_mutated_file(drive.run, "config.yaml", text, [
            ("config", "check", "IN/config.yaml"), _run(drive.path, "--config", "IN/config.yaml")]), 100),
        "options": Format(_option_trial(lab), 90),
    }
    found |= _written_calibrations(lab, drive)
    if "stops" in lab.recordings:
        found |= _formats_of_stops(lab)
    found["YAML attacks"] = Format(_yaml_trial(lab), 180, may_take_long=True)
    return found


def _names(folder):
    return sorted(file.name for file in folder.iterdir() if file.is_file())


def _written_calibrations(lab, drive):
    """Formats that `rig convert` writes, each in a folder of its own."""
    found = {}
    for name in CALIBRATIONS:
        folder = lab.work / "calibrations" / name
        folder.mkdir(parents=True)
        target = folder / f"rig{_ENDINGS.get(name, '')}"
        done = lab.run("rig", "convert", drive.path / "calib.txt", target, "--to", name,
                       "--size-px", "320,240", "--force")
        files = sorted(file.relative_to(folder) for file in folder.rglob("*") if file.is_file())
        if done.code != 0 or not files:
            raise RuntimeError(f"no {name} calibration was written: {done.err}")
        given = "IN/rig" if (folder / "rig").is_dir() else ",".join(f"IN/{file}" for file in files[:2])
        convert = ("rig", "convert", given, "OUT.yaml", "--size-px", "320,240")  # a few formats do not hold the size
        read = lab.run(*_filled(convert, folder, lab.new_folder()))
        if read.code != 0:  # else a mutation would show nothing
            raise RuntimeError(f"the {name} calibration that was written is not read: {read.err}")
        found[f"calibration, {name}"] = Format(_mutated_file(folder, files, mutations.of_text, [
            convert, ("rig", "inspect", given), _run(drive.path, "--rig", given)]), 20)
    return found


def _formats_of_stops(lab):
    stops = lab.recordings["stops"]
    rec, scenarios = stops.path, lab.small_runs / "stops"
    maps = lab.work / "maps"
    maps.mkdir()
    done = lab.run("map", "export", stops.run, "-o", maps / "site.map")
    if done.code != 0:
        raise RuntimeError(f"no map was written: {done.err}")
    reads_map = [("map", "info", "IN/site.map"), ("map", "export", "IN/site.map", "-o", "OUT.tif"),
                 ("map", "merge", "IN/site.map", maps / "site.map", "-o", "OUT.map")]
    resume = ("run", rec, "-o", "IN", "--resume", "--threads", "1")
    reads_run = [("map", "info", "IN"), ("map", "export", "IN", "-o", "OUT.tif"), resume,
                 ("export", "IN", "--format", "ply", "-o", "OUT")]
    found = {
        "recording.yaml": Format(_mutated_file(rec, "recording.yaml", mutations.of_text, [_run("IN")]), 45),
        "rig.yaml of a recording": Format(_mutated_file(rec, "rig.yaml", mutations.of_text, [_run("IN")]), 60),
        "frames.csv": Format(_mutated_file(rec, "frames.csv", mutations.of_table, [_run("IN")]), 95),
        "scenario.yaml": Format(_mutated_file(rec, "truth/scenario.yaml", mutations.of_text, [
            ("simulate", "IN/truth/scenario.yaml", "-o", "OUT", "--threads", "1")]), 50, may_take_long=True),
        ".map, bytes": Format(_mutated_file(maps, "site.map", mutations.of_bytes, reads_map), 60),
        ".map, content": Format(_mutated_file(maps, "site.map", mutations.of_database, reads_map), 240),
        "run.sqlite with maps": Format(_mutated_file(stops.run, "run.sqlite", mutations.of_database, reads_run), 60),
    }
    for sensor in ("imu", "wheels", "compass", "inclinometer"):
        found[f"{sensor}.csv"] = Format(
            _mutated_file(rec, f"sensors/{sensor}.csv", mutations.of_table, [_run("IN")]), 32)
    return found


def _yaml_trial(lab):
    """Each attack, in turn, on each reader of YAML."""
    drive = lab.recordings["drive"]
    readers = [("config", "check", "IN"), _run(drive.path, "--config", "IN"), ("rig", "inspect", "IN"),
               _run(drive.path, "--rig", "IN"), ("rig", "design", "IN"),
               ("simulate", "IN", "-o", "OUT", "--threads", "1"), ("rig", "convert", "IN", "OUT.yaml")]
    attacks = mutations.yaml_attacks()
    order = [(name, reader) for reader in readers for name in attacks]

    def trial(folder, rng):
        if not order:
            order.extend((name, reader) for reader in readers for name in attacks)
        name, reader = order.pop(rng.randrange(len(order)))
        prefix = rng.choice((b"", b"", b"%YAML:1.0\n---\n", b"cam0:\n"))  # what OpenCV and Kalibr files begin with
        path = folder / rng.choice(("attack.yaml", "attack.yml"))
        path.write_bytes(prefix + attacks[name])
        return _filled(reader, path, folder / "out")

    return trial


def _option_trial(lab):
    """Numeric arguments of the commands with extreme values."""
    drive = lab.recordings["drive"]
    left, right = drive.path / "image_0/000000.png", drive.path / "image_1/000000.png"
    calib = drive.path / "calib.txt"
    build = ("map", "build", left, right, "-o", "OUT", "--rig", calib, "--threads", "1")
    evaluate = ("evaluate", drive.run, "--truth", drive.path)
    run = ("run", drive.path, "-o", "OUT")
    commands = [
        (*run, "--threads=VALUE"), (*run, "--max-frames=VALUE"), 
        (*run, "--max-frames=1", "--set", "terrain.every_m=VALUE"),
        (*run, "--max-frames=1", "--set", "odometry.detection.landmarks=VALUE"),
        (*run, "--max-frames=1", "--set", "gravity_m_s2=VALUE"), (*_stereo(left, right)[:-2], "--max-disparity=VALUE"),
        (*_stereo(left, right), "--min-disparity=VALUE"), 
        (*_stereo(left, right), "--truth-scale=VALUE", "--truth", left),
        (*build, "--extent-m=VALUE"), (*build, "--cell-m=VALUE"), (*build, "--gravity=VALUE,0,1"),
        (*evaluate, "--max-dt=VALUE"), (*evaluate, "--segments=VALUE"),
        ("map", "export", list(lab.recordings.values())[-1].run, "-o", "OUT.tif", "--window=0,0,VALUE,VALUE"),
        ("map", "export", list(lab.recordings.values())[-1].run, "-o", "OUT.tif", "--window=-VALUE,-VALUE,1,1"),
        ("rig", "convert", calib, "OUT.yaml", "--size-px=VALUE,VALUE"),
        ("rig", "design", lab.source / "config/requirements/rover.yaml", "--rows=VALUE"),
    ]

    def trial(folder, rng):
        value, command = rng.choice(EXTREME_ARGUMENTS), rng.choice(commands)
        return [word.replace("VALUE", value) for word in _filled(command, folder, Path(folder) / "out")]

    return trial
