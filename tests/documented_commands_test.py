#!/usr/bin/env python3
"""Runs the command lines of README.md, of the other documents and of `--help`, as they are written.

    documented_commands_test.py [--long] PROGRAM SOURCE SMALL_RUNS   SMALL_RUNS: the folder that make_small_runs filled

A command line is a line of a code block, or an example of --help, that starts with `spartan`. Lines with placeholders
in capitals, brackets or "…" are synopses. They run in the order of the documents, in a folder that holds what `make
demo` leaves and the other files that they name. Lines that render a shipped scenario take minutes: --long runs them
alone. Options that the texts for users name (`--option`) must exist. Lines with $SPARTAN_DATA need the recordings. Exit code 77 (skipped) where the program has no simulator.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PLACEHOLDER = re.compile(r"(?<![$\w])(RECORDING|RUN|TRUTH|LEFT|RIGHT|INPUT|FILE|DIR|MAP|EST|GT|RIG|REQ|SCENARIO)\b"
                         r"|[\[\]…]|\w\|\w")
RENDERS = re.compile(r"^spartan ((demo|simulate)\b|(run|record) sim:)")


def lines_of_documents(source):
    for document in [source / "README.md", *sorted((source / "docs").rglob("*.md"))]:
        inside = False
        text = document.read_text(encoding="utf-8")
        text = re.sub(r"\\\n", lambda _: "\\\0", text)  # a line that continues is one line, with the number of its first
        for number, line in enumerate(text.split("\n"), 1):
            line = line.replace("\\\0", " ")
            if line.lstrip().startswith("```"):
                inside = not inside
            elif inside and line.startswith("spartan ") and not PLACEHOLDER.search(line.split("  #")[0]):
                yield f"{document.relative_to(source)}:{number}", line


def helps(program, words=()):
    text = subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True, timeout=60).stdout
    commands = re.findall(r"^  ([a-z]+) ", text.partition("Subcommands:")[2], re.MULTILINE)
    if not commands:
        yield words, text
    for command in commands:
        yield from helps(program, (*words, command))


def lines_of_help(program):
    for words, text in helps(program):
        example = re.search(r"Example:\s+(spartan .*)", text)
        if example is None:
            sys.exit(f"failed: spartan {' '.join(words)} --help has no example")
        yield f"spartan {' '.join(words)} --help", example[1]


def check_named_options(program, source):
    own = subprocess.run([program, "--help"], check=True, capture_output=True, text=True, timeout=60).stdout
    bags = (source / "python/spartan/bags/_command.py").read_text(encoding="utf-8")  # spartan-bag
    known = {option for text in [own, bags, *(text for _, text in helps(program))] for option in re.findall(r"--[a-z][a-z-]+", text)}
    texts = [source / "docs/limits.md", *(source / "docs/tutorials").glob("*.md"), *(source / "docs/reference").glob("*.md")]
    for text in texts:
        for number, line in enumerate(text.read_text(encoding="utf-8").splitlines(), 1):
            for option in re.findall(r"`(--[a-z][a-z-]+)", line):
                if option not in known:
                    sys.exit(f"failed: {text.relative_to(source)}:{number}: no command has the option {option}")


def prepare(program, source, small_runs, work):
    """What `make demo` leaves, from a smaller scenario, and the files that the examples name."""
    def spartan(*arguments):
        done = subprocess.run([program, *map(str, arguments), "-q"], cwd=work, capture_output=True, text=True, timeout=300)
        if done.returncode not in (0, 6):  # 6: lost for a part of the small drive
            sys.exit(f"failed: spartan {' '.join(map(str, arguments))}: {done.stderr}")
    spartan("demo", small_runs / "stops/small.yaml", "-o", work)
    (work / "config").symlink_to(source / "config")
    (work / "drive").symlink_to(small_runs / "stops/rec")
    for name in ("run_monday", "run_tuesday"):
        shutil.copytree(small_runs / "stops/whole", work / name)
    spartan("rig", "convert", "kitti/calib.txt", "rig.yaml", "--size-px", "320,240")
    shutil.copy(work / "kitti/calib.txt", work)
    for side, camera in (("left", 0), ("right", 1)):
        shutil.copy(work / f"kitti/image_{camera}/000000.png", work / f"{side}.png")
    (work / ".local/share/bash-completion/completions").mkdir(parents=True)


def needs_recordings(line):
    return "$SPARTAN_DATA" in line or "run_06" in line  # run_06 is a run of one of them


def run(where, line, program, work):
    """Exits where the line fails. A view answers until it is terminated."""
    environment = {**os.environ, "HOME": str(work), "PATH": f"{Path(program).parent}:{os.environ['PATH']}"}
    if line.startswith("spartan view "):
        line = f"timeout --foreground --preserve-status 2 {line}"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", line], cwd=work, env=environment, capture_output=True,
                          text=True, timeout=600)
    lost = 6 if re.match("spartan (run|demo) ", line) else 0  # for a part of the small drive
    if done.returncode not in (0, lost):
        sys.exit(f"failed: {where}: {line}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")


def main():
    long = sys.argv[1] == "--long"
    program, source, small_runs = (Path(word).resolve() for word in sys.argv[1 + long:])
    if not (small_runs / "stops/whole").exists():
        print("skipped: built without the simulator")
        return 77
    lines = [*lines_of_documents(source), *lines_of_help(program)]
    if len(lines) < 20:
        sys.exit(f"failed: only {len(lines)} command lines were found")
    check_named_options(program, source)
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        prepare(program, source, small_runs, work)
        for where, line in lines:
            if bool(RENDERS.match(line)) != long:
                continue
            if needs_recordings(line) and "SPARTAN_DATA" not in os.environ:
                print(f"not run without the recordings: {where}: {line}")
                continue
            if "| man " in line and shutil.which("man") is None:
                print(f"not run without man: {where}: {line}")
                continue
            run(where, line, program, work)
            count += 1
    print(f"{count} command lines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
