"""MCAP files with the schemas of Foxglove (protobuf): written from messages of ROS, and read back as such.

Foxglove has no schema of an IMU and of texts: they are JSON with a schema of their own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import Any, Self

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Odometry_pb2 import Odometry
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from spartan.bags._messages import Messages
from spartan.bags._reader import damaged
from spartan.bags._writer import UnfinishedOutput, output_errors

_FLOAT32, _FLOAT64 = PackedElementField.FLOAT32, PackedElementField.FLOAT64
_NUMBERS = {name: {"type": "number"} for name in "xyz"}
_VECTOR = {"type": "object", "properties": _NUMBERS}
_TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_JSON_SCHEMAS: dict[str, dict[str, Any]] = {
    "spartan.Imu": {"timestamp": _TIME, "frame_id": {"type": "string"}, "angular_velocity": _VECTOR, "linear_acceleration": _VECTOR},
    "spartan.Text": {"data": {"type": "string"}},
}


def _time(header: Any) -> Timestamp:
    return Timestamp(seconds=header.stamp.sec, nanos=header.stamp.nanosec)


def _vector(v: Any) -> Vector3:
    return Vector3(x=v.x, y=v.y, z=v.z)


def _quaternion(q: Any) -> Quaternion:
    return Quaternion(x=q.x, y=q.y, z=q.z, w=q.w)


def _pose(pose: Any) -> Pose:
    return Pose(position=_vector(pose.position), orientation=_quaternion(pose.orientation))


def _of_image(m: Any) -> Message:
    return RawImage(timestamp=_time(m.header), frame_id=m.header.frame_id, width=m.width, height=m.height,
                    encoding="mono16" if m.encoding == "16UC1" else m.encoding, step=m.step, data=m.data.tobytes())


def _of_disparity(m: Any) -> Message:
    return _of_image(m.image)


def _of_camera_info(m: Any) -> Message:
    model = "kannala_brandt" if m.distortion_model == "equidistant" else m.distortion_model
    return CameraCalibration(timestamp=_time(m.header), frame_id=m.header.frame_id, width=m.width, height=m.height,
                             distortion_model=model, D=m.d, K=m.k, R=m.r, P=m.p)


def _of_transforms(m: Any) -> Message:
    return FrameTransforms(transforms=[
        FrameTransform(timestamp=_time(each.header), parent_frame_id=each.header.frame_id, child_frame_id=each.child_frame_id,
                       translation=_vector(each.transform.translation), rotation=_quaternion(each.transform.rotation))
        for each in m.transforms])


def _of_joints(m: Any) -> Message:
    joints = [JointState(name=name, position=position) for name, position in zip(m.name, m.position)]
    return JointStates(timestamp=_time(m.header), joints=joints)


def _of_odometry(m: Any) -> Message:
    return Odometry(timestamp=_time(m.header), frame_id=m.header.frame_id, body_frame_id=m.child_frame_id,
                    pose=_pose(m.pose.pose), pose_covariance=m.pose.covariance)


def _of_pose(m: Any) -> Message:
    """Foxglove's PoseInFrame has no covariance, its Odometry has."""
    return Odometry(timestamp=_time(m.header), frame_id=m.header.frame_id, body_frame_id="base_link", pose=_pose(m.pose.pose),
                    pose_covariance=m.pose.covariance)


def _of_path(m: Any) -> Message:
    return PosesInFrame(timestamp=_time(m.header), frame_id=m.header.frame_id, poses=[_pose(each.pose) for each in m.poses])


def _of_cloud(m: Any) -> Message:
    """Colours are four bytes, as Foxglove's panels find them by the names red, green, blue and alpha."""
    points = m.data.view([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("sigma_m", "<f4")])
    packed = np.zeros(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1"),
                                    ("alpha", "u1"), ("sigma_m", "<f4")])
    for name in ("x", "y", "z", "sigma_m"):
        packed[name] = points[name]
    for name, shift in (("red", 16), ("green", 8), ("blue", 0)):
        packed[name] = points["rgb"] >> shift & 255
    packed["alpha"] = 255
    fields = [PackedElementField(name=name, offset=packed.dtype.fields[name][1],  # type: ignore[index]
                                 type=_FLOAT32 if packed.dtype[name].itemsize == 4 else PackedElementField.UINT8)
              for name in packed.dtype.names or ()]
    here = Pose(position=Vector3(), orientation=Quaternion(w=1))
    return PointCloud(timestamp=_time(m.header), frame_id=m.header.frame_id, pose=here, point_stride=packed.itemsize,
                      fields=fields, data=packed.tobytes())


def _grid(header: Any, cell_m: float, west: float, south: float, layers: dict[str, Any], number: Any) -> Message:
    """`layers`: arrays whose first row is the southern one, as rows of a Foxglove grid go along y."""
    rows, columns = next(iter(layers.values())).shape
    packed = np.stack(list(layers.values()), axis=-1)
    fields = [PackedElementField(name=name, offset=i * packed.itemsize, type=number) for i, name in enumerate(layers)]
    corner = Pose(position=Vector3(x=west, y=south), orientation=Quaternion(w=1))
    return Grid(timestamp=_time(header), frame_id=header.frame_id, pose=corner, column_count=columns,
                cell_size=Vector2(x=cell_m, y=cell_m), cell_stride=packed.itemsize * len(layers),
                row_stride=packed.itemsize * len(layers) * columns, fields=fields, data=packed.tobytes())


def _of_grid_map(m: Any) -> Message:
    """Columns and rows of grid_map are counted against x and y."""
    centre, info = m.info.pose.position, m.info
    layers = {}
    for name, each in zip(m.layers, m.data):
        columns, rows = (dimension.size for dimension in each.layout.dim)
        layers[name] = np.asarray(each.data, np.float32).reshape((rows, columns), order="F")[::-1, ::-1].T
    return _grid(m.header, info.resolution, centre.x - info.length_x / 2, centre.y - info.length_y / 2, layers, _FLOAT32)


def _of_occupancy(m: Any) -> Message:
    info, origin = m.info, m.info.origin.position
    percent = np.asarray(m.data, np.int8).reshape(info.height, info.width)
    return _grid(m.header, info.resolution, origin.x, origin.y, {"occupancy_percent": percent}, PackedElementField.INT8)


_CONVERTED: dict[str, Callable[[Any], Message]] = {
    "sensor_msgs/msg/Image": _of_image, "sensor_msgs/msg/CameraInfo": _of_camera_info, "tf2_msgs/msg/TFMessage": _of_transforms,
    "sensor_msgs/msg/JointState": _of_joints, "nav_msgs/msg/Odometry": _of_odometry, "nav_msgs/msg/Path": _of_path,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _of_pose, "sensor_msgs/msg/PointCloud2": _of_cloud,
    "stereo_msgs/msg/DisparityImage": _of_disparity, "grid_map_msgs/msg/GridMap": _of_grid_map,
    "nav_msgs/msg/OccupancyGrid": _of_occupancy}


def _as_json(message: Any) -> tuple[str, dict[str, Any]]:
    if message.__msgtype__ == "std_msgs/msg/String":
        return "spartan.Text", {"data": message.data}
    header, w, a = message.header, message.angular_velocity, message.linear_acceleration
    return "spartan.Imu", {
        "timestamp": {"sec": header.stamp.sec, "nsec": header.stamp.nanosec}, "frame_id": header.frame_id,
        "angular_velocity": {"x": w.x, "y": w.y, "z": w.z}, "linear_acceleration": {"x": a.x, "y": a.y, "z": a.z}}


class FoxgloveWriter:
    """Takes messages of ROS 2, as BagWriter does, and writes them with the schemas of Foxglove."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._output = UnfinishedOutput(path)
        self.path, self.messages = self._output.path, Messages(ros1=False)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def __enter__(self) -> Self:
        self._output.begin()
        try:
            with output_errors(self.path):
                self._file = self._output.part.open("wb")
                self._writer = Writer(self._file)
                self._writer.start(profile="", library="spartan")
        except BaseException:
            self._output.discard()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with suppress(OSError) if kind is not None else output_errors(self.path), self._file:
                if kind is None:
                    self._writer.finish()  # type: ignore[no-untyped-call]
            if kind is None:
                self._output.finish()
        finally:
            self._output.discard()

    def write(self, topic: str, stamp_ns: int, message: Any, *, latched: bool = False) -> None:
        """Appends a message; the type of a topic is that of its first message."""
        if message.__msgtype__ in _CONVERTED:
            converted = _CONVERTED[message.__msgtype__](message)
            name, data, encoding = converted.DESCRIPTOR.full_name, converted.SerializeToString(), "protobuf"
        else:
            name, values = _as_json(message)
            data, encoding = json.dumps(values).encode(), "json"
        with output_errors(self.path):
            if name not in self._schemas:
                if encoding == "protobuf":
                    self._schemas[name] = register_schema(self._writer, type(converted))
                else:
                    schema = {"title": name, "type": "object", "properties": _JSON_SCHEMAS[name]}
                    self._schemas[name] = self._writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
            if topic not in self._channels:
                self._channels[topic] = self._writer.register_channel(topic, encoding, self._schemas[name])
            self._writer.add_message(self._channels[topic], log_time=stamp_ns, publish_time=stamp_ns, data=data)


def _header(message: Any, frame: str | None = None) -> SimpleNamespace:
    stamp = SimpleNamespace(sec=message.timestamp.seconds, nanosec=message.timestamp.nanos)
    return SimpleNamespace(stamp=stamp, frame_id=message.frame_id if frame is None else frame)


def _to_image(m: Any) -> Any:
    return SimpleNamespace(header=_header(m), width=m.width, height=m.height, encoding=m.encoding, step=m.step, data=m.data,
                           is_bigendian=False)


def _to_compressed(m: Any) -> Any:
    return SimpleNamespace(header=_header(m), format=m.format, data=m.data)


def _to_camera_info(m: Any) -> Any:
    model = "equidistant" if m.distortion_model == "kannala_brandt" else m.distortion_model
    return SimpleNamespace(header=_header(m), width=m.width, height=m.height, distortion_model=model, d=list(m.D),
                           k=list(m.K), r=list(m.R), p=list(m.P))


def _to_transform(m: Any) -> Any:
    return SimpleNamespace(header=_header(m, m.parent_frame_id), child_frame_id=m.child_frame_id,
                           transform=SimpleNamespace(translation=m.translation, rotation=m.rotation))


def _to_transforms(m: Any) -> Any:
    return SimpleNamespace(transforms=[_to_transform(each) for each in m.transforms])


def _to_joints(m: Any) -> Any:
    return SimpleNamespace(header=_header(m, ""), name=[each.name for each in m.joints],
                           position=[each.position for each in m.joints])


def _to_odometry(m: Any) -> Any:
    return SimpleNamespace(header=_header(m), pose=SimpleNamespace(pose=m.pose))


# Of each schema: the type of ROS that it becomes, the protobuf class, the conversion.
_READ: dict[str, tuple[str, Callable[[], Any], Callable[[Any], Any]]] = {
    "foxglove.RawImage": ("sensor_msgs/msg/Image", RawImage, _to_image),
    "foxglove.CompressedImage": ("sensor_msgs/msg/CompressedImage", CompressedImage, _to_compressed),
    "foxglove.CameraCalibration": ("sensor_msgs/msg/CameraInfo", CameraCalibration, _to_camera_info),
    "foxglove.FrameTransform": ("tf2_msgs/msg/TFMessage", FrameTransform,
                                lambda m: SimpleNamespace(transforms=[_to_transform(m)])),
    "foxglove.FrameTransforms": ("tf2_msgs/msg/TFMessage", FrameTransforms, _to_transforms),
    "foxglove.JointStates": ("sensor_msgs/msg/JointState", JointStates, _to_joints),
    "foxglove.Odometry": ("nav_msgs/msg/Odometry", Odometry, _to_odometry),
}


def _from_json(name: str, data: bytes) -> Any:
    values = json.loads(data)
    if name == "spartan.Text":
        return SimpleNamespace(data=values["data"])
    stamp = SimpleNamespace(sec=values["timestamp"]["sec"], nanosec=values["timestamp"]["nsec"])
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp, frame_id=values["frame_id"]),
                           angular_velocity=SimpleNamespace(**values["angular_velocity"]),
                           linear_acceleration=SimpleNamespace(**values["linear_acceleration"]))


_JSON_TYPES = {"spartan.Imu": "sensor_msgs/msg/Imu", "spartan.Text": "std_msgs/msg/String"}


def is_foxglove_file(path: str | os.PathLike[str]) -> bool:
    """Whether it is one MCAP file with schemas in protobuf; MCAP storage of ROS 2 has messages in CDR."""
    try:
        with Path(path).open("rb") as file:
            summary = make_reader(file).get_summary()
    except Exception:  # a damaged file makes the reader raise errors of many kinds
        return False
    return summary is not None and any(each.message_encoding == "protobuf" for each in summary.channels.values())


class FoxgloveFile:
    """The messages of an MCAP file as messages of ROS 2; those with other schemas are left out (MessageReader)."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._types: dict[str, str] = {}
        self._filled: set[str] = set()
        with self.path.open("rb") as file:
            summary = make_reader(file).get_summary()
        assert summary is not None  # is_foxglove_file()
        counts = None if summary.statistics is None else summary.statistics.channel_message_counts
        for channel in summary.channels.values():
            name = summary.schemas[channel.schema_id].name if channel.schema_id in summary.schemas else ""
            kind = _READ[name][0] if name in _READ else _JSON_TYPES.get(name)
            if kind is not None:
                self._types[channel.topic] = kind
                if counts is None or counts.get(channel.id, 0):
                    self._filled.add(channel.topic)

    def close(self) -> None:
        """The file is open only while messages are read."""

    def types(self) -> dict[str, str]:
        return dict(self._types)

    def empty_topics(self) -> set[str]:
        return set(self._types) - self._filled

    def messages(self, topics: set[str]) -> Iterator[tuple[str, Any]]:
        wanted = sorted(topics & set(self._types))
        try:
            with self.path.open("rb") as file:
                for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(topics=wanted) if wanted else ():
                    name = schema.name if schema is not None else ""
                    if name in _JSON_TYPES:
                        yield channel.topic, _from_json(name, message.data)
                    else:
                        _, made, converted = _READ[name]
                        decoded = made()
                        decoded.ParseFromString(message.data)
                        yield channel.topic, converted(decoded)
        except Exception as error:  # a damaged file makes the decoders raise errors of many kinds
            raise damaged(error, self.path) from error
