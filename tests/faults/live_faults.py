"""Loss of power in a live run that records its stream."""
import shutil

from lab import DIFFERS, Recording, Verdict, judge
from power_loss import Trace, build, frames_in, journal_cut, surviving_files, surviving_names

ODOMETRY = "trajectory_odometry.tum"


class LiveTrace(Trace):
    """The changes of a live run of a recording, which end with the same odometry as a run of that recording."""

    def __init__(self, lab, recording):
        folder = lab.new_folder("live")
        self.live = Recording(recording.name, f"replay:{recording.path}", (*recording.options, "--speed", "4"))
        done = lab.run(*lab.run_command(self.live, folder))
        self.live.code, self.live.run = done.code, folder
        self.trajectory = (recording.run / ODOMETRY).read_bytes()
        super().__init__(lab, self.live)

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
    odometry of an undisturbed run, and no frame of the recording is half written."""
    trace = LiveTrace(lab, lab.recordings["drive"])
    if not trace.is_complete():
        yield Verdict(DIFFERS, "the trace does not give the folder (a fault of the shim)")
        return
    for attempt in range(trials):
        journal, end = attempt % 2 == 0, lab.rng.randint(1, len(trace.changes))
        share = lab.rng.choice((0, 0.2, 0.5, 0.8, 1))
        changes, folder = trace.changes[:end], lab.new_folder()

        def keep():
            return lab.rng.random() < share  # pylint: disable=cell-var-from-loop

        cut = journal_cut(changes, lab.rng) if journal else None
        build(folder, surviving_files(changes, keep, cut), *surviving_names(changes, keep, cut))
        found = frames_in(folder)
        durable = max((frames for at, frames in trace.durable_frames.items() if at <= end), default=0)
        problems = [f"{found} frames in the store, {durable} were durable"] if found < durable else []
        lost = attempt % 4 == 3  # and the recording with it
        if lost:
            shutil.rmtree(folder / "live", ignore_errors=True)
        done = lab.run(*lab.run_command(trace.live, folder, "--resume"))
        problems += [f"resume: {problem}" for problem in done.problems({trace.live.code})]
        problems += recorded_problems(lab, folder)  # the resume has finished the recording of the interrupted run
        if not problems and (folder / ODOMETRY).read_bytes() != trace.trajectory:
            problems.append("the odometry differs from that of an undisturbed run")
        yield judge(problems, f"live, {'journal' if journal else 'posix'}, change {end} of {len(trace.changes)}, "
                              f"{share:.0%} of what was not synced survives{', the recording is lost' if lost else ''}")
        shutil.rmtree(folder, ignore_errors=True)


CLASSES = {"live_power_loss": (live_power_loss, 4, 60)}
