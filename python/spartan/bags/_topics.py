"""The topics of a bag that become a recording."""

from __future__ import annotations

from dataclasses import dataclass

from spartan._errors import Error
from spartan.bags._reader import MessageReader

_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_IMU, _JOINTS = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"


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


def is_rectified(topic: str) -> bool:
    """Whether image_proc or a camera publishes rectified images there: `image_rect`, `image_rect_color` …"""
    return "rect" in topic.removesuffix("/compressed").rsplit("/", 1)[-1]


def _side_of(topic: str) -> str | None:
    words = topic.lower().replace("_", "/").split("/")
    for side, names in (("left", ("left", "cam0", "infra1", "camera0")), ("right", ("right", "cam1", "infra2", "camera1"))):
        if any(name in words for name in names):
            return side
    return None


def _of_type(types: dict[str, str], *kinds: str, word: str = "") -> str | None:
    found = sorted(topic for topic, kind in types.items() if kind in kinds and word in topic)
    return found[0] if found else None


def guess_topics(types: dict[str, str], pairs: list[str] | None = None) -> Topics:
    """The topics of a bag by their types and names: images of a left and a right camera, the IMU, and, of bags that
    Spartan wrote (whose pairs are known), wheels, compass and inclinometer."""
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
    return Topics(found, _of_type(types, _IMU), _of_type(types, _JOINTS, word="/wheels"),
                  _of_type(types, _JOINTS, word="/compass"), _of_type(types, _JOINTS, word="/inclinometer"))


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


def choose_topics(bag: MessageReader, pairs: list[str] | None, wanted: dict[str, str | None]) -> Topics:
    """The topics that were named, and guesses for the others. Raises Error where the bag has not got them."""
    types, empty = bag.types(), bag.empty_topics()
    filled = {topic: kind for topic, kind in types.items() if topic not in empty}
    topics = guess_topics(filled, pairs)
    if wanted["left"] is not None and wanted["right"] is not None:
        topics.pairs = [PairTopics("stereo", wanted["left"], wanted["right"])]
    topics.imu, topics.wheels = wanted["imu"] or topics.imu, wanted["wheels"] or topics.wheels
    topics.pairs = [pair for pair in topics.pairs if pair.left in filled and pair.right in filled] or topics.pairs
    if not topics.pairs:
        hint = f"its topics: {', '.join(sorted(types))}; name them with --left and --right"
        raise Error("input", "has no images of a left and a right camera", str(bag.path), hint)
    _check_topics(bag, topics)
    return topics
