"""MCAP files with Foxglove's schemas and recordings of Rerun, read back by the readers of those projects."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import spartan
from conftest import heights_above

bags = pytest.importorskip("spartan.bags")
mcap_reader = pytest.importorskip("mcap.reader")
decoder = pytest.importorskip("mcap_protobuf.decoder")


@pytest.fixture(scope="module")
def decoded(drive_run, tmp_path_factory):
    """Schema, topic, stamp and message of all messages, decoded by the schemas that the file itself carries."""
    path = tmp_path_factory.mktemp("foxglove") / "run.mcap"
    bags.export_run(drive_run, path)
    with path.open("rb") as file:
        reader = mcap_reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        return [(schema.name, channel.topic, message.log_time, value)
                for schema, channel, message, value in reader.iter_decoded_messages()]


def of(decoded, topic):
    return [(stamp, message) for _, each, stamp, message in decoded if each == topic]


def pose_of(translation, rotation):
    return spartan.Pose.from_quaternion([rotation.x, rotation.y, rotation.z, rotation.w],
                                        [translation.x, translation.y, translation.z])


def test_the_results_of_a_run_have_foxgloves_schemas(drive_run, decoded):
    pair = drive_run.rig.pairs[0].name
    assert {topic: schema for schema, topic, _, _ in decoded} == {
        "/tf_static": "foxglove.FrameTransforms", "/tf": "foxglove.FrameTransforms", "/spartan/odometry": "foxglove.Odometry",
        "/spartan/pose": "foxglove.Odometry", "/spartan/path": "foxglove.PosesInFrame", f"/{pair}/disparity": "foxglove.RawImage",
        "/spartan/terrain": "foxglove.PointCloud", "/spartan/map": "foxglove.Grid", "/spartan/occupancy": "foxglove.Grid"}
    best, covariances = drive_run.trajectory(), drive_run.covariances()
    poses = of(decoded, "/spartan/pose")
    assert [stamp for stamp, _ in poses] == list(best.stamps_ns)
    for (stamp, message), pose, covariance in zip(poses, best, covariances):
        assert message.timestamp.seconds * 10**9 + message.timestamp.nanos == stamp
        assert message.frame_id == "map" and message.body_frame_id == "base_link"
        found = pose_of(message.pose.position, message.pose.orientation)
        np.testing.assert_allclose(found.matrix(), pose.pose.matrix(), atol=1e-12)
        expected = bags.world_covariance(spartan.UncertainPose(pose.pose, covariance))
        np.testing.assert_allclose(np.reshape(message.pose_covariance, (6, 6)), expected, atol=1e-15)
    ((_, path),) = of(decoded, "/spartan/path")
    np.testing.assert_array_equal([[p.position.x, p.position.y, p.position.z] for p in path.poses], best.positions)


def cells(grid, layer):
    """Values and centres (x, y) of the cells, by the rules of foxglove.Grid."""
    kinds = {7: np.float32, 2: np.int8}
    (field,) = (each for each in grid.fields if each.name == layer)
    rows = len(grid.data) // grid.row_stride
    raw = np.frombuffer(grid.data, np.uint8).reshape(rows, grid.column_count, grid.cell_stride)
    kind = np.dtype(kinds[field.type])
    values = raw[:, :, field.offset : field.offset + kind.itemsize].copy().view(kind)[:, :, 0]
    y, x = np.mgrid[: values.shape[0], : values.shape[1]] + 0.5
    return values, grid.pose.position.x + x * grid.cell_size.x, grid.pose.position.y + y * grid.cell_size.y


def test_grids_are_the_map(drive_run, decoded):
    view = drive_run.map().view()
    west, _, _, north = view.extent
    ((_, grid),), ((_, occupancy),) = of(decoded, "/spartan/map"), of(decoded, "/spartan/occupancy")
    for layer, expected in view.layers.items():
        values, x, y = cells(grid, layer)
        column, row = np.floor((x - west) / view.cell_m).astype(int), np.floor((north - y) / view.cell_m).astype(int)
        assert np.array_equal(values, expected[row, column], equal_nan=True), layer
    percent, x, y = cells(occupancy, "occupancy_percent")
    kinds = view["class"][np.floor((north - y) / view.cell_m).astype(int), np.floor((x - west) / view.cell_m).astype(int)]
    assert (percent[kinds == 0] == -1).all() and (percent[kinds == 1] < 50).all() and (percent[kinds >= 2] >= 50).all()


def test_clouds_lie_on_the_map(drive_run, decoded):
    poses = {}
    for stamp, message in of(decoded, "/tf"):
        first, second = message.transforms
        poses[stamp] = pose_of(first.translation, first.rotation) @ pose_of(second.translation, second.rotation)
    world, differences = drive_run.map(), []
    for stamp, cloud in of(decoded, "/spartan/terrain"):
        assert [(each.name, each.offset) for each in cloud.fields] == [
            ("x", 0), ("y", 4), ("z", 8), ("red", 12), ("green", 13), ("blue", 14), ("alpha", 15), ("sigma_m", 16)]
        rows = np.frombuffer(cloud.data, np.uint8).reshape(-1, cloud.point_stride)
        assert (rows[:, 15] == 255).all() and (rows[:, 12] == rows[:, 13]).all() and len(np.unique(rows[:, 12])) > 20
        points = poses[stamp] @ rows[:, :12].copy().view(np.float32).astype(float)
        differences += heights_above(world, points[::7])
    assert len(differences) > 200
    assert abs(np.median(differences)) < 0.01 and np.percentile(np.abs(differences), 90) < 0.05


def test_a_file_that_is_cut_off_or_of_other_schemas(drive, tmp_path):
    bags.export_recording(drive, tmp_path / "whole.mcap")
    whole = (tmp_path / "whole.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "empty.mcap").write_bytes(b"")
    for name in ("cut", "empty"):
        with pytest.raises(spartan.Error) as raised:
            bags.import_bag(tmp_path / f"{name}.mcap", tmp_path / "recording")
        assert raised.value.code == "input" and f"{name}.mcap" in str(raised.value)
    middle = len(whole) // 2
    (tmp_path / "damaged.mcap").write_bytes(whole[:middle] + bytes(1000) + whole[middle + 1000 :])
    with pytest.raises(spartan.Error) as raised:
        bags.import_bag(tmp_path / "damaged.mcap", tmp_path / "recording")
    assert raised.value.code == "input"
    with pytest.raises(spartan.Error, match="exists"):
        bags.export_recording(drive, tmp_path / "whole.mcap")


def test_camera_calibrations_of_others(drive, drive_run, tmp_path):
    """Without the rig that Spartan writes: intrinsics by CameraCalibration, mounts by FrameTransform, images as JPEG."""
    import io

    import PIL.Image
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
    from google.protobuf.timestamp_pb2 import Timestamp
    from mcap_protobuf.writer import Writer

    bags.export_recording(drive, tmp_path / "ours.mcap")
    with (tmp_path / "ours.mcap").open("rb") as source, (tmp_path / "other.mcap").open("wb") as target:
        reader, writer = mcap_reader.make_reader(source, decoder_factories=[decoder.DecoderFactory()]), Writer(target)
        kept = [channel.topic for channel in reader.get_summary().channels.values() if channel.message_encoding == "protobuf"]
        for schema, channel, message, value in reader.iter_decoded_messages(topics=kept):
            if schema.name == "foxglove.RawImage":
                pixels = np.frombuffer(value.data, np.uint8).reshape(value.height, value.step)
                png = io.BytesIO()
                PIL.Image.fromarray(pixels).save(png, "png")
                stamp = Timestamp(seconds=value.timestamp.seconds, nanos=value.timestamp.nanos)
                value = CompressedImage(timestamp=stamp, frame_id=value.frame_id, data=png.getvalue(), format="png")
            writer.write_message(channel.topic, value, log_time=message.log_time, publish_time=message.log_time)
        writer.finish()
    counts = bags.import_bag(tmp_path / "other.mcap", tmp_path / "recording")
    assert counts["frames"] == len(drive_run.frames)
    run = spartan.run(tmp_path / "recording", tmp_path / "run")
    for ours, original in zip(run.frames, drive_run.frames, strict=True):
        assert ours.stamp_ns == original.stamp_ns and ours.motion.inliers == original.motion.inliers


def test_a_recording_of_rerun(drive, drive_run, tmp_path):
    """Read back by Rerun's own tool: it verifies the file, and lists its chunks with their rows and columns."""
    pytest.importorskip("rerun")
    path = tmp_path / "run.rrd"
    bags.export_rerun(drive_run, path, recording=drive)
    tool = Path(sys.executable).parent / "rerun"

    def call(*arguments):
        done = subprocess.run([tool, "rrd", *arguments, path], capture_output=True, text=True, timeout=120,
                              env={**os.environ, "DO_NOT_TRACK": "1"})
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    assert "1 file verified without error" in call("verify")
    rows, columns = {}, {}
    for count, entity, names in re.findall(r"with (\d+) rows .*? - (/\S+) - .*data columns: \[(.*)\]", call("print")):
        rows[entity] = rows.get(entity, 0) + int(count)
        columns.setdefault(entity, set()).update(names.split())
    frames, pair = len(drive_run.frames), drive_run.rig.pairs[0].name
    assert "Mesh3D:triangle_indices" in columns["/map/surface"]
    for kind in drive_run.trajectories:
        assert rows[f"/map/trajectory/{kind}"] == 1
    assert rows["/map/base_link"] == rows["/health/inliers"] == frames
    assert {"Image:buffer", "EncodedImage:blob"} & columns[f"/map/base_link/{pair}_left"]
    assert "Pinhole:image_from_camera" in columns[f"/map/base_link/{pair}_left"]
    assert rows["/map/terrain"] == len(drive_run.terrain_stamps_ns)
    with pytest.raises(spartan.Error, match="exists"):
        bags.export_rerun(drive_run, path)
