"""A bag of ROS 1 or ROS 2 as a recording of Spartan."""

from __future__ import annotations

import base64
import json
import logging
import os
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan._errors import Error
from spartan.bags._calibration import guessed_rig, mounted
from spartan.bags._export_recording import DESCRIPTION_TOPIC
from spartan.bags._images import pixels_of, stamp_of
from spartan.bags._reader import MessageReader, first_message, opened
from spartan.bags._rigs import mounts_imu, with_known_masks, with_layouts, with_masks_of, with_readings_in_body, write_masks
from spartan.bags._topics import PairTopics, Topics, choose_topics

_MOST_WAITING = 64  # images of one side without a partner
_LOG = logging.getLogger("spartan")


@dataclass
class _Waiting:
    """Images and details of a pair that wait for the other image."""

    left: deque[tuple[int, npt.NDArray[Any], str]] = field(default_factory=deque)
    right: deque[tuple[int, npt.NDArray[Any], str]] = field(default_factory=deque)
    details: dict[int, dict[str, float]] = field(default_factory=dict)
    frames: int = 0


class _Importer:
    def __init__(self, writer: _core.RecordingWriter, rig: _core.Rig, topics: Topics, tolerance_ns: int) -> None:
        self.writer, self.rig, self.topics, self.tolerance_ns = writer, rig, topics, tolerance_ns
        self.waiting = {pair.name: _Waiting() for pair in topics.pairs}
        self.counts = {"frames": 0, "unpaired": 0, "samples": 0, "rejected": 0}
        self.reasons: dict[str, Error] = {}  # the first one of each pair and each kind of sensor
        self.travelled: tuple[float, float, float, float, float] | None = None  # x, y, yaw, left, right

    def add(self, sample: Any) -> None:
        try:
            self.writer.add(sample)
        except Error as error:
            if error.code != "input":  # a stamp that does not increase, an image of another size
                raise
            self.counts["rejected"] += 1
            source = f"pair {sample.pair}" if isinstance(sample, _core.StereoFrame) else type(sample).__name__
            if self.reasons.setdefault(source, error) is error:
                _LOG.warning("%s: rejected: %s", source, error)
        else:
            self.counts["frames" if isinstance(sample, _core.StereoFrame) else "samples"] += 1

    def take(self, topic: str, message: Any) -> None:
        for pair in self.topics.pairs:
            waiting = self.waiting[pair.name]
            if topic == pair.joints:
                waiting.details[stamp_of(message)] = dict(zip(message.name, map(float, message.position)))
            for side, images in ((pair.left, waiting.left), (pair.right, waiting.right)):
                if topic == side:
                    images.append((stamp_of(message), *pixels_of(message, topic)))
                    self.match(pair, waiting, keep=4)
        if topic == self.topics.imu:
            w, a = message.angular_velocity, message.linear_acceleration
            self.add(_core.ImuSample(stamp_of(message), [w.x, w.y, w.z], [a.x, a.y, a.z]))
        elif topic in (self.topics.wheels, self.topics.compass, self.topics.inclinometer):
            self.take_sensor(topic, message)

    def take_sensor(self, topic: str, message: Any) -> None:
        stamp = stamp_of(message)
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
            left, right, stamp, right_stamp, pair=pair.name, layout=layout, bits=bits, alignment=camera.alignment,
            frame_id=frame_id, position_id=int(details.get("position_id", -1)), pan_rad=details.get("pan", 0.0),
            tilt_rad=details.get("tilt", 0.0), exposure_us=details.get("exposure_us", 0.0), gain=details.get("gain", 0.0))

    def finish(self) -> dict[str, int]:
        for pair in self.topics.pairs:
            waiting = self.waiting[pair.name]
            self.match(pair, waiting, keep=0)
            self.counts["unpaired"] += len(waiting.left) + len(waiting.right)
        if not self.counts["frames"]:
            self.raise_no_frames()
        self.writer.finish()
        return self.counts

    def raise_no_frames(self) -> None:
        where = ", ".join(topic for pair in self.topics.pairs for topic in (pair.left, pair.right))
        for reason in (self.reasons.get(f"pair {pair.name}") for pair in self.topics.pairs):
            if reason is not None:
                raise Error("input", f"no frame fits the calibration: {reason}", where, "name that of these cameras with --rig")
        raise Error("input", f"no left and right image have stamps within {self.tolerance_ns / 1e9} s", where,
                    "raise --pair-tolerance, or name other topics with --left and --right")


@dataclass
class _Description:
    """What Spartan wrote into a bag (DESCRIPTION_TOPIC)."""

    rig: _core.Rig
    masks: dict[str, bytes]  # by the names that the rig has
    noise: _core.SensorNoise
    name: str
    gravity_m_s2: float


def _description_in(bag: MessageReader) -> _Description | None:
    """None of a bag of others. Raises Error where it is damaged."""
    if DESCRIPTION_TOPIC not in bag.types() or DESCRIPTION_TOPIC in bag.empty_topics():
        return None
    noise, message = _core.SensorNoise(), first_message(bag, DESCRIPTION_TOPIC)
    try:
        about = json.loads(message.data)
        noise.imu = _core.ImuNoise.from_yaml(about["noise"]["imu"])
        noise.compass = _core.CompassNoise.from_yaml(about["noise"]["compass"])
        noise.inclinometer = _core.InclinometerNoise.from_yaml(about["noise"]["inclinometer"])
        masks = {name: base64.b64decode(text) for name, text in about.get("masks", {}).items()}
        rig, missing = with_known_masks(_core.Rig.from_yaml(about["rig"]), masks)
        name, gravity = str(about.get("name") or bag.path.stem), float(about.get("gravity_m_s2") or 9.81)
    except (Error, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Error("input", f"the message of {DESCRIPTION_TOPIC} cannot be read: {type(error).__name__}: {error}",
                    str(bag.path), "name the calibration with --rig, and the images with --left and --right") from error
    if missing:
        _LOG.warning("%s: has no self-masks (%s): the recording has none", bag.path, ", ".join(missing))
    return _Description(with_readings_in_body(rig), masks, noise, name, gravity)


def _layouts_in(bag: MessageReader, topics: Topics, rig: _core.Rig) -> dict[str, str]:
    """The Bayer patterns of images whose cameras the rig has as gray: formats of other programs do not state layouts."""
    found = {}
    for pair in topics.pairs:
        for side, topic in (("left", pair.left), ("right", pair.right)):
            camera = rig.camera(getattr(rig.pair(pair.name), side))
            _, layout = pixels_of(first_message(bag, topic), topic)
            if camera.layout == "gray" and layout.startswith("bayer"):
                found[camera.name] = layout
    return found


def _choose_rig(
    bag: MessageReader, topics: Topics, about: _Description | None, file: str | os.PathLike[str] | None
) -> tuple[_core.Rig, dict[str, bytes]]:
    """The rig of a file, that which Spartan wrote into the bag, or a guess, and the files of its self-masks. A single pair
    of topics takes its name. Chooses the IMU of `topics`."""
    if file is None and about is None:
        return guessed_rig(bag, topics), {}
    first_imu = topics.imu or next(iter(topics.possible_imus), None)
    if file is None and about is not None:
        topics.imu = first_imu
        return about.rig, about.masks
    assert file is not None
    rig, masks = with_masks_of(_core.read_rig(file), Path(file).parent)
    names = [pair.name for pair in rig.pairs]
    if len(topics.pairs) == 1 and names and topics.pairs[0].name not in names:
        topics.pairs[0].name = names[0]
    if missing := [pair.name for pair in topics.pairs if pair.name not in names]:
        raise Error("configuration", f"has no pair {', '.join(missing)}", str(file), f"its pairs: {', '.join(names) or 'none'}")
    if not mounts_imu(rig):
        rig = mounted(bag, rig, topics, only_with_imu=True)
    else:
        topics.imu = first_imu
        if DESCRIPTION_TOPIC in bag.types():  # Spartan writes the readings of the IMU in base_link
            rig = with_readings_in_body(rig)
        elif topics.imu is not None:
            _LOG.info("%s: the IMU is %s, mounted by %s", bag.path, topics.imu, file)
    return with_layouts(rig, _layouts_in(bag, topics, rig)), masks


def import_bag(
    bag: str | os.PathLike[str], recording: str | os.PathLike[str], *, left: str | None = None, right: str | None = None,
    imu: str | None = None, wheels: str | None = None, rig: str | os.PathLike[str] | None = None,
    pair_tolerance_s: float = 0.005
) -> dict[str, int]:
    """Writes the images and sensors of a bag as a recording. Topics that are not named are guessed (guess_topics()).

    The calibration is, in this order: `rig`, that which Spartan wrote into the bag, `camera_info` with the mounts of
    `/tf_static`. `wheels` may be a topic of nav_msgs/Odometry. Returns counts: `frames`, `unpaired` images, `samples` of
    sensors, and `rejected` ones, whose stamps do not increase or whose images do not fit the calibration. Raises Error;
    with the code `usage` for arguments that do not fit, `input` where the bag is damaged, a topic is missing or empty, or
    no frame can be made, `configuration` where the calibration does not fit the topics, and `output` where the recording
    cannot be written. After an error what was imported before is an unfinished recording.
    """
    if (left is None) != (right is None):
        raise Error("usage", "is named without the topic of the other camera", str(left or right), "name --left and --right")
    if not 0 <= pair_tolerance_s <= 1:
        raise Error("usage", f"is {pair_tolerance_s} s, must be 0 to 1 s", "pair tolerance")
    source = opened(bag)
    try:
        about = _description_in(source) if left is None and right is None else None
        pairs = [pair.name for pair in about.rig.pairs] if about is not None else None
        topics = choose_topics(source, pairs, {"left": left, "right": right, "imu": imu, "wheels": wheels})
        chosen, masks = _choose_rig(source, topics, about, rig)
        _LOG.info("%s: %s", source.path, topics.description())
        writer = _core.RecordingWriter(
            recording, chosen, name=about.name if about is not None else Path(bag).stem,
            gravity_m_s2=about.gravity_m_s2 if about is not None else 9.81,
            noise=about.noise if about is not None and rig is None else _core.SensorNoise())
        write_masks(Path(recording), masks)
        importer = _Importer(writer, chosen, topics, round(1e9 * pair_tolerance_s))
        try:
            for topic, message in source.messages(topics.all()):
                importer.take(topic, message)
            return importer.finish()
        except BaseException:
            with suppress(Error):  # the first error counts
                writer.sync()
            raise
    finally:
        source.close()
