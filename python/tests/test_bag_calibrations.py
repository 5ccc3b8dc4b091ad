"""Calibrations in bags: self-masks, and the camera_info of rectified images."""

import dataclasses
import importlib.util
import json
import logging
import re
import shutil

import numpy as np
import pytest

import spartan

bags = pytest.importorskip("spartan.bags")
from bag_files import rewritten  # noqa: E402
from test_bag_topics import OPTICAL, reading  # noqa: E402
import PIL.Image  # noqa: E402


def with_mask(text, name):
    """The rig.yaml of the small recording whose camera `nl` has a self-mask."""
    camera = text.index('  "nl":')
    bits = text.index("    bits: 8\n", camera)
    return f"{text[:bits]}    self_mask: {name}\n{text[bits:]}"


@pytest.fixture(scope="module")
def masked(stops, tmp_path_factory):
    """The recording with stops, whose narrow left camera sees the rover in its lower rows."""
    folder = tmp_path_factory.mktemp("masked") / "rec"
    shutil.copytree(stops, folder)
    (folder / "own masks").mkdir()
    mask = np.full((72, 96), 255, np.uint8)
    mask[50:] = 0
    PIL.Image.fromarray(mask).save(folder / "own masks" / "rover.png")
    (folder / "rig.yaml").write_text(with_mask((folder / "rig.yaml").read_text(), '"own masks/rover.png"'))
    return folder


@pytest.mark.parametrize("name", ["drive.bag", "drive.mcap"])
def test_self_masks_go_through_a_bag(masked, stops_run, tmp_path, name):
    bags.export_recording(masked, tmp_path / name)
    bags.import_bag(tmp_path / name, tmp_path / "recording")
    (mask,) = (tmp_path / "recording" / "masks").iterdir()
    assert mask.read_bytes() == (masked / "own masks" / "rover.png").read_bytes()
    assert f"self_mask: \"masks/{mask.name}\"" in (tmp_path / "recording" / "rig.yaml").read_text()
    options = stops_run.options
    options.set("align_rows=false")
    original, again = (spartan.run(folder, tmp_path / name, options)
                       for folder, name in ((masked, "original"), (tmp_path / "recording", "again")))
    for kind in original.trajectories:
        assert (again.path / f"trajectory_{kind}.tum").read_bytes() == (original.path / f"trajectory_{kind}.tum").read_bytes()
    (stamp,) = again.terrain_stamps_ns
    unmasked, seen = (spartan.read_disparity(run.path / "terrain" / f"{stamp}.pfm") for run in (stops_run, again))
    assert np.isfinite(unmasked[52:]).any() and not np.isfinite(seen[52:]).any()
    bags.export_run(again, tmp_path / "run.bag")  # geometry alone, wherever the masks are
    (again.path / "rig.yaml").write_text(with_mask((masked / "rig.yaml").read_text().replace("self_mask", "#"), "none.png"))
    bags.export_run(again.path, tmp_path / "again.bag")
    if importlib.util.find_spec("rerun"):
        bags.export_rerun(again.path, tmp_path / "again.rrd", recording=tmp_path / "recording")


def test_masks_that_a_bag_has_not_got(masked, tmp_path, caplog):
    """Bags of the versions before named them and did not contain them; names that lead elsewhere are not followed."""
    bags.export_recording(masked, tmp_path / "ours.bag")
    for i, masks in enumerate(({}, {"../outside.png": "AAAA"})):

        def change(messages, topic, message, masks=masks):
            if topic == "/spartan/recording":
                about = json.loads(message.data)
                about |= {"masks": masks, "rig": about["rig"].replace("masks/0.png", next(iter(masks), "masks/0.png"))}
                message = dataclasses.replace(message, data=json.dumps(about))
            return [(topic, message)]

        rewritten(tmp_path / "ours.bag", tmp_path / f"{i}.bag", change)
        with caplog.at_level(logging.WARNING, "spartan"):
            bags.import_bag(tmp_path / f"{i}.bag", tmp_path / f"recording_{i}")
        assert "self-mask" in caplog.text
        assert "self_mask" not in (tmp_path / f"recording_{i}" / "rig.yaml").read_text()
        assert not (tmp_path / "outside.png").exists()
        caplog.clear()


def test_masks_of_a_rig_that_is_named(masked, stops, tmp_path):
    bags.export_recording(stops, tmp_path / "drive.bag")
    bags.import_bag(tmp_path / "drive.bag", tmp_path / "recording", rig=masked / "rig.yaml")
    (mask,) = (tmp_path / "recording" / "masks").iterdir()
    assert mask.read_bytes() == (masked / "own masks" / "rover.png").read_bytes()
    (tmp_path / "rig.yaml").write_text((masked / "rig.yaml").read_text())  # without its masks
    with pytest.raises(spartan.Error, match="rover.png") as raised:
        bags.import_bag(tmp_path / "drive.bag", tmp_path / "other", rig=tmp_path / "rig.yaml")
    assert raised.value.code == "configuration" and not (tmp_path / "other").exists()


def test_the_imu_of_a_bag_of_spartan_is_in_the_body(stops, tmp_path):
    """Also beside a rig that is named, in which the IMU is turned."""
    bags.export_recording(stops, tmp_path / "drive.bag")
    turned = (stops / "rig.yaml").read_text() + "imu:\n  translation_m: [0.2, 0, 0]\n  roll_pitch_yaw_deg: [0, 0, 90]\n"
    (tmp_path / "rig.yaml").write_text(turned)
    bags.import_bag(tmp_path / "drive.bag", tmp_path / "recording", rig=tmp_path / "rig.yaml")
    original, again = ([s.accel_m_s2.tolist() for s in spartan.open_recording(folder) if isinstance(s, spartan.ImuSample)]
                       for folder in (stops, tmp_path / "recording"))
    assert again == original
    assert "translation_m: [0.2, 0, 0]" in (tmp_path / "recording" / "rig.yaml").read_text()


def test_the_imu_of_a_bag_of_spartan_beside_a_calibration_of_cameras_alone(drive, tmp_path):
    """/tf_static has the cameras in base_link, in whose axes the readings are."""
    source = spartan.open_recording(drive)
    body_from_left = spartan.Pose.from_quaternion([0, 0.3, 0, 1], [0.2, 0.06, 0.8]) @ OPTICAL
    writer = spartan.RecordingWriter(tmp_path / "rec", source.rig.mounted(body_from_left))
    for frame in source:
        writer.add(spartan.ImuSample(frame.stamp_ns, [0, 0, 0], [1, 2, 9]))
        writer.add(spartan.StereoFrame(frame.left, frame.right, frame.stamp_ns, frame.right_stamp_ns, pair=frame.pair))
    writer.finish()
    bags.export_recording(tmp_path / "rec", tmp_path / "drive.bag")
    (tmp_path / "rig.yaml").write_text(source.rig.to_yaml())  # its body is the left camera
    bags.import_bag(tmp_path / "drive.bag", tmp_path / "recording", rig=tmp_path / "rig.yaml")
    recording = spartan.open_recording(tmp_path / "recording")
    sample = next(sample for sample in recording if isinstance(sample, spartan.ImuSample))
    np.testing.assert_allclose(sample.accel_m_s2, [1, 2, 9], atol=1e-12)
    mounted = recording.rig.body_from_camera(recording.rig.pairs[0].left)
    np.testing.assert_allclose(mounted.matrix(), body_from_left.matrix(), atol=1e-12)


@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
@pytest.mark.parametrize("named", [False, True])
def test_rectified_images_have_the_projection_matrix(drive, drive_run, tmp_path, model, named):
    """K, D and R of camera_info describe the raw images."""
    bags.export_recording(drive, tmp_path / "ours.bag")
    turn = spartan.Pose.from_quaternion([0.02, 0.01, 0, 1], [0, 0, 0]).rotation

    def change(messages, topic, message):
        if topic.endswith("image_raw"):
            return [(topic.replace("image_raw", "image_rect"), message)]
        if topic.endswith("camera_info"):
            d = np.array([-0.3, 0.1, 0.001, 0.002] + [0.0] * (model == "plumb_bob"))
            raw = np.array([[300.0, 0, 150], [0, 301, 110], [0, 0, 1]])
            message = dataclasses.replace(message, distortion_model=model, D=d, K=raw.reshape(-1), R=turn.reshape(-1))
            return [(topic, message)]
        return [(topic, message)] if topic == "/tf_static" else []

    rewritten(tmp_path / "ours.bag", tmp_path / "other.bag", change)
    topics = {side: f"/stereo/{side}/image_rect" for side in ("left", "right")} if named else {}
    bags.import_bag(tmp_path / "other.bag", tmp_path / "recording", **topics)
    rig = spartan.open_recording(tmp_path / "recording").rig
    for camera in rig.cameras:
        assert camera.model.kind == "pinhole" or not np.any(camera.model.parameters["distortion"])
        np.testing.assert_array_equal(camera.model.parameters["focal_px"], [260, 260])
        np.testing.assert_array_equal(camera.model.parameters["centre_px"], [159.5, 119.5])
    moved = rig.right_from_left(rig.pairs[0].name)
    np.testing.assert_allclose(moved.matrix(), spartan.Pose.from_quaternion([0, 0, 0, 1], [-0.12, 0, 0]).matrix(), atol=1e-12)
    np.testing.assert_allclose(rig.body_from_camera("left").rotation, OPTICAL.rotation @ turn.T, atol=1e-12)  # /tf_static: raw
    run = spartan.run(tmp_path / "recording", tmp_path / "run", max_frames=4)
    assert [frame.motion.inliers for frame in run.frames] == [frame.motion.inliers for frame in drive_run.frames[:4]]


@pytest.mark.parametrize("root", ["base_link", "camera_link"])
@pytest.mark.parametrize("named", [False, True])
def test_mounts_of_rectified_images(drive, tmp_path, root, named):
    """/tf_static has the frame of the raw left camera, whose images R turns."""
    bags.export_recording(drive, tmp_path / "ours.bag")
    turn = spartan.Pose.from_quaternion([0.02, 0.06, 0.01, 1], [0, 0, 0])
    root_from_raw = spartan.Pose.from_quaternion([0, 0.1, 0, 1], [0.3, 0.06, 0.9]) @ OPTICAL
    raw_from_imu = spartan.Pose.from_quaternion([0.1, -0.2, 0.3, 1], [0.02, 0.01, -0.03])

    def change(messages, topic, message):
        if topic.endswith("camera_info"):
            return [(topic, dataclasses.replace(message, R=turn.rotation.reshape(-1)))]
        if not topic.endswith("image_raw"):
            return []
        frames = [(root, message.header.frame_id, root_from_raw), (message.header.frame_id, "imu", raw_from_imu)]
        static = messages.transforms([messages.transform(0, *each) for each in frames])
        extra = [("/tf_static", static), ("/imu/data", reading(messages, message.header, "imu", (1, 2, 9)))]
        return [(topic.replace("image_raw", "image_rect"), message), *(extra if "/left/" in topic else [])]

    rewritten(tmp_path / "ours.bag", tmp_path / "other.bag", change)
    topics = {side: f"/stereo/{side}/image_rect" for side in ("left", "right")} if named else {}
    bags.import_bag(tmp_path / "other.bag", tmp_path / "recording", **topics)
    body_from_left = root_from_raw @ turn.inverse() if root == "base_link" else OPTICAL
    body_from_imu = body_from_left @ turn @ raw_from_imu
    recording = spartan.open_recording(tmp_path / "recording")
    np.testing.assert_allclose(recording.rig.body_from_camera("left").matrix(), body_from_left.matrix(), atol=1e-9)
    sample = next(sample for sample in recording if isinstance(sample, spartan.ImuSample))
    np.testing.assert_allclose(sample.accel_m_s2, body_from_imu.rotation @ [1, 2, 9], atol=1e-9)
    (line,) = re.findall(r"^imu:\n  translation_m: (.*)$", recording.rig.to_yaml(), re.MULTILINE)
    np.testing.assert_allclose(json.loads(line), body_from_imu.translation, atol=1e-9)
