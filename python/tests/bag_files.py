"""Bags of ROS as the tests read and change them."""

import pytest

import spartan

bags = pytest.importorskip("spartan.bags")
from rosbags.highlevel import AnyReader  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402


def read_bag(path):
    """Topic, type and message of all messages of a bag of ROS."""
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        return [(c.topic, c.msgtype, reader.deserialize(raw, c.msgtype)) for c, _, raw in reader.messages()]


def stamp_of(message):
    """Of the header, ns."""
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def pose_of(transform):
    """parent_from_child of a geometry_msgs/Transform."""
    t, q = transform.translation, transform.rotation
    return spartan.Pose.from_quaternion([q.x, q.y, q.z, q.w], [t.x, t.y, t.z])


def rewritten(source, target, change):
    """A copy of a bag of ROS 1 whose messages went through `change`, which returns a list of (topic, message)."""
    with bags.BagWriter(target) as out:
        for topic, _, message in read_bag(source):
            stamp = stamp_of(message) if hasattr(message, "header") else 0
            for name, each in change(out.messages, topic, message):
                out.write(name, stamp, each)
