#!/usr/bin/env python3
"""Writes ROS 1 and ROS 2 bags of the small drive, extracts them with scripts/bag_to_images.py, and runs the odometry on
the result: the trajectory is that of the drive itself.

    bag_to_images_test.py PROGRAM PROJECT SMALL_RUNS
"""
import os
import pathlib
import subprocess
import sys
import tempfile

VENV_PYTHON = pathlib.Path(__file__).resolve().parent.parent / ".venv/bin/python3"  # made by ./setup
try:
    import numpy
    import PIL.Image
    import rosbags.rosbag1
    import rosbags.rosbag2
    from rosbags.typesys import Stores, get_typestore
except ImportError as error:
    if VENV_PYTHON.exists() and pathlib.Path(sys.prefix) != VENV_PYTHON.parent.parent:
        os.execv(VENV_PYTHON, [str(VENV_PYTHON), *sys.argv])
    print(f"skipped: {error} (./setup test installs it)")
    sys.exit(77)

FRAMES = 5
TOPICS = ["/stereo/left/image_raw", "/stereo/right/image_raw"]


def calibration(drive):
    rows = dict(line.split(": ") for line in (drive / "calib.txt").read_text().splitlines())
    return [numpy.array(rows[key].split(), dtype=numpy.float64) for key in ("P0", "P1")]


def messages(store, drive, ros1):
    """(topic, type, stamp in ns, message) of both cameras, the IMU and the calibration."""
    types = store.types
    header = lambda ns: types["std_msgs/msg/Header"](
        **({"seq": 0} if ros1 else {}), frame_id="camera",
        stamp=types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9))
    times = [1_700_000_000 * 10**9 + round(1e9 * float(t)) for t in (drive / "times.txt").read_text().split()]
    projections = calibration(drive)
    roi = types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    for i in range(FRAMES):
        for side, topic in enumerate(TOPICS):
            pixels = numpy.array(PIL.Image.open(drive / f"image_{side}" / f"{i:06}.png"))
            yield topic, "sensor_msgs/msg/Image", times[i], types["sensor_msgs/msg/Image"](
                header=header(times[i]), height=pixels.shape[0], width=pixels.shape[1], encoding="mono8",
                is_bigendian=0, step=pixels.shape[1], data=pixels.reshape(-1))
            k = projections[side].reshape(3, 4)[:, :3].reshape(-1)
            names = ("D", "K", "R", "P") if ros1 else ("d", "k", "r", "p")
            values = (numpy.zeros(5), k, numpy.eye(3).reshape(-1), projections[side])
            yield topic.replace("image_raw", "camera_info"), "sensor_msgs/msg/CameraInfo", times[i], types[
                "sensor_msgs/msg/CameraInfo"](header=header(times[i]), height=pixels.shape[0], width=pixels.shape[1],
                                              distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi,
                                              **dict(zip(names, values)))
        vector = types["geometry_msgs/msg/Vector3"]
        yield "/imu", "sensor_msgs/msg/Imu", times[i], types["sensor_msgs/msg/Imu"](
            header=header(times[i]), orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=numpy.zeros(9), angular_velocity=vector(x=0.0, y=0.0, z=0.0),
            angular_velocity_covariance=numpy.zeros(9), linear_acceleration=vector(x=0.0, y=0.0, z=9.81),
            linear_acceleration_covariance=numpy.zeros(9))


def write_bag(path, drive, ros1):
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    writer = rosbags.rosbag1.Writer(path) if ros1 else rosbags.rosbag2.Writer(path, version=9)
    with writer:
        connections = {}
        for topic, kind, stamp, message in messages(store, drive, ros1):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
            writer.write(connections[topic], stamp, serialize(message, kind))


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(w) for w in words)}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def poses(folder):
    lines = (folder / "trajectory_odometry.tum").read_text().splitlines()
    return [[float(v) for v in line.split()[1:]] for line in lines if not line.startswith("#")]


def main():
    program, project, small_runs = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    drive = small_runs / "drive"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(program, "run", drive, "-o", folder / "own", "--odometry-only", "--max-frames", FRAMES)
        for ros1 in (True, False):
            bag = folder / ("drive.bag" if ros1 else "drive2")
            write_bag(bag, drive, ros1)
            out = folder / f"images_{bag.name}"
            said = run(sys.executable, project / "scripts" / "bag_to_images.py", bag, out, "--left", TOPICS[0], "--right",
                       TOPICS[1], "--imu", "/imu").stdout
            assert f"{FRAMES} left and {FRAMES} right images" in said, said
            done = run(program, "run", out, "-o", folder / f"run_{bag.name}", "--odometry-only", "--rig",
                       out / "left.yaml")
            assert "mav0/cam0/data.csv found" in done.stderr, done.stderr
            assert len((out / "mav0" / "imu0" / "data.csv").read_text().splitlines()) == FRAMES + 1
            # Positions; the world may be rotated to gravity, which the IMU gives.
            own, other = poses(folder / "own"), poses(folder / f"run_{bag.name}")
            assert len(other) == FRAMES, len(other)
            length = lambda list_: sum(sum((a - b) ** 2 for a, b in zip(p[:3], q[:3])) ** 0.5
                                       for p, q in zip(list_, list_[1:]))
            assert abs(length(own) - length(other)) < 1e-6 * length(own), (length(own), length(other))
            missing = subprocess.run([sys.executable, project / "scripts" / "bag_to_images.py", bag, folder / "none",
                                      "--left", "/nothing", "--right", TOPICS[1]], capture_output=True, text=True)
            assert missing.returncode != 0 and "has no topic /nothing" in missing.stderr, missing.stderr
    print("both bags give the trajectory of the drive")


if __name__ == "__main__":
    main()
