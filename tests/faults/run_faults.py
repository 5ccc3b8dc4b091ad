#!/usr/bin/env python3
"""Runs `spartan` under injected faults and prints, for each class, how many trials ended as documented.

    run_faults.py --program SPARTAN --shim LIBRARY --small-runs FOLDER [--trials N] [--seed N] [--only CLASS]…

Documented (docs/reference/command_line.md): a fault of the system ends a run with 3, 5 or 130, never by a signal that was
not sent and never with 1; what was committed stays; --resume continues, and its results have the same bytes as those of
the undisturbed run. `--trials` scales the number of trials of each class (1: continuous integration). FOLDER is what
make_small_runs has made. Exits with 1 if a trial differs.
"""
import argparse
import errno
import importlib.machinery
import importlib.util
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import power_loss

REPOSITORY = Path(__file__).resolve().parents[2]
RUN_OPTIONS = ["--set", "terrain.every_m=0.15", "--threads", "1"]
TIME_LIMIT_S = 120
FAILED_RUN = {3, 5}


def load_run_hashes():
    loader = importlib.machinery.SourceFileLoader("run_hashes", str(REPOSITORY / "scripts" / "run_hashes"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("run_hashes", loader))
    loader.exec_module(module)
    return module


run_hashes = load_run_hashes()


class Differs(Exception):
    """A trial did not end as documented; says how."""


class Skipped(Exception):
    """A trial that could not inject its fault, and so says nothing."""


def stable_content(run):
    files = {str(p.relative_to(run)): p.read_bytes() for p in run.rglob("*")
             if p.is_file() and run_hashes.is_byte_stable(p.relative_to(run))}
    files.update(run_hashes.table_hashes(run / "run.sqlite"))
    return files


class Bench:
    """The program, a recording, what its undisturbed run gives, and a folder for each trial."""

    def __init__(self, options):
        self.program, self.shim = options.program, options.shim
        self.drive = Path(options.small_runs) / "drive"
        self.expected = stable_content(Path(options.small_runs) / "drive_run")
        self.trials, self.random = options.trials, random.Random(options.seed)
        self.folder = Path(tempfile.mkdtemp(prefix="spartan_faults_"))
        self.out = self.folder / "out"

    def command(self, *more, drive=None, out=None):
        return [self.program, "run", str(drive or self.drive), "-o", str(out or self.out), *RUN_OPTIONS, *more]

    def spawn(self, command, faults=None, **more):
        environment = dict(os.environ, **(more.pop("environment", {})))
        if faults is not None:
            environment.update({f"FAULT_{key}": str(value) for key, value in faults.items()}, LD_PRELOAD=self.shim)
        more.setdefault("stdout", subprocess.PIPE)
        more.setdefault("stderr", subprocess.PIPE)
        return subprocess.Popen(command, env=environment, **more)

    def execute(self, command, faults=None, allowed=None, **more):
        process = self.spawn(command, faults, **more)
        try:
            out, err = process.communicate(timeout=TIME_LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            raise Differs(f"does not end: {' '.join(command)}") from None
        message = (err or b"").decode(errors="replace").strip().splitlines()[-1:]
        if allowed is not None and process.returncode not in allowed:
            raise Differs(f"exit {process.returncode}, expected one of {sorted(allowed)}: {message}")
        return process.returncode, (out or b"").decode(errors="replace"), (err or b"").decode(errors="replace")

    def faulted(self, faults, allowed, command=None):
        """Executes with the shim; the number of counted calls. Skips the trial where nothing was injected."""
        report = self.folder / "report"
        report.unlink(missing_ok=True)
        code, _, _ = self.execute(command or self.command(), {**faults, "REPORT": report}, allowed)
        text = report.read_text() if report.exists() else ""
        if "AT" in faults and "injected at" not in text:
            raise Skipped(f"call {faults['AT']} was not reached")
        return code, int(text.split("calls ")[-1].split()[0]) if "calls " in text else 0

    def expect_same_bytes(self, out=None):
        """Continues the run undisturbed; everything must be as if nothing had happened."""
        out = out or self.out
        self.execute(self.command("--resume", out=out), allowed={0})
        content = stable_content(out)
        wrong = [name for name in self.expected.keys() | content.keys() if self.expected.get(name) != content.get(name)]
        if wrong:
            raise Differs(f"other bytes after --resume: {sorted(wrong)[:4]}")
        leftover = [p.name for p in out.rglob("*") if p.name.endswith(".part") or p.name == "owner.lock"]
        if leftover:
            raise Differs(f"left behind: {leftover}")

    def seconds_of_a_run(self):
        start = time.monotonic()
        self.execute(self.command(), allowed={0})
        shutil.rmtree(self.out)
        return time.monotonic() - start

    def times(self, count):
        return range(max(1, round(count * self.trials)))


# --- classes: generators of trials; a trial is a function without arguments ------------------------------------------


def kills(bench):
    """SIGKILL at a random moment, in every second trial also inside the --resume."""
    seconds = bench.seconds_of_a_run()

    def kill_after(command, delay):
        process = bench.spawn(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(delay)
        process.kill()
        process.wait()

    def trial(i):
        kill_after(bench.command(), bench.random.uniform(0, seconds))
        if i % 2:
            kill_after(bench.command("--resume"), bench.random.uniform(0, seconds))
        bench.expect_same_bytes()

    for i in bench.times(6):
        yield lambda i=i: trial(i)


def two_processes(bench):
    """Two processes begin with one folder: one finishes, the other one is refused or comes after it."""
    def trial(first, second):
        if first and second:
            bench.execute(bench.command("--max-frames", "3"), allowed={0})
        started = [bench.spawn(bench.command(*more)) for more in (first, second)]
        results = []
        for process in started:
            _, err = process.communicate(timeout=TIME_LIMIT_S)
            results.append((process.returncode, err.decode(errors="replace")))
        codes = sorted(code for code, _ in results)
        refused = [err for code, err in results if code == 5]
        if codes[0] != 0 or codes[1] not in {0, 5} or (codes[1] == 0 and not (first or second)):
            raise Differs(f"exit {codes}")
        if any("in use by another process" not in err and "already exists" not in err for err in refused):
            raise Differs(f"refused for another reason: {refused}")
        bench.expect_same_bytes()

    for _ in bench.times(2):
        for pair in (([], []), ([], ["--resume"]), (["--resume"], ["--resume"])):
            yield lambda pair=pair: trial(*pair)


def signals(bench):
    """SIGINT and SIGTERM once: 130. What was done stays."""
    seconds = dict.fromkeys(("run", "simulate"), bench.seconds_of_a_run())
    left, right = (str(bench.drive / f"image_{camera}/000000.png") for camera in (0, 1))
    rig = str(bench.drive / "calib.txt")
    commands = {
        "run": bench.command(),
        "stereo": [bench.program, "stereo", left, right, "-o", str(bench.folder / "stereo")],
        "map build": [bench.program, "map", "build", left, right, "--rig", rig, "-o", str(bench.folder / "map")],
        "rig design": [bench.program, "rig", "design", str(REPOSITORY / "config/requirements/rover.yaml"), "--all"],
        "simulate": [bench.program, "simulate", "quick", "-o", str(bench.folder / "rec")],
    }

    def remove_outputs():
        for output in ("stereo", "map", "rec"):
            shutil.rmtree(bench.folder / output, ignore_errors=True)

    def seconds_of(name):
        start = time.monotonic()
        bench.execute(commands[name], allowed={0})
        return time.monotonic() - start

    remove_outputs()
    # A simulation takes a minute; its signals come within the time of a run.
    seconds |= {name: seconds_of(name) for name in ("stereo", "map build", "rig design")}

    def trial(name, number):
        remove_outputs()
        process = bench.spawn(commands[name], stdout=subprocess.DEVNULL)
        # Before main() has begun the default action applies, which is 130 in a shell as well.
        time.sleep(bench.random.uniform(0.05, 0.4) * seconds[name])
        if process.poll() is not None:
            raise Skipped("ended before the signal")
        process.send_signal(number)
        process.communicate(timeout=TIME_LIMIT_S)
        if process.returncode not in {130, 128 + number, -number}:
            raise Differs(f"{name}: exit {process.returncode} after signal {number}")
        if name == "run":
            bench.expect_same_bytes()

    for _ in bench.times(1):
        for name in commands:
            for number in (signal.SIGINT, signal.SIGTERM):
                yield lambda name=name, number=number: trial(name, number)


def streams(bench):
    """Standard streams that are full, closed or not read."""
    dump = [bench.program, "config", "dump", "--all"]

    def trial(redirect, command, allowed):
        code, _, _ = bench.execute(["/bin/bash", "-c", f'"$@" {redirect}', "bash", *command])
        if code not in allowed:
            raise Differs(f"{redirect}: exit {code}, expected {sorted(allowed)}")
        if command[1] == "run":
            bench.expect_same_bytes()

    cases = [(redirect, bench.command(), {0}) for redirect in ("2>/dev/full", "2>&-", "2>&- <&-", "2>&1 | head -1 >/dev/null")]
    cases += [(redirect, bench.command(), {5}) for redirect in (">/dev/full", ">&-", ">&- 2>&- <&-", "> >(exec true)")]
    cases += [(redirect, dump, {5}) for redirect in (">/dev/full", ">&-")]
    for case in cases:
        yield lambda case=case: trial(*case)


def failing_call(call, number, path="", least=0, allowed=frozenset({0, 3, 5}), count=10, first=1):
    """Call n of a kind fails, once or from then on; n over the whole run."""
    def trials(bench):
        base = {"CALL": call, "ERRNO": number, **({"PATH": path} if path else {}), **({"MIN": least} if least else {})}
        _, total = bench.faulted(base, {0})
        shutil.rmtree(bench.out)
        if total < 1:
            raise Differs(f"no {call} was counted")

        def trial(at, from_then_on):
            faults = {**base, "AT": at, **({"FROM": 1} if from_then_on else {})}
            bench.faulted(faults, allowed)
            bench.expect_same_bytes()

        wanted = len(bench.times(count))
        numbers = range(first, total + 1) if wanted >= total else sorted(bench.random.sample(range(first, total + 1), wanted))
        for i, at in enumerate(numbers):
            yield lambda at=at, i=i: trial(at, i % 3 == 2)

    trials.__doc__ = f"{call} fails with {errno.errorcode[number]}" + (f" on *{path}*" if path else "")
    return trials


def file_size_limits(bench):
    """ulimit -f: 5, and the same bytes afterwards."""
    def trial(kilobytes):
        limit = kilobytes * 1024
        code, _, _ = bench.execute(bench.command(), allowed={0, 5},
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        if code == 0 and kilobytes < 1000:
            raise Differs(f"exit 0 with {kilobytes} kB")
        bench.expect_same_bytes()

    for i in bench.times(4):
        yield lambda i=i: trial([0, 8, 256, 900, 1500, 64, 32, 512, 1, 128][i % 10] + i // 10)


def full_disk(bench):
    """A small file system that is full: 5, also for --resume; after it was enlarged the same bytes."""
    def trial(kilobytes):
        mount = bench.folder / "disk"
        mount.mkdir(exist_ok=True)
        made = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "none", str(mount)], capture_output=True, check=False)
        if made.returncode != 0:
            raise Skipped("no tmpfs can be mounted")
        try:
            for more in ([], ["--resume"]):
                bench.execute(bench.command(*more, out=mount / "out"), allowed={5})
            subprocess.run(["mount", "-o", "remount,size=100m", str(mount)], check=True)
            bench.expect_same_bytes(mount / "out")
        finally:
            subprocess.run(["umount", str(mount)], check=True)

    for i in bench.times(3):
        yield lambda i=i: trial([64, 400, 1200, 150, 800, 250, 1000, 100, 600, 300][i % 10] + 4 * (i // 10))


def slow_disk(bench):
    """Every write and fsync takes longer: the same bytes."""
    def trial(delay_us):
        bench.execute(bench.command(), {"DELAY": delay_us}, {0})
        bench.expect_same_bytes()

    for i in bench.times(1):
        yield lambda i=i: trial(200 * (i + 1))


def address_space(bench):
    """ulimit -v at ten limits: done, or 5 (3 where an image cannot be read, 127 where the loader does not fit)."""
    def trial(megabytes):
        limit = megabytes << 20
        code, _, err = bench.execute(bench.command(), allowed={0, 3, 5, 127},
                                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
        if code == 127 and "shared libraries" not in err:
            raise Differs(f"exit 127: {err}")
        if code == 127:
            raise Skipped("the libraries do not fit")
        bench.expect_same_bytes()

    for megabytes in (150, 300, 350, 380, 400, 430, 460, 500, 700, 2000):
        yield lambda megabytes=megabytes: trial(megabytes)


def environments(bench):
    """One core, no HOME, no TMPDIR, odd time zones and locales, a clock that jumps: the same bytes."""
    def trial(command, environment=None, faults=None):
        bench.execute(command, faults, {0}, environment=environment or {})
        bench.expect_same_bytes()

    yield lambda: trial(["taskset", "-c", "0", *bench.command()])
    yield lambda: trial(["env", "-u", "HOME", *bench.command()])
    yield lambda: trial(["env", "-i", *bench.command()])
    for key, value in (("TMPDIR", "/nowhere"), ("TZ", "Pacific/Kiritimati"), ("TZ", ":/etc/passwd"), ("LC_ALL", "tr_TR.UTF-8"),
                       ("LC_ALL", "de_DE.UTF-8"), ("LC_NUMERIC", "de_DE.UTF-8"), ("LANG", "xx_YY")):
        yield lambda key=key, value=value: trial(bench.command(), {key: value})
    for _ in bench.times(1):
        yield lambda: trial(bench.command(), faults={"CLOCK": 1})


def changed_recordings(bench):
    """An image or a stamp changes before --resume: 4, and nothing is written."""
    def trial(change):
        drive = bench.folder / "drive"
        shutil.rmtree(drive, ignore_errors=True)
        shutil.copytree(bench.drive, drive)
        bench.execute(bench.command("--max-frames", "8", drive=drive), allowed={0})
        before = stable_content(bench.out)
        change(drive)
        bench.execute(bench.command("--resume", drive=drive), allowed={4})
        if stable_content(bench.out) != before:
            raise Differs("a refused --resume has written")

    def swap(drive, camera, i):
        shutil.copy(drive / f"image_{camera}/{i + 1:06}.png", drive / f"image_{camera}/{i:06}.png")

    for _ in bench.times(2):
        camera, i = bench.random.randrange(2), bench.random.randrange(8)
        yield lambda camera=camera, i=i: trial(lambda drive: swap(drive, camera, i))
        yield lambda camera=camera, i=i: trial(lambda drive: (drive / f"image_{camera}/{i:06}.png").unlink())
    yield lambda: trial(lambda drive: (drive / "times.txt").write_text((drive / "times.txt").read_text() + "99.0\n"))


def removed_output(bench):
    """run.sqlite or the whole folder is removed in the middle: 5."""
    seconds = bench.seconds_of_a_run()

    def trial(whole):
        process = bench.spawn(bench.command())
        deadline = time.monotonic() + TIME_LIMIT_S
        while not (bench.out / "trajectory_odometry.tum").exists() and process.poll() is None:
            if (bench.out / "run.sqlite-wal").exists() and (bench.out / "run.sqlite-wal").stat().st_size > 100_000:
                break
            if time.monotonic() > deadline:
                raise Differs("nothing was written")
            time.sleep(0.005 * seconds)
        if process.poll() is not None:
            raise Skipped("ended too early")
        shutil.rmtree(bench.out, ignore_errors=True) if whole else (bench.out / "run.sqlite").unlink(missing_ok=True)
        process.communicate(timeout=TIME_LIMIT_S)
        if process.returncode != 5:
            raise Differs(f"exit {process.returncode}, expected 5")

    for i in bench.times(2):
        yield lambda i=i: trial(i % 2 == 1)


def power_losses(bench):
    """What was not flushed is lost in any order: --resume works, with the same bytes."""
    trace = bench.folder / "trace"
    bench.execute(bench.command(), {"TRACE": trace, "TRACE_FOLDER": bench.folder}, {0})
    shutil.rmtree(bench.out)
    records = power_loss.read_trace(trace)
    if len(records) < 100:
        raise Differs(f"only {len(records)} records were traced")

    def trial(count, seed):
        for path, content in power_loss.state_after(records, count, seed).items():
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            Path(path).write_bytes(content)
        bench.expect_same_bytes()

    for i in bench.times(8):
        yield lambda i=i: trial(bench.random.randrange(len(records) + 1), i)


# A report that cannot be made is a warning, so 0 is documented for faults after the last frame; the bytes tell.
CLASSES = {
    "kill": kills,
    "two processes": two_processes,
    "signals": signals,
    "streams": streams,
    "malloc": failing_call("malloc", errno.ENOMEM, least=2048, count=12),
    "malloc, large": failing_call("malloc", errno.ENOMEM, least=100_000, count=6),
    "open, no descriptor": failing_call("open", errno.EMFILE, path="/", count=8),
    "open, permission": failing_call("open", errno.EACCES, path="image_", count=4, allowed=frozenset({0, 3})),
    "read": failing_call("read", errno.EIO, path="drive", count=8, allowed=frozenset({0, 3, 4})),
    "read of the store": failing_call("read", errno.EIO, path="run.sqlite", count=3),
    "write, disk full": failing_call("write", errno.ENOSPC, path="out", count=8, allowed=frozenset({5})),
    "write, error": failing_call("write", errno.EIO, path="out", count=4, allowed=frozenset({5})),
    "fsync": failing_call("fsync", errno.EIO, path="out", count=4, allowed=frozenset({0, 5})),
    "rename": failing_call("rename", errno.ENOSPC, count=4, allowed=frozenset({0, 5})),
    "file size limit": file_size_limits,
    "full disk": full_disk,
    "slow disk": slow_disk,
    "address space": address_space,
    "environment": environments,
    "changed recording": changed_recordings,
    "removed output": removed_output,
    "power loss": power_losses,
}


def run_class(bench, name):
    """Numbers of trials as documented, that differ, and skipped; prints what differs."""
    good = bad = skipped = 0
    for trial in CLASSES[name](bench):
        shutil.rmtree(bench.out, ignore_errors=True)
        try:
            trial()
            good += 1
        except Skipped:
            skipped += 1
        except Differs as difference:
            bad += 1
            print(f"  {name}: {difference}", flush=True)
    shutil.rmtree(bench.out, ignore_errors=True)
    return good, bad, skipped


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--shim", required=True)
    parser.add_argument("--small-runs", required=True)
    parser.add_argument("--trials", type=float, default=1, help="factor of the number of trials")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", choices=list(CLASSES), help="only this class")
    options = parser.parse_args()
    bench = Bench(options)
    total_bad = total_good = 0
    print(f"{'class':22} {'as documented':>14} {'different':>10} {'skipped':>8}")
    try:
        for name in options.only or CLASSES:
            good, bad, skipped = run_class(bench, name)
            total_bad, total_good = total_bad + bad, total_good + good
            if good + bad == 0 and skipped > 0:
                total_bad += name not in {"full disk"}  # needs root
            print(f"{name:22} {good:14} {bad:10} {skipped:8}", flush=True)
    finally:
        shutil.rmtree(bench.folder, ignore_errors=True)
    print(f"{'total':22} {total_good:14} {total_bad:10}")
    sys.exit(1 if total_bad or not total_good else 0)


if __name__ == "__main__":
    main()
