"""Odd environments: one core, no HOME or TMPDIR, time zones, locales, a jumping clock. The files are the same."""
import os
import resource

from lab import VOID, Verdict, judge

KINDS = {
    "one core": {"before": lambda: os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})},
    "no HOME": {"more": {"HOME": None}},
    "no TMPDIR": {"more": {"TMPDIR": None}},
    "TMPDIR that does not exist": {"more": {"TMPDIR": "/no/such/folder"}},
    "an empty environment": {"empty": True},
    "clock jumping by hours": {"faults": {"CLOCK_S": 7200}},
    "clock jumping by months": {"faults": {"CLOCK_S": 10_000_000}},
    "TZ=Pacific/Kiritimati": {"more": {"TZ": "Pacific/Kiritimati"}},
    "TZ=:nonsense": {"more": {"TZ": ":nonsense"}},
    "LC_ALL=de_DE.UTF-8": {"more": {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}},
    "LC_ALL=tr_TR.UTF-8": {"more": {"LC_ALL": "tr_TR.UTF-8"}},
    "LC_ALL=no_such.LOCALE": {"more": {"LC_ALL": "no_such.LOCALE"}},
    "TERM=dumb, COLUMNS=1": {"more": {"TERM": "dumb", "COLUMNS": "1"}},
    "umask 777": {"before": lambda: os.umask(0o777), "allowed": {5} if os.geteuid() else set()},
    "umask 077": {"before": lambda: os.umask(0o077)},
    "nice 19": {"before": lambda: os.nice(19)},
    "small stack": {"before": lambda: resource.setrlimit(resource.RLIMIT_STACK, (256 << 10, 256 << 10))},
    "working folder removed": {"before": None},
}


def environment(lab, trials):
    for attempt in range(trials):
        name = list(KINDS)[attempt % len(KINDS)]
        kind, recording, folder = KINDS[name], lab.any_recording(), lab.new_folder()
        faults, report = kind.get("faults", {}), lab.new_folder("report")
        environment_ = lab.environment({**faults, "REPORT": report}, kind.get("more"))
        if kind.get("empty"):
            environment_ = {}
        before = kind.get("before") or (_in_removed_folder(lab) if "before" in kind else None)
        command = list(lab.run_command(recording, folder))
        if name == "one core":
            command = [word for i, word in enumerate(command) if "--threads" not in command[max(0, i - 1):i + 1]]
        done = lab.run(*command, env=environment_, before=before)
        problems = done.problems({recording.code} | kind.get("allowed", set()))
        if done.code == recording.code:
            problems += lab.differences(folder, recording)
        if "TBB Warning" in done.err:
            problems.append("a warning of TBB on standard error")
        counted = lab.read_report(report)
        what = f"{recording.name}, {name}"
        yield Verdict(VOID, what) if faults and counted.clock_readings == 0 else judge(problems, what)
        lab.clean(folder)


def _in_removed_folder(lab):
    folder = lab.new_folder()
    folder.mkdir()

    def enter():
        os.chdir(folder)
        folder.rmdir()

    return enter


CLASSES = {"environment": (environment, 4, 3 * len(KINDS))}
