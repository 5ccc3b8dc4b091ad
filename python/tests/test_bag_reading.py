"""Recordings that are read as their bags and runs need it: --left, --fps, --pair-tolerance and the like."""

import dataclasses
import importlib.util
import logging
import shutil
import subprocess
import sys

import numpy as np
import pytest

import spartan
from conftest import frames_of

bags = pytest.importorskip("spartan.bags")
from bag_files import read_bag, rewritten, stamp_of  # noqa: E402
import PIL.Image  # noqa: E402

APART_NS = 12_000_000


def command(*arguments, code=0):
    script = "from spartan.bags._command import main; main()"
    done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], capture_output=True, text=True, timeout=120)
    assert done.returncode == code and "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def webcams(drive, tmp_path_factory):
    """A bag whose last right images come 12 ms late, and its recording."""
    folder = tmp_path_factory.mktemp("webcams")
    bags.export_recording(drive, folder / "ours.bag")
    count = 0

    def change(messages, topic, message):
        nonlocal count
        if topic.endswith("/right/image_raw"):
            count += 1
            if count > 4:
                header = messages.header(stamp_of(message) + APART_NS, message.header.frame_id)
                message = dataclasses.replace(message, header=header)
        return [(topic, message)] if topic.endswith(("image_raw", "camera_info")) else []

    rewritten(folder / "ours.bag", folder / "webcams.bag", change)
    counts = bags.import_bag(folder / "webcams.bag", folder / "recording", pair_tolerance_s=0.02)
    assert counts["frames"] == 14
    return folder


def test_frames_that_are_left_out_are_counted(webcams, tmp_path, caplog):
    with caplog.at_level(logging.WARNING, "spartan"):
        assert bags.export_recording(webcams / "recording", tmp_path / "default.bag") == 4
    assert "10 frames are left out; the first one: " in caplog.text and "differ by 0.012000 s" in caplog.text
    caplog.clear()
    opened = spartan.open_recording(webcams / "recording", pair_tolerance_s=0.02)
    with caplog.at_level(logging.WARNING, "spartan"):
        assert bags.export_recording(opened, tmp_path / "whole.bag") == 14
    assert "left out" not in caplog.text
    with pytest.raises(spartan.Error, match="open recording") as raised:
        bags.export_recording(opened, tmp_path / "other.bag", rig=webcams / "recording/rig.yaml")
    assert raised.value.code == "usage"


def test_the_command_keeps_the_tolerance_of_an_import(webcams, tmp_path):
    text = command("import", webcams / "webcams.bag", "-o", tmp_path / "rec", "--pair-tolerance", "0.02")
    assert f"next: spartan run {tmp_path / 'rec'} -o RUN --pair-tolerance 0.02\n" in text
    assert "14 frames" in command("export", tmp_path / "rec", "-o", tmp_path / "whole.bag", "--pair-tolerance", "0.02")
    text = command("export", tmp_path / "rec", "-o", tmp_path / "default.bag")
    assert "4 frames" in text and "10 frames are left out" in text


@pytest.fixture(scope="module")
def images(drive, tmp_path_factory):
    """Images of both cameras in one folder, without times, and their calibration."""
    folder = tmp_path_factory.mktemp("images")
    recording = spartan.open_recording(drive)
    for i, frame in enumerate(frames_of(recording)[:5]):
        for name, pixels in (("l", frame.left), ("r", frame.right)):
            PIL.Image.fromarray(np.array(pixels)).save(folder / f"{name}{i:03}.png")
    (folder / "rig.yaml").write_text(recording.rig.to_yaml())
    return folder


READING = {"left": "l*.png", "right": "r*.png", "fps": 30.0}
OPTIONS = ("--left", "l*.png", "--right", "r*.png", "--fps", "30")


def test_image_folders_become_bags(images, tmp_path):
    command("export", images, "-o", tmp_path / "images.bag", *OPTIONS)
    stamps = [stamp_of(message) for topic, _, message in read_bag(tmp_path / "images.bag") if topic.endswith("left/image_raw")]
    np.testing.assert_allclose(np.diff(stamps), 1e9 / 30, atol=1)
    text = command("export", images, "-o", tmp_path / "assumed.bag", *OPTIONS[:4])
    assert "0.1 s apart" in text  # what is assumed is said
    (tmp_path / "other").mkdir()
    for file in images.glob("*.png"):
        shutil.copy(file, tmp_path / "other")
    rig = ("--rig", images / "rig.yaml")
    assert "5 frames" in command("export", tmp_path / "other", "-o", tmp_path / "by_rig.bag", *OPTIONS, *rig)


@pytest.mark.skipif(importlib.util.find_spec("rerun") is None, reason="without Rerun")
def test_images_of_a_run_for_rerun(images, tmp_path):
    run = spartan.run(images, tmp_path / "run", **READING)
    bags.export_rerun(run, tmp_path / "run.rrd", recording=spartan.open_recording(images, **READING))
    assert (tmp_path / "run.rrd").exists()
    command("export", tmp_path / "run", "-o", tmp_path / "by_command.rrd", "--recording", images, *OPTIONS)
    assert (tmp_path / "by_command.rrd").exists()


def test_options_that_have_no_effect_or_are_out_of_bounds(images, drive_run, tmp_path):
    text = command("export", drive_run.path, "-o", tmp_path / "run.bag", "--fps", "30", "--pair-tolerance", "0.1", code=2)
    assert "--fps, --pair-tolerance: no recording is read" in text
    for option, value in (("--fps", "-1"), ("--bits", "99"), ("--pair-tolerance", "2"), ("--format", "tum")):
        command("export", images, "-o", tmp_path / "images.bag", *OPTIONS[:4], option, value, code=2)
    assert not list(tmp_path.iterdir())
