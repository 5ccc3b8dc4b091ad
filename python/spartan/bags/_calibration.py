"""Calibrations from messages of ROS: camera_info and tf_static."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from spartan import _core
from spartan._errors import Error
from spartan.bags._images import pixels_of
from spartan.bags._reader import MessageReader, first_message
from spartan.bags._topics import PairTopics, is_rectified


def _camera_info_yaml(message: Any, name: str, rectified: bool) -> str:
    """The file that ROS has of a camera_info. Its K, D and R describe the raw image, P the rectified one."""
    k, d, r, p = (getattr(message, key if hasattr(message, key) else key.lower()) for key in "KDRP")
    model = message.distortion_model
    if rectified and len(p) != 12:
        raise Error("configuration", "the camera_info of rectified images has no projection matrix P", name,
                    "name a calibration file with --rig")
    if rectified:
        k, d, r, model = np.reshape(p, (3, 4))[:, :3].reshape(-1), np.zeros(5), np.identity(3).reshape(-1), "plumb_bob"

    def matrix(key: str, rows: int, values: Any) -> str:
        numbers = ", ".join(repr(float(value)) for value in values)
        return f"{key}:\n  rows: {rows}\n  cols: {len(values) // rows}\n  data: [{numbers}]\n"

    return (f"image_width: {message.width}\nimage_height: {message.height}\ncamera_name: {name}\n"
            + matrix("camera_matrix", 3, k) + f"distortion_model: {model}\n"
            + matrix("distortion_coefficients", 1, d) + matrix("rectification_matrix", 3, r)
            + matrix("projection_matrix", 3, p))


def _tf_static(bag: MessageReader) -> dict[str, tuple[str, _core.Pose]]:
    """Parent and parent_from_child of each child frame."""
    tree: dict[str, tuple[str, _core.Pose]] = {}
    for _, message in bag.messages({"/tf_static"}):
        for each in message.transforms:
            t, q = each.transform.translation, each.transform.rotation
            try:
                pose = _core.Pose.from_quaternion([q.x, q.y, q.z, q.w], [t.x, t.y, t.z])
            except ValueError as error:
                raise Error("input", f"the transform of {each.child_frame_id} is invalid: {error}", "/tf_static") from error
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


def guessed_rig(bag: MessageReader, topics: PairTopics, imu: str | None) -> _core.Rig:
    """Intrinsics and baseline by camera_info, mounts by /tf_static. Of topics of rectified images (is_rectified()) by P
    alone."""
    types, empty, files, first = bag.types(), bag.empty_topics(), [], {}
    for side, topic in (("left", topics.left), ("right", topics.right)):
        near = topic.removesuffix("/compressed").rsplit("/", 1)[0] + "/camera_info"
        if near not in types or near in empty:
            raise Error("configuration", f"has no {near}", str(bag.path), "name a calibration file with --rig")
        files.append(_camera_info_yaml(first_message(bag, near), side, is_rectified(topic)))
        first[side] = first_message(bag, topic)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{side}.yaml" for side in ("left", "right")]
        for path, text in zip(paths, files):
            path.write_text(text, encoding="utf-8")
        read = _core.read_calibration(",".join(map(str, paths)), "ros").rig
    cameras = []
    for side, topic in (("left", topics.left), ("right", topics.right)):
        pixels, layout = pixels_of(first[side], topic)
        given = read.camera(getattr(read.pairs[0], side))
        cameras.append(_core.Camera(side, given.size, given.model, layout=layout, bits=8 * pixels.dtype.itemsize))
    rig = _core.Rig.stereo(cameras[0], cameras[1], read.right_from_left(read.pairs[0].name), topics.name)
    tree = _tf_static(bag)
    body_from_left = _pose_in(tree, first["left"].header.frame_id)
    body_from_imu = _pose_in(tree, first_message(bag, imu).header.frame_id) if imu else None
    return rig if body_from_left is None else rig.mounted(body_from_left, body_from_imu)
