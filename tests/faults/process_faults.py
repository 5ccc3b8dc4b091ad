"""Faults of processes: kills, signals, two processes in one folder."""
import json
import signal
import time

from lab import DIFFERS, VOID, Verdict, judge

QUICK_DEATH = (signal.SIGHUP, signal.SIGQUIT)


def kill(lab, trials):
    """kill -9 at random moments, in every third trial inside resumes, too; then a resume, with 1 to 3 threads.

    Every other trial kills by the clock, the others at a random call, which meets short steps as often as long ones.
    """
    done = 0
    for attempt in range(4 * trials):
        if done == trials:
            return
        recording, folder = lab.any_recording(), lab.new_folder()
        threads = lab.rng.randint(1, 3)
        kills = 1 + (attempt % 3 == 0) * lab.rng.randint(1, 2)
        delivered = 0
        for i in range(kills):
            command = lab.run_command(recording, folder, *(["--resume"] if i else []), threads=threads)
            delivered += _killed(lab, command, recording, folder, attempt % 2 == 0)
        what = f"{recording.name}, {delivered} kills, {threads} threads"
        if delivered:
            done += 1
            yield judge(lab.resume(folder, recording), what)
        else:
            yield Verdict(VOID, what)
        lab.clean(folder)


def _killed(lab, command, recording, folder, by_clock):
    """Runs a command and kills it. False if it had ended before."""
    if by_clock:
        process = lab.start(*command)
        time.sleep(lab.rng.uniform(0, recording.seconds))
        process.kill()
        return lab.end(process).code == -signal.SIGKILL
    call = lab.rng.choice(("malloc", "write", "fsync", "rename", "open"))
    most = {"malloc": 67_000, "write": 700, "fsync": 20, "rename": 15, "open": 40}[call]
    faults = {"CALL": call, "AT": lab.rng.randint(1, most), "SIGNAL": int(signal.SIGKILL)}
    if call != "malloc":
        faults["PATH"] = folder.name
    done, _ = lab.run_with(faults, *command)
    return done.code == -signal.SIGKILL


def signals_of_run(lab, trials):
    """SIGINT and SIGTERM (once, twice), SIGHUP, SIGQUIT, SIGSTOP and SIGCONT on `run`; then a resume."""
    kinds = [(signal.SIGINT,), (signal.SIGTERM,), (signal.SIGHUP,), (signal.SIGQUIT,), (signal.SIGINT, signal.SIGINT),
             (signal.SIGSTOP, signal.SIGCONT)]
    for attempt in range(trials):
        recording, folder, kind = lab.any_recording(), lab.new_folder(), kinds[attempt % len(kinds)]
        # Writes are slow, so that the signal comes before the end.
        environment = lab.environment({"DELAY_US": 500, "PATH": folder.name})
        process = lab.start(*lab.run_command(recording, folder), env=environment)
        deadline = time.monotonic() + 30
        while not (folder / "rig.yaml").exists() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(lab.rng.uniform(0, 0.5 * recording.seconds))
        for one in kind:
            process.send_signal(one)
            time.sleep(0.05)
        done = lab.end(process)
        if kind[0] in QUICK_DEATH:
            allowed = {130, -kind[0]}
        elif kind[0] == signal.SIGSTOP:
            allowed = {recording.code}
        else:
            allowed = {130} if len(kind) == 1 else {130, -kind[0]}
        what = f"{recording.name}, {'+'.join(one.name for one in kind)}"
        yield judge(done.problems(allowed) + lab.resume(folder, recording), what)
        lab.clean(folder)


def signals_of_commands(lab, trials):
    """SIGINT and SIGTERM on every command that works for a while: exit code 130, nothing half written."""
    commands = {name: make for name, make in lab.commands().items() if make.interruptible}
    for attempt in range(trials):
        name = list(commands)[attempt % len(commands)]
        command, folder = commands[name], lab.new_folder()
        number = lab.rng.choice((signal.SIGINT, signal.SIGTERM))
        # The process sends the signal to itself while it reads its last input, or writes: in the work, at any load.
        faults = {"CALL": command.busy_call, "PATH": command.busy_path or folder.name, "SIGNAL": int(number)}
        _, counted = lab.run_with(faults, *command.arguments(folder))
        lab.clean(folder)
        if counted.calls == 0:
            yield Verdict(DIFFERS, f"{name}: the shim saw no {command.busy_call} of {faults['PATH']}")
            continue
        at = counted.calls if command.busy_call == "open" else lab.rng.randint(1, max(1, counted.calls // 3))
        done, report = lab.run_with({**faults, "AT": at}, *command.arguments(folder))
        if report.injected == 0:
            yield Verdict(VOID, name)
        else:
            parts = [f"{part.name} is left" for part in folder.rglob("*.part")] if folder.is_dir() else []
            yield judge(done.problems({130}) + parts, f"{name}, {number.name}")
        lab.clean(folder)


def two_processes(lab, trials):
    """Two processes, one run folder: one owner, which ends as if alone; the other ends with 5 and names the owner."""
    kinds = [("fresh", "fresh"), ("fresh", "resume"), ("resume", "resume")]
    for attempt in range(trials):
        recording, folder, kind = lab.any_recording(), lab.new_folder(), kinds[attempt % len(kinds)]
        if kind[0] == "resume":  # of a run that was interrupted
            lab.run(*lab.run_command(recording, folder, "--max-frames", str(lab.rng.randint(1, 3))))
        environment = lab.environment({"DELAY_US": 500, "PATH": folder.name})
        pair = []
        for mode in kind:
            more = ["--resume"] if mode == "resume" else []
            pair.append(lab.start(*lab.run_command(recording, folder, *more), env=environment))
            if len(pair) == 1:
                time.sleep(lab.rng.choice((0, lab.rng.uniform(0, 2 * recording.seconds))))
        overlap = pair[0].poll() is None
        ends = [lab.end(process) for process in pair]
        what = f"{recording.name}, {'+'.join(kind)}"
        if not overlap:
            yield Verdict(VOID, what)
        else:
            problems = [] if _one_after_the_other(ends, folder, recording) else _one_owner(ends, recording)
            yield judge(problems + lab.resume(folder, recording), what)
        lab.clean(folder)


def _one_after_the_other(ends, folder, recording):
    """The first ended before the second, which resumes, had reached the folder: it found every frame processed."""
    if [end.code for end in ends] != 2 * [recording.code]:
        return False
    return json.loads((folder / "summary.json").read_text())["resumed_from_frame"] is None


def _one_owner(ends, recording):
    owners = [end for end in ends if end.code == recording.code]
    others = [end for end in ends if end.code != recording.code]
    if len(owners) != 1:
        return [f"exit codes {[end.code for end in ends]}: {len(owners)} owners"]
    problems = others[0].problems({5})
    if not problems and str(owners[0].pid) not in others[0].err:
        problems = [f"the owner's process id {owners[0].pid} is missing in: {others[0].err.strip()[-160:]}"]
    return problems


def repeated_resumes(lab, trials):
    """A finished run resumed again, frames in steps, other input and options (4), a new run in an old folder (5)."""
    for attempt in range(trials):
        recording, folder, kind = lab.any_recording(), lab.new_folder(), attempt % 4
        other = [r for r in lab.recordings.values() if r is not recording]
        problems = []
        if kind == 0:
            what = "resume of a finished run"
            lab.run(*lab.run_command(recording, folder))
            for _ in range(2):
                problems += lab.resume(folder, recording)
        elif kind == 1:
            what = "frames in steps"
            for frames in range(1, 4):
                done = lab.run(*lab.run_command(recording, folder, "--resume", "--max-frames", str(frames)))
                problems += done.problems({0, 6})
        else:
            lab.run(*lab.run_command(recording, folder, "--max-frames", "2"))
            wrong = lab.run_command(other[0] if kind == 2 and other else recording, folder)
            if kind == 2:
                what = "other input or options"
                wrong += ("--resume",) if other else ("--resume", "--set", "odometry.detection.landmarks=700")
            else:
                what = "a new run in an old folder"
            problems += lab.run(*wrong).problems({4 if kind == 2 else 5})
        yield judge(problems + lab.resume(folder, recording), f"{recording.name}, {what}")
        lab.clean(folder)


CLASSES = {
    "kill": (kill, 4, 80),
    "signals_of_run": (signals_of_run, 3, 36),
    "signals_of_commands": (signals_of_commands, 5, 50),
    "two_processes": (two_processes, 3, 45),
    "repeated_resumes": (repeated_resumes, 2, 20),
}
