"""Calibrations from messages of ROS: camera_info and tf_static."""

from __future__ import annotations

import logging
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from spartan import _core
from spartan._errors import Error
from spartan.bags._images import pixels_of
from spartan.bags._reader import MessageReader, first_message
from spartan.bags._topics import PairTopics, Topics, is_rectified

_LOG = logging.getLogger("spartan")


def _matrix_of(message: Any, key: str) -> Any:
    """K, D, R or P of a camera_info, whose names are small letters in ROS 2."""
    return getattr(message, key if hasattr(message, key) else key.lower())


def _camera_info_of(bag: MessageReader, topic: str) -> tuple[str, Any]:
    """The topic of the camera_info beside images, and its first message; None without one."""
    near = topic.removesuffix("/compressed").rsplit("/", 1)[0] + "/camera_info"
    return near, first_message(bag, near) if near in bag.types() and near not in bag.empty_topics() else None


def _rectified_from_raw(bag: MessageReader, topic: str) -> _core.Pose:
    """R of the camera_info of rectified images: image_proc leaves them in the frame of the raw camera. The identity for
    raw images, and where R is not stated."""
    near, message = _camera_info_of(bag, topic)
    r = np.array([] if message is None or not is_rectified(topic) else _matrix_of(message, "R"), dtype=np.float64)
    if not r.any():
        return _core.Pose()
    if r.size == 9 and np.isfinite(r).all():
        u, scales, vt = np.linalg.svd(r.reshape(3, 3))
        if np.abs(scales - 1).max() < 1e-3 and np.linalg.det(u @ vt) > 0:
            return _core.Pose(np.column_stack([u @ vt, np.zeros(3)]))
    raise Error("configuration", "R of the camera_info is no rotation matrix", near, "name images that are not rectified")


def _camera_info_yaml(message: Any, name: str, rectified: bool) -> str:
    """The file that ROS has of a camera_info. Its K, D and R describe the raw image, P the rectified one."""
    k, d, r, p = (_matrix_of(message, key) for key in "KDRP")
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
            tree[each.child_frame_id.lstrip("/")] = (_frame_of(each), pose)
    return tree


def _to_root(tree: dict[str, tuple[str, _core.Pose]], frame: str) -> tuple[str, _core.Pose]:
    """The root above a frame, and root_from_frame. Ends where the tree has a cycle."""
    pose = _core.Pose()
    for _ in tree:
        if frame not in tree:
            break
        frame, parent_from_child = tree[frame]
        pose = parent_from_child @ pose
    return frame, pose


def _between(tree: dict[str, tuple[str, _core.Pose]], a: str, b: str) -> _core.Pose | None:
    """a_from_b along the tree; None where they are not connected."""
    (root, root_from_a), (other, root_from_b) = _to_root(tree, a), _to_root(tree, b)
    return root_from_a.inverse() @ root_from_b if a and root == other else None


def _frame_of(message: Any) -> str:
    return str(message.header.frame_id).lstrip("/")


def _connected_imu(bag: MessageReader, tree: dict[str, tuple[str, _core.Pose]], left: str, topics: Topics) -> _core.Pose | None:
    """left_from_imu of the first IMU that /tf_static connects with the frame `left`, which becomes that of `topics`. Raises
    Error for one that is named and not connected: readings whose axes are not known are worse than none, they turn the
    world."""
    named, topics.imu = topics.imu, None
    for topic in topics.possible_imus if named is None else [named]:
        frame = _frame_of(first_message(bag, topic))
        left_from_imu = _between(tree, left, frame)
        if left_from_imu is not None:
            topics.imu = topic
            _LOG.info("%s: the IMU is %s in the frame '%s', mounted by /tf_static", bag.path, topic, frame)
            return left_from_imu
        what = f"/tf_static does not connect its frame '{frame}' with '{left}', that of the left images"
        hint = "name a calibration that states it with --rig"
        if named is not None:
            raise Error("configuration", f"the mount of {topic} is not known: {what}", str(bag.path), hint)
        _LOG.warning("%s: %s is left out: %s; %s", bag.path, topic, what, hint)
    return None


def mounted(bag: MessageReader, rig: _core.Rig, topics: Topics, *, only_with_imu: bool = False) -> _core.Rig:
    """A rig of one pair on the body, by /tf_static, with the IMU that is connected with the left images. The body is
    base_link or, where it is not known, that of the rig. Chooses the IMU of `topics`; without one, the rig is returned
    as it is if it moves `only_with_imu`."""
    images = topics.pairs[0].left
    tree, frame = _tf_static(bag), _frame_of(first_message(bag, images))
    left_from_frame = _rectified_from_raw(bag, images)
    frame_from_imu = _connected_imu(bag, tree, frame, topics)
    base_from_frame = _between(tree, "base_link", frame)
    if frame_from_imu is None and only_with_imu:
        return rig
    body = "base_link" if base_from_frame is not None else "the left camera, turned to x forward, y left, z up"
    _LOG.info("%s: the body is %s", bag.path, body)
    if frame_from_imu is None and base_from_frame is None:
        return rig
    body_from_left = rig.body_from_camera(rig.pairs[0].left)
    if base_from_frame is not None:
        body_from_left = base_from_frame @ left_from_frame.inverse()
    return rig.mounted(body_from_left, None if frame_from_imu is None else body_from_left @ left_from_frame @ frame_from_imu)


def guessed_rig(bag: MessageReader, topics: Topics) -> _core.Rig:
    """Intrinsics and baseline of the first pair by camera_info, mounts by /tf_static. Of topics of rectified images
    (is_rectified()) by P alone. Chooses the IMU of `topics`."""
    pair = topics.pairs[0]
    files, first = [], {}
    for side, topic in (("left", pair.left), ("right", pair.right)):
        near, message = _camera_info_of(bag, topic)
        if message is None:
            raise Error("configuration", f"has no {near}", str(bag.path), "name a calibration file with --rig")
        files.append(_camera_info_yaml(message, side, is_rectified(topic)))
        first[side] = first_message(bag, topic)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{side}.yaml" for side in ("left", "right")]
        for path, text in zip(paths, files):
            path.write_text(text, encoding="utf-8")
        read = _core.read_calibration(",".join(map(str, paths)), "ros").rig
    cameras = []
    for side, topic in (("left", pair.left), ("right", pair.right)):
        pixels, layout = pixels_of(first[side], topic)
        given = read.camera(getattr(read.pairs[0], side))
        cameras.append(_core.Camera(side, given.size, given.model, layout=layout, bits=8 * pixels.dtype.itemsize))
    rig = _core.Rig.stereo(cameras[0], cameras[1], read.right_from_left(read.pairs[0].name), pair.name)
    return mounted(bag, rig, topics)
