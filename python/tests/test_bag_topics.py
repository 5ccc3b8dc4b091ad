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
