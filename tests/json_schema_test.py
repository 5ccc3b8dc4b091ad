#!/usr/bin/env python3
"""Validates the JSON that the program prints against the schemas in docs/reference/schemas.

    json_schema_test.py PROGRAM SOURCE SMALL_RUNS   SMALL_RUNS: the folder that make_small_runs has filled
    json_schema_test.py --self-test SOURCE          shows that each schema can fail

Exit code 77 (skipped) without the Python package jsonschema, which ./setup installs into .venv.
"""
import copy
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

VENV_PYTHON = Path(__file__).resolve().parent.parent / ".venv/bin/python3"  # made by ./setup
try:
    import jsonschema
except ImportError:
    if VENV_PYTHON.exists() and Path(sys.prefix) != VENV_PYTHON.parent.parent:
        os.execv(VENV_PYTHON, [str(VENV_PYTHON), *sys.argv])
    print("skipped: the Python package jsonschema is missing (./setup installs it)")
    sys.exit(77)


def schema(source, name):
    found = json.loads((source / "docs/reference/schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


def output_of(program, *arguments, codes=(0,)):
    done = subprocess.run([program, *map(str, arguments), "--json", "-q"], capture_output=True, text=True, timeout=600)
    if done.returncode not in codes:
        sys.exit(f"spartan {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stderr}")
    return json.loads(done.stdout)


def outputs(program, source, small_runs, work):
    """Pairs of a schema's name and an output of the program, one or more for each schema."""
    drive, stops = small_runs / "drive", small_runs / "stops"
    left, right = (sorted((drive / f"image_{side}").glob("*.png"))[0] for side in (0, 1))
    rig, design = source / "config/rigs/rover.yaml", source / "config/requirements/rover.yaml"
    yield "run", output_of(program, "run", drive, "-o", work / "run", "--truth", drive)
    yield "run", json.loads((work / "run/summary.json").read_text(encoding="utf-8"))
    yield "run", output_of(program, "run", drive, "-o", work / "odometry", "--odometry-only")
    live = [program, "run", f"replay:{drive}", "-o", work / "live", "--speed", "20", "--publish", "-", "-q"]
    for line in subprocess.run(map(str, live), capture_output=True, text=True, timeout=600, check=True).stdout.splitlines():
        message = json.loads(line)
        yield f"message_{message['type']}", message
    yield "run", json.loads((work / "live/summary.json").read_text(encoding="utf-8"))
    yield "record", output_of(program, "record", f"replay:{drive}", "-o", work / "recorded", "--speed", "20")
    for align in ("se3", "sim3", "none"):
        yield "evaluate", output_of(program, "evaluate", work / "run", "--truth", drive, "--align", align)
    yield "evaluate", output_of(program, "evaluate", work / "run", "--truth", drive, "--trajectory", "odometry")
    yield "stereo", output_of(program, "stereo", left, right, "-o", work / "stereo", "--calib", drive / "calib.txt")
    yield "stereo", output_of(program, "stereo", left, right, "-o", work / "scored", "--truth",
                              work / "stereo/disparity.pfm")
    yield "features_compare", output_of(program, "features", "compare", left, "--repetitions", 1)
    yield "features_compare", output_of(program, "features", "compare", left, right, "--rectified", "--repetitions", 1)
    yield "map_build", output_of(program, "map", "build", left, right, "-o", work / "map", "--rig", drive / "calib.txt")
    yield "error", output_of(program, "evaluate", work / "missing", "--truth", drive, codes=(3,))
    yield "rig_inspect", output_of(program, "rig", "inspect", rig)
    yield "rig_inspect", output_of(program, "rig", "inspect", drive / "calib.txt", left, right)
    yield "rig_inspect", output_of(program, "rig", "inspect", "-", left, right)
    yield "rig_convert", output_of(program, "rig", "convert", drive / "calib.txt", work / "rig.yaml", "--size-px",
                                   "320,240")
    yield "rig_design", output_of(program, "rig", "design", design)
    if not (stops / "rec").exists():
        return  # built without Embree
    yield "simulate", output_of(program, "simulate", stops / "small.yaml", "-o", work / "recording")
    yield "run", json.loads((stops / "whole/summary.json").read_text(encoding="utf-8"))
    yield "map_info", output_of(program, "map", "info", stops / "whole")
    yield "map_merge", output_of(program, "map", "merge", stops / "whole", stops / "whole", "-o", work / "merged.map")


def validate(program, source, small_runs):
    checked, faults = set(), []
    with tempfile.TemporaryDirectory() as folder:
        for name, output in outputs(program, source, small_runs, Path(folder)):
            checked.add(name)
            for error in schema(source, name).iter_errors(output):
                faults.append(f"{name}: {error.json_path}: {error.message}")
    print("\n".join(faults) or f"valid: {', '.join(sorted(checked))}")
    return 1 if faults else 0


def self_test(source):
    """Each schema refuses an object without its first required key, and one with a further key."""
    for file in sorted((source / "docs/reference/schemas").glob("*.schema.json")):
        found = json.loads(file.read_text(encoding="utf-8"))
        validator = jsonschema.Draft202012Validator(found)
        empty = {"schema": 1}
        if validator.is_valid(empty) or validator.is_valid({"schema": 2}):
            return f"{file.name} accepts an object without its keys"
        relaxed = copy.deepcopy(found)
        relaxed["required"] = ["schema"]
        relaxed_validator = jsonschema.Draft202012Validator(relaxed)
        if not relaxed_validator.is_valid(empty) or relaxed_validator.is_valid({**empty, "no_such_key": 1}):
            return f"{file.name} accepts an unknown key"
    return None


def main(arguments):
    if arguments[0] == "--self-test":
        problem = self_test(Path(arguments[1]))
        print(problem or "every schema can fail")
        return 1 if problem else 0
    return validate(Path(arguments[0]), Path(arguments[1]), Path(arguments[2]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
