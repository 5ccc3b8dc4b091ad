#!/usr/bin/env python3
"""Validates the JSON that the program prints against the schemas in docs/reference/schemas.

    json_schema_test.py PROGRAM SOURCE DRIVE     DRIVE: a small recording in the KITTI layout
    json_schema_test.py --self-test SOURCE       shows that each schema can fail

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

SCENARIO = """schema: 1
name: schema_test
seed: 3
samples: 1
rig: rig.yaml
extent_m: 30
path: {kind: straight, length_m: 1, speed_m_s: 0.1}
capture: {frame_step_m: 0.25, stop_every_m: 0.5, pans_deg: [0]}
imu: {rate_hz: 50}
"""
CAMERA = ("{{size_px: [160, 120], model: pinhole, focal_px: [130, 130], centre_px: [79.5, 59.5], axes: forward, "
          "mount: {0}, translation_m: [0, {1}, {2}], roll_pitch_yaw_deg: [0, {3}, 0]}}")
RIG = f"""schema: 1
pan_tilt_units:
  mast: {{translation_m: [0, 0, 1.0], rest_angles_deg: [0, 39]}}
cameras:
  wide_left: {CAMERA.format('mast', 0.1, 0, 0)}
  wide_right: {CAMERA.format('mast', -0.1, 0, 0)}
  narrow_left: {CAMERA.format('body', 0.06, 0.3, 31.5)}
  narrow_right: {CAMERA.format('body', -0.06, 0.3, 31.5)}
pairs:
  wide: {{left: wide_left, right: wide_right, nearest_m: 0.9, for_odometry: false}}
  narrow: {{left: narrow_left, right: narrow_right, nearest_m: 0.3}}
"""


def schema(source, name):
    found = json.loads((source / "docs/reference/schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(found)
    return jsonschema.Draft202012Validator(found)


def output_of(program, *arguments, codes=(0,)):
    done = subprocess.run([program, *map(str, arguments), "--json", "-q"], capture_output=True, text=True, timeout=600)
    if done.returncode not in codes:
        sys.exit(f"spartan {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stderr}")
    return json.loads(done.stdout)


def outputs(program, source, drive, work):
    """Pairs of a schema's name and an output of the program, one or more for each schema."""
    left, right = (sorted((drive / f"image_{side}").glob("*.png"))[0] for side in (0, 1))
    rig, design = source / "config/rigs/rover.yaml", source / "config/requirements/rover.yaml"
    yield "run", output_of(program, "run", drive, "-o", work / "run", "--truth", drive)
    yield "run", json.loads((work / "run/summary.json").read_text(encoding="utf-8"))
    yield "run", output_of(program, "run", drive, "-o", work / "odometry", "--odometry-only")
    for align in ("se3", "sim3", "none"):
        yield "evaluate", output_of(program, "evaluate", work / "run", "--truth", drive, "--align", align)
    yield "stereo", output_of(program, "stereo", left, right, "-o", work / "stereo", "--calib", drive / "calib.txt")
    yield "stereo", output_of(program, "stereo", left, right, "-o", work / "scored", "--truth",
                              work / "stereo/disparity.pfm")
    yield "map_build", output_of(program, "map", "build", left, right, "-o", work / "map", "--rig", drive / "calib.txt")
    yield "rig_inspect", output_of(program, "rig", "inspect", rig)
    yield "rig_inspect", output_of(program, "rig", "inspect", drive / "calib.txt", left, right)
    yield "rig_inspect", output_of(program, "rig", "inspect", "-", left, right)
    yield "rig_convert", output_of(program, "rig", "convert", drive / "calib.txt", work / "rig.yaml", "--size-px",
                                   "320,240")
    yield "rig_design", output_of(program, "rig", "design", design)
    (work / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    (work / "scenario").mkdir()
    (work / "scenario/rig.yaml").write_text(RIG, encoding="utf-8")
    (work / "scenario/scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    if "no simulator" in subprocess.run([program, "simulate", "none", "-o", work / "none"], capture_output=True,
                                        text=True).stderr:
        return
    yield "simulate", output_of(program, "simulate", work / "scenario/scenario.yaml", "-o", work / "recording")
    yield "run", output_of(program, "run", work / "recording", "-o", work / "drive", codes=(0, 6))
    yield "map_info", output_of(program, "map", "info", work / "drive")
    yield "map_merge", output_of(program, "map", "merge", work / "drive", work / "drive", "-o", work / "merged.map")


def validate(program, source, drive):
    checked, faults = set(), []
    with tempfile.TemporaryDirectory() as folder:
        for name, output in outputs(program, source, drive, Path(folder)):
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
