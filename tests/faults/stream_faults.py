"""Faults of standard output and standard error: closed, full, the reader gone."""
import os
import subprocess

from lab import judge

STREAMS = {"stdout": 1, "stderr": 2}


def streams(lab, trials):
    """A broken standard error changes nothing; a broken standard output is at most exit code 5. Files are whole."""
    kinds = [(names, fault) for fault in ("closed", "full", "gone") for names in (("stdout",), ("stderr",),
                                                                                 ("stdout", "stderr"))]
    kinds.append((("stdin", "stdout", "stderr"), "closed"))
    commands = lab.commands()
    pairs = [(name, kind) for name in commands for kind in kinds]
    lab.rng.shuffle(pairs)
    pairs.sort(key=lambda pair: pair[0] != "run")  # `run` has most to lose
    for name, (broken, fault) in pairs[:trials]:
        command, folder = commands[name], lab.new_folder()
        done = _run_with_broken(lab, command.arguments(folder), broken, fault)
        allowed = {command.code, 5} if "stdout" in broken else {command.code}
        problems = done.problems(allowed)
        if name == "run" and not problems:
            problems = lab.differences(folder, lab.recordings["drive"])
        yield judge(problems, f"{name}, {'+'.join(broken)} {fault}")
        lab.clean(folder)


def _run_with_broken(lab, arguments, broken, fault):
    if fault == "closed":
        numbers = [("stdin", "stdout", "stderr").index(name) for name in broken]
        return lab.run(*arguments, before=lambda: [os.close(number) for number in numbers])
    if fault == "full":
        with open("/dev/full", "wb") as full:
            return lab.run(*arguments, **dict.fromkeys(broken, full))
    process = lab.start(*arguments, **dict.fromkeys(broken, subprocess.PIPE))
    for name in broken:
        getattr(process, name).close()
    return lab.end(process)


CLASSES = {"streams": (streams, 8, 130)}
