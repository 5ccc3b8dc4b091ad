"""Types of messages of ROS 1 and ROS 2, and the messages that bags are made of."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from spartan import _core

# grid_map (BSD licence) has no place in the distributions; the definition is that of its release for ROS 1 and 2.
_GRID_MAP_INFO = "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
_GRID_MAP = (
    "{header}grid_map_msgs/GridMapInfo info\nstring[] layers\nstring[] basic_layers\n"
    "std_msgs/Float32MultiArray[] data\nuint16 outer_start_index\nuint16 inner_start_index\n"
)
_GRID_MAP_INFO_ROS1 = "std_msgs/Header header\n" + _GRID_MAP_INFO
_TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"


class Messages:
    """Makes messages of one generation of ROS.

    Stamps are integer nanoseconds. Frames follow REP-103 and REP-105: `map`, `odom`, `base_link` (x forward, y left,
    z up), and optical frames (x right, y down, z forward).
    """

    def __init__(self, ros1: bool) -> None:
        self.ros1 = ros1
        self.store: Typestore = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        self.store.register(get_types_from_msg(_TF_MESSAGE, "tf2_msgs/msg/TFMessage"))
        info = _GRID_MAP_INFO_ROS1 if ros1 else _GRID_MAP_INFO
        self.store.register(get_types_from_msg(info, "grid_map_msgs/msg/GridMapInfo"))
        header = "" if ros1 else "std_msgs/Header header\n"
        self.store.register(get_types_from_msg(_GRID_MAP.format(header=header), "grid_map_msgs/msg/GridMap"))

    def make(self, name: str, /, **fields: Any) -> Any:
        """A message of the type "package/Name"."""
        return self.store.types[name.replace("/", "/msg/")](**fields)

    def time(self, stamp_ns: int) -> Any:
        return self.make("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)

    def header(self, stamp_ns: int, frame: str) -> Any:
        sequence = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/Header", stamp=self.time(stamp_ns), frame_id=frame, **sequence)

    def vector(self, values: npt.ArrayLike, name: str = "geometry_msgs/Vector3") -> Any:
        x, y, z = (float(value) for value in np.asarray(values))
        return self.make(name, x=x, y=y, z=z)

    def quaternion(self, pose: _core.Pose) -> Any:
        x, y, z, w = (float(value) for value in pose.quaternion_xyzw)
        return self.make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)

    def pose(self, pose: _core.Pose) -> Any:
        return self.make(
            "geometry_msgs/Pose",
            position=self.vector(pose.translation, "geometry_msgs/Point"),
            orientation=self.quaternion(pose),
        )

    def transform(self, stamp_ns: int, parent: str, child: str, parent_from_child: _core.Pose) -> Any:
        """A TransformStamped: the pose of the frame `child` in `parent`."""
        moved = self.make(
            "geometry_msgs/Transform",
            translation=self.vector(parent_from_child.translation),
            rotation=self.quaternion(parent_from_child),
        )
        return self.make(
            "geometry_msgs/TransformStamped",
            header=self.header(stamp_ns, parent),
            child_frame_id=child,
            transform=moved,
        )

    def transforms(self, items: list[Any]) -> Any:
        return self.make("tf2_msgs/TFMessage", transforms=items)

    def joints(self, stamp_ns: int, values: dict[str, float]) -> Any:
        return self.make(
            "sensor_msgs/JointState",
            header=self.header(stamp_ns, ""),
            name=list(values),
            position=np.array(list(values.values()), np.float64),
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )

    def image(self, stamp_ns: int, frame: str, pixels: npt.NDArray[Any], encoding: str) -> Any:
        rows = np.ascontiguousarray(pixels)
        return self.make(
            "sensor_msgs/Image",
            header=self.header(stamp_ns, frame),
            height=rows.shape[0],
            width=rows.shape[1],
            encoding=encoding,
            is_bigendian=0,
            step=rows.strides[0],
            data=rows.view(np.uint8).reshape(-1),
        )


def world_covariance(pose: _core.UncertainPose) -> npt.NDArray[np.float64]:
    """The covariance of ROS (REP-103, geometry_msgs/PoseWithCovariance): of the position in the parent frame and of a
    rotation about fixed axes of the parent frame, order (x, y, z, rotation about x, y, z).

    Spartan's is of the right perturbation, whose parts are along the axes of the body: both parts are rotated.
    """
    rotation = pose.pose.rotation
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = rotation
    return np.asarray(turn @ pose.covariance @ turn.T)
