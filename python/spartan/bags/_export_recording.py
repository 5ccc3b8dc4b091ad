"""A recording as a bag: images, calibration and sensors, as a robot would publish them."""

from __future__ import annotations

import base64
import json
import logging
import os
from pathlib import Path
from typing import Any

import numpy as np

from spartan import _core
from spartan._errors import Error
from spartan.bags._rigs import with_masks_of, with_readings_in_body
from spartan.bags._writer import MessageWriter, open_writer

_LOG = logging.getLogger("spartan")

DESCRIPTION_TOPIC = "/spartan/recording"
_ENCODINGS = {"gray": ("mono8", "mono16"), "rgb": ("rgb8", "rgb16"), "bayer_rggb": ("bayer_rggb8", "bayer_rggb16"),
              "bayer_grbg": ("bayer_grbg8", "bayer_grbg16"), "bayer_gbrg": ("bayer_gbrg8", "bayer_gbrg16"),
              "bayer_bggr": ("bayer_bggr8", "bayer_bggr16")}


def optical_frame(pair: str, side: str) -> str:
    return f"{pair}_{side}_optical_frame"


def _description(recording: _core.Recording) -> str:
    """What messages of ROS have no place for: the rig with its models, errors and self-masks, gravity, and the noise of
    the sensors. The rig is that of readings in the axes of the body, as `/imu` has them."""
    noise = recording.noise
    rig, masks = with_masks_of(with_readings_in_body(recording.rig), Path(recording.rig_source).parent)
    return json.dumps({"schema": 1, "name": recording.name, "gravity_m_s2": recording.gravity_m_s2,
                       "noise": {kind: getattr(noise, kind).to_yaml() for kind in ("imu", "compass", "inclinometer")},
                       "rig": rig.to_yaml(), "masks": {name: base64.b64encode(file).decode() for name, file in masks.items()}})


def _camera_info(bag: MessageWriter, rig: _core.Rig, pair: _core.StereoPair, side: str, stamp_ns: int) -> Any:
    """Intrinsics and, of a pair that is rectified already, the projection with its baseline. Lens models that
    camera_info does not know are left to the rig in DESCRIPTION_TOPIC."""
    camera = rig.camera(getattr(pair, side))
    values, messages = camera.model.parameters, bag.messages
    k, p, distortion, name = np.identity(3), np.zeros((3, 4)), np.zeros(5), "plumb_bob"
    if "focal_px" in values:
        (fx, fy), (cx, cy) = values["focal_px"], values["centre_px"]
        k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    if camera.model.kind == "radial_tangential":
        given = values["distortion"]
        distortion = np.array([*given, *[0.0] * max(0, 5 - len(given))])
        name = "plumb_bob" if len(distortion) == 5 else "rational_polynomial"
    elif camera.model.kind == "equidistant":
        distortion, name = np.array(values["distortion"]), "equidistant"
    elif camera.model.kind != "pinhole":
        name = ""
    p[:, :3] = k
    right_from_left = rig.right_from_left(pair.name)
    if side == "right" and np.array_equal(right_from_left.rotation, np.identity(3)):
        p[0, 3] = k[0, 0] * right_from_left.translation[0]
    keys = ("D", "K", "R", "P") if messages.ros1 else ("d", "k", "r", "p")
    matrices = (distortion.astype(np.float64), k.reshape(-1), np.identity(3).reshape(-1), p.reshape(-1))
    region = messages.make("sensor_msgs/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    return messages.make("sensor_msgs/CameraInfo", header=messages.header(stamp_ns, optical_frame(pair.name, side)),
                         height=camera.size[1], width=camera.size[0], distortion_model=name, binning_x=0, binning_y=0,
                         roi=region, **dict(zip(keys, matrices)))


def _write_frame(bag: MessageWriter, rig: _core.Rig, frame: _core.StereoFrame) -> None:
    pair, messages = rig.pair(frame.pair), bag.messages
    for side, stamp, pixels in (("left", frame.stamp_ns, frame.left), ("right", frame.right_stamp_ns, frame.right)):
        camera = rig.camera(getattr(pair, side))
        layout = "rgb" if pixels.ndim == 3 else "gray" if camera.layout == "rgb" else camera.layout
        encoding = _ENCODINGS[layout][pixels.dtype == np.uint16]
        bag.write(f"/{pair.name}/{side}/image_raw", stamp,
                  messages.image(stamp, optical_frame(pair.name, side), pixels, encoding))
        bag.write(f"/{pair.name}/{side}/camera_info", stamp, _camera_info(bag, rig, pair, side, stamp))
    mount = rig.camera(pair.left).mount
    details = {"position_id": float(frame.position_id), "frame_id": float(frame.frame_id)}
    if mount != "body":
        details |= {"pan": frame.pan_rad, "tilt": frame.tilt_rad}
    if frame.exposure_us > 0:
        details |= {"exposure_us": frame.exposure_us, "gain": frame.gain}
    bag.write(f"/{pair.name}/joint_states", frame.stamp_ns, messages.joints(frame.stamp_ns, details))
    if mount != "body":
        moved = [messages.transform(frame.stamp_ns, "base_link", optical_frame(pair.name, side),
                                    rig.body_from_camera(getattr(pair, side), frame.pan_rad, frame.tilt_rad))
                 for side in ("left", "right")]
        bag.write("/tf", frame.stamp_ns, messages.transforms(moved))


def _write_sample(bag: MessageWriter, sample: Any) -> None:
    messages, stamp = bag.messages, sample.stamp_ns
    header = messages.header(stamp, "base_link")
    if isinstance(sample, _core.ImuSample):
        unknown = np.zeros(9)
        unknown[0] = -1  # REP-145: there is no orientation
        orientation = messages.make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        bag.write("/imu", stamp, messages.make(
            "sensor_msgs/Imu", header=header, orientation=orientation, orientation_covariance=unknown,
            angular_velocity=messages.vector(sample.gyro_rad_s), angular_velocity_covariance=np.zeros(9),
            linear_acceleration=messages.vector(sample.accel_m_s2), linear_acceleration_covariance=np.zeros(9)))
    elif isinstance(sample, _core.WheelSample):
        bag.write("/wheels", stamp, messages.joints(stamp, {"left_m": sample.left_m, "right_m": sample.right_m}))
    elif isinstance(sample, _core.CompassSample):
        values = {"heading_rad": sample.heading_rad, "sigma_rad": sample.sigma_rad}
        bag.write("/compass", stamp, messages.joints(stamp, values))
    elif isinstance(sample, _core.InclinometerSample):
        values = {"roll_rad": sample.roll_rad, "pitch_rad": sample.pitch_rad, "sigma_rad": sample.sigma_rad}
        bag.write("/inclinometer", stamp, messages.joints(stamp, values))


def _write_beginning(bag: MessageWriter, recording: _core.Recording, stamp_ns: int) -> None:
    """What does not change: the frames of fixed cameras, and the description."""
    messages, rig = bag.messages, recording.rig
    fixed = [messages.transform(stamp_ns, "base_link", optical_frame(pair.name, side), rig.body_from_camera(getattr(pair, side)))
             for pair in rig.pairs for side in ("left", "right") if rig.camera(getattr(pair, side)).mount == "body"]
    if fixed:
        bag.write("/tf_static", stamp_ns, messages.transforms(fixed), latched=True)
    bag.write(DESCRIPTION_TOPIC, stamp_ns, messages.make("std_msgs/String", data=_description(recording)), latched=True)


def export_recording(
    recording: str | os.PathLike[str] | _core.Recording, bag: str | os.PathLike[str], *,
    rig: str | os.PathLike[str] | None = None, storage: str = "sqlite3"
) -> int:
    """Writes a recording, open or its path, as a bag of ROS 1 (`bag` ends with .bag) or ROS 2 (a folder), or as an
    MCAP file with Foxglove's schemas (.mcap). Returns the number of frames. `rig`: calibration to use for a path instead of
    the recording's own.

    Images are `/<pair>/left/image_raw` and `right`, with `camera_info`; the IMU is `/imu` in `base_link`. Wheels, compass,
    inclinometer, and pan, tilt and stop of a frame are JointState messages. `/tf_static` has the cameras that are fixed to
    the body, `/tf` those on a pan-tilt unit. Frames that are missing, or whose stamps are too far apart, are left out with a
    warning.
    """
    if not isinstance(recording, _core.Recording):
        recording = _core.open_recording(recording, rig=rig)
    elif rig is not None:
        raise Error("usage", "has no effect on an open recording", "rig", "open the recording with it")
    for remark in recording.remarks:
        _LOG.warning("%s: %s", recording.name, remark)
    frames, missing, first_reason = 0, 0, ""
    with open_writer(bag, storage) as out:
        begun = False
        for sample in recording:
            if isinstance(sample, _core.MissingFrame):
                missing, first_reason = missing + 1, first_reason or sample.message
                continue
            if not begun:
                _write_beginning(out, recording, sample.stamp_ns)
                begun = True
            if isinstance(sample, _core.StereoFrame):
                _write_frame(out, recording.rig, sample)
                frames += 1
            else:
                _write_sample(out, sample)
    if missing:
        _LOG.warning("%s: %d frames are left out; the first one: %s", recording.name, missing, first_reason)
    return frames
