"""Power loss: what a disk may hold after a crash of the machine, from the trace of a run's changes to its folder.

Model. A write survives for certain only if its file was synced after it; a name (creation, rename, removal) only if its
folder was synced after it. Of everything else any part may survive, in any order, in pages of 4 KB. Two file systems:
  - `journal`: names and sizes of files survive as a prefix of their order, and syncing anything makes all earlier ones
    durable (ext4, XFS, Btrfs);
  - `posix`: each name survives on its own, and only syncing its folder makes it durable (what POSIX promises).
"""
import os
import shutil
import sqlite3
import struct
from dataclasses import dataclass

from lab import DIFFERS, Verdict, judge

CREATE, WRITE, TRUNCATE, SYNC, RENAME, UNLINK, MKDIR, SYNC_FOLDER, CONTENT = range(1, 10)
NAME_CHANGES = (CREATE, RENAME, UNLINK, MKDIR)
PAGE = 4096
HEADER = struct.Struct("<IIIIQq")


@dataclass
class Change:
    kind: int
    path: str
    second: str
    inode: int
    offset: int
    data: bytes


def read_trace(file, folder):
    """Changes below `folder` with paths relative to it. A file that is made anew under a used inode gets a new one."""
    data, at, changes, generation = file.read_bytes(), 0, [], {}
    prefix = str(folder)
    while at < len(data):
        kind, first, second, size, inode, offset = HEADER.unpack_from(data, at)
        at += HEADER.size
        paths = (data[at:at + first].decode(), data[at + first:at + first + second].decode())
        at += first + second
        if kind == CREATE:
            generation[inode] = len(changes)
        paths = [os.path.relpath(path, prefix) if path else "" for path in paths]
        changes.append(Change(kind, *paths, (inode, generation.get(inode)), offset, data[at:at + size]))
        at += size
    return changes


def apply(content, change, keep=None):
    """Applies a change of a file's bytes, or only those pages of it for which keep() is true."""
    if change.kind == TRUNCATE:
        if keep is None or keep():
            del content[change.offset:]
            content.extend(bytes(change.offset - len(content)))
        return
    if change.kind == CONTENT and keep is None:
        content.clear()
    end = change.offset
    while end < change.offset + len(change.data):
        begin, end = end, min((end // PAGE + 1) * PAGE, change.offset + len(change.data))
        if keep is not None and not keep():
            continue
        content.extend(bytes(max(0, end - len(content))))
        content[begin:end] = change.data[begin - change.offset:end - change.offset]


def surviving_files(changes, keep, cut=None):
    """Bytes of each file by inode: synced ones whole; of later writes those pages for which keep() is true. From
    change `cut` on no file grows or shrinks."""
    last_sync = {change.inode: i for i, change in enumerate(changes) if change.kind == SYNC}
    files = {}
    for i, change in enumerate(changes):
        if change.kind in (CREATE, WRITE, TRUNCATE, CONTENT):
            content = files.setdefault(change.inode, bytearray())
            late, size = cut is not None and i >= cut, len(content)
            if change.kind != CREATE and not (late and change.kind == TRUNCATE):
                apply(content, change, None if i < last_sync.get(change.inode, -1) else keep)
            if late:
                del content[size:]
    return files


def journal_cut(changes, rng):
    """A change before which all names and sizes survive, and none after it: after the last sync."""
    durable = max((i for i, change in enumerate(changes) if change.kind in (SYNC, SYNC_FOLDER)), default=-1)
    return rng.randint(durable + 1, len(changes))


def surviving_names(changes, keep, cut=None):
    """Inode of each name, and the set of folders: those before `cut`; without it the synced ones and some others."""
    names_at = [i for i, change in enumerate(changes) if change.kind in NAME_CHANGES]
    if cut is not None:
        kept = [i for i in names_at if i < cut]
    else:
        synced = {}
        for i, change in enumerate(changes):
            if change.kind == SYNC_FOLDER:
                synced[change.path] = i
        kept = [i for i in names_at if i < synced.get(os.path.dirname(changes[i].path) or ".", -1) or keep()]
    names, folders = {}, set()
    origin = {}  # inode that a name would have if everything had survived: a rename moves a file, whatever was lost
    for i in names_at:
        change = changes[i]
        if change.kind == CREATE:
            origin[change.path] = change.inode
        if change.kind == RENAME:
            origin[change.second] = origin.pop(change.path)
        if i not in kept:
            continue
        if change.kind == CREATE:
            names[change.path] = change.inode
        elif change.kind == MKDIR:
            folders.add(change.path)
        elif change.kind == UNLINK:
            names.pop(change.path, None)
        else:
            names.pop(change.path, None)
            names[change.second] = origin[change.second]
    return names, folders


def build(folder, files, names, folders):
    """Makes the run folder that is found after the power loss."""
    folder.mkdir()
    for name in sorted(folders):
        (folder / name).mkdir(exist_ok=True, parents=True)
    for name, inode in names.items():
        if name.endswith("-shm"):  # a memory map of living processes; SQLite makes it anew
            continue
        if (folder / name).parent.is_dir():  # else the folder itself is lost
            (folder / name).write_bytes(files.get(inode, b""))


def frames_in(folder):
    """Number of frames that the store holds; 0 without a store. Works on a copy: reading replays the log."""
    store = folder / "run.sqlite"
    if not store.exists():
        return 0
    copy = folder.with_name(folder.name + "_read")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(folder, copy)
    try:
        with sqlite3.connect(copy / "run.sqlite") as database:
            return database.execute("SELECT count(*) FROM frames").fetchone()[0]
    except sqlite3.DatabaseError:
        return 0
    finally:
        shutil.rmtree(copy, ignore_errors=True)


class Trace:
    """The changes of one run, and how many frames were durable after each sync of its store."""

    def __init__(self, lab, recording):
        self.lab, self.recording = lab, recording
        folder, file = lab.new_folder("traced"), lab.new_folder("trace")
        done, _ = lab.run_with({"TRACE": file, "FOLDER": folder}, *lab.run_command(recording, folder))
        if done.code != recording.code:
            raise RuntimeError(f"the traced run fails: {done.err}")
        self.changes = [change for change in read_trace(file, folder) if not change.path.startswith("..")]
        self.folder = folder
        syncs = [i + 1 for i, change in enumerate(self.changes)
                 if change.kind in (SYNC, SYNC_FOLDER) and change.path in ("run.sqlite", "run.sqlite-wal", ".")]
        self.durable_frames = {end: self._frames_at(end) for end in syncs}

    def _frames_at(self, end):
        folder = self.rebuild(end, keep=lambda: False)
        frames = frames_in(folder)
        self.lab.clean(folder)
        return frames

    def rebuild(self, end, keep=None):
        """Everything up to a change: nothing lost, or only that part of what was not synced which `keep` keeps."""
        changes, folder = self.changes[:end], self.lab.new_folder("whole")
        files = surviving_files(changes, keep)
        names, folders = surviving_names(changes, keep or (lambda: True))
        build(folder, files, names, folders)
        return folder

    def is_complete(self):
        """Whether the trace alone gives the folder of the traced run: else a call has escaped the shim."""
        folder = self.rebuild(len(self.changes))
        same = self.lab.differences(folder, self.recording) == []
        self.lab.clean(folder)
        return same


def power_loss(lab, trials):
    """The power fails at a random change; a resume gives the same files, from no less than what was synced."""
    traces = [Trace(lab, recording) for recording in lab.recordings.values()]
    for trace in traces:
        if not trace.is_complete():
            yield Verdict(DIFFERS, f"{trace.recording.name}: the trace does not give the folder (a fault of the shim)")
            return
    for attempt in range(trials):
        trace, journal = traces[attempt % len(traces)], attempt // len(traces) % 2 == 0
        end = lab.rng.randint(1, len(trace.changes))
        share = lab.rng.choice((0, 0.2, 0.5, 0.8, 1))
        changes, folder = trace.changes[:end], lab.new_folder()

        def keep():
            return lab.rng.random() < share  # pylint: disable=cell-var-from-loop

        cut = journal_cut(changes, lab.rng) if journal else None
        files = surviving_files(changes, keep, cut)
        names, folders = surviving_names(changes, keep, cut)
        build(folder, files, names, folders)
        found = frames_in(folder)
        durable = max((frames for at, frames in trace.durable_frames.items() if at <= end), default=0)
        problems = [f"{found} frames in the store, {durable} were durable"] if found < durable else []
        problems += lab.resume(folder, trace.recording)
        yield judge(problems, f"{trace.recording.name}, {'journal' if journal else 'posix'}, change {end} of "
                              f"{len(trace.changes)}, {share:.0%} of what was not synced survives")
        lab.clean(folder)


CLASSES = {"power_loss": (power_loss, 6, 240)}
