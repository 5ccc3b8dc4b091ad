"""The topics of a bag that become a recording."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field

from spartan._errors import Error
from spartan.bags._export_recording import DESCRIPTION_TOPIC
from spartan.bags._reader import MessageReader

_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_IMU, _JOINTS = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
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


def _side_of(topic: str) -> str | None:
    words = topic.lower().replace("_", "/").split("/")
    for side, names in (("left", ("left", "cam0", "infra1", "camera0")), ("right", ("right", "cam1", "infra2", "camera1"))):
        if any(name in words for name in names):
            return side
    return None


def guess_topics(types: dict[str, str], pairs: list[str] | None = None) -> Topics:
    """The topics of a bag by their types and names: images of a left and a right camera, possible IMUs, and, of bags that
    Spartan wrote, whose topics have known names, wheels, compass and inclinometer. `pairs`: of such a bag."""
    found: list[PairTopics] = []
    for name in pairs or []:
        joints = f"/{name}/joint_states"
        found.append(PairTopics(name, f"/{name}/left/image_raw", f"/{name}/right/image_raw",
                                joints if joints in types else None))
    if not found:
        sides: dict[str, list[str]] = {"left": [], "right": []}
        for topic in sorted(types):
            if types[topic] in _IMAGES and (side := _side_of(topic)):
                sides[side].append(topic)
        raw = {side: sorted(topics, key=lambda topic: ("compressed" in topic, is_rectified(topic), topic))
               for side, topics in sides.items()}
        if raw["left"] and raw["right"]:
            found.append(PairTopics("stereo", raw["left"][0], raw["right"][0]))
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


def choose_topics(bag: MessageReader, pairs: list[str] | None, wanted: dict[str, str | None]) -> Topics:
    """The topics that were named, and guesses for the others. Raises Error where the bag has not got them."""
    types, empty = bag.types(), bag.empty_topics()
    filled = {topic: kind for topic, kind in types.items() if topic not in empty}
    topics = guess_topics(filled, pairs)
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
