"""Faults of the disk: file size limit, full, slow; parts of the output removed; changed input before a resume."""
import os
import resource
import shutil
import signal
import subprocess

from lab import DIFFERS, SKIPPED, VOID, Verdict, judge


def file_size_limit(lab, trials):
    """`ulimit -f` from 0 to beyond the largest file: exit code 5, and the same files after a resume without it."""
    done = 0
    for _ in range(4 * trials):
        if done == trials:
            return
        recording, folder = lab.any_recording(), lab.new_folder()
        largest = max(file.stat().st_size for file in recording.run.rglob("*") if file.is_file())
        limit = lab.rng.choice((0, 1, lab.rng.randint(1, largest), int(largest ** lab.rng.random())))
        end = lab.run(*lab.run_command(recording, folder), before=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (limit, limit)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        what = f"{recording.name}, {limit} bytes"
        if end.code == recording.code and not lab.differences(folder, recording):
            yield Verdict(VOID, what)  # the largest file was of the report, or the store grew otherwise
        else:
            done += 1
            yield judge(end.problems({5}) + lab.resume(folder, recording), what)
        lab.clean(folder)


class SmallDisk:
    """A tmpfs of a given size; `path` is None where it cannot be mounted."""

    def __init__(self, lab, kilobytes):
        self.path, self.folder = None, lab.new_folder("disk")
        self.folder.mkdir()
        if os.geteuid() == 0 and self._mount(f"size={kilobytes}k"):
            self.path = self.folder

    def _mount(self, options):
        return subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(self.folder)],
                              capture_output=True, check=False).returncode == 0

    def enlarge(self):
        self._mount("remount,size=256m")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.path is not None:
            subprocess.run(["umount", "-l", str(self.folder)], capture_output=True, check=False)
        self.folder.rmdir()


def full_disk(lab, trials):
    """`run` on a small tmpfs ends with 5, also when resumed there; after enlarging, a resume gives the same files."""
    done = 0
    for _ in range(4 * trials):
        if done == trials:
            return
        recording = lab.any_recording()
        bytes_used = sum(file.stat().st_size for file in recording.run.rglob("*") if file.is_file())
        kilobytes = max(8, int(1.1 * bytes_used / 1024 * lab.rng.random() ** 2))
        what = f"{recording.name}, {kilobytes} KB"
        with SmallDisk(lab, kilobytes) as disk:
            if disk.path is None:
                yield Verdict(SKIPPED, "not root, or tmpfs cannot be mounted")
                return
            folder = disk.path / "run"
            first = lab.run(*lab.run_command(recording, folder))
            if first.code == recording.code:
                yield Verdict(VOID, what)
                continue
            done += 1
            problems = first.problems({5})
            problems += lab.run(*lab.run_command(recording, folder, "--resume")).problems({5})
            disk.enlarge()
            yield judge(problems + lab.resume(folder, recording), what)


def full_disk_of_commands(lab, trials):
    """Every other command that writes ends with 5 on a full disk and leaves no partial file under its final name."""
    commands = {name: command for name, command in lab.commands().items() if command.writes and name != "run"}
    for attempt in range(trials):
        name = list(commands)[attempt % len(commands)]
        kilobytes = 4 * lab.rng.randint(1, 2)
        with SmallDisk(lab, kilobytes) as disk:
            if disk.path is None:
                yield Verdict(SKIPPED, "not root, or tmpfs cannot be mounted")
                return
            done = lab.run(*commands[name].arguments(disk.path / "out"))
            if done.code == commands[name].code:  # its whole output fits into 8 KB
                yield Verdict(VOID, f"{name}, {kilobytes} KB")
            else:
                yield judge(done.problems({5}), f"{name}, {kilobytes} KB")


def slow_disk(lab, trials):
    """Every write and fsync of the output takes up to 1 ms: the same files."""
    for _ in range(trials):
        recording, folder = lab.any_recording(), lab.new_folder()
        delay = lab.rng.randint(100, 1000)
        done, report = lab.run_with({"DELAY_US": delay, "PATH": folder.name}, *lab.run_command(recording, folder))
        problems = done.problems({recording.code}) + lab.differences(folder, recording)
        what = f"{recording.name}, {report.delays} delays of {delay} us"
        yield judge(problems, what) if report.delays else Verdict(VOID, what)
        lab.clean(folder)


def stopped_midway(lab, recording, folder, change):
    """A run that stops at a random write to its store, lets `change` happen, and goes on. None if it did not stop."""
    counted, probe = lab.new_folder("report"), lab.new_folder()
    faults = {"CALL": "write", "PATH": "run.sqlite", "REPORT": counted}
    lab.run(*lab.run_command(recording, probe), env=lab.environment(faults))
    lab.clean(probe)
    writes = lab.read_report(counted).calls
    at = lab.rng.randint(writes // 4, writes * 3 // 4)  # the store exists, and frames are still to come
    stop = {**faults, "AT": at, "SIGNAL": int(signal.SIGSTOP)}
    process = lab.start(*lab.run_command(recording, folder), env=lab.environment(stop))
    _, status = os.waitpid(process.pid, os.WUNTRACED)
    counted.unlink(missing_ok=True)
    if not os.WIFSTOPPED(status):
        process.returncode = os.waitstatus_to_exitcode(status)
        lab.end(process)
        return None
    change()
    process.send_signal(signal.SIGCONT)
    return lab.end(process)


def removed_midway(lab, trials):
    """Output removed while a run works: exit code 5 for the store, no worse for the rest; then a resume."""
    parts = ("run.sqlite", "", "terrain", "config.yaml", "log.txt")
    for attempt in range(trials):
        recording, folder = lab.any_recording(), lab.new_folder()
        part = parts[attempt % len(parts)]

        def remove():
            target = folder / part  # pylint: disable=cell-var-from-loop
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)

        done = stopped_midway(lab, recording, folder, remove)
        if done is None:
            yield Verdict(VOID, part)
            continue
        allowed = {5} if part in ("run.sqlite", "") else {5, recording.code}
        problems = done.problems(allowed)
        if part == "run.sqlite":  # what its write-ahead log says belongs to no store
            for left in folder.glob("run.sqlite-*"):
                left.unlink()
        if part != "terrain":  # files of frames that are done are not computed again
            problems += lab.resume(folder, recording)
        yield judge(problems, f"{recording.name}, {part or 'the run folder'} removed midway")
        lab.clean(folder)


def changed_input(lab, trials):
    """Another input than that of the first part: a resume ends with 4 and goes on with the right one."""
    changes = {
        "an image swapped": ("drive", _swap_images),
        "times.txt moved": ("drive", lambda path: _edit(path / "times.txt", "0.5", "0.6")),
        "calib.txt changed": ("drive", lambda path: _edit(path / "calib.txt", "260", "261")),
        "imu.csv one row shorter": ("stops", lambda path: _drop_row(path / "sensors/imu.csv", 0.2)),
        "wheels.csv one row shorter": ("stops", lambda path: _drop_row(path / "sensors/wheels.csv", 0.2)),
        "compass.csv one row shorter": ("stops", lambda path: _drop_row(path / "sensors/compass.csv", 0.2)),
        "inclinometer.csv one row shorter": ("stops", lambda path: _drop_row(path / "sensors/inclinometer.csv", 0.2)),
        "imu.csv a value changed": ("stops", lambda path: _change_row(path / "sensors/imu.csv", 0.2)),
        "frames.csv with another image": ("stops", _other_image),
        "gravity of recording.yaml changed": (
            "stops", lambda path: _edit(path / "recording.yaml", "gravity_m_s2: 3.71", "gravity_m_s2: 3.72")),
        "rig.yaml changed": ("stops", lambda path: _edit(path / "rig.yaml", "0.12", "0.121", "0.06", "0.061")),
    }
    usable = {name: change for name, change in changes.items() if change[0] in lab.recordings}
    for attempt in range(trials):
        name = list(usable)[attempt % len(usable)]
        recording_name, change = usable[name]
        recording, folder = lab.recordings[recording_name], lab.new_folder()
        frames = str(lab.rng.randint(1, 3) if recording_name == "stops" else lab.rng.randint(1, 10))
        lab.run(*lab.run_command(recording, folder, "--max-frames", frames))
        copy = lab.new_folder("input")
        shutil.copytree(recording.path, copy)
        if not change(copy):
            yield Verdict(DIFFERS, f"{name}: the change changes nothing (a fault of the trial)")
            continue
        command = list(lab.run_command(recording, folder, "--resume"))
        command[1] = copy
        problems = lab.run(*command).problems({4})
        yield judge(problems + lab.resume(folder, recording), f"{name}, after {frames} frames")
        lab.clean(folder, copy)


def _edit(file, *pairs):
    text = file.read_text(encoding="utf-8")
    changed = text
    for old, new in zip(pairs[::2], pairs[1::2]):
        changed = changed.replace(old, new, 1)
    file.write_text(changed, encoding="utf-8")
    return changed != text


def _drop_row(file, share):
    return _edit_row(file, share, lambda row: "")


def _change_row(file, share):
    def raised(row):
        cells = row.split(",")
        return ",".join([cells[0], str(float(cells[1]) + 0.01), *cells[2:]])

    return _edit_row(file, share, raised)


def _edit_row(file, share, edit):
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    row = 1 + int(share * (len(lines) - 1))
    lines[row] = edit(lines[row])
    file.write_text("".join(lines), encoding="utf-8")
    return True


def _swap_images(path):
    first, other = path / "image_0/000003.png", path / "image_0/000009.png"
    content = first.read_bytes()
    first.write_bytes(other.read_bytes())
    other.write_bytes(content)
    return True


def _other_image(path):
    """The last row of frames.csv names the images of the row before."""
    file = path / "frames.csv"
    lines = file.read_text(encoding="utf-8").splitlines()
    last, before = lines[-1].split(","), lines[1].split(",")
    columns = [i for i, name in enumerate(lines[0].split(",")) if name.strip() in ("left", "right")]
    for column in columns:
        last[column] = before[column]
    lines[-1] = ",".join(last)
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return len(columns) == 2


CLASSES = {
    "file_size_limit": (file_size_limit, 3, 24),
    "full_disk": (full_disk, 2, 24),
    "full_disk_of_commands": (full_disk_of_commands, 4, 16),
    "slow_disk": (slow_disk, 1, 10),
    "removed_midway": (removed_midway, 2, 25),
    "changed_input": (changed_input, 4, 33),
}
