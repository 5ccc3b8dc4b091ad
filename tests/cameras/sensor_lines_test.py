#!/usr/bin/env python3
"""A live run whose images come from a pipeline of GStreamer, and whose other sensors from lines in a FIFO.

    sensor_lines_test.py SPARTAN SMALL_RUNS
    sensor_lines_test.py SPARTAN SMALL_RUNS --recording DRIVE --rate 10

Plays a rendered drive: that of the small runs, with wheels that turn as its true poses say, or a recording of the
simulator with all of its sensors, whose trajectory is then compared with its truth. Without the plugin of GStreamer the
test is skipped (77).
"""
import argparse
import contextlib
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

SKIPPED = 77


def steady_frames(recording, rate_hz):
    """Rows of frames.csv of the odometry's pair at this rate: without those before the rover has its speed."""
    with (recording / "frames.csv").open() as rows:
        frames = [row for row in csv.DictReader(rows) if row["pair"] == "narrow"]
    stamps = [int(row["left_stamp_ns"]) for row in frames]
    steady = [i for i in range(len(frames) - 1) if abs((stamps[i + 1] - stamps[i]) * rate_hz - 10**9) < 10**7]
    return frames[steady[0]:steady[-1] + 2]


def images_of(recording, rate_hz):
    """The files of the left and the right camera, in KITTI's layout or of the odometry's pair of a simulation."""
    if (recording / "image_0").exists():
        return [sorted((recording / f"image_{i}").iterdir()) for i in (0, 1)]
    return [[recording / row[side] for row in steady_frames(recording, rate_hz)] for side in ("left", "right")]


def wheels_of_poses(recording, rate_hz):
    """Lines of wheels, (seconds after the first image, sensor, values), five for each interval of the images."""
    positions = [[float(v) for v in line.split()][3::4] for line in (recording / "poses.txt").read_text().splitlines()]
    at_m = [0.0]
    for a, b in zip(positions, positions[1:]):
        at_m.append(at_m[-1] + math.dist(a, b))
    lines = []
    for i in range(5 * (len(at_m) - 1) + 1):
        frame, part = min(i // 5, len(at_m) - 2), i / 5 - min(i // 5, len(at_m) - 2)
        metres = at_m[frame] + part * (at_m[frame + 1] - at_m[frame])
        lines.append((i / 5 / rate_hz, "wheels", f"{metres},{metres}"))
    return lines


def lines_of_tables(recording, first_ns):
    lines = []
    for sensor in ("imu", "wheels", "compass", "inclinometer"):
        table = recording / "sensors" / f"{sensor}.csv"
        if not table.exists():
            continue
        with table.open() as rows:
            for row in list(csv.reader(rows))[1:]:
                lines.append((1e-9 * (int(row[0]) - first_ns), sensor, ",".join(row[1:])))
    return sorted(lines)


def make_rig(program, recording, images, rate_hz, folder):
    """The rig of the recording with a driver for both cameras of its pair."""
    pipeline = []
    for side, files in zip(("left", "right"), images):
        (folder / side).mkdir()
        for number, file in enumerate(files):
            (folder / side / f"{number:06}.png").symlink_to(file.resolve())
        pipeline.append(f"multifilesrc location={folder}/{side}/%06d.png caps=image/png,framerate={rate_hz}/1 ! pngdec ! "
                        f"videoconvert ! video/x-raw,format=GRAY8 ! identity sync=true ! appsink name={side}")
    rig = folder / "rig.yaml"
    subprocess.run([program, "rig", "convert", str(recording), str(rig), "--to", "rig.yaml"], check=True, capture_output=True)
    return rig, "gst:" + " ".join(pipeline)


def open_to_write(path, flags):
    """Fails where no run reads the FIFO, instead of waiting for one."""
    file = os.open(path, flags & ~(os.O_CREAT | os.O_TRUNC) | os.O_NONBLOCK)
    os.set_blocking(file, True)
    return file


def play(process, fifo, lines, rate_hz):
    """Writes the lines at their time after the first image of the pipeline, whose stamp is returned."""
    first = None
    for message in map(json.loads, process.stdout):
        if message["type"] == "health":
            first = message["stamp_ns"] - 10**9 * message["frame_id"] // rate_hz
            break
    assert first is not None, "the run has no frame"
    # Until the images end: then nobody reads the FIFO any more.
    with contextlib.suppress(OSError), open(fifo, "w", buffering=1, opener=open_to_write) as out:
        out.write("wheels,nothing,1,2\n")  # harms no other
        for after_s, sensor, values in lines:
            stamp = first + int(1e9 * after_s)
            wait = stamp - time.time_ns()
            if wait > 0:
                time.sleep(1e-9 * wait)
            out.write(f"{sensor},{stamp},{values}\n")
    return first


def print_errors(program, run, recording, shift_ns):
    """ATE and drift against the truth, by a trajectory with the stamps of the recording."""
    for kind in ("odometry", "localization"):
        rows = [line.split(" ", 1) for line in (run / f"trajectory_{kind}.tum").read_text().splitlines()]
        shifted = run / f"shifted_{kind}.tum"
        shifted.write_text("".join(f"{float(stamp) - 1e-9 * shift_ns:.9f} {pose}\n" for stamp, pose in rows))
        done = subprocess.run([program, "evaluate", str(shifted), "--truth", str(recording), "--align", "first"], check=True, capture_output=True, text=True)
        print(kind, done.stdout)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("small_runs", type=pathlib.Path)
    parser.add_argument("--recording", type=pathlib.Path)
    parser.add_argument("--rate", type=int, default=2)
    parser.add_argument("--set", help="an option of the run, such as gravity_m_s2=3.71")
    arguments = parser.parse_args()
    recording = arguments.recording or arguments.small_runs / "drive"
    images = images_of(recording, arguments.rate)
    if arguments.recording:
        begin_ns = int(steady_frames(recording, arguments.rate)[0]["left_stamp_ns"])
        lines = lines_of_tables(recording, begin_ns)
    else:
        lines = wheels_of_poses(recording, arguments.rate)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rig, pipeline = make_rig(arguments.program, recording, images, arguments.rate, folder)
        fifo, output = folder / "sensors", folder / "run"
        process = subprocess.Popen([arguments.program, "run", pipeline, "--rig", str(rig), "--sensors", str(fifo), "-o",
                                    str(output), "--publish", "-", "--pair-tolerance", str(0.2 / arguments.rate),
                                    *(("--set", arguments.set) if arguments.set else ())],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            first = play(process, fifo, lines, arguments.rate)
        except AssertionError:
            errors = process.communicate()[1]
            if "spartan_gstreamer" in errors:
                print("no plugin of GStreamer: skipped")
                return SKIPPED
            raise AssertionError(errors) from None
        errors = process.communicate(timeout=120)[1]
        assert process.returncode in (0, 6), errors
        summary = json.loads((output / "summary.json").read_text())
        print(json.dumps({"frames": summary["frames"], "health": summary["health"],
                          "skipped_sensor_rows": summary["skipped_sensor_rows"]}, indent=1))
        assert summary["frames"] >= 0.8 * len(images[0]), "frames are missing"
        assert summary["skipped_sensor_rows"] == {"reversed": 0, "unreadable": 1}
        assert f"{fifo}: 'wheels,nothing,1,2': 'nothing' is not a time in nanoseconds" in errors, errors
        assert summary["health"]["localization"]["wheels"]["ok"] >= 0.5 * summary["frames"]
        recorded = (output / "live" / "1" / "sensors" / "wheels.csv").read_text().splitlines()[1:]
        wheels = [line for line in lines if line[1] == "wheels"]
        assert len(recorded) >= 0.8 * len(wheels), "lines are missing"
        if arguments.recording:
            print_errors(arguments.program, output, recording, first - begin_ns)
    return 0


if __name__ == "__main__":
    sys.exit(main())
