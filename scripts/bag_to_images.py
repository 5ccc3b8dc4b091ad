#!/usr/bin/env python3
"""Extracts the stereo images, the IMU and the calibration of a ROS 1 or ROS 2 bag into the layout of EuRoC.

  bag_to_images.py BAG FOLDER --left TOPIC --right TOPIC [--imu TOPIC]

Then: spartan run FOLDER -o RUN. Without camera_info topics add --rig with a calibration. Needs the packages rosbags and
pillow from PyPI. The IMU must be given in the body frame of the calibration.
"""
import argparse
import pathlib
import sys

ENCODINGS = {"mono8": ("L", 1), "8UC1": ("L", 1), "mono16": ("I;16", 2), "16UC1": ("I;16", 2), "rgb8": ("RGB", 3),
             "bgr8": ("RGB", 3), "bayer_rggb8": ("L", 1), "bayer_bggr8": ("L", 1), "bayer_gbrg8": ("L", 1),
             "bayer_grbg8": ("L", 1)}


def stamp_of(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def write_image(message, folder, name):
    """Writes one Image or CompressedImage; returns the file name."""
    from PIL import Image
    if hasattr(message, "format"):  # CompressedImage: the bytes of a file
        file = f"{name}.png" if bytes(message.data[:4]) == b"\x89PNG" else f"{name}.jpg"
        (folder / file).write_bytes(bytes(message.data))
        return file
    if message.encoding not in ENCODINGS:
        sys.exit(f"images of encoding {message.encoding} are not read; known: {', '.join(ENCODINGS)}")
    mode, size = ENCODINGS[message.encoding]
    rows = [bytes(message.data[y * message.step:y * message.step + message.width * size]) for y in range(message.height)]
    data = b"".join(rows)
    if size == 2 and message.is_bigendian:
        data = bytes(data[i ^ 1] for i in range(len(data)))
    if message.encoding == "bgr8":
        image = Image.frombytes("RGB", (message.width, message.height), data, "raw", "BGR")
    else:
        image = Image.frombytes(mode, (message.width, message.height), data)
    file = f"{name}.png"
    image.save(folder / file, compress_level=1)
    return file


def matrix(name, rows, values):
    columns = len(values) // rows
    return f"{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{', '.join(repr(float(v)) for v in values)}]\n"


def camera_info_text(message, name):
    upper = hasattr(message, "K")  # ROS 1
    k, d, r, p = ((message.K, message.D, message.R, message.P) if upper else
                  (message.k, message.d, message.r, message.p))
    return (f"image_width: {message.width}\nimage_height: {message.height}\ncamera_name: {name}\n"
            + matrix("camera_matrix", 3, k) + f"distortion_model: {message.distortion_model}\n"
            + matrix("distortion_coefficients", 1, d) + matrix("rectification_matrix", 3, r)
            + matrix("projection_matrix", 3, p))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bag")
    parser.add_argument("folder")
    parser.add_argument("--left", required=True, help="topic of the left images")
    parser.add_argument("--right", required=True, help="topic of the right images")
    parser.add_argument("--imu", help="topic of sensor_msgs/Imu")
    arguments = parser.parse_args()
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
        import PIL.Image  # noqa: F401
    except ImportError as error:
        sys.exit(f"{error}: pip install rosbags pillow")

    out = pathlib.Path(arguments.folder)
    if out.exists() and any(out.iterdir()):
        sys.exit(f"{out} exists and is not empty")
    cameras = {arguments.left: ("cam0", "left"), arguments.right: ("cam1", "right")}
    infos = {topic.rsplit("/", 1)[0] + "/camera_info": names for topic, names in cameras.items()}
    tables = {folder: ["#timestamp [ns],filename"] for folder, _ in cameras.values()}
    imu = ["#timestamp [ns],w_x [rad/s],w_y,w_z,a_x [m/s^2],a_y,a_z"]
    with AnyReader([pathlib.Path(arguments.bag)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        wanted = [c for c in reader.connections if c.topic in {*cameras, *infos, arguments.imu}]
        missing = {*cameras, *([arguments.imu] if arguments.imu else [])} - {c.topic for c in wanted}
        if missing:
            sys.exit(f"{arguments.bag} has no topic {', '.join(sorted(missing))}; it has: "
                     + ", ".join(sorted({c.topic for c in reader.connections})))
        for folder in tables:
            (out / "mav0" / folder / "data").mkdir(parents=True)
        for connection, _, raw in reader.messages(connections=wanted):
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic in cameras:
                folder, _ = cameras[connection.topic]
                stamp = stamp_of(message)
                file = write_image(message, out / "mav0" / folder / "data", stamp)
                tables[folder].append(f"{stamp},{file}")
            elif connection.topic in infos:
                _, side = infos[connection.topic]
                (out / f"{side}.yaml").write_text(camera_info_text(message, side))
            else:
                w, a = message.angular_velocity, message.linear_acceleration
                imu.append(f"{stamp_of(message)},{w.x!r},{w.y!r},{w.z!r},{a.x!r},{a.y!r},{a.z!r}")
    for folder, rows in tables.items():
        (out / "mav0" / folder / "data.csv").write_text("\n".join(rows) + "\n")
    if arguments.imu:
        (out / "mav0" / "imu0").mkdir()
        (out / "mav0" / "imu0" / "data.csv").write_text("\n".join(imu) + "\n")
    rig = f" --rig {out}/left.yaml" if (out / "left.yaml").exists() and (out / "right.yaml").exists() else " --rig CALIBRATION"
    print(f"{len(tables['cam0']) - 1} left and {len(tables['cam1']) - 1} right images; next: spartan run {out} -o RUN{rig}")


if __name__ == "__main__":
    main()
