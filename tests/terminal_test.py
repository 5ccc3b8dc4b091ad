#!/usr/bin/env python3
"""Runs the program at a terminal (a pseudo-terminal): colours, NO_COLOR, and the bar of a run.

    terminal_test.py PROGRAM SMALL_RUNS   SMALL_RUNS: the folder that make_small_runs has filled
"""
import os
import pty
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ESCAPE = "\x1b[3"  # the start of a colour


def at_terminal(words, **environment):
    """What the program writes to its standard error, which is a terminal."""
    master, slave = pty.openpty()
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=slave,
                               env={**os.environ, "TERM": "xterm", **environment})
    os.close(slave)
    text = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        text += part
    process.wait(timeout=120)
    os.close(master)
    return text.decode()


def completed(program, folder, typed):
    """What zsh makes of the typed words and a tab, with the completion as a file of $fpath."""
    script = subprocess.run([program, "completion", "zsh"], check=True, capture_output=True, text=True, timeout=60).stdout
    (Path(folder) / "_spartan").write_text(script, encoding="utf-8")
    process, terminal = pty.fork()
    if process == 0:
        os.execvpe("zsh", ["zsh", "-f", "-i"], {**os.environ, "TERM": "dumb"})
    def answer(until):
        text, end = b"", time.monotonic() + 20
        while until not in text and time.monotonic() < end:
            if select.select([terminal], [], [], 0.1)[0]:
                text += os.read(terminal, 65536)
        return text.decode()
    os.write(terminal, f"fpath=({folder} $fpath); autoload -Uz compinit; compinit -u -D; print rea''dy\n".encode())
    answer(b"ready\r")
    os.write(terminal, typed.encode() + b"\t")
    text = answer(b"--window")
    os.close(terminal)
    os.waitpid(process, 0)
    return text


def check(holds, message, text):
    if not holds:
        sys.exit(f"failed: {message}: {text!r}")


def main():
    program, small_runs = sys.argv[1], Path(sys.argv[2])
    os.environ.pop("NO_COLOR", None)
    wrong = [program, "map", "info", "nowhere.map"]
    text = at_terminal(wrong)
    check(ESCAPE in text and "nowhere.map" in text, "an error is in colour at a terminal", text)
    text = at_terminal(wrong, NO_COLOR="1")
    check("\x1b" not in text and "nowhere.map" in text, "NO_COLOR: no escape sequence", text)
    text = at_terminal(wrong, NO_COLOR="")
    check(ESCAPE in text, "an empty NO_COLOR has no effect (no-color.org)", text)
    with tempfile.TemporaryDirectory() as folder:
        if shutil.which("zsh"):
            text = completed(program, folder, "spartan map export --win")
            check("--window" in text, "zsh completes a flag at the first tab", text)
        else:
            print("not tried: zsh is not installed")
        text = at_terminal([program, "run", str(small_runs / "drive"), "-o", f"{folder}/run", "--max-frames", "5"])
    bar = re.findall(r"\[(#*)(\.*)\] (\d+)/(\d+) (\w+), [\d.]+ m, [\d.]+ frames/s", text)
    check(bar, "the bar shows the tracking state, the distance and frames per second", text)
    check(all(total == "5" for _, _, _, total, _ in bar), "the bar counts up to --max-frames", text)
    check(bar[-1][1] == "" and bar[-1][2] == "5", "the bar is full at the end", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
