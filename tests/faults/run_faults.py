#!/usr/bin/env python3
"""Injects faults into processes and files of `spartan` and prints the table of docs/benchmarks/robustness.md.

    run_faults.py PROGRAM SHIM SMALL_RUNS SOURCE WORK [--only CLASS[,CLASS…]] [--long] [--scale F] [--seed N]

PROGRAM: spartan; SHIM: the library built from fault_shim.cpp; SMALL_RUNS: what make_small_runs has made; WORK: a folder
for the trials. The exit code is 1 if an end was not as documented, or if nothing of a class could be
injected. A trial counts only if its fault was injected; the others are `void`.
"""
import argparse
import random
import sys
import time

import call_faults
import disk_faults
import environment_faults
import live_faults
import path_faults
import power_loss
import process_faults
import stream_faults
from lab import DIFFERS, DOCUMENTED, SKIPPED, VOID, Lab

# Name: function (lab, trials) that yields a Verdict for each trial; trials in CI; trials of the long test.
CLASSES = (process_faults.CLASSES | stream_faults.CLASSES | disk_faults.CLASSES | call_faults.CLASSES
           | environment_faults.CLASSES | path_faults.CLASSES | power_loss.CLASSES | live_faults.CLASSES)


def run_class(lab, name, trials):
    """Counts of the verdicts of a class; prints the trials that differ."""
    counts = dict.fromkeys((DOCUMENTED, DIFFERS, VOID, SKIPPED), 0)
    for verdict in CLASSES[name][0](lab, trials):
        counts[verdict.result] += 1
        if verdict.result == DIFFERS:
            print(f"{name}: {verdict.what}", flush=True)
    return counts


def table(rows):
    """Lines of a Markdown table."""
    yield "| class | trials | as documented | not | void | skipped |"
    yield "|---|---|---|---|---|---|"
    for name, counts in rows:
        valid = counts[DOCUMENTED] + counts[DIFFERS]
        yield f"| {name} | {valid} | {counts[DOCUMENTED]} | {counts[DIFFERS]} | {counts[VOID]} | {counts[SKIPPED]} |"


def failed(counts):
    return counts[DIFFERS] > 0 or (counts[DOCUMENTED] == 0 and counts[SKIPPED] == 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("program", "shim", "small_runs", "source", "work"):
        parser.add_argument(name)
    parser.add_argument("--only", help="names of classes, separated by commas")
    parser.add_argument("--except", dest="left_out", default="", help="names of classes to leave out, likewise")
    parser.add_argument("--long", action="store_true", help="the numbers of trials of `make faults`")
    parser.add_argument("--scale", type=float, default=1, help="factor on the numbers of trials")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    left_out = arguments.left_out.split(",") if arguments.left_out else []
    names = arguments.only.split(",") if arguments.only else list(CLASSES)
    if unknown := [name for name in names + left_out if name not in CLASSES]:
        parser.error(f"no such class: {', '.join(unknown)}; there are: {', '.join(CLASSES)}")
    names = [name for name in names if name not in left_out]
    lab = Lab(arguments.program, arguments.shim, arguments.small_runs, arguments.source, arguments.work)
    rows = []
    for number, name in enumerate(names):
        start = time.monotonic()
        lab.rng = random.Random(f"{arguments.seed} {name}")
        trials = max(1, round(CLASSES[name][2 if arguments.long else 1] * arguments.scale))
        rows.append((name, run_class(lab, name, trials)))
        print(f"[{number + 1}/{len(names)}] {name}: {time.monotonic() - start:.0f} s", flush=True)
    print("\n".join(table(rows)))
    lab.remove()
    bad = [name for name, counts in rows if failed(counts)]
    print(f"not as documented: {', '.join(bad)}" if bad else "all as documented")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
