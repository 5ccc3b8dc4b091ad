#!/usr/bin/env python3
"""Gives `spartan` mutated and hostile inputs of every format, and prints how the commands ended.

    mutate_inputs.py PROGRAM SHIM SMALL_RUNS SOURCE WORK [--only FORMAT[,FORMAT…]] [--long] [--scale F] [--seed N]

The arguments are those of run_faults.py. Every trial must end with a documented exit code (0, 2, 3, 4, 5, 6), within
60 s and 3 GB of memory: never by a signal, never with 1, which is a fault of the program. A mutated scenario may ask
for a long simulation; it must then end with 130 when interrupted. The input of a trial that differs is kept in
WORK/found.
"""
import argparse
import collections
import random
import shutil
import sys
import time
from pathlib import Path

import input_formats
from lab import Lab

DOCUMENTED = (0, 2, 3, 4, 5, 6)


def run_format(lab, found, name, entry, trials):
    """Exit codes of the trials of a format, and how many were not as documented."""
    codes, differ = collections.Counter(), 0
    for i in range(trials):
        folder = lab.new_folder("input")
        folder.mkdir()
        command = entry.trial(folder, lab.rng)
        allowed = {*DOCUMENTED, 130} if entry.may_take_long else set(DOCUMENTED)
        done = lab.run(*command, timeout=10 if entry.may_take_long else 60, interrupt=entry.may_take_long)
        codes[done.code] += 1
        if problems := done.problems(allowed):
            differ += 1
            kept = found / f"{name.replace(' ', '_').replace('/', '_')}_{i}"
            shutil.copytree(folder, kept, symlinks=True, dirs_exist_ok=True)
            words = " ".join(str(word).replace(str(folder), str(kept)) for word in command)
            print(f"{name}: {'; '.join(problems)}: spartan {words}", flush=True)
        lab.clean(folder)
    return codes, differ


def table(rows):
    """Lines of a Markdown table."""
    yield "| format | trials | 0 | 2 | 3 | 4 | 5 | 6 | interrupted | not as documented |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for name, codes, differ in rows:
        counts = " | ".join(str(codes[code] or "") for code in (*DOCUMENTED, 130))
        yield f"| {name} | {sum(codes.values())} | {counts} | {differ} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("program", "shim", "small_runs", "source", "work"):
        parser.add_argument(name)
    parser.add_argument("--only", help="names of formats, separated by commas")
    parser.add_argument("--long", action="store_true", help="the numbers of trials of `make faults`, instead of 3")
    parser.add_argument("--scale", type=float, default=1, help="factor on the numbers of trials")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    lab = Lab(arguments.program, arguments.shim, arguments.small_runs, arguments.source, arguments.work)
    formats = input_formats.formats_of(lab)
    names = arguments.only.split(",") if arguments.only else list(formats)
    if unknown := [name for name in names if name not in formats]:
        lab.remove()
        parser.error(f"no such format: {', '.join(unknown)}; there are: {', '.join(formats)}")
    found = Path(arguments.work).resolve() / "found"
    shutil.rmtree(found, ignore_errors=True)
    rows, start = [], time.monotonic()
    for name in names:
        lab.rng = random.Random(f"{arguments.seed} {name}")
        trials = max(1, round((formats[name].long_trials if arguments.long else 3) * arguments.scale))
        rows.append((name, *run_format(lab, found, name, formats[name], trials)))
    lab.remove()
    print("\n".join(table(rows)))
    total, differ = sum(sum(row[1].values()) for row in rows), sum(row[2] for row in rows)
    print(f"{total} trials in {time.monotonic() - start:.0f} s, {differ} not as documented")
    return 1 if differ or not total else 0


if __name__ == "__main__":
    sys.exit(main())
