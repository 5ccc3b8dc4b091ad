#!/usr/bin/env python3
"""Faults of the images, injected into copies of recordings; prints what `spartan run` makes of them.

Needs Python 3.9, numpy and Pillow. Example:

    tests/faults/vision_faults.py --spartan build/release/bin/spartan --data $SPARTAN_DATA kitti_06 rover_sandbox

Recordings have KITTI's layout or Spartan's. Every fault is deterministic. Frames before and after the fault are links to
the recording's own images. The columns: exit code; frames tracking / degraded / standing / lost; skipped frames by
reason; status of the first frame after the fault; ATE of odometry and localization in metres, by `spartan evaluate` (SE3,
or Sim3 where the scale of the recording is not known); what the fault costs: the distance between the last positions
with and without it, in percent of the distance driven, of the odometry and the localization.
"""
import argparse
import csv
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

ALIGNMENTS = {"rover_sandbox": "sim3"}  # its calibration is inferred; others: se3
# A moving object covers WIDTH x HEIGHT of the image (34 %), at a constant disparity that is nearer than the scene.
OBJECT_FRAMES, WIDTH, HEIGHT, DISPARITY = 10, 0.62, 0.55, 0.06


class Recording:
    """A copy of a recording whose images can be replaced. Frames are numbered from 0."""

    def __init__(self, source, folder):
        self.source, self.folder = pathlib.Path(source), pathlib.Path(folder)
        self.is_kitti = (self.source / "times.txt").exists()
        self.files = self.files_of_kitti() if self.is_kitti else self.files_of_spartan()
        for path in self.source.rglob("*"):
            name = path.relative_to(self.source)
            copy = self.folder / name
            if path.is_dir():
                copy.mkdir(parents=True)
            elif str(name) in ("times.txt", "frames.csv"):
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(path, copy)
            else:
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.symlink_to(path.resolve())
        self.first_after = None  # the first frame after the fault

    def files_of_kitti(self):
        names = sorted(p.name for p in (self.source / "image_0").glob("*.png"))
        return [(f"image_0/{name}", f"image_1/{name}") for name in names]

    def files_of_spartan(self):
        """Those of the first pair that is listed: the pair of the odometry."""
        with open(self.source / "frames.csv") as table:
            rows = list(csv.DictReader(table))
        return [(row["left"], row["right"]) for row in rows if row["pair"] == rows[0]["pair"]]

    def middle(self, count):
        """Frames from 43 % of the recording on (frame 22 of 51, 55 of 128)."""
        first = int(0.435 * len(self.files))
        self.first_after = first + count
        return range(first, first + count)

    def read(self, side, frame):
        return np.array(Image.open(self.source / self.files[frame][side]))

    def remove(self, side, frame):
        (self.folder / self.files[frame][side]).unlink()

    def write(self, side, frame, pixels):
        self.remove(side, frame)
        Image.fromarray(pixels).save(self.folder / self.files[frame][side])

    def change(self, frames, change, sides=(0, 1)):
        for frame in frames:
            for side in sides:
                changed = change(self.read(side, frame).astype(float))
                self.write(side, frame, np.clip(np.rint(changed), 0, 255).astype(np.uint8))


def frozen(recording, sides, count):
    frames = recording.middle(count)
    for side in sides:
        for frame in frames:
            recording.write(side, frame, recording.read(side, frames[0] - 1))


def dark(recording, count, sides=(0, 1)):
    """The noise of the sensor alone: dark images of a real camera differ."""
    noise = np.random.default_rng(1)
    recording.change(recording.middle(count), lambda pixels: noise.normal(1, 1, pixels.shape), sides)


def blurred(recording, count):
    """Motion blur of 25 px along the rows."""
    kernel = np.ones(25) / 25

    def blur(pixels):
        return np.apply_along_axis(lambda row: np.convolve(np.pad(row, 12, "edge"), kernel, "valid"), 1, pixels)

    recording.change(recording.middle(count), blur)


def missing(recording, side, count):
    half = len(recording.files) // 2
    for frame in range(half, len(recording.files)) if count is None else recording.middle(count):
        recording.remove(side, frame)


def dropped(recording):
    """Every tenth frame, without a regular distance."""
    draw = np.random.default_rng(3)
    for frame in range(2, len(recording.files) - 2):
        if draw.random() < 0.1:
            recording.remove(0, frame)
            recording.remove(1, frame)


def shifted_rows(recording, count):
    """The right image is 1 px lower."""
    recording.change(recording.middle(count), lambda pixels: np.roll(pixels, 1, axis=0), (1,))


def swapped(recording):
    for frame in recording.middle(1):
        for side in (0, 1):
            recording.write(side, frame, recording.read(1 - side, frame))


def changed_times(recording, change):
    """`change(times, first)` changes the stamps in seconds, `first` is the first frame of the fault."""
    frames = recording.middle(1)
    path = recording.folder / "times.txt"
    times = np.loadtxt(path)
    change(times, frames[0])
    np.savetxt(path, times, "%.9f")


def repeated_stamp(recording):
    def repeat(times, first):
        times[first] = times[first - 1]

    changed_times(recording, repeat)


def gap(recording):
    def delay(times, first):
        times[first:] += 100

    changed_times(recording, delay)
    recording.first_after = recording.middle(1)[0]


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
    shape = recording.read(0, 0).shape
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
    "1 blurred frame": lambda r: blurred(r, 1),
    "5 blurred frames": lambda r: blurred(r, 5),
    "20 blurred frames": lambda r: blurred(r, 20),
    "right camera dark, 20 frames": lambda r: dark(r, 20, (1,)),
    "left camera dark, 20 frames": lambda r: dark(r, 20, (0,)),
    "right image missing, 5 frames": lambda r: missing(r, 1, 5),
    "left image missing, 5 frames": lambda r: missing(r, 0, 5),
    "right image missing from the middle on": lambda r: missing(r, 1, None),
    "brightness doubled, 20 frames": lambda r: r.change(r.middle(20), lambda pixels: 2 * pixels),
    "10 % of the frames missing": dropped,
    "rows off by 1 px, 20 frames": lambda r: shifted_rows(r, 20),
    "left and right swapped, 1 frame": swapped,
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
    "object over 60 % of the view": lambda r: moving_object(r, (6, 0), size=(0.8, 0.75)),
}
# Only recordings in KITTI's layout, which have no sensors whose stamps would have to follow.
FAULTS_OF_TIME = {
    "stamp repeated, 1 frame": repeated_stamp,
    "gap of 100 s": gap,
}


def evaluate(spartan, run, recording, trajectory):
    align = ALIGNMENTS.get(recording.source.name, "se3")
    result = subprocess.run([spartan, "evaluate", str(run), "--truth", str(recording.source),
                             "--trajectory", trajectory, "--align", align, "--json"],
                            capture_output=True, text=True)
    return f"{json.loads(result.stdout)['ate_m']['rmse']:.3f}" if result.returncode == 0 else "-"


def last_position(run, trajectory):
    positions = np.loadtxt(run / f"trajectory_{trajectory}.tum", ndmin=2)[:, 1:4]
    length = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    return positions[-1], length


def cost(run, undisturbed, trajectory):
    if not (undisturbed / "summary.json").exists():
        return "-"
    (end, _), (wanted, length) = last_position(run, trajectory), last_position(undisturbed, trajectory)
    return f"{100 * np.linalg.norm(end - wanted) / length:.2f} %"


def status_after(run, recording):
    """Of the first frame after the fault."""
    if recording.first_after is None or recording.first_after >= len(recording.files):
        return ""
    with sqlite3.connect(run / "run.sqlite") as store:
        pair = store.execute("SELECT pair FROM frames ORDER BY seq LIMIT 1").fetchone()[0]
        rows = store.execute("SELECT status FROM frames WHERE pair = ? ORDER BY seq", (pair,)).fetchall()
    return rows[recording.first_after][0]


def try_fault(spartan, source, title, fault, folder, undisturbed, options):
    recording = Recording(source, folder / "recording")
    fault(recording)
    run = undisturbed if title == "none" else folder / "run"
    result = subprocess.run([spartan, "run", str(recording.folder), "-o", str(run), "-q", *options],
                            capture_output=True, text=True)
    if not (run / "summary.json").exists():
        sys.exit(f"{source}, {title}: exit code {result.returncode}\n{result.stderr}")
    summary = json.loads((run / "summary.json").read_text())
    health = summary["health"]["odometry"]
    counts = "/".join(str(health[k]) for k in ("tracking", "degraded", "standing", "lost"))
    skipped = ", ".join(f"{n} {reason}" for reason, n in summary["skipped"].items())
    accuracy = [evaluate(spartan, run, recording, trajectory) for trajectory in ("odometry", "localization")]
    costs = [cost(run, undisturbed, trajectory) for trajectory in ("odometry", "localization")]
    return (f"| {title} | {result.returncode} | {counts} | {skipped} | {status_after(run, recording)} | "
            f"{', '.join(accuracy)} | {', '.join(costs)} |")


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
        print(f"\n{name}:\n\n| fault | exit | T/D/S/L | skipped | after it | ATE, m | cost |\n|---|---|---|---|---|---|---|")
        source = pathlib.Path(arguments.data) / name
        faults = FAULTS | (FAULTS_OF_TIME if (source / "times.txt").exists() else {})
        undisturbed = work / f"{name}_undisturbed"
        for index, (title, fault) in enumerate(faults.items()):
            if title != "none" and arguments.faults not in title:
                continue
            folder = work / f"{name}_{index}"
            print(try_fault(arguments.spartan, source, title, fault, folder, undisturbed, options), flush=True)
            if not arguments.keep:
                shutil.rmtree(folder)
    if not arguments.keep:
        shutil.rmtree(work)


if __name__ == "__main__":
    main()
