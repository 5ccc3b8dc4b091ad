#!/usr/bin/env python3
"""The steps of docs/tutorials/webcams.md, with a rendered drive in place of the webcams, and the chessboards of OpenCV in
$SPARTAN_DATA for their calibration.

    webcams_tutorial_test.py SPARTAN SOURCE SMALL_RUNS

Without the plugin of GStreamer the test is skipped (77).
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
RATE_HZ = 5
DEBIAN_PYTHON = "/usr/bin/python3"  # has OpenCV by the package python3-opencv


def spartan(program, folder, line, replaced, accepted=(0,)):
    words = [replaced.get(word, word) for word in line.split()]
    done = subprocess.run([program, *words[1:]], cwd=folder, capture_output=True, text=True, timeout=120)
    if "spartan_gstreamer" in done.stderr:
        print("no plugin of GStreamer: skipped")
        sys.exit(SKIPPED)
    if done.returncode not in accepted:
        sys.exit(f"failed: {' '.join(words)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def scaled(calibration):
    """A calib.txt of KITTI for images of twice the size."""
    lines = []
    for line in calibration.read_text().splitlines():
        name, *values = line.split()
        p = [float(v) for v in values]
        if name in ("P0:", "P1:"):
            p = [2 * v for v in p[:8]] + p[8:]
            p[2], p[6] = p[2] + 0.5, p[6] + 0.5
        lines.append(" ".join([name, *map(str, p)]))
    return "\n".join(lines) + "\n"


def calibrate(program, text, convert):
    """By images of chessboards, each of which comes twice, as of a board that is held still."""
    boards = pathlib.Path(os.environ.get("SPARTAN_DATA", "")) / "opencv_chessboard"
    if not boards.is_dir():
        print("not tried: calibration, no opencv_chessboard in $SPARTAN_DATA")
        return
    if subprocess.run([DEBIAN_PYTHON, "-c", "import cv2"], capture_output=True).returncode != 0:
        print("not tried: calibration, python3-opencv is not installed (./setup test)")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        images = folder / "recording/images/stereo"
        images.mkdir(parents=True)
        lefts = sorted(boards.glob("left??.jpg"))
        for i, left in enumerate(left for left in lefts for _ in range(2)):
            for side, file in (("left", left), ("right", left.with_name(left.name.replace("left", "right")))):
                shutil.copy(file, images / f"{1_700_000_000 + i}000000000_{side}.jpg")
        (folder / "calibrate.py").write_text(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1])
        words = re.search(r"^python3 (calibrate\.py .*)", text, re.MULTILINE)[1].replace("RECORDING", "recording").split()
        done = subprocess.run([DEBIAN_PYTHON, *words[:-1], "calibration"], cwd=folder, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        views, rms, baseline = re.fullmatch(r"(\d+) views, (\S+) px RMS, baseline (\S+) m\n", done.stdout).groups()
        assert int(views) >= len(lefts) - 1 and float(rms) < 0.5 and abs(float(baseline) - 0.0834) < 0.0005, done.stdout
        spartan(program, folder, convert, {"DIR": "calibration"})
        told = spartan(program, folder, f"spartan rig inspect rig.yaml {boards}/left*.jpg {boards}/right*.jpg", {})
        rows = float(re.search(r"rectified with the given calibration (\S+) px", told)[1])
        assert "pair stereo: calibration: good" in told and rows < 0.4, told
        print(f"{done.stdout.strip()}, rows agree to {rows} px")


def main():
    program, source, small_runs = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    text = (source / "docs/tutorials/webcams.md").read_text(encoding="utf-8")
    rig = re.search(r"```yaml\n(.*?)```", text, re.DOTALL)[1]
    lines = re.findall(r"^spartan .*", text, re.MULTILINE)
    drive = small_runs / "drive"
    calibrate(program, text, lines[1])
    for device, images in (("video0", "image_0"), ("video2", "image_1")):
        camera = f"v4l2src device=/dev/{device} !"
        assert rig.count(camera) == 2, rig
        rig = rig.replace(camera, f"multifilesrc location={drive / images}/%06d.png caps=image/png,framerate={RATE_HZ}/1 ! pngdec ! "
                                  "videoconvert ! videoscale ! identity sync=true !")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "pair.yaml").write_text(rig)
        replaced = {"live:RIG": "live:pair.yaml", "RECORDING": "recording", "DIR": "calibration", "RUN": "run"}
        record, convert, inspect, run = lines
        spartan(program, folder, record, replaced)
        listed = (folder / "recording/frames.csv").read_text().splitlines()[1:]
        assert len(listed) >= 7, f"{len(listed)} frames are recorded"
        # In place of the calibration by another tool.
        (folder / "calib.txt").write_text(scaled(drive / "calib.txt"))
        (folder / "calibration").mkdir()
        spartan(program, folder, "spartan rig convert calib.txt calibration/camchain.yaml --to kalibr --size-px 640,480", {})
        spartan(program, folder, convert, replaced)
        told = spartan(program, folder, inspect, replaced)
        assert "pair stereo: calibration: good" in told, told
        spartan(program, folder, run, replaced, (0, 6))  # 6: lost at times, by the first rig
        print(f"{len(listed)} frames; {told}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
