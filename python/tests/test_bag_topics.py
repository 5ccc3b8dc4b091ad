"""Bags of other programs: which topics are taken, which calibration they have, and what does not fit it."""

import dataclasses
import io
import logging

import numpy as np
import pytest

import spartan
from conftest import frames_of

bags = pytest.importorskip("spartan.bags")
from bag_files import rewritten, stamp_of  # noqa: E402
from test_bag_errors import command  # noqa: E402
import PIL.Image  # noqa: E402

from spartan.bags._topics import guess_topics  # noqa: E402

UP_IN_BODY = [0, 0, 9.81]


@pytest.fixture(scope="module")
def ours(drive, tmp_path_factory):
    path = tmp_path_factory.mktemp("ours") / "drive.bag"
    bags.export_recording(drive, path)
    return path


@pytest.fixture(scope="module")
def text(drive):
    """The rig.yaml of the images of `ours`."""
    return spartan.open_recording(drive).rig.to_yaml()


def foreign(source, target, change_image=None, extra=None):
    """A copy with the images, as `change_image` returns them, and their camera_info alone. `extra` returns further
    (topic, message) for the stamp of each left image."""
    def change(messages, topic, message):
        if topic.endswith("camera_info"):
            return [(topic, message)]
        if not topic.endswith("image_raw"):
            return []
        found = [(topic, message) if change_image is None else change_image(messages, topic, message)]
        return found + (extra(messages, message.header) if extra and "/left/" in topic else [])

    rewritten(source, target, change)
    return target


def encoded(encoding):
    """The images with the name of another encoding, and with its bytes."""
    def change(messages, topic, message):
        pixels = np.array(message.data).reshape(message.height, -1)
        if "16" in encoding:
            pixels = np.repeat(pixels.astype(np.uint16) << 4, 3 if "rgb" in encoding else 1, axis=1)
        data = pixels.view(np.uint8)
        return topic, dataclasses.replace(message, encoding=encoding, step=data.shape[1], data=data.reshape(-1))

    return change


def samples_of(folder, kind):
    return [sample for sample in spartan.open_recording(folder) if isinstance(sample, kind)]


@pytest.mark.parametrize("encoding", ["bayer_rggb8", "bayer_gbrg16"])
def test_the_bayer_pattern_is_that_of_the_images(ours, text, tmp_path, encoding):
    """Where the calibration has a gray camera, as those of formats that do not state it."""
    (tmp_path / "rig.yaml").write_text(text)
    bag = foreign(ours, tmp_path / "bayer.bag", encoded(encoding))
    counts = bags.import_bag(bag, tmp_path / "recording", rig=tmp_path / "rig.yaml")
    assert counts["frames"] == 14 and counts["rejected"] == 0
    recording = spartan.open_recording(tmp_path / "recording")
    assert {camera.layout for camera in recording.rig.cameras} == {encoding.rstrip("816")}
    assert frames_of(recording)[0].layout == encoding.rstrip("816")
    (tmp_path / "other.yaml").write_text(text.replace("pixel_layout: gray", "pixel_layout: bayer_bggr"))
    with pytest.raises(spartan.Error, match="is bayer_.*, but the layout of camera .* in the rig is bayer_bggr"):
        bags.import_bag(bag, tmp_path / "other", rig=tmp_path / "other.yaml")


def test_no_frame_that_fits_is_an_error(ours, text, tmp_path, caplog):
    (tmp_path / "rig.yaml").write_text(text.replace("size_px: [320, 240]", "size_px: [640, 480]"))
    with caplog.at_level(logging.WARNING, "spartan"), pytest.raises(spartan.Error) as raised:
        bags.import_bag(ours, tmp_path / "recording", rig=tmp_path / "rig.yaml")
    assert raised.value.code == "input" and "is 320x240, but camera" in str(raised.value) and "640x480" in str(raised.value)
    assert len([record for record in caplog.records if "rejected" in record.getMessage()]) == 1  # the first one
    code, said = command("import", ours, "-o", tmp_path / "by_command", "--rig", tmp_path / "rig.yaml")
    assert code == 3 and "no frame fits the calibration" in said


def test_images_that_never_coincide(ours, tmp_path):
    def change(messages, topic, message):
        stamp = stamp_of(message) + 10**8 * ("/right/" in topic)
        return topic, dataclasses.replace(message, header=messages.header(stamp, message.header.frame_id))

    bag = foreign(ours, tmp_path / "shifted.bag", change)
    with pytest.raises(spartan.Error, match="no left and right image have stamps within 0.005 s") as raised:
        bags.import_bag(bag, tmp_path / "recording")
    assert raised.value.code == "input" and "--pair-tolerance" in raised.value.hint


def test_rgb_of_16_bits_is_refused_at_once(ours, text, tmp_path):
    (tmp_path / "rig.yaml").write_text(text)
    bag = foreign(ours, tmp_path / "deep.bag", encoded("rgb16"))
    for rig in (None, tmp_path / "rig.yaml"):
        with pytest.raises(spartan.Error, match="images of encoding 'rgb16' are not read"):
            bags.import_bag(bag, tmp_path / "recording", rig=rig)
        assert not (tmp_path / "recording").exists()


@pytest.mark.parametrize("encoding", ["bgra8", "rgba8", "8UC4"])
def test_images_with_an_alpha_channel(ours, drive, tmp_path, encoding):
    """As the wrappers of ZED publish colour images."""
    def change(messages, topic, message):
        gray = np.array(message.data).reshape(message.height, message.width)
        colour = np.stack([gray, gray // 2, 255 - gray, np.full_like(gray, 7)], axis=2)
        return topic, messages.image(stamp_of(message), "camera", colour, encoding)

    bags.import_bag(foreign(ours, tmp_path / "alpha.bag", change), tmp_path / "recording")
    gray, read = (frames_of(spartan.open_recording(folder))[0].left for folder in (drive, tmp_path / "recording"))
    colour = np.stack([gray, gray // 2, 255 - gray], axis=2)
    assert np.array_equal(read, colour if encoding == "rgba8" else colour[:, :, ::-1])


@pytest.mark.parametrize("format_, codec, layout", [
    ("bayer_rggb8; png compressed ", "png", "bayer_rggb"), ("bayer_grbg8; jpeg compressed ", "jpeg", "bayer_grbg"),
    ("mono8; png compressed ", "png", "gray"), ("png", "png", "gray")])
def test_the_layout_of_compressed_images(ours, tmp_path, format_, codec, layout):
    def change(messages, topic, message):
        file = io.BytesIO()
        PIL.Image.fromarray(np.array(message.data).reshape(message.height, message.width)).save(file, codec)
        return f"{topic}/compressed", messages.make("sensor_msgs/CompressedImage", header=message.header, format=format_,
                                                    data=np.frombuffer(file.getvalue(), np.uint8))

    bags.import_bag(foreign(ours, tmp_path / "small.bag", change), tmp_path / "recording")
    assert frames_of(spartan.open_recording(tmp_path / "recording"))[0].layout == layout


@pytest.mark.parametrize("name", ["drive.bag", "drive.mcap"])
def test_bits_of_high_alignment_go_through_a_bag(text, tmp_path, name):
    deep = text.replace("bits: 8", "bits: 12").replace("bit_alignment: low", "bit_alignment: high")
    writer = spartan.RecordingWriter(tmp_path / "deep", spartan.Rig.from_yaml(deep))
    pair = spartan.Rig.from_yaml(deep).pairs[0].name
    rng = np.random.default_rng(1)
    images = [rng.integers(0, 4096, (240, 320)).astype(np.uint16) << 4 for _ in range(4)]
    for i in (0, 1):
        writer.add(spartan.StereoFrame(images[2 * i], images[2 * i + 1], i * 10**8, pair=pair, bits=12, alignment="high"))
    writer.finish()
    bags.export_recording(tmp_path / "deep", tmp_path / name)
    assert bags.import_bag(tmp_path / name, tmp_path / "again")["frames"] == 2
    for folder in ("deep", "again"):
        recording = spartan.open_recording(tmp_path / folder)
        assert {(camera.bits, camera.alignment) for camera in recording.rig.cameras} == {(12, "high")}
        for i, frame in enumerate(frames_of(recording)):
            assert (frame.bits, frame.alignment) == (12, "high")
            assert np.array_equal(frame.left, images[2 * i]) and np.array_equal(frame.right, images[2 * i + 1])


# --- which images are those of the pair ---

REALSENSE = ["/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw", "/camera/aligned_depth_to_infra1/image_raw",
             "/camera/aligned_depth_to_infra2/image_raw", "/camera/color/image_raw", "/camera/depth/image_rect_raw"]


@pytest.mark.parametrize("topics, left, right", [
    (REALSENSE, "/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw"),
    (["/stereo/left/disparity", "/stereo/left/image_rect", "/stereo/right/image_rect", "/stereo/right/confidence_map"],
     "/stereo/left/image_rect", "/stereo/right/image_rect"),
    (["/back_left/image", "/front_left/image_raw", "/front_right/image_raw"], "/front_left/image_raw", "/front_right/image_raw"),
    (["/left/image_color", "/left/image_mono", "/right/image_mono"], "/left/image_mono", "/right/image_mono"),
    (["/rig/left/image_rect", "/rig/right/image_rect", "/rig/left/image_raw"], "/rig/left/image_rect", "/rig/right/image_rect"),
    (["/a/left/image_raw", "/b/right/image_raw"], "/a/left/image_raw", "/b/right/image_raw")])
def test_the_images_of_a_pair_are_guessed(topics, left, right):
    (pair,) = guess_topics({topic: "sensor_msgs/msg/Image" for topic in topics}).pairs
    assert (pair.left, pair.right) == (left, right)


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_images_of_depth_are_not_guessed(ours, tmp_path, encoding):
    """By their encoding, where their names are those of the images of a camera."""
    def extra(messages, header):
        depth = np.ones((240, 320), np.uint16 if encoding == "16UC1" else np.float32)
        return [(f"/range/{side}/image_raw", dataclasses.replace(messages.image(0, side, depth, encoding), header=header))
                for side in ("left", "right")]

    bag = foreign(ours, tmp_path / "depth.bag", extra=extra)
    assert bags.import_bag(bag, tmp_path / "recording")["frames"] == 14
    assert frames_of(spartan.open_recording(tmp_path / "recording"))[0].left.dtype == np.uint8
    if encoding == "16UC1":  # named ones are read
        (tmp_path / "rig.yaml").write_text(spartan.open_recording(tmp_path / "recording").rig.to_yaml().replace("bits: 8", "bits: 16"))
        named = {side: f"/range/{side}/image_raw" for side in ("left", "right")}
        assert bags.import_bag(bag, tmp_path / "named", rig=tmp_path / "rig.yaml", **named)["frames"] == 14


# --- the IMU ---

# x right, y down, z forward, as the optical frames of a camera, in x forward, y left, z up.
OPTICAL = spartan.Pose.from_quaternion([-0.5, 0.5, -0.5, 0.5], [0, 0, 0])


def in_frame(frame):
    def change(messages, topic, message):
        return topic, dataclasses.replace(message, header=messages.header(stamp_of(message), frame))

    return change


def reading(messages, header, frame, accel, gyro=(0.01, 0, 0)):
    return messages.make("sensor_msgs/Imu", header=messages.header(stamp_of(type("Stamped", (), {"header": header})), frame),
                         orientation=messages.make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
                         orientation_covariance=np.zeros(9), angular_velocity=messages.vector(gyro),
                         angular_velocity_covariance=np.zeros(9), linear_acceleration=messages.vector(accel),
                         linear_acceleration_covariance=np.zeros(9))


def camera_with_imu(topics, tree=(("camera_link", "camera_imu_optical_frame", OPTICAL),)):
    """Messages of IMUs at rest, by topic: frame, and specific force and angular rate in it; and the frames as RealSense has
    them: the root is camera_link."""
    def extra(messages, header):
        frames = [("camera_link", "camera_infra1_optical_frame", OPTICAL), *tree]
        static = messages.transforms([messages.transform(0, *each) for each in frames])
        return [("/tf_static", static), *((topic, reading(messages, header, *imu)) for topic, imu in topics.items())]

    return extra


def imported(ours, tmp_path, topics, tree=(("camera_link", "camera_imu_optical_frame", OPTICAL),), **arguments):
    bag = foreign(ours, tmp_path / "other.bag", in_frame("camera_infra1_optical_frame"), camera_with_imu(topics, tree))
    bags.import_bag(bag, tmp_path / "recording", **arguments)
    return samples_of(tmp_path / "recording", spartan.ImuSample)


IMU_UP = ("camera_imu_optical_frame", (0, -9.81, 0))


def test_an_imu_is_mounted_relative_to_the_left_camera(ours, tmp_path, caplog):
    """There is no base_link; the body is the left camera, turned to x forward, y left, z up."""
    with caplog.at_level(logging.INFO, "spartan"):
        samples = imported(ours, tmp_path, {"/camera/imu": IMU_UP})
    assert len(samples) == 14
    np.testing.assert_allclose(samples[0].accel_m_s2, UP_IN_BODY, atol=1e-9)
    np.testing.assert_allclose(samples[0].gyro_rad_s, [0, -0.01, 0], atol=1e-12)
    assert "the IMU is /camera/imu in the frame 'camera_imu_optical_frame'" in caplog.text
    assert "the body is the left camera" in caplog.text
    rig = spartan.open_recording(tmp_path / "recording").rig
    np.testing.assert_allclose(rig.body_from_camera("left").matrix(), OPTICAL.matrix(), atol=1e-12)


def test_an_imu_on_base_link(ours, tmp_path):
    up = spartan.Pose.from_quaternion([0, 0, 0, 1], [0.1, 0, 0.5])
    tree = (("base_link", "camera_link", up), ("base_footprint", "base_link", up), ("base_footprint", "imu", up @ OPTICAL))
    (sample, *_) = imported(ours, tmp_path, {"/imu/data": ("imu", (0, -9.81, 0))}, tree)
    np.testing.assert_allclose(sample.accel_m_s2, UP_IN_BODY, atol=1e-9)
    rig = spartan.open_recording(tmp_path / "recording").rig
    np.testing.assert_allclose(rig.body_from_camera("left").translation, [0.1, 0, 0.5], atol=1e-12)


@pytest.mark.parametrize("frame", ["imu4", ""])
def test_an_imu_that_is_not_connected_is_left_out(ours, tmp_path, caplog, frame):
    with caplog.at_level(logging.WARNING, "spartan"):
        assert not imported(ours, tmp_path, {"/imu0": (frame, (0, 9.81, 0))})
    assert f"/imu0 is left out: /tf_static does not connect its frame '{frame}'" in caplog.text
    with pytest.raises(spartan.Error, match="the mount of /imu0 is not known") as raised:
        bags.import_bag(tmp_path / "other.bag", tmp_path / "named", imu="/imu0")
    assert raised.value.code == "configuration" and "--rig" in raised.value.hint and not (tmp_path / "named").exists()


def test_the_imu_that_is_connected_is_taken(ours, tmp_path):
    samples = imported(ours, tmp_path, {"/a/imu": ("elsewhere", (1, 2, 3)), "/camera/imu": IMU_UP})
    np.testing.assert_allclose(samples[0].accel_m_s2, UP_IN_BODY, atol=1e-9)


def test_an_imu_beside_a_calibration_of_cameras_alone(ours, text, tmp_path, caplog):
    """Its body is the left camera. /tf_static tells how the IMU is turned against it, or the IMU is left out."""
    (tmp_path / "rig.yaml").write_text(text)
    (sample, *_) = imported(ours, tmp_path, {"/imu0": ("imu4", (1, 2, 3)), "/camera/imu": IMU_UP}, rig=tmp_path / "rig.yaml")
    np.testing.assert_allclose(sample.accel_m_s2, UP_IN_BODY, atol=1e-9)
    np.testing.assert_allclose(sample.gyro_rad_s, [0, -0.01, 0], atol=1e-12)
    with pytest.raises(spartan.Error, match="the mount of /imu0 is not known") as raised:
        bags.import_bag(tmp_path / "other.bag", tmp_path / "named", imu="/imu0", rig=tmp_path / "rig.yaml")
    assert raised.value.code == "configuration" and not (tmp_path / "named").exists()
    without = foreign(ours, tmp_path / "without.bag", extra=lambda messages, header: [("/imu0", reading(messages, header, "imu4", (1, 2, 3)))])
    with caplog.at_level(logging.WARNING, "spartan"):
        bags.import_bag(without, tmp_path / "without", rig=tmp_path / "rig.yaml")
    assert not samples_of(tmp_path / "without", spartan.ImuSample) and "/imu0 is left out: /tf_static does not" in caplog.text
    assert (tmp_path / "without" / "rig.yaml").read_text() == text


def test_an_imu_that_a_calibration_mounts(ours, text, tmp_path):
    """By its body, in whose axes the readings are then, or by a pose; /tf_static has no say."""
    turned = "imu:\n  translation_m: [0, 0, 0]\n  roll_pitch_yaw_deg: [180, 0, 0]\n"
    body = text.replace("pose_convention: left_optical", "pose_convention: body")
    for i, (rig, expected) in enumerate(((body, [1, 2, 3]), (body + turned, [1, -2, -3]), (text + turned, [1, -2, -3]))):
        (tmp_path / f"{i}").mkdir()
        (tmp_path / f"{i}" / "rig.yaml").write_text(rig)
        (sample, *_) = imported(ours, tmp_path / f"{i}", {"/camera/imu": (IMU_UP[0], (1, 2, 3))}, rig=tmp_path / f"{i}" / "rig.yaml")
        np.testing.assert_allclose(sample.accel_m_s2, expected, atol=1e-9)


def test_a_topic_of_one_quantity_is_no_imu(ours, text, tmp_path, caplog):
    split = {"/camera/accel/sample": (*IMU_UP, (0, 0, 0)), "/camera/gyro/sample": (IMU_UP[0], (0, 0, 0))}
    with caplog.at_level(logging.WARNING, "spartan"):
        assert not imported(ours, tmp_path, split)
    assert "/camera/accel/sample is left out: its messages have no angular_velocity" in caplog.text
    assert "/camera/gyro/sample is left out: its messages have no linear_acceleration" in caplog.text
    (tmp_path / "rig.yaml").write_text(text)
    bags.import_bag(tmp_path / "other.bag", tmp_path / "by_rig", rig=tmp_path / "rig.yaml")
    assert not samples_of(tmp_path / "by_rig", spartan.ImuSample)
    with pytest.raises(spartan.Error, match="the messages of /camera/accel/sample have no angular_velocity"):
        bags.import_bag(tmp_path / "other.bag", tmp_path / "named", imu="/camera/accel/sample")


def test_joints_of_other_programs_are_not_sensors(ours, tmp_path):
    def extra(messages, header):
        joints = dict(name=["fl", "fr"], position=np.array([1.0, 2.0]), velocity=np.zeros(0), effort=np.zeros(0))
        return [(topic, messages.make("sensor_msgs/JointState", header=header, **joints))
                for topic in ("/wheels", "/front/wheels/joint_states", "/compass/state", "/inclinometer")]

    bag = foreign(ours, tmp_path / "other.bag", extra=extra)
    assert bags.import_bag(bag, tmp_path / "recording")["samples"] == 0
    with pytest.raises(spartan.Error, match="a message has no joint 'left_m'"):
        bags.import_bag(bag, tmp_path / "named", wheels="/wheels")


# --- arguments ---

def test_a_calibration_with_other_pairs(stops, text, tmp_path):
    """The bag has a narrow and a wide pair."""
    bags.export_recording(stops, tmp_path / "stops.bag")
    (tmp_path / "rig.yaml").write_text(text)
    code, said = command("import", tmp_path / "stops.bag", "-o", tmp_path / "recording", "--rig", tmp_path / "rig.yaml")
    assert code == 4 and "has no pair" in said and "narrow" in said and "its pairs: stereo" in said
    assert not (tmp_path / "recording").exists()


@pytest.mark.parametrize("arguments, words", [
    (("--pair-tolerance", "nan"), "must be 0 to 1 s"), (("--pair-tolerance", "-1"), "must be 0 to 1 s"),
    (("--pair-tolerance", "1.5"), "must be 0 to 1 s"), (("--left", "/stereo/left/image_raw"), "name --left and --right"),
    (("--right", "/stereo/right/image_raw"), "name --left and --right")])
def test_arguments_that_do_not_fit(ours, tmp_path, arguments, words):
    code, said = command("import", ours, "-o", tmp_path / "recording", *arguments)
    assert code == 2 and words in said and not (tmp_path / "recording").exists()


def test_only_rerun_gets_images_of_the_recording(drive, drive_run, tmp_path):
    for source in (drive, drive_run.path):
        code, said = command("export", source, "-o", tmp_path / "out.bag", "--recording", tmp_path / "none")
        assert code == 2 and "only .rrd files" in said and not (tmp_path / "out.bag").exists()
