#!/usr/bin/env python3
"""Faults of the images, injected into copies of recordings in KITTI's layout; prints what `spartan run` makes of them.

Needs Python 3.9, numpy and Pillow. Example:

    tests/faults/vision_faults.py --spartan build/release/bin/spartan --data $SPARTAN_DATA kitti_06 rover_sandbox

Every fault is deterministic. Frames before and after the fault are links to the recording's own images. The columns:
exit code; frames tracking / degraded / standing / lost; skipped frames by reason; ATE of odometry and localization in
metres, by `spartan evaluate` (SE3, or Sim3 where the scale of the recording is not known).
"""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

ALIGNMENTS = {"rover_sandbox": "sim3"}  # its calibration is inferred; others: se3
# A moving object covers WIDTH x HEIGHT of the image (34 %), at a constant disparity that is nearer than the scene.
OBJECT_FRAMES, WIDTH, HEIGHT, DISPARITY = 10, 0.62, 0.55, 0.06


class Recording:
    """A copy of a recording whose images can be replaced."""

    def __init__(self, source, folder):
        self.source, self.folder = pathlib.Path(source), pathlib.Path(folder)
        self.names = sorted(p.name for p in (self.source / "image_0").glob("*.png"))
        self.folder.mkdir(parents=True)
        for path in self.source.iterdir():
            if path.name not in ("image_0", "image_1"):
                (self.folder / path.name).symlink_to(path.resolve())
        for side in (0, 1):
            (self.folder / f"image_{side}").mkdir()
            for name in self.names:
                self.path(side, name).symlink_to((self.source / f"image_{side}" / name).resolve())

    def path(self, side, name):
        return self.folder / f"image_{side}" / name

    def middle(self, count):
        """Frames from 43 % of the recording on (frame 22 of 51, 55 of 128)."""
        first = int(0.435 * len(self.names))
        return self.names[first:first + count]

    def read(self, side, name):
        return np.array(Image.open(self.source / f"image_{side}" / name))

    def write(self, side, name, pixels):
        self.path(side, name).unlink()
        Image.fromarray(pixels).save(self.path(side, name))


def frozen(recording, sides, count):
    frames = recording.middle(count)
    before = recording.names[recording.names.index(frames[0]) - 1]
    for side in sides:
        for name in frames:
            recording.write(side, name, recording.read(side, before))


def dark(recording, count):
    """The noise of the sensor alone: dark images of a real camera differ."""
    noise = np.random.default_rng(1)
    for name in recording.middle(count):
        for side in (0, 1):
            shape = recording.read(side, name).shape
            recording.write(side, name, np.clip(np.rint(noise.normal(1, 1, shape)), 0, 255).astype(np.uint8))


def missing_right(recording, count):
    frames = recording.names[len(recording.names) // 2:] if count is None else recording.middle(count)
    for name in frames:
        recording.path(1, name).unlink()


def texture(rng, height, width):
    """Blobs of several sizes with the contrast of well lit gravel, 8 bit."""
    result = np.zeros((height, width))
    for cell in (3, 6, 12, 24):
        coarse = rng.normal(0, 1, (height // cell + 3, width // cell + 3))
        y, x = np.arange(height) / cell, np.arange(width) / cell
        iy, ix = y.astype(int), x.astype(int)
        fy, fx = (y - iy)[:, None], (x - ix)[None, :]
        fy, fx = fy * fy * (3 - 2 * fy), fx * fx * (3 - 2 * fx)
        rows = coarse[iy][:, ix] * (1 - fx) + coarse[iy][:, ix + 1] * fx
        below = coarse[iy + 1][:, ix] * (1 - fx) + coarse[iy + 1][:, ix + 1] * fx
        result += rows * (1 - fy) + below * fy
    return np.clip(110 + 28 * result, 5, 250)


def resized(board, scale):
    """A bilinear resampling about the centre, at the same size."""
    height, width = board.shape
    y = np.clip((np.arange(height) - height / 2) / scale + height / 2, 0, height - 1.001)
    x = np.clip((np.arange(width) - width / 2) / scale + width / 2, 0, width - 1.001)
    iy, ix = y.astype(int), x.astype(int)
    fy, fx = (y - iy)[:, None], (x - ix)[None, :]
    rows = board[iy][:, ix] * (1 - fx) + board[iy][:, ix + 1] * fx
    below = board[iy + 1][:, ix] * (1 - fx) + board[iy + 1][:, ix + 1] * fx
    return rows * (1 - fy) + below * fy


def moving_object(recording, step_px, size=(WIDTH, HEIGHT), growth=1.0):
    """A textured board parallel to the images that moves by `step_px` (right, down) a frame in both of them.

    `growth`: factor of its disparity and of the size of its texture from frame to frame, as of a board that comes
    nearer."""
    rng = np.random.default_rng(7)
    shape = recording.read(0, recording.names[0]).shape
    height, width = int(size[1] * shape[0]), int(size[0] * shape[1])
    board = texture(rng, height, width)
    frames = recording.middle(OBJECT_FRAMES)
    path = np.outer(np.arange(len(frames)) - (len(frames) - 1) / 2, step_px)
    for index, (name, (dx, dy)) in enumerate(zip(frames, np.rint(path).astype(int))):
        left, top = (shape[1] - width) // 2 + dx, (shape[0] - height) // 2 + dy
        disparity = round(DISPARITY * shape[1] * growth ** index)
        content = board if growth == 1 else resized(board, growth ** index)
        for side in (0, 1):
            pixels = recording.read(side, name)
            x0 = left - side * disparity
            a, b = max(0, x0), min(shape[1], x0 + width)
            c, d = max(0, top), min(shape[0], top + height)
            seen = content[c - top:d - top, a - x0:b - x0]
            seen = seen + rng.normal(0, 1.5, seen.shape)
            pixels[c:d, a:b] = np.clip(np.rint(seen), 0, 255).astype(np.uint8)
            recording.write(side, name, pixels)


FAULTS = {
    "none": lambda r: None,
    "both cameras frozen, 10 frames": lambda r: frozen(r, (0, 1), 10),
    "right camera frozen, 10 frames": lambda r: frozen(r, (1,), 10),
    "1 dark frame": lambda r: dark(r, 1),
    "5 dark frames": lambda r: dark(r, 5),
    "20 dark frames": lambda r: dark(r, 20),
    "right image missing, 5 frames": lambda r: missing_right(r, 5),
    "right image missing from the middle on": lambda r: missing_right(r, None),
    "object, 7 px a frame to the right": lambda r: moving_object(r, (7, 0)),
    "object, 7 px to the left, 2 px down": lambda r: moving_object(r, (-7, 2)),
    "object, 3 px a frame to the right": lambda r: moving_object(r, (3, 0)),
    "object at rest in the image": lambda r: moving_object(r, (0, 0)),
    # On these no constant was chosen.
    "object, 16 px a frame to the right": lambda r: moving_object(r, (16, 0)),
    "object, 5 px up, 3 px to the left": lambda r: moving_object(r, (-3, -5)),
    "object that comes nearer, 3 % a frame": lambda r: moving_object(r, (0, 0), growth=1.03),
    "object over 20 % of the view": lambda r: moving_object(r, (5, 1), size=(0.48, 0.42)),
    "object over half of the view": lambda r: moving_object(r, (6, 0), size=(0.75, 0.67)),
}


def evaluate(spartan, run, recording, trajectory):
    align = ALIGNMENTS.get(recording.source.name, "se3")
    result = subprocess.run([spartan, "evaluate", str(run), "--truth", str(recording.source),
                             "--trajectory", trajectory, "--align", align, "--json"],
                            capture_output=True, text=True)
    return f"{json.loads(result.stdout)['ate_m']['rmse']:.3f}" if result.returncode == 0 else "-"


def try_fault(spartan, source, title, folder, options):
    recording = Recording(source, folder / "recording")
    FAULTS[title](recording)
    run = folder / "run"
    result = subprocess.run([spartan, "run", str(recording.folder), "-o", str(run), "-q", *options],
                            capture_output=True, text=True)
    if not (run / "summary.json").exists():
        sys.exit(f"{source}, {title}: exit code {result.returncode}\n{result.stderr}")
    summary = json.loads((run / "summary.json").read_text())
    health = summary["health"]["odometry"]
    counts = "/".join(str(health[k]) for k in ("tracking", "degraded", "standing", "lost"))
    skipped = ", ".join(f"{n} {reason}" for reason, n in summary["skipped"].items())
    return (f"| {title} | {result.returncode} | {counts} | {skipped} | "
            f"{evaluate(spartan, run, recording, 'odometry')} | {evaluate(spartan, run, recording, 'localization')} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", help="names of folders in the data folder")
    parser.add_argument("--spartan", default="build/release/bin/spartan", help="the program")
    parser.add_argument("--data", default=os.environ.get("SPARTAN_DATA", "."), help="folder of the recordings")
    parser.add_argument("--faults", default="", help="only faults that contain this text")
    parser.add_argument("--keep", help="keep recordings and runs in this new folder")
    parser.add_argument("--set", action="append", default=[], help="option of the run, as in `spartan run --set`")
    arguments = parser.parse_args()
    options = ["--threads", "1", "--set", "terrain.enabled=false"]
    for assignment in arguments.set:
        options += ["--set", assignment]
    work = pathlib.Path(arguments.keep or tempfile.mkdtemp(prefix="vision_faults_"))
    for name in arguments.recordings:
        print(f"\n{name}:\n\n| fault | exit | T/D/S/L | skipped | ATE odometry, m | ATE localization, m |")
        print("|---|---|---|---|---|---|")
        for index, title in enumerate(FAULTS):
            if arguments.faults in title:
                folder = work / f"{name}_{index}"
                source = pathlib.Path(arguments.data) / name
                print(try_fault(arguments.spartan, source, title, folder, options), flush=True)
                if not arguments.keep:
                    shutil.rmtree(folder)
    if not arguments.keep:
        shutil.rmtree(work)


if __name__ == "__main__":
    main()
