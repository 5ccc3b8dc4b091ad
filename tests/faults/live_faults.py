"""Loss of power in a live run that records its stream, and a full disk under a recording."""
import csv
import shutil

from disk_faults import SmallDisk
from lab import DIFFERS, SKIPPED, VOID, Recording, Verdict, judge
from power_loss import SYNC, Trace, build, frames_in, journal_cut, surviving_files, surviving_names

ODOMETRY = "trajectory_odometry.tum"
RECORDED = "live/1"


def rows_of(recording):
    """The complete rows of each table of a recording, without their headers."""
    tables = [recording / "frames.csv", *sorted((recording / "sensors").glob("*.csv"))]
    return {table.name: table.read_bytes().split(b"\n")[1:-1] for table in tables if table.exists()}


def durable_rows(trace, end):
    """The rows of the last sync of each table before a change."""
    rows = {}
    for at, tables in trace.durable_rows.items():
        if at <= end:
            rows |= tables
    return rows


def lost_rows(recording, durable):
    found = rows_of(recording)
    return [f"{name}: {len(found.get(name, []))} rows, {len(rows)} were durable" for name, rows in durable.items()
            if found.get(name, [])[:len(rows)] != rows]


class LiveTrace(Trace):
    """The changes of a live run of a recording, which end with the same odometry as a run of that recording."""

    def __init__(self, lab, recording):
        folder, self.original, self.stream = lab.new_folder("live"), recording.path, lab.new_folder("stream")
        self.restore_stream()
        self.live = Recording(recording.name, f"replay:{self.stream}", (*recording.options, "--speed", "4"))
        done = lab.run(*lab.run_command(self.live, folder))
        self.live.code, self.live.run = done.code, folder
        self.trajectory = (recording.run / ODOMETRY).read_bytes()
        super().__init__(lab, self.live)
        syncs = [i + 1 for i, change in enumerate(self.changes)
                 if change.kind == SYNC and change.path == f"{RECORDED}/frames.csv"]
        self.durable_rows = {end: self._rows_at(end) for end in syncs}

    def _rows_at(self, end):
        """Of the files that were synced, whether their names were or not: frames.csv comes first in each sync, so that
        what the sync before has done must be durable."""
        folder, changes = self.lab.new_folder("synced"), self.changes[:end]
        build(folder, surviving_files(changes, lambda: False), *surviving_names(changes, lambda: True))
        rows = rows_of(folder / RECORDED)
        self.lab.clean(folder)
        return rows

    def restore_stream(self):
        shutil.rmtree(self.stream, ignore_errors=True)
        shutil.copytree(self.original, self.stream)

    def remove_from_stream(self, rows):
        """The stream does not bring these frames again, as cameras do not."""
        names = csv.reader(row.decode() for row in rows)
        for number, _, _, _, _, left, right, *_ in names:
            files = [left.replace(".pnm", ".png"), right.replace(".pnm", ".png")]
            if (self.stream / "image_0").exists():
                files = [f"image_{side}/{int(number):06}.png" for side in (0, 1)]
            for file in files:
                (self.stream / file).unlink()

    def is_complete(self):
        folder = self.rebuild(len(self.changes))
        same = (folder / ODOMETRY).read_bytes() == self.trajectory
        self.lab.clean(folder)
        return same


def recorded_problems(lab, folder):
    """Every frame that a recording of the stream lists can be read."""
    problems = []
    for recording in sorted((folder / "live").glob("*")):
        listed = recording / "frames.csv"
        # A recording that lists no frame is left as it is.
        if not listed.exists() or listed.read_bytes().count(b"\n") < 3:
            continue
        out = lab.new_folder("recorded")
        done = lab.run("run", recording, "-o", out, "--threads", "1", "--odometry-only")
        problems += [f"{recording.name}: {problem}" for problem in done.problems({0, 6})]
        said = done.err.lower()
        problems += [f"{recording.name}: {word}" for word in ("unreadable", "damaged", "missing") if word in said]
        lab.clean(out)
    return problems


def live_power_loss(lab, trials):
    """The power fails at a random change of a live run: no less than what was synced is there, a resume goes on to the
    odometry of an undisturbed run, though the stream does not bring the frames again that were recorded, and no frame
    of the recording is half written."""
    traces = [LiveTrace(lab, recording) for recording in lab.recordings.values()]
    for trace in traces:
        if not trace.is_complete():
            yield Verdict(DIFFERS, f"{trace.live.name}: the trace does not give the folder (a fault of the shim)")
            return
    for attempt in range(trials):
        trace, journal = traces[attempt % len(traces)], attempt // len(traces) % 2 == 0
        end = lab.rng.randint(1, len(trace.changes))
        share = lab.rng.choice((0, 0.2, 0.5, 0.8, 1))
        changes, folder = trace.changes[:end], lab.new_folder()

        def keep():
            return lab.rng.random() < share  # pylint: disable=cell-var-from-loop

        cut = journal_cut(changes, lab.rng) if journal else None
        build(folder, surviving_files(changes, keep, cut), *surviving_names(changes, keep, cut))
        found = frames_in(folder)
        durable = max((frames for at, frames in trace.durable_frames.items() if at <= end), default=0)
        problems = [f"{found} frames in the store, {durable} were durable"] if found < durable else []
        recorded = durable_rows(trace, end)
        problems += lost_rows(folder / RECORDED, recorded) + recorded_problems(lab, folder)
        lost = attempt % 8 in (3, 6)  # and the recording with it
        if lost:
            shutil.rmtree(folder / "live", ignore_errors=True)
        else:
            trace.remove_from_stream(recorded.get("frames.csv", [])[:-1])  # one usable frame makes it a recording
        done = lab.run(*lab.run_command(trace.live, folder, "--resume"))
        problems += [f"resume: {problem}" for problem in done.problems({trace.live.code})]
        problems += recorded_problems(lab, folder)
        trace.restore_stream()
        if not problems and (folder / ODOMETRY).read_bytes() != trace.trajectory:
            problems.append("the odometry differs from that of an undisturbed run")
        yield judge(problems, f"{trace.live.name}, live, {'journal' if journal else 'posix'}, change {end} of {len(trace.changes)}, "
                              f"{share:.0%} of what was not synced survives{', the recording is lost' if lost else ''}")
        shutil.rmtree(folder, ignore_errors=True)


def full_disk_of_recording(lab, trials):
    """The disk is full after a part of the images: exit code 5, and what was recorded can be processed."""
    drive = lab.recordings["drive"]
    image_kilobytes = sum(len(image.read_bytes()) for image in drive.path.glob("image_*/*.png")) / 1024
    for _ in range(trials):
        kilobytes = int(image_kilobytes * lab.rng.uniform(0.5, 0.9))
        with SmallDisk(lab, kilobytes) as disk:
            if disk.path is None:
                yield Verdict(SKIPPED, "not root, or tmpfs cannot be mounted")
                return
            recording, out = disk.path / "rec", lab.new_folder()
            done = lab.run("record", f"replay:{drive.path}", "-o", recording, "--record-images", "png")
            listed = rows_of(recording).get("frames.csv", [])
            what = f"{kilobytes} KB, {len(listed)} frames"
            if done.code == 0 or not listed:
                yield Verdict(VOID, what)
                continue
            problems = done.problems({5})
            problems += lab.run("run", recording, "-o", out, "--threads", "1").problems({0, 6})
            yield judge(problems, what)
            lab.clean(out)


CLASSES = {"live_power_loss": (live_power_loss, 4, 60), "full_disk_of_recording": (full_disk_of_recording, 1, 6)}
