"""The topics of a bag that become a recording."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from spartan._errors import Error
from spartan.bags._export_recording import DESCRIPTION_TOPIC
from spartan.bags._reader import MessageReader, first_message

_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_IMU, _JOINTS = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
# Words of the topics of left and of right cameras, and of images that are computed from those of both.
_SIDES = (("left", "right"), ("cam0", "cam1"), ("infra1", "infra2"), ("camera0", "camera1"))
_COMPUTED = {"depth", "disparity", "confidence", "compresseddepth"}
_DEPTHS = ("16UC1", "32FC1")
_LOG = logging.getLogger("spartan")


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
    possible_imus: list[str] = field(default_factory=list)  # where none is named: one is chosen with the calibration

    def all(self) -> set[str]:
        sensors = {self.imu, self.wheels, self.compass, self.inclinometer}
        images = {topic for pair in self.pairs for topic in (pair.left, pair.right, pair.joints)}
        return {topic for topic in sensors | images if topic is not None}

    def description(self) -> str:
        pairs = [f"pair {pair.name}: {pair.left} and {pair.right}" for pair in self.pairs]
        sensors = {"IMU": self.imu, "wheels": self.wheels, "compass": self.compass, "inclinometer": self.inclinometer}
        return "; ".join(pairs + [f"{name}: {topic}" for name, topic in sensors.items() if topic is not None])


def is_rectified(topic: str) -> bool:
    """Whether image_proc or a camera publishes rectified images there: `image_rect`, `image_rect_color` …"""
    return "rect" in topic.removesuffix("/compressed").rsplit("/", 1)[-1]


def _side_of(topic: str) -> tuple[int, str] | None:
    """0 of a left camera, 1 of a right one, and the name without the words that tell; None of other images, and of those
    that are computed from both."""
    words = re.split("([/_])", topic.lower())
    if _COMPUTED & set(words):
        return None
    for side in (0, 1):
        if any(names[side] in words for names in _SIDES):
            of_pair = {names[side]: f"<{i}>" for i, names in enumerate(_SIDES)}
            return side, "".join(of_pair.get(word, word) for word in words)
    return None


def _guessed_pair(topics: Iterable[str]) -> PairTopics | None:
    """Raw images before compressed and rectified ones, and two topics whose names differ in the side alone before others."""
    sides: tuple[dict[str, str], dict[str, str]] = ({}, {})  # topics by their names without the side
    for topic in sorted(topics, key=lambda topic: ("compressed" in topic, is_rectified(topic), topic)):
        if found := _side_of(topic):
            side, name = found
            sides[side].setdefault(name, topic)
    if not all(sides):
        return None
    left, right = sides
    both = next((name for name in left if name in right), None)
    return PairTopics("stereo", left[both or next(iter(left))], right[both or next(iter(right))])


def guess_topics(types: dict[str, str], pairs: list[str] | None = None) -> Topics:
    """The topics of a bag by their types and names: images of a left and a right camera, possible IMUs, and, of bags that
    Spartan wrote, whose topics have known names, wheels, compass and inclinometer. `pairs`: of such a bag."""
    found: list[PairTopics] = []
    for name in pairs or []:
        joints = f"/{name}/joint_states"
        found.append(PairTopics(name, f"/{name}/left/image_raw", f"/{name}/right/image_raw",
                                joints if joints in types else None))
    if not found and (pair := _guessed_pair(topic for topic, kind in types.items() if kind in _IMAGES)):
        found.append(pair)
    if DESCRIPTION_TOPIC not in types:
        return Topics(found, possible_imus=sorted(topic for topic, kind in types.items() if kind == _IMU))
    wheels, compass, inclinometer = (topic if types.get(topic) == _JOINTS else None
                                     for topic in ("/wheels", "/compass", "/inclinometer"))
    imus = ["/imu"] if types.get("/imu") == _IMU else []
    return Topics(found, wheels=wheels, compass=compass, inclinometer=inclinometer, possible_imus=imus)


def _check_topics(bag: MessageReader, topics: Topics) -> None:
    """Raises Error where the bag has no messages of a topic, or those of another type."""
    types, where = bag.types(), str(bag.path)
    known = f"its topics: {', '.join(sorted(types))}"
    if missing := sorted(topics.all() - set(types)):
        raise Error("input", f"has no topic {', '.join(missing)}", where, f"{known}; name them with --left and --right")
    if empty := sorted(topics.all() & bag.empty_topics()):
        raise Error("input", f"has no messages of the topic {', '.join(empty)}", where, f"{known}; name others")
    expected: list[tuple[str | None, tuple[str, ...]]] = [
        (topics.imu, (_IMU,)), (topics.wheels, (_JOINTS, "nav_msgs/msg/Odometry")), (topics.compass, (_JOINTS,)),
        (topics.inclinometer, (_JOINTS,)), *((side, _IMAGES) for pair in topics.pairs for side in (pair.left, pair.right))]
    for topic, kinds in expected:
        if topic is not None and types[topic] not in kinds:
            raise Error("input", f"the topic {topic} is of {types[topic]}, not of {' or '.join(kinds)}", where, known)


def _unmeasured(bag: MessageReader, topic: str) -> str:
    """What the messages of an IMU do not contain: one of the two quantities is 0 in all messages of drivers that publish
    gyroscopes and accelerometers on topics of their own. Empty for a whole IMU."""
    unmeasured = {"angular_velocity", "linear_acceleration"}
    for _, message in bag.messages({topic}):
        unmeasured -= {name for name in unmeasured if any(abs(getattr(getattr(message, name), axis)) > 0 for axis in "xyz")}
        if not unmeasured:
            break
    return " and ".join(sorted(unmeasured))


def _check_imus(bag: MessageReader, topics: Topics) -> None:
    """Removes possible IMUs that lack a quantity. Raises Error where one is named."""
    if DESCRIPTION_TOPIC in bag.types():
        return  # of Spartan, by whatever IMU
    hint = "both on one topic are needed, as by unite_imu_method of the driver of RealSense"
    if topics.imu is not None and (nothing := _unmeasured(bag, topics.imu)):
        raise Error("input", f"the messages of {topics.imu} have no {nothing}", str(bag.path), hint)
    for topic in list(topics.possible_imus):
        if nothing := _unmeasured(bag, topic):
            _LOG.warning("%s: %s is left out: its messages have no %s (%s)", bag.path, topic, nothing, hint)
            topics.possible_imus.remove(topic)


def _without_depths(bag: MessageReader, types: dict[str, str]) -> dict[str, str]:
    """The topics without raw images of depth that have names of images of a left or a right camera."""
    return {topic: kind for topic, kind in types.items()
            if not (kind == _IMAGES[0] and _side_of(topic) and first_message(bag, topic).encoding in _DEPTHS)}


def choose_topics(bag: MessageReader, pairs: list[str] | None, wanted: dict[str, str | None]) -> Topics:
    """The topics that were named, and guesses for the others. Raises Error where the bag has not got them."""
    types, empty = bag.types(), bag.empty_topics()
    filled = {topic: kind for topic, kind in types.items() if topic not in empty}
    topics = guess_topics(_without_depths(bag, filled), pairs)
    if wanted["left"] is not None and wanted["right"] is not None:
        topics.pairs = [PairTopics("stereo", wanted["left"], wanted["right"])]
    topics.wheels = wanted["wheels"] or topics.wheels
    if wanted["imu"] is not None:
        topics.imu, topics.possible_imus = wanted["imu"], []
    topics.pairs = [pair for pair in topics.pairs if pair.left in filled and pair.right in filled] or topics.pairs
    if not topics.pairs:
        hint = f"its topics: {', '.join(sorted(types))}; name them with --left and --right"
        raise Error("input", "has no images of a left and a right camera", str(bag.path), hint)
    _check_topics(bag, topics)
    _check_imus(bag, topics)
    return topics
