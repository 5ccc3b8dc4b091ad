"""The command `spartan` of an installed package: the program in C++, with the arguments as they are."""

import os
import sys
from pathlib import Path


def main() -> None:
    program = Path(__file__).parent / "bin" / "spartan"
    os.execv(program, ["spartan", *sys.argv[1:]])
