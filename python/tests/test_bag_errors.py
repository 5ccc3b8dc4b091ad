"""Bags that are damaged, topics that do not fit, and disks that are full: an Error with its code, and nothing half done."""

import dataclasses
import json
import logging
import random
import resource
import shutil
import sqlite3
import subprocess
import sys

import numpy as np
import pytest

import spartan

bags = pytest.importorskip("spartan.bags")
from bag_files import rewritten  # noqa: E402
from conftest import frames_of  # noqa: E402

KINDS = [("drive.bag", "sqlite3"), ("drive", "sqlite3"), ("drive", "mcap"), ("drive.mcap", "foxglove")]


def file_of(path):
    """The file with the messages of a bag."""
    return path if path.is_file() else next(each for each in path.iterdir() if each.suffix != ".yaml")


def command(*arguments, before=None):
    script = "from spartan.bags._command import main; main()"
    done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], capture_output=True, text=True, timeout=120,
                          preexec_fn=before)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.parametrize("name, storage", KINDS)
def test_damaged_files(stops, tmp_path, name, storage):
    """Damage is found, or does not matter, as that of a pixel where the format has no checksum."""
    bags.export_recording(stops, tmp_path / name, storage=storage)
    file, random_numbers, found = file_of(tmp_path / name), random.Random(1), 0
    whole = file.read_bytes()
    for i in range(20):
        begin = random_numbers.randrange(len(whole))
        count = random_numbers.choice([1, 8, 300, 5000])
        part = bytes(byte ^ 0xA5 for byte in whole[begin : begin + count])
        file.write_bytes(whole[:begin] + part + whole[begin + count :])
        try:
            bags.import_bag(tmp_path / name, tmp_path / f"recording_{i}")
        except spartan.Error as error:
            assert error.code in ("input", "configuration"), error
            found += 1
        shutil.rmtree(tmp_path / f"recording_{i}", ignore_errors=True)
    assert found > 3


def test_the_command_names_a_damaged_file(stops, tmp_path):
    """Its beginning and its index are whole, so that only reading finds the damage."""
    bags.export_recording(stops, tmp_path / "drive.bag")
    whole = (tmp_path / "drive.bag").read_bytes()
    third = len(whole) // 3
    (tmp_path / "drive.bag").write_bytes(whole[:third] + bytes(third) + whole[2 * third :])
    code, text = command("import", tmp_path / "drive.bag", "-o", tmp_path / "recording")
    assert code == 3 and f"{tmp_path / 'drive.bag'}: cannot be read" in text and "damaged" in text


def test_a_folder_without_metadata(tmp_path):
    (tmp_path / "drive").mkdir()
    with pytest.raises(spartan.Error, match="is not a bag") as raised:
        bags.import_bag(tmp_path / "drive", tmp_path / "recording")
    assert raised.value.code == "input"


@pytest.mark.parametrize("data", [b"", b"\xff\xd8\xff\xe0 no JPEG", b"cut"])
def test_compressed_images_that_cannot_be_decoded(drive, tmp_path, data):
    import io

    import PIL.Image

    bags.export_recording(drive, tmp_path / "ours.bag")
    file, count = io.BytesIO(), 0
    PIL.Image.fromarray(np.zeros((240, 320), np.uint8)).save(file, "jpeg")

    def change(messages, topic, message):
        nonlocal count
        if not topic.endswith("image_raw"):
            return [(topic, message)] if topic.endswith("camera_info") else []
        count += 1
        content = file.getvalue() if count < 5 else file.getvalue()[:-200] if data == b"cut" else data
        return [(f"{topic}/compressed", messages.make("sensor_msgs/CompressedImage", header=message.header, format="jpeg",
                                                       data=np.frombuffer(content, np.uint8)))]

    rewritten(tmp_path / "ours.bag", tmp_path / "other.bag", change)
    with pytest.raises(spartan.Error, match="/image_raw/compressed: the image of stamp .* cannot be decoded") as raised:
        bags.import_bag(tmp_path / "other.bag", tmp_path / "recording")
    assert raised.value.code == "input" and raised.value.hint
    assert len(frames_of(spartan.open_recording(tmp_path / "recording"))) == 2  # what was imported before


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_topics_without_messages(tmp_path, storage):
    """They are not guessed, and cannot be named."""
    for target in ("drive.bag", "drive"):
        with bags.BagWriter(tmp_path / target, storage) as out:
            for side in ("left", "right"):  # before the others by name
                topic = f"/a/{side}/image_raw"
                out._connections[topic] = out._connect(topic, "sensor_msgs/msg/Image", False)
                image = out.messages.image(1, side, np.zeros((240, 320), np.uint8), "mono8")
                out.write(f"/b/{side}/image_raw", 1, image)
        with pytest.raises(spartan.Error, match="has no /b/left/camera_info"):
            bags.import_bag(tmp_path / target, tmp_path / "recording")
        with pytest.raises(spartan.Error, match="has no messages of the topic /a/left/image_raw, /a/right/image_raw") as raised:
            bags.import_bag(tmp_path / target, tmp_path / "recording", left="/a/left/image_raw", right="/a/right/image_raw")
        assert raised.value.code == "input" and "/b/left/image_raw" in raised.value.hint


def test_topics_of_other_types(stops, tmp_path):
    bags.export_recording(stops, tmp_path / "drive.bag")
    for topics in ({"left": "/imu", "right": "/imu"}, {"imu": "/wheels"}, {"wheels": "/imu"}):
        with pytest.raises(spartan.Error, match="is of sensor_msgs/msg/.*, not of") as raised:
            bags.import_bag(tmp_path / "drive.bag", tmp_path / "recording", **topics)
        assert raised.value.code == "input"


def test_a_description_that_is_damaged(stops, tmp_path):
    bags.export_recording(stops, tmp_path / "ours.bag")
    noise = json.dumps({kind: "" for kind in ("imu", "compass", "inclinometer")})
    for i, text in enumerate(("", "[]", "{}", '{"noise": 1}', '{"rig', f'{{"noise": {noise}, "rig": "cameras: 1"}}')):

        def change(messages, topic, message, text=text):
            return [(topic, dataclasses.replace(message, data=text) if topic == "/spartan/recording" else message)]

        rewritten(tmp_path / "ours.bag", tmp_path / f"{i}.bag", change)
        with pytest.raises(spartan.Error, match="/spartan/recording cannot be read") as raised:
            bags.import_bag(tmp_path / f"{i}.bag", tmp_path / "recording")
        assert raised.value.code == "input"


@pytest.mark.parametrize("name, storage", KINDS)
@pytest.mark.parametrize("limit", [2000, 200_000])
def test_a_full_disk(stops, stops_run, tmp_path, name, storage, limit):
    """As a limit of the size of files, at which writing fails as on a full disk."""
    def before():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    option = () if storage == "foxglove" else ("--storage", storage)
    for source in (stops, stops_run.path):
        code, text = command("export", source, "-o", tmp_path / name, *option, before=before)
        assert code == 5 and f"{tmp_path / name}: cannot be written" in text
        assert not list(tmp_path.iterdir())
        assert command("export", source, "-o", tmp_path / name, *option)[0] == 0
        (shutil.rmtree if (tmp_path / name).is_dir() else (lambda path: path.unlink()))(tmp_path / name)


def test_a_full_disk_below_a_recording(stops, tmp_path):
    bags.export_recording(stops, tmp_path / "drive.bag")

    def before():
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

    assert command("import", tmp_path / "drive.bag", "-o", tmp_path / "recording", before=before)[0] == 5


@pytest.mark.parametrize("name, storage", KINDS)
def test_an_error_leaves_no_bag(stops_run, tmp_path, name, storage):
    run = tmp_path / "run"
    shutil.copytree(stops_run.path, run)
    (cloud,) = (run / "terrain").glob("*.ply")
    whole = cloud.read_bytes()
    cloud.write_bytes(whole[:100])
    with pytest.raises(spartan.Error):
        bags.export_run(run, tmp_path / name, storage=storage)
    assert list(tmp_path.iterdir()) == [run]
    cloud.write_bytes(whole)
    bags.export_run(run, tmp_path / name, storage=storage)
    assert (tmp_path / name).exists()
    with pytest.raises(spartan.Error, match="exists"):
        bags.export_run(run, tmp_path / name, storage=storage)


def test_a_bag_where_there_is_no_folder(stops, tmp_path):
    for name in ("none/drive.bag", "none/drive.mcap", "file/drive"):
        (tmp_path / "file").write_text("")
        with pytest.raises(spartan.Error, match="cannot be written") as raised:
            bags.export_recording(stops, tmp_path / name)
        assert raised.value.code == "output"


@pytest.mark.parametrize("name", ["run.bag", "run", "run.mcap", "run.rrd"])
def test_a_map_that_is_too_large_for_a_message(stops_run, tmp_path, caplog, name):
    """A tile far away, as after a long drive."""
    run = tmp_path / "long_run"
    shutil.copytree(stops_run.path, run)
    with sqlite3.connect(run / "run.sqlite") as store:
        store.execute("INSERT INTO map_tiles SELECT submap, ix + 20000, iy + 20000, revision, checksum, cells FROM map_tiles "
                      "WHERE (submap, ix, iy, revision) IN (SELECT submap, ix, iy, max(revision) FROM map_tiles)")
    store.close()
    with caplog.at_level(logging.WARNING, "spartan"):
        if name.endswith(".rrd"):
            pytest.importorskip("rerun")
            bags.export_rerun(run, tmp_path / name)
        else:
            bags.export_run(run, tmp_path / name)
    assert "the map is left out" in caplog.text and (tmp_path / name).exists()
