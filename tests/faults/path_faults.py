"""Odd paths and names: special characters, links, FIFOs, devices, permissions of another user."""
import os
import shutil
import sqlite3

from lab import SKIPPED, Verdict, judge

NO_OTHER_USER = "root, and the folder of the trials is closed to other users"
# Each is the name of a folder. A surrogate stands for a byte that is not UTF-8 (os.fsencode).
NAMES = ("not\udcffutf8", "<script>alert(1)<", "with space", "Ünïcødé 火星", "new\nline", "quote'\"s", "percent%20?#&",
         "; DROP TABLE frames;--", "{}%n%s", "-dash", "a" * 200)


def names(lab, trials):
    """Recording, run and results in folders with odd names: the same results, also in what reads the run again."""
    for attempt in range(trials):
        recording, name = lab.any_recording(), NAMES[attempt % len(NAMES)]
        parent = lab.new_folder()
        parent.mkdir()
        source, out, ply = (parent / f"{kind}{name}" for kind in ("rec ", "out ", "ply "))
        shutil.copytree(recording.path, source)
        command = list(lab.run_command(recording, out))
        command[1] = source
        problems = lab.run(*command).problems({recording.code}) or lab.differences(out, recording)
        again = lab.run(*command, "--resume").problems({recording.code}) or lab.differences(out, recording)
        problems += [f"again: {problem}" for problem in again]
        page = out / "report/index.html"
        if page.exists() and b"<script>alert" in page.read_bytes():
            problems.append("the name is a script in the report")
        for words in (("export", out, "--format", "ply", "-o", ply), ("evaluate", out, "--truth", source, "--json"),
                      ("map", "info", out, "--json"), ("config", "check", out / "config.yaml"),
                      ("rig", "inspect", out / "rig.yaml", "--json")):
            allowed = {0, 3} if words[0] in ("map", "evaluate") else {0}  # without maps; too few poses to compare
            problems += [f"{words[0]}: {problem}" for problem in lab.run(*words).problems(allowed)]
        yield judge(problems, f"{recording.name}, {name!r}")
        lab.clean(parent)


def _objects(folder):
    """Paths that are no files of the expected kind, by what they are."""
    folder.mkdir()
    loop, fifo, deep = folder / "loop", folder / "fifo", folder / "deep"
    loop.symlink_to(loop)
    os.mkfifo(fifo)
    (folder / "empty_folder").mkdir()
    (folder / "empty_file").touch()
    deep.symlink_to(folder / "no" / "such" / "target")
    return {"a symlink loop": loop, "a FIFO": fifo, "/dev/zero": "/dev/zero", "/dev/null": "/dev/null",
            "/dev/urandom": "/dev/urandom", "300 characters": folder / ("n" * 300),
            "a path of 5000 characters": "/".join(["x" * 100] * 50), "an empty name": "",
            "an empty folder": folder / "empty_folder", "an empty file": folder / "empty_file",
            "a dangling link": deep, "/proc/self/mem": "/proc/self/mem", "/proc": "/proc",
            "a missing file": folder / "no"}


def _uses(lab, path, out):
    """Commands with `path` in the place of a file that they read, and the documented codes."""
    drive = lab.recordings["drive"]
    left, right, calib = drive.path / "image_0/000000.png", drive.path / "image_1/000000.png", drive.path / "calib.txt"
    return {
        "run": (("run", path, "-o", out), {2, 3, 4}),
        "run --rig": (("run", drive.path, "-o", out, "--rig", path), {2, 3, 4}),
        "run --config": (("run", drive.path, "-o", out, "--config", path, "--max-frames", "1"), {0, 2, 3, 4}),
        "run --truth": (("run", drive.path, "-o", out, "--truth", path, "--max-frames", "1"), {0, 2, 3}),
        "stereo": (("stereo", path, right, "-o", out), {2, 3}),
        "stereo --mask": (("stereo", left, right, "-o", out, "--truth", path, "--mask", path), {2, 3}),
        "map build": (("map", "build", left, right, "-o", out, "--rig", path), {2, 3, 4}),
        "map info": (("map", "info", path), {2, 3}),
        "map merge": (("map", "merge", path, path, "-o", out), {2, 3}),
        "map export": (("map", "export", path, "-o", f"{out}.tif"), {2, 3}),
        "evaluate": (("evaluate", path, "--truth", drive.path), {2, 3}),
        "evaluate --truth": (("evaluate", drive.run, "--truth", path), {2, 3}),
        "export": (("export", path, "--format", "tum", "-o", out), {2, 3}),
        "rig inspect": (("rig", "inspect", path), {2, 3, 4}),
        "rig convert": (("rig", "convert", path, f"{out}.yaml", "--size-px", "320,240"), {2, 3, 4}),
        "rig convert, output": (("rig", "convert", calib, path, "--to", "kitti", "--size-px", "320,240"), {0, 2, 5}),
        "rig design": (("rig", "design", path), {2, 3, 4}),
        "simulate": (("simulate", path, "-o", out), {2, 3, 4, 130}),
        "config check": (("config", "check", path), {0, 2, 3, 4}),
    }


def objects(lab, trials):
    """FIFOs, devices, links and folders where files are expected: a documented code, soon, with little memory."""
    probe = lab.new_folder()
    pairs = [(kind, use) for kind in _objects(probe) for use in _uses(lab, "", "")]
    lab.clean(probe)
    user = lab.as_other_user()
    if user is None:
        yield Verdict(SKIPPED, NO_OTHER_USER)
        return
    lab.rng.shuffle(pairs)
    for kind, use in pairs[:trials]:
        folder = lab.new_folder()
        path = _objects(folder)[kind]
        lab.give_away(folder)
        words, allowed = _uses(lab, path, folder / "out")[use]
        done = lab.run(*words, timeout=20, interrupt=130 in allowed, memory=1 << 30, **user)
        # An allocation that the limit of 1 GB refuses shows that the program reads a device without end.
        yield judge(done.problems(allowed), f"{use} of {kind}")
        lab.clean(folder)


def outputs(lab, trials):
    """Outputs that cannot be: an empty name is 2; a file, a loop, a long name, a device are 5."""
    kinds = {"an empty name": {2}, "a symlink loop": {5}, "300 characters": {5}, "an empty file": {5}, "a FIFO": {5},
             "/dev/null": {5}, "/proc": {5}, "a path of 5000 characters": {5}}
    commands = {name: command for name, command in lab.commands().items() if command.writes}
    pairs = [(kind, name) for kind in kinds for name in commands]
    lab.rng.shuffle(pairs)
    pairs.sort(key=lambda pair: pair[0] != "an empty name")  # it once meant the root folder
    user = lab.as_other_user()
    if user is None:
        yield Verdict(SKIPPED, NO_OTHER_USER)
        return
    for kind, name in pairs[:trials]:
        folder = lab.new_folder()
        target = _objects(folder)[kind]
        words = [str(word) for word in commands[name].arguments(folder / "TARGET")]
        place = next(i for i, word in enumerate(words) if "TARGET" in word)
        words[place] = str(target)
        working_folder = lab.new_folder()
        working_folder.mkdir()
        lab.give_away(folder)
        lab.give_away(working_folder)
        done = lab.run(*words, timeout=60, cwd=working_folder, **user)
        allowed = kinds[kind]
        if name in ("map_export", "map_merge", "export_ply") and kind != "an empty name":
            allowed = {2, 5}  # 2: the ending of the name
            if kind in ("an empty file", "a symlink loop"):  # a file or a link is replaced
                allowed |= {0}
        problems = done.problems(allowed)
        if any(working_folder.iterdir()):
            problems.append("files in the working folder")
        yield judge(problems, f"{name} into {kind}")
        lab.clean(folder, working_folder)


def permissions(lab, trials):
    """As another user: what may not be read is 3 (4 for a calibration), what may not be written 5."""
    user = lab.as_other_user()
    if not user:
        yield Verdict(SKIPPED, "not root" if user is not None else NO_OTHER_USER)
        return
    kinds = list(_forbidden(lab, None, None))
    for attempt in range(trials):
        kind, parent = kinds[attempt % len(kinds)], lab.new_folder()
        parent.mkdir()
        recording = lab.recordings["drive"]
        shutil.copytree(recording.path, parent / "rec")
        shutil.copytree(recording.run, parent / "run")
        (parent / "free").mkdir()
        lab.give_away(parent)
        words, allowed, change = _forbidden(lab, parent, recording)[kind]
        change()
        done = lab.run(*words, **user)
        yield judge(done.problems(allowed), kind)
        lab.clean(parent)


def _forbidden(lab, parent, recording):
    if parent is None:
        parent, recording = lab.work, lab.recordings["drive"]
    rec, run, free = parent / "rec", parent / "run", parent / "free"

    def of(path, mode):
        return lambda: path.chmod(mode)

    def command(folder, *more):
        return ("run", rec, "-o", folder, "--threads", "1", *recording.options, *more)

    left, right, calib = rec / "image_0/000000.png", rec / "image_1/000000.png", rec / "calib.txt"
    stereo = ("stereo", left, right, "-o", free / "out", "--calib", calib)
    return {
        "recording without search": (command(free / "out"), {3}, of(rec, 0o600)),
        "recording without reading": (command(free / "out"), {0, 3}, of(rec, 0o300)),
        "closed recording": (command(free / "out"), {3}, of(rec, 0)),
        "closed image folder": (command(free / "out"), {3}, of(rec / "image_1", 0)),
        "unreadable image": (command(free / "out"), {3, 5}, of(left, 0)),
        "unreadable calib.txt": (command(free / "out"), {3, 4}, of(calib, 0)),
        "unreadable times.txt": (command(free / "out"), {3}, of(rec / "times.txt", 0)),
        "output in a read-only folder": (command(free / "out"), {5}, of(free, 0o500)),
        "output in a closed folder": (command(free / "out"), {5}, of(free, 0)),
        "resume of a read-only run folder": (command(run, "--resume"), {5}, of(run, 0o500)),
        "resume of a closed run folder": (command(run, "--resume"), {3, 5}, of(run, 0)),
        "resume of a read-only store": (command(run, "--resume"), {0, 5}, of(run / "run.sqlite", 0o400)),
        "resume of an unreadable store": (command(run, "--resume"), {3, 5}, of(run / "run.sqlite", 0)),
        "resume with a closed terrain folder": (command(run, "--resume"), {0, 5}, of(run / "terrain", 0)),
        "resume with a read-only log": (command(run, "--resume"), {0, 5}, of(run / "log.txt", 0o400)),
        "evaluate a closed run": (("evaluate", run, "--truth", rec), {3}, of(run, 0)),
        "evaluate a run without reading": (("evaluate", run, "--truth", rec), {0, 3}, of(run, 0o300)),
        "evaluate an unreadable trajectory": (("evaluate", run / "trajectory_slam.tum", "--truth", rec), {3},
                                              of(run / "trajectory_slam.tum", 0)),
        "evaluate with a closed truth": (("evaluate", run, "--truth", rec), {3}, of(rec, 0)),
        "evaluate with unreadable poses": (("evaluate", run, "--truth", rec), {3}, of(rec / "poses.txt", 0)),
        "map info of a closed run": (("map", "info", run), {3}, of(run, 0)),
        "map info of an unreadable store": (("map", "info", run), {3}, of(run / "run.sqlite", 0)),
        "map merge of closed runs": (("map", "merge", run, run, "-o", free / "m.map"), {3}, of(run, 0)),
        "export of a closed run": (("export", run, "--format", "tum", "-o", free / "t"), {3}, of(run, 0)),
        "export into a read-only folder": (("export", run, "--format", "tum", "-o", free / "t"), {5}, of(free, 0o500)),
        "stereo of an unreadable image": (stereo, {3}, of(left, 0)),
        "stereo with an unreadable calibration": (stereo, {3, 4}, of(calib, 0)),
        "stereo into a read-only folder": (stereo, {5}, of(free, 0o500)),
        "config check of an unreadable file": (("config", "check", run / "config.yaml"), {3, 4},
                                               of(run / "config.yaml", 0)),
        "rig inspect of an unreadable file": (("rig", "inspect", run / "rig.yaml"), {3, 4}, of(run / "rig.yaml", 0)),
        "rig convert into a closed folder": (("rig", "convert", run / "rig.yaml", free / "r.yaml"), {5}, of(free, 0)),
        "simulate with an unreadable scenario": (("simulate", run / "rig.yaml", "-o", free / "s"), {3, 4},
                                                 of(run / "rig.yaml", 0)),
        "rig design of an unreadable file": (("rig", "design", run / "rig.yaml"), {3, 4}, of(run / "rig.yaml", 0)),
    }


def stored_text(lab, trials):
    """Text in the store, in names of pairs and in arguments: never a script in the report, never SQL."""
    attack = "<script>alert(1)</script>'; DROP TABLE frames;--"
    for attempt in range(trials):
        folder = lab.new_folder()
        recording = lab.recordings["drive"]
        shutil.copytree(recording.run, folder)
        kind = ("frames", "stage_times", "health", "terrain", "argument", "rig")[attempt % 6]
        problems = []
        if kind == "argument":
            done = lab.run("export", folder, "--format", "tum", "--trajectory", attack, "-o", folder / "t")
            problems = done.problems({2})
        elif kind == "rig":
            rig = lab.new_folder()
            rig.write_text((folder / "rig.yaml").read_text(encoding="utf-8").replace("name:", f"name: \"{attack}\" #"),
                           encoding="utf-8")
            done = lab.run("run", recording.path, "-o", f"{folder}_2", "--rig", rig, "--max-frames", "2")
            problems = done.problems({0, 4, 6})
            folder = folder.with_name(folder.name + "_2")
        else:
            _put_text(folder / "run.sqlite", kind, attack)
            problems = lab.run(*lab.run_command(recording, folder, "--resume")).problems({0, 3, 4, 6})
        page = folder / "report/index.html"
        if page.exists() and "<script>alert" in page.read_text(encoding="utf-8"):
            problems.append("a script in the report")
        if kind != "rig":
            with sqlite3.connect(folder / "run.sqlite") as store:
                store.execute("SELECT count(*) FROM frames").fetchone()
        yield judge(problems, kind)
        lab.clean(folder)


def _put_text(file, table, text):
    with sqlite3.connect(file) as store:
        columns = [row[1] for row in store.execute(f"PRAGMA table_info({table})") if "TEXT" in row[2].upper()]
        for column in columns:
            row = store.execute(f"SELECT max(rowid) FROM {table}").fetchone()[0]
            try:
                store.execute(f"UPDATE {table} SET {column} = ? WHERE rowid = ?", (text, row))
            except sqlite3.IntegrityError:
                continue


CLASSES = {
    "names": (names, 2, 2 * len(NAMES)),
    "objects": (objects, 12, 266),
    "outputs": (outputs, 8, 72),
    "permissions": (permissions, 8, 66),
    "stored_text": (stored_text, 3, 18),
}
