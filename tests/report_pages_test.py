#!/usr/bin/env python3
"""Makes the report pages of different runs and looks at each in a browser (scripts/check_page).

    report_pages_test.py PROGRAM SOURCE [SCREENSHOTS]   SCREENSHOTS: a folder for images of the pages

The runs: of recordings of $SPARTAN_DATA, without a truth, and lost for a while (black images). Exit code 77 (skipped)
without the recordings, a browser or the Python packages of ./setup.
"""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

VENV_PYTHON = Path(__file__).resolve().parent.parent / ".venv/bin/python3"  # made by ./setup
try:
    from PIL import Image
except ImportError:
    if VENV_PYTHON.exists() and Path(sys.prefix) != VENV_PYTHON.parent.parent:
        os.execv(VENV_PYTHON, [str(VENV_PYTHON), *sys.argv])
    print("skipped: the Python package pillow is missing (./setup test installs it)")
    sys.exit(77)

BLACK = range(20, 38)  # frames of the drive that loses its way


def without_truth(drive, folder):
    shutil.copytree(drive, folder)
    (folder / "poses.txt").unlink()
    return folder


def with_black_images(drive, folder):
    shutil.copytree(drive, folder)
    for side in ("image_0", "image_1"):
        for number in BLACK:
            path = folder / side / f"{number:06d}.png"
            Image.new("L", Image.open(path).size).save(path)
    return folder


def main():
    program, source = (Path(word).resolve() for word in sys.argv[1:3])
    screenshots = Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
    data = os.environ.get("SPARTAN_DATA")
    if not data:
        print("skipped: SPARTAN_DATA is not set")
        return 77
    data = Path(data)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        recordings = {name: data / name for name in ("kitti_06", "kitti_0013", "rover_sandbox", "euroc_v101")}
        recordings["without_truth"] = without_truth(data / "kitti_06", work / "no_truth")
        recordings["lost"] = with_black_images(data / "kitti_06", work / "black")
        for name, recording in recordings.items():
            run = work / f"run_{name}"
            code = subprocess.run([program, "run", recording, "-o", run, "-q"], stdout=subprocess.DEVNULL,
                                  timeout=600).returncode
            if code != (6 if name == "lost" else 0):
                sys.exit(f"failed: run of {name}: exit code {code}")
            command = [source / "scripts/check_page", run / "report/index.html"]
            if screenshots:
                (screenshots / name).mkdir(parents=True, exist_ok=True)
                command.append(screenshots / name)
            status = subprocess.run(command, timeout=600).returncode
            if status == 77:
                return 77
            if status != 0:
                sys.exit(f"failed: the page of {name}")
            print(f"{name}: no finding")
    return 0


if __name__ == "__main__":
    sys.exit(main())
