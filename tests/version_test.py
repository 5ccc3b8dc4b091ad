#!/usr/bin/env python3
"""The version is the same in CMakeLists.txt, CITATION.cff, the newest entry of CHANGELOG.md, and the program.

    version_test.py PROGRAM SOURCE
"""
import re
import subprocess
import sys
from pathlib import Path


def version_in(path, pattern):
    found = re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        sys.exit(f"failed: {path.name} states no version")
    return found[1]


def main():
    program, source = sys.argv[1], Path(sys.argv[2])
    printed = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
    versions = {
        "CMakeLists.txt": version_in(source / "CMakeLists.txt", r"^project\(spartan VERSION ([0-9.]+)"),
        "CITATION.cff": version_in(source / "CITATION.cff", r"^version: ([0-9.]+)"),
        "CHANGELOG.md": version_in(source / "CHANGELOG.md", r"^## \[([0-9.]+)\]"),
        "spartan --version": printed.split()[1],
    }
    return f"failed: {versions}" if len(set(versions.values())) != 1 else 0


if __name__ == "__main__":
    sys.exit(main())
