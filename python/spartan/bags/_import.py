"""A bag of ROS 1 or ROS 2 as a recording of Spartan."""

from __future__ import annotations

import io
import json
import os
import tempfile
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.highlevel import AnyReader
from rosbags.highlevel.anyreader import AnyReaderError
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from spartan import _core
from spartan._errors import Error
from spartan.bags._export_recording import DESCRIPTION_TOPIC

_MOST_WAITING = 64  # images of one side without a partner
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_LAYOUTS = {
    "mono8": "gray", "8UC1": "gray", "mono16": "gray", "16UC1": "gray", "rgb8": "rgb", "bgr8": "rgb", "8UC3": "rgb",
    "rgb16": "rgb", "bgr16": "rgb",
    **{f"bayer_{pattern}{bits}": f"bayer_{pattern}" for pattern in ("rggb", "grbg", "gbrg", "bggr") for bits in (8, 16)},
}


@dataclass
class PairTopics:
    """Where the images of a pair and what else is known of its frames are published."""

    name: str
    left: str
    right: str
    joints: str | None = None


@dataclass
class Topics:
    """The topics that are imported."""

    pairs: list[PairTopics]
    imu: str | None = None
    wheels: str | None = None  # JointState with left_m and right_m, or nav_msgs/Odometry
    compass: str | None = None
    inclinometer: str | None = None

    def all(self) -> set[str]:
        sensors = {self.imu, self.wheels, self.compass, self.inclinometer}
        images = {topic for pair in self.pairs for topic in (pair.left, pair.right, pair.joints)}
        return {topic for topic in sensors | images if topic is not None}


@dataclass
class _Waiting:
    """Images and details of a pair that wait for the other image."""

    left: deque[tuple[int, npt.NDArray[Any], str]] = field(default_factory=deque)
    right: deque[tuple[int, npt.NDArray[Any], str]] = field(default_factory=deque)
    details: dict[int, dict[str, float]] = field(default_factory=dict)
    frames: int = 0


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def _pixels(message: Any, topic: str) -> tuple[npt.NDArray[Any], str]:
    """The image as an array, and its layout."""
    if hasattr(message, "format"):
        import PIL.Image

        decoded: PIL.Image.Image = PIL.Image.open(io.BytesIO(bytes(message.data)))
        if decoded.mode not in ("L", "I;16"):
            decoded = decoded.convert("RGB")
        pixels = np.array(decoded)
        return pixels, "rgb" if pixels.ndim == 3 else "gray"
    if message.encoding not in _LAYOUTS:
        raise Error("input", f"images of encoding '{message.encoding}' are not read", topic,
                    f"known: {', '.join(_LAYOUTS)}")
    layout = _LAYOUTS[message.encoding]
    wide = message.encoding.endswith("16") or message.encoding.startswith("16")
    kind = np.dtype(np.uint16 if wide else np.uint8).newbyteorder(">" if message.is_bigendian else "<")
    channels = 3 if layout == "rgb" else 1
    used = message.width * channels * kind.itemsize
    if message.step < used or len(message.data) < message.step * message.height:
        raise Error("input", "an image has fewer bytes than it states", topic)
    rows = np.frombuffer(bytes(message.data), np.uint8)[: message.step * message.height].reshape(message.height, -1)
    pixels = np.ascontiguousarray(rows[:, :used]).view(kind).astype(kind.newbyteorder("="), copy=False)
    if channels == 3:
        pixels = pixels.reshape(message.height, message.width, 3)
        if message.encoding.startswith("bgr") or message.encoding == "8UC3":
            pixels = np.ascontiguousarray(pixels[:, :, ::-1])
    return pixels, layout


def _camera_info_yaml(message: Any, name: str) -> str:
    k, d, r, p = (getattr(message, key, None) if hasattr(message, key) else getattr(message, key.lower()) for key in "KDRP")

    def matrix(key: str, rows: int, values: Any) -> str:
        numbers = ", ".join(repr(float(value)) for value in values)
        return f"{key}:\n  rows: {rows}\n  cols: {len(values) // rows}\n  data: [{numbers}]\n"

    return (f"image_width: {message.width}\nimage_height: {message.height}\ncamera_name: {name}\n"
            + matrix("camera_matrix", 3, k) + f"distortion_model: {message.distortion_model}\n"
            + matrix("distortion_coefficients", 1, d) + matrix("rectification_matrix", 3, r)
            + matrix("projection_matrix", 3, p))


def _side_of(topic: str) -> str | None:
    words = topic.lower().replace("_", "/").split("/")
    for side, names in (("left", ("left", "cam0", "infra1", "camera0")), ("right", ("right", "cam1", "infra2", "camera1"))):
        if any(name in words for name in names):
            return side
    return None


class _Bag:
    """The messages of a bag, read from the start as often as needed."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.exists():
            raise Error("input", "no such bag", str(path))
        self._reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        try:
            self._reader.open()
        except (AnyReaderError, OSError, ValueError, KeyError) as error:
            raise Error("input", f"is not a bag: {error}", str(path)) from error

    def close(self) -> None:
        self._reader.close()

    def types(self) -> dict[str, str]:
        return {connection.topic: connection.msgtype for connection in self._reader.connections}

    def messages(self, topics: set[str]) -> Iterator[tuple[str, Any]]:
        wanted: list[Connection] = [each for each in self._reader.connections if each.topic in topics]
        try:
            for connection, _, raw in self._reader.messages(connections=wanted) if wanted else ():
                yield connection.topic, self._reader.deserialize(raw, connection.msgtype)
        except (AnyReaderError, OSError, ValueError, KeyError, AssertionError) as error:
            raise Error("input", f"cannot be read: {error}", str(self.path)) from error

    def first(self, topic: str) -> Any:
        return next(iter(self.messages({topic})), (topic, None))[1]


def _opened(path: str | os.PathLike[str]) -> Any:
    """A bag, or an MCAP file with Foxglove's schemas, which gives the same messages."""
    if Path(path).suffix == ".mcap" and Path(path).is_file():
        from spartan.bags._foxglove import FoxgloveFile, is_foxglove_file

        if is_foxglove_file(path):
            return FoxgloveFile(path)
    return _Bag(path)


def _of_type(types: dict[str, str], *kinds: str, word: str = "") -> str | None:
    found = sorted(topic for topic, kind in types.items() if kind in kinds and word in topic)
    return found[0] if found else None


def guess_topics(types: dict[str, str], pairs: list[str] | None = None) -> Topics:
    """The topics of a bag by their types and names: images of a left and a right camera, the IMU, and, of bags that
    Spartan wrote (whose pairs are known), wheels, compass and inclinometer."""
    found: list[PairTopics] = []
    for name in pairs or []:
        joints = f"/{name}/joint_states"
        found.append(PairTopics(name, f"/{name}/left/image_raw", f"/{name}/right/image_raw", joints if joints in types else None))
    if not found:
        sides: dict[str, list[str]] = {"left": [], "right": []}
        for topic in sorted(types):
            if types[topic] in _IMAGES and (side := _side_of(topic)):
                sides[side].append(topic)
        raw = {side: sorted(topics, key=lambda topic: ("compressed" in topic, "rect" in topic, topic)) for side, topics in sides.items()}
        if raw["left"] and raw["right"]:
            found.append(PairTopics("stereo", raw["left"][0], raw["right"][0]))
    joint = "sensor_msgs/msg/JointState"
    return Topics(found, _of_type(types, "sensor_msgs/msg/Imu"),
                  _of_type(types, joint, word="/wheels"), _of_type(types, joint, word="/compass"),
                  _of_type(types, joint, word="/inclinometer"))


def _tf_static(bag: _Bag) -> dict[str, tuple[str, _core.Pose]]:
    """Parent and parent_from_child of each child frame."""
    tree: dict[str, tuple[str, _core.Pose]] = {}
    for _, message in bag.messages({"/tf_static"}):
        for each in message.transforms:
            t, q = each.transform.translation, each.transform.rotation
            pose = _core.Pose.from_quaternion([q.x, q.y, q.z, q.w], [t.x, t.y, t.z])
            tree[each.child_frame_id.lstrip("/")] = (each.header.frame_id.lstrip("/"), pose)
    return tree


def _pose_in(tree: dict[str, tuple[str, _core.Pose]], frame: str, root: str = "base_link") -> _core.Pose | None:
    """root_from_frame along the tree; None where they are not connected."""
    pose, frame, steps = _core.Pose(), frame.lstrip("/"), 0
    while frame != root:
        if frame not in tree or steps > len(tree):
            return None
        frame, parent_from_child = tree[frame][0], tree[frame][1]
        pose, steps = parent_from_child @ pose, steps + 1
    return pose


def _guessed_rig(bag: _Bag, topics: PairTopics, imu: str | None) -> _core.Rig:
    """Intrinsics and baseline by camera_info, mounts by /tf_static."""
    types, files, first = bag.types(), [], {}
    for side, topic in (("left", topics.left), ("right", topics.right)):
        near = topic.removesuffix("/compressed").rsplit("/", 1)[0] + "/camera_info"
        info = bag.first(near) if near in types else None
        if info is None:
            raise Error("configuration", f"has no {near}", str(bag.path), "name a calibration file with --rig")
        files.append(_camera_info_yaml(info, side))
        first[side] = bag.first(topic)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{side}.yaml" for side in ("left", "right")]
        for path, text in zip(paths, files):
            path.write_text(text, encoding="utf-8")
        read = _core.read_calibration(",".join(map(str, paths)), "ros").rig
    cameras = []
    for side, topic in (("left", topics.left), ("right", topics.right)):
        pixels, layout = _pixels(first[side], topic)
        given = read.camera(getattr(read.pairs[0], side))
        cameras.append(_core.Camera(side, given.size, given.model, layout=layout, bits=8 * pixels.dtype.itemsize))
    rig = _core.Rig.stereo(cameras[0], cameras[1], read.right_from_left(read.pairs[0].name), topics.name)
    tree = _tf_static(bag)
    body_from_left = _pose_in(tree, first["left"].header.frame_id)
    message = bag.first(imu) if imu else None
    body_from_imu = None if message is None else _pose_in(tree, message.header.frame_id)
    return rig if body_from_left is None else rig.mounted(body_from_left, body_from_imu)


class _Importer:
    def __init__(self, writer: _core.RecordingWriter, rig: _core.Rig, topics: Topics, tolerance_ns: int) -> None:
        self.writer, self.rig, self.topics, self.tolerance_ns = writer, rig, topics, tolerance_ns
        self.waiting = {pair.name: _Waiting() for pair in topics.pairs}
        self.counts = {"frames": 0, "unpaired": 0, "samples": 0, "rejected": 0}
        self.travelled: tuple[float, float, float, float, float] | None = None  # x, y, yaw, left, right

    def add(self, sample: Any) -> None:
        try:
            self.writer.add(sample)
        except Error as error:
            if error.code != "input":  # a stamp that does not increase, an image of another size
                raise
            self.counts["rejected"] += 1
        else:
            self.counts["frames" if isinstance(sample, _core.StereoFrame) else "samples"] += 1

    def take(self, topic: str, message: Any) -> None:
        for pair in self.topics.pairs:
            waiting = self.waiting[pair.name]
            if topic == pair.joints:
                waiting.details[_stamp(message)] = dict(zip(message.name, map(float, message.position)))
            for side, images in ((pair.left, waiting.left), (pair.right, waiting.right)):
                if topic == side:
                    images.append((_stamp(message), *_pixels(message, topic)))
                    self.match(pair, waiting, keep=4)
        if topic == self.topics.imu:
            w, a = message.angular_velocity, message.linear_acceleration
            self.add(_core.ImuSample(_stamp(message), [w.x, w.y, w.z], [a.x, a.y, a.z]))
        elif topic in (self.topics.wheels, self.topics.compass, self.topics.inclinometer):
            self.take_sensor(topic, message)

    def take_sensor(self, topic: str, message: Any) -> None:
        stamp = _stamp(message)
        if hasattr(message, "pose"):  # nav_msgs/Odometry
            left, right = self.rolled(message.pose.pose)
            return self.add(_core.WheelSample(stamp, left, right))
        values = dict(zip(message.name, map(float, message.position)))
        try:
            if topic == self.topics.wheels:
                self.add(_core.WheelSample(stamp, values["left_m"], values["right_m"]))
            elif topic == self.topics.compass:
                self.add(_core.CompassSample(stamp, values["heading_rad"], values["sigma_rad"]))
            else:
                self.add(_core.InclinometerSample(stamp, values["roll_rad"], values["pitch_rad"], values["sigma_rad"]))
        except KeyError as missing:
            raise Error("input", f"a message has no joint {missing}", topic) from missing

    def rolled(self, pose: Any) -> tuple[float, float]:
        """Distances that both sides have rolled, of planar wheel odometry: d -+ turn * track / 2 for each step."""
        q = pose.orientation
        x, y, yaw = pose.position.x, pose.position.y, np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2))
        if self.travelled is None:
            self.travelled = (x, y, yaw, 0.0, 0.0)
        x0, y0, yaw0, left, right = self.travelled
        turn = float(np.arctan2(np.sin(yaw - yaw0), np.cos(yaw - yaw0)))
        heading = yaw0 + turn / 2
        ahead = float((x - x0) * np.cos(heading) + (y - y0) * np.sin(heading))
        left, right = left + ahead - turn * self.rig.track_m / 2, right + ahead + turn * self.rig.track_m / 2
        self.travelled = (x, y, float(yaw), left, right)
        return left, right

    def match(self, pair: PairTopics, waiting: _Waiting, keep: int) -> None:
        """Makes frames of the images that have a partner; `keep` images may wait for one that comes later."""
        while waiting.left and waiting.right:
            difference = waiting.right[0][0] - waiting.left[0][0]
            if abs(difference) > self.tolerance_ns:
                (waiting.left if difference > 0 else waiting.right).popleft()
                self.counts["unpaired"] += 1
                continue
            if len(waiting.left) < keep and len(waiting.right) < keep and pair.joints is not None:
                if waiting.left[0][0] not in waiting.details:
                    return  # its details come after the images
            self.add(self.frame(pair, waiting))
        for images in (waiting.left, waiting.right):
            while len(images) > _MOST_WAITING:
                images.popleft()
                self.counts["unpaired"] += 1

    def frame(self, pair: PairTopics, waiting: _Waiting) -> _core.StereoFrame:
        (stamp, left, layout), (right_stamp, right, _) = waiting.left.popleft(), waiting.right.popleft()
        if left.ndim != right.ndim or left.dtype != right.dtype:
            raise Error("input", "the left and the right images have different formats", pair.left)
        details = waiting.details.pop(stamp, {})
        camera = self.rig.camera(self.rig.pair(pair.name).left)
        frame_id = int(details.get("frame_id", waiting.frames))
        waiting.frames += 1
        bits = camera.bits if left.dtype == np.uint16 and camera.bits > 8 else None
        return _core.StereoFrame(
            left, right, stamp, right_stamp, pair=pair.name, layout=layout, bits=bits, frame_id=frame_id,
            position_id=int(details.get("position_id", -1)), pan_rad=details.get("pan", 0.0),
            tilt_rad=details.get("tilt", 0.0), exposure_us=details.get("exposure_us", 0.0), gain=details.get("gain", 0.0))

    def finish(self) -> dict[str, int]:
        for pair in self.topics.pairs:
            waiting = self.waiting[pair.name]
            self.match(pair, waiting, keep=0)
            self.counts["unpaired"] += len(waiting.left) + len(waiting.right)
        self.writer.finish()
        return self.counts


def _choose_topics(bag: _Bag, pairs: list[str] | None, wanted: dict[str, str | None]) -> Topics:
    """The topics that were named, and guesses for the others. Raises Error where the bag has not got them."""
    types = bag.types()
    topics = guess_topics(types, pairs)
    if wanted["left"] is not None and wanted["right"] is not None:
        topics.pairs = [PairTopics("stereo", wanted["left"], wanted["right"])]
    topics.imu, topics.wheels = wanted["imu"] or topics.imu, wanted["wheels"] or topics.wheels
    topics.pairs = [pair for pair in topics.pairs if pair.left in types and pair.right in types] or topics.pairs
    missing = sorted(topics.all() - set(types))
    if missing or not topics.pairs:
        what = f"has no topic {', '.join(missing)}" if missing else "has no images of a left and a right camera"
        hint = f"its topics: {', '.join(sorted(types))}; name them with --left and --right"
        raise Error("input", what, str(bag.path), hint)
    return topics


def _choose_rig(bag: _Bag, topics: Topics, described: str | None, file: str | os.PathLike[str] | None) -> _core.Rig:
    """The rig of a file, that which Spartan wrote into the bag, or a guess. A single pair of topics takes its name."""
    if file is not None:
        rig = _core.read_rig(file)
    elif described is not None:
        return _core.Rig.from_yaml(described)
    else:
        rig = _guessed_rig(bag, topics.pairs[0], topics.imu)
    if len(topics.pairs) == 1:
        topics.pairs[0].name = rig.pairs[0].name
    return rig


def import_bag(
    bag: str | os.PathLike[str], recording: str | os.PathLike[str], *, left: str | None = None, right: str | None = None,
    imu: str | None = None, wheels: str | None = None, rig: str | os.PathLike[str] | None = None,
    pair_tolerance_s: float = 0.005
) -> dict[str, int]:
    """Writes the images and sensors of a bag as a recording. Topics that are not named are guessed (guess_topics()).

    The calibration is, in this order: `rig`, that which Spartan wrote into the bag, `camera_info` with the mounts of
    `/tf_static`. `wheels` may be a topic of nav_msgs/Odometry. Returns counts: `frames`, `unpaired` images, `samples` of
    sensors, and `rejected` ones whose stamps do not increase. Raises Error.
    """
    opened: _Bag = _opened(bag)
    try:
        text = None
        if DESCRIPTION_TOPIC in opened.types() and left is None and right is None:
            text = opened.first(DESCRIPTION_TOPIC)
        about: dict[str, Any] = {} if text is None else json.loads(text.data)
        pairs = [pair.name for pair in _core.Rig.from_yaml(about["rig"]).pairs] if about else None
        topics = _choose_topics(opened, pairs, {"left": left, "right": right, "imu": imu, "wheels": wheels})
        chosen = _choose_rig(opened, topics, about.get("rig"), rig)
        noise = _core.SensorNoise()
        if about and rig is None:
            noise.imu = _core.ImuNoise.from_yaml(about["noise"]["imu"])
            noise.compass = _core.CompassNoise.from_yaml(about["noise"]["compass"])
            noise.inclinometer = _core.InclinometerNoise.from_yaml(about["noise"]["inclinometer"])
        writer = _core.RecordingWriter(recording, chosen, name=about.get("name", Path(bag).stem),
                                       gravity_m_s2=about.get("gravity_m_s2") or 9.81, noise=noise)
        importer = _Importer(writer, chosen, topics, round(1e9 * pair_tolerance_s))
        for topic, message in opened.messages(topics.all()):
            importer.take(topic, message)
        return importer.finish()
    finally:
        opened.close()
