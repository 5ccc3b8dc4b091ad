"""Images without copies, recordings, and errors."""

import gc
import pickle
import time
import weakref

import numpy as np
import pytest

import spartan
from conftest import address, frames_of


def pair_of_images(dtype=np.uint8, shape=(240, 320)):
    rng = np.random.default_rng(1)
    return rng.integers(0, 255, shape).astype(dtype), rng.integers(0, 255, shape).astype(dtype)


@pytest.mark.parametrize("dtype, shape, layout, bits", [
    (np.uint8, (240, 320), "gray", None), (np.uint16, (240, 320), "gray", 12), (np.uint8, (240, 320, 3), "rgb", None),
    (np.uint16, (240, 320, 3), "rgb", 10), (np.uint8, (240, 320), "bayer_rggb", 8)])
def test_a_frame_has_the_memory_of_the_arrays(dtype, shape, layout, bits):
    left, right = pair_of_images(dtype, shape)
    frame = spartan.StereoFrame(left, right, 5, pair="stereo", layout=layout, bits=bits)
    assert address(frame.left) == address(left) and address(frame.right) == address(right)
    assert np.array_equal(frame.left, left) and frame.left.dtype == dtype
    assert not frame.left.flags.writeable
    assert frame.stamp_ns == frame.right_stamp_ns == 5


def test_the_format_of_a_frame_and_of_a_camera():
    left, right = pair_of_images(np.uint16)
    frame = spartan.StereoFrame(left, right, 0, pair="stereo", layout="bayer_grbg", bits=12, alignment="high")
    camera = spartan.Camera("left", (320, 240), spartan.CameraModel("pinhole", focal_px=[250, 250], centre_px=[160, 120]), layout="bayer_grbg",
                            bits=12, alignment="high")
    for each in (frame, camera):
        assert (each.layout, each.bits, each.alignment) == ("bayer_grbg", 12, "high")
        with pytest.raises(AttributeError):
            each.alignment = "low"
    plain = spartan.StereoFrame(left, right, 0, pair="stereo")
    assert (plain.layout, plain.bits, plain.alignment) == ("gray", 16, "low")
    with pytest.raises(ValueError, match="alignment = 'middle': must be low or high"):
        spartan.StereoFrame(left, right, 0, pair="stereo", alignment="middle")


def test_a_part_of_an_image_is_not_copied():
    left, right = pair_of_images(shape=(300, 400))
    frame = spartan.StereoFrame(left[20:260, 30:350], right[20:260, 30:350], 0, pair="stereo")
    assert address(frame.left) == address(left) + 20 * 400 + 30
    assert np.array_equal(frame.left, left[20:260, 30:350])


def test_a_frame_keeps_its_arrays_and_arrays_keep_their_frame():
    class Array(np.ndarray):
        pass

    left, right = (image.view(Array) for image in pair_of_images())
    expected = np.array(left)
    alive = weakref.ref(left)
    frame = spartan.StereoFrame(left, right, 0, pair="stereo")
    del left, right
    gc.collect()
    view = frame.left
    del frame
    gc.collect()
    assert np.array_equal(view, expected)
    del view
    gc.collect()
    assert alive() is None


@pytest.mark.parametrize("bad, error, text", [
    (np.zeros((240, 320), np.float32), TypeError, "left: must have the dtype uint8, not float32"),
    (np.zeros((240, 320), np.int8), TypeError, "uint8, not int8"),
    (np.zeros((240, 320), bool), TypeError, "not bool"),
    (np.zeros(240, np.uint8), ValueError, r"must have the shape \(height, width\)"),
    (np.zeros((240, 320, 3), np.uint8), ValueError, "shape"),
    (np.zeros((240, 640), np.uint8)[:, ::2], ValueError, "ascontiguousarray"),
    (np.zeros((240, 320), np.uint8)[::-1], ValueError, "ascontiguousarray"),
    (np.zeros((320, 240), np.uint8).T, ValueError, "ascontiguousarray"),
    (np.lib.stride_tricks.as_strided(np.zeros(320, np.uint8), (240, 320), (1, 1)), ValueError, "ascontiguousarray"),
    (np.zeros((1, 40000), np.uint8), ValueError, "at most 32767"),
    (np.zeros((240, 320), ">u2"), (TypeError, ValueError), None),
    (None, TypeError, None), ("image", TypeError, None), ([[1, 2], [3, 4]], TypeError, None),
])
def test_other_arrays_are_refused(bad, error, text):
    with pytest.raises(error, match=text):
        spartan.StereoFrame(bad, np.zeros((240, 320), np.uint8), 0, pair="stereo")
    with pytest.raises(error, match=text and text.replace("left", "right")):
        spartan.StereoFrame(np.zeros((240, 320), np.uint8), bad, 0, pair="stereo")


def test_the_format_of_a_frame_is_checked():
    left, right = pair_of_images()
    with pytest.raises(ValueError, match="layout = 'blue': must be one of gray, rgb"):
        spartan.StereoFrame(left, right, 0, pair="stereo", layout="blue")
    with pytest.raises(ValueError, match="bits = 17"):
        spartan.StereoFrame(left, right, 0, pair="stereo", bits=17)
    with pytest.raises(TypeError, match="uint16"):
        spartan.StereoFrame(left, right, 0, pair="stereo", bits=12)


def test_sensor_samples():
    imu = spartan.ImuSample(7, [1, 2, 3], (4, 5, 6))
    assert imu.stamp_ns == 7 and list(imu.gyro_rad_s) == [1, 2, 3] and list(imu.accel_m_s2) == [4, 5, 6]
    with pytest.raises(ValueError, match="gyro_rad_s"):
        spartan.ImuSample(7, [1, 2], [4, 5, 6])
    assert spartan.WheelSample(1, 2.0, 3.0).right_m == 3
    assert spartan.CompassSample(1, 2.0, 3.0).sigma_rad == 3
    assert spartan.InclinometerSample(1, 2.0, 3.0, 4.0).pitch_rad == 3


def test_a_recording_is_iterated(drive, stops):
    recording = spartan.open_recording(str(drive))
    first = frames_of(recording)
    assert len(first) == len(recording.stamps_ns(recording.rig.pairs[0].name)) and recording.format == "kitti"
    again = frames_of(recording)  # from the start
    assert [f.stamp_ns for f in again] == [f.stamp_ns for f in first]
    assert np.array_equal(first[3].left, recording.frame_at(first[3].pair, first[3].stamp_ns).left)
    kinds = {type(sample).__name__ for sample in spartan.open_recording(str(stops))}
    assert {"StereoFrame", "ImuSample", "WheelSample", "CompassSample", "InclinometerSample"} <= kinds


def test_frames_outlive_their_recording(drive):
    frame = next(iter(spartan.open_recording(str(drive))))
    gc.collect()
    assert frame.left.sum() > 0


def test_an_iterator_outlives_the_name_of_its_recording(drive):
    iterator = iter(spartan.open_recording(str(drive)))
    gc.collect()
    assert sum(1 for _ in iterator) > 0


def test_an_unfinished_recording_has_what_was_synced(drive, tmp_path):
    """By sync(), and by a second that has passed; also if the program ends without finish()."""
    source = spartan.open_recording(drive)
    frames = frames_of(source)
    writer = spartan.RecordingWriter(tmp_path / "recording", source.rig)

    def listed():
        return len(frames_of(spartan.open_recording(tmp_path / "recording")))

    for frame in frames[:2]:
        writer.add(frame)
    writer.sync()
    assert listed() == 2
    writer.add(frames[2])
    time.sleep(1.1)
    writer.add(frames[3])
    assert listed() == 4
    writer.finish()
    assert listed() == 4


@pytest.mark.parametrize("name, values", [
    ("fps", [-1, 1e-300, 10001, float("inf"), float("nan")]), ("bits", [-3, 5, 8, 17]),
    ("pair_tolerance_s", [-1, 1.5, float("inf"), float("nan")])])
def test_how_to_read_a_recording_has_the_bounds_of_the_program(drive, tmp_path, name, values):
    for value in values:
        with pytest.raises(ValueError, match=f"{name} = .*: must be"):
            spartan.open_recording(drive, **{name: value})
        with pytest.raises(ValueError, match=f"{name} = .*: must be"):
            spartan.run(drive, tmp_path / "run", **{name: value})
    assert not (tmp_path / "run").exists()
    spartan.open_recording(drive, fps=0.001, bits=16, pair_tolerance_s=0)


def test_an_error_says_what_to_do():
    with pytest.raises(spartan.Error) as raised:
        spartan.open_recording("/no/such/folder")
    error = raised.value
    assert error.code == "input" and error.where == "/no/such/folder" and error.what == "no such folder" and error.hint
    assert str(error).startswith("/no/such/folder: no such folder (")
    again = pickle.loads(pickle.dumps(error))
    assert (again.code, again.what, again.where, again.hint) == (error.code, error.what, error.where, error.hint)
    with pytest.raises(spartan.Error) as raised:
        spartan.open_recording("/tmp", format="hologram")
    assert raised.value.code == "usage"
