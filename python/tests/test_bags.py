"""Bags: recordings out and in, results out, read back by rosbags."""

import filecmp
import shutil
import subprocess
import sys

import numpy as np
import pytest

import spartan
from conftest import heights_above

bags = pytest.importorskip("spartan.bags")
from bag_files import pose_of, read_bag, rewritten, stamp_of  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

from spartan.bags import _import  # noqa: E402

KINDS = [("drive.bag", "sqlite3"), ("drive", "sqlite3"), ("drive", "mcap")]
IN_AND_OUT = [*KINDS, ("drive.mcap", "foxglove")]
TRAJECTORIES = [f"trajectory_{kind}.tum" for kind in ("odometry", "slam", "localization", "smoothed")]


@pytest.fixture(scope="session")
def turned(stops, stops_run, tmp_path_factory):
    """The recording with stops and its run, with an IMU that is turned against the body."""
    folder = tmp_path_factory.mktemp("turned")
    shutil.copytree(stops, folder / "rec")
    with (folder / "rec" / "rig.yaml").open("a") as rig:
        rig.write("imu:\n  translation_m: [0.2, 0.1, 0.3]\n  roll_pitch_yaw_deg: [0, 0, 90]\n")
    spartan.run(folder / "rec", folder / "whole", stops_run.options)
    return folder / "rec", folder / "whole"


def readings(sample):
    """All numbers of a sample of a sensor."""
    names = ("gyro_rad_s", "accel_m_s2", "left_m", "right_m", "heading_rad", "roll_rad", "pitch_rad", "sigma_rad")
    return [np.asarray(getattr(sample, name)).tolist() for name in names if hasattr(sample, name)]


@pytest.mark.parametrize("name, storage", IN_AND_OUT)
@pytest.mark.parametrize("which", ["drive", "stops", "turned"])
def test_a_recording_goes_through_a_bag(small_runs, drive, stops, turned, tmp_path, which, name, storage):
    folder, finished = {"drive": (drive, small_runs / "drive_run"), "stops": (stops, small_runs / "stops/whole"),
                        "turned": turned}[which]
    written = bags.export_recording(folder, tmp_path / name, storage=storage)
    counts = bags.import_bag(tmp_path / name, tmp_path / "recording")
    assert counts["frames"] == written and counts["unpaired"] == counts["rejected"] == 0
    original = [s for s in spartan.open_recording(folder)]
    again = [s for s in spartan.open_recording(tmp_path / "recording")]
    assert [(type(s), s.stamp_ns) for s in again] == [(type(s), s.stamp_ns) for s in original]
    for a, b in zip(again, original):
        if isinstance(a, spartan.StereoFrame):
            assert np.array_equal(a.left, b.left) and np.array_equal(a.right, b.right)
            assert (a.pair, a.position_id, a.pan_rad, a.right_stamp_ns) == (b.pair, b.position_id, b.pan_rad, b.right_stamp_ns)
        else:
            assert readings(a) == readings(b)
    options = spartan.Run(finished).options
    run = spartan.run(tmp_path / "recording", tmp_path / "run", None if which == "drive" else options)
    assert all(filecmp.cmp(run.path / t, finished / t, shallow=False) for t in TRAJECTORIES)


def test_the_calibration_is_found_in_camera_info_and_tf(drive, drive_run, tmp_path):
    """A bag without what Spartan alone writes, with other names: the trajectory is that of the folder, in the body that
    /tf_static defines."""
    bags.export_recording(drive, tmp_path / "ours.bag")
    names = {"left": "/cam0/image_raw", "right": "/cam1/image_raw"}

    def change(messages, topic, message):
        for side, name in names.items():
            if topic.endswith(f"/{side}/image_raw"):
                return [(name, message)]
            if topic.endswith(f"/{side}/camera_info"):
                return [(name.replace("image_raw", "camera_info"), message)]
        return [(topic, message)] if topic == "/tf_static" else []

    rewritten(tmp_path / "ours.bag", tmp_path / "other.bag", change)
    counts = bags.import_bag(tmp_path / "other.bag", tmp_path / "recording")
    assert counts["frames"] == len(drive_run.frames)
    recording = spartan.open_recording(tmp_path / "recording")
    assert recording.rig.baseline_m(recording.rig.pairs[0].name) == pytest.approx(0.12, abs=1e-12)
    run = spartan.run(tmp_path / "recording", tmp_path / "run")
    assert len(run.frames) == len(drive_run.frames)
    for ours, original in zip(run.frames, drive_run.frames):  # with a body the world is not aligned with the ground
        assert ours.stamp_ns == original.stamp_ns
        np.testing.assert_allclose(ours.motion.previous_from_current.matrix(),
                                   original.motion.previous_from_current.matrix(), atol=1e-9)


@pytest.mark.parametrize("compressed", [True, False])
def test_compressed_and_coloured_images(drive, tmp_path, compressed):
    import io

    import PIL.Image

    bags.export_recording(drive, tmp_path / "ours.bag")

    def change(messages, topic, message):
        if not topic.endswith("image_raw"):
            return [(topic, message)] if topic.endswith("camera_info") else []
        pixels = np.array(message.data).reshape(message.height, message.width)
        if not compressed:
            colour = np.stack([pixels // 2, pixels, 255 - pixels], axis=2)  # as bgr8
            return [(topic, messages.image(stamp_of(message), "camera", colour, "bgr8"))]
        file = io.BytesIO()
        PIL.Image.fromarray(pixels).save(file, "png")
        data = np.frombuffer(file.getvalue(), np.uint8)
        return [(topic + "/compressed", messages.make("sensor_msgs/CompressedImage", header=message.header, format="png", data=data))]

    rewritten(tmp_path / "ours.bag", tmp_path / "other.bag", change)
    bags.import_bag(tmp_path / "other.bag", tmp_path / "recording")
    first, original = (next(iter(spartan.open_recording(folder))) for folder in (tmp_path / "recording", drive))
    left = original.left if compressed else np.stack([255 - original.left, original.left, original.left // 2], axis=2)
    assert np.array_equal(first.left, left)


def test_wheels_of_planar_odometry():
    rig = type("Rig", (), {"track_m": 0.6})()
    importer = _import._Importer(None, rig, _import.Topics([]), 0)
    point = lambda x, y, yaw: type("Pose", (), {
        "position": type("P", (), {"x": x, "y": y})(),
        "orientation": type("Q", (), {"x": 0.0, "y": 0.0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)})()})()
    assert importer.rolled(point(1, 2, 3)) == (0, 0)
    radius, turn = 2.0, 0.01
    for i in range(1, 101):  # a circle to the left: the sides roll (R -+ track / 2) angle
        yaw = 3 + i * turn
        x = 1 + radius * (np.sin(yaw) - np.sin(3))
        y = 2 - radius * (np.cos(yaw) - np.cos(3))
        left, right = importer.rolled(point(x, y, yaw))
    assert left == pytest.approx(1.7, rel=1e-4) and right == pytest.approx(2.3, rel=1e-4)


@pytest.mark.parametrize("name, storage", KINDS)
def test_the_results_of_a_run_are_messages_of_ros(drive_run, tmp_path, name, storage):
    bags.export_run(drive_run, tmp_path / name, storage=storage)
    messages = read_bag(tmp_path / name)
    types = {topic: kind for topic, kind, _ in messages}
    pair = drive_run.rig.pairs[0].name
    assert types == {
        "/tf_static": "tf2_msgs/msg/TFMessage", "/tf": "tf2_msgs/msg/TFMessage", "/spartan/odometry": "nav_msgs/msg/Odometry",
        "/spartan/pose": "geometry_msgs/msg/PoseWithCovarianceStamped", "/spartan/path": "nav_msgs/msg/Path",
        f"/{pair}/disparity": "stereo_msgs/msg/DisparityImage", "/spartan/terrain": "sensor_msgs/msg/PointCloud2",
        "/spartan/map": "grid_map_msgs/msg/GridMap", "/spartan/occupancy": "nav_msgs/msg/OccupancyGrid"}
    of = lambda topic: [message for each, _, message in messages if each == topic]
    best = drive_run.trajectory()
    path = of("/spartan/path")[0]
    assert [stamp_of(p) for p in path.poses] == list(best.stamps_ns)
    np.testing.assert_array_equal([[p.pose.position.x, p.pose.position.y, p.pose.position.z] for p in path.poses], best.positions)
    # The product of /tf is the pose.
    for message, pose in zip(of("/tf"), best):
        first, second = message.transforms
        assert (first.header.frame_id, first.child_frame_id, second.child_frame_id) == ("map", "odom", "base_link")
        product = pose_of(first.transform) @ pose_of(second.transform)
        np.testing.assert_allclose(product.matrix(), pose.pose.matrix(), atol=1e-12)
    # Occupancy and GridMap are one map: grid_map's (0, 0) has the largest x and y.
    view, grid, occupancy = drive_run.map().view(), of("/spartan/map")[0], of("/spartan/occupancy")[0]
    elevation = grid.data[grid.layers.index("elevation_m")]
    columns, rows = (d.size for d in elevation.layout.dim)
    assert [d.label for d in elevation.layout.dim] == ["column_index", "row_index"]
    cells = np.array(elevation.data).reshape(columns, rows).T  # column-major
    i, j = np.nonzero(np.isfinite(cells))
    x = grid.info.pose.position.x + grid.info.length_x / 2 - (i + 0.5) * grid.info.resolution
    y = grid.info.pose.position.y + grid.info.length_y / 2 - (j + 0.5) * grid.info.resolution
    west, _, _, north = view.extent
    column, row = np.floor((x - west) / view.cell_m).astype(int), np.floor((north - y) / view.cell_m).astype(int)
    np.testing.assert_array_equal(cells[i, j], view["elevation_m"][row, column])
    assert len(i) == np.isfinite(view["elevation_m"]).sum() > 100
    percent = np.array(occupancy.data).reshape(occupancy.info.height, occupancy.info.width)
    column = np.floor((x - occupancy.info.origin.position.x) / occupancy.info.resolution).astype(int)
    row = np.floor((y - occupancy.info.origin.position.y) / occupancy.info.resolution).astype(int)
    kinds = np.array(grid.data[grid.layers.index("class")].data).reshape(columns, rows).T[i, j]
    seen = percent[row, column]
    assert (seen[kinds == 0] == -1).all() and (seen[kinds == 1] < 50).all() and (seen[kinds >= 2] >= 50).all()


def test_point_clouds_lie_on_the_map(drive_run, tmp_path):
    bags.export_run(drive_run, tmp_path / "run.bag")
    messages = read_bag(tmp_path / "run.bag")
    poses = {stamp_of(m.transforms[0]): pose_of(m.transforms[0].transform) @ pose_of(m.transforms[1].transform)
             for topic, _, m in messages if topic == "/tf"}
    world, differences = drive_run.map(), []
    for topic, _, cloud in messages:
        if topic != "/spartan/terrain":
            continue
        kinds = {f.name: (f.offset, f.datatype) for f in cloud.fields}
        assert kinds == {"x": (0, 7), "y": (4, 7), "z": (8, 7), "rgb": (12, 7), "sigma_m": (16, 7)}
        values = np.array(cloud.data).view(np.float32).reshape(-1, cloud.point_step // 4)
        assert cloud.header.frame_id == "base_link" and len(values) == cloud.width
        points = poses[stamp_of(cloud)] @ values[::7, :3].astype(np.float64)
        differences += heights_above(world, points)
    assert len(differences) > 200
    assert abs(np.median(differences)) < 0.01 and np.percentile(np.abs(differences), 90) < 0.05


def test_disparity_images_are_those_of_the_run(drive_run, tmp_path):
    bags.export_run(drive_run, tmp_path / "run.bag")
    pair = drive_run.rig.pairs[0]
    images = [m for topic, _, m in read_bag(tmp_path / "run.bag") if topic == f"/{pair.name}/disparity"]
    assert images
    for image in images:
        values = np.array(image.image.data).view(np.float32).reshape(image.image.height, image.image.width)
        expected = spartan.read_disparity(drive_run.path / "terrain" / f"{stamp_of(image)}.pfm")
        assert np.array_equal(np.where(values < image.min_disparity, np.nan, values), expected, equal_nan=True)
        assert image.T == pytest.approx(0.12) and image.f == pytest.approx(260)


def test_covariances_are_turned_to_the_axes_of_the_parent():
    """Of an error of 1 m along the body's x axis while the body looks along y of the world."""
    turned = spartan.UncertainPose(spartan.Pose.from_quaternion([0, 0, np.sqrt(0.5), np.sqrt(0.5)], [5, 6, 7]),
                                   np.diag([1.0, 0, 0, 0, 0.25, 0]))
    expected = np.diag([0, 1.0, 0, 0.25, 0, 0])
    np.testing.assert_allclose(bags.world_covariance(turned), expected, atol=1e-12)
    # Numerically: errors of the right perturbation, seen in the world.
    rng = np.random.default_rng(1)
    root = 1e-3 * rng.normal(size=(6, 6))
    pose = spartan.UncertainPose(spartan.Pose.from_quaternion(rng.normal(size=4), [1, 2, 3]), root @ root.T)
    errors = []
    for error in rng.normal(size=(20000, 6)) @ root.T:
        moved = pose.pose @ spartan.Pose.exp(error)
        turn = spartan.Pose(np.block([[moved.rotation @ pose.pose.rotation.T, np.zeros((3, 1))], [np.zeros(3), 1]]))
        errors.append([*(moved.translation - pose.pose.translation), *turn.log()[3:]])
    expected = bags.world_covariance(pose)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert (np.abs(np.cov(np.array(errors).T) - expected) < 0.05 * scale).all()


@pytest.mark.parametrize("content", [b"", b"#ROSBAG V2.0\n", b"\x89PNG\r\n" * 100])
def test_what_is_no_bag(tmp_path, content):
    (tmp_path / "bad.bag").write_bytes(content)
    with pytest.raises(spartan.Error) as raised:
        bags.import_bag(tmp_path / "bad.bag", tmp_path / "recording")
    assert raised.value.code == "input" and not (tmp_path / "recording").exists()
    with pytest.raises(spartan.Error, match="no such bag"):
        bags.import_bag(tmp_path / "none.bag", tmp_path / "recording")


def test_a_bag_that_ends_in_the_middle(drive, tmp_path):
    bags.export_recording(drive, tmp_path / "whole.bag")
    whole = (tmp_path / "whole.bag").read_bytes()
    for share in (0.3, 0.9):
        (tmp_path / f"{share}.bag").write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(spartan.Error):
            bags.import_bag(tmp_path / f"{share}.bag", tmp_path / f"recording_{share}")


def test_the_command(drive, drive_run, tmp_path):
    def call(*arguments, code=0):
        script = "import sys; from spartan.bags._command import main; main()"
        done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stdout + done.stderr

    assert "14 frames" in call("export", drive, "-o", tmp_path / "drive.bag")
    assert "next: spartan run" in call("import", tmp_path / "drive.bag", "-o", tmp_path / "recording")
    call("export", drive_run.path, "-o", tmp_path / "run.bag")
    assert "exists" in call("export", drive, "-o", tmp_path / "drive.bag", code=5)
    assert "no such bag" in call("import", tmp_path / "none.bag", "-o", tmp_path / "other", code=3)
    text = call("import", tmp_path / "run.bag", "-o", tmp_path / "other", code=3)
    assert "no images of a left and a right camera" in text and "/spartan/odometry" in text
    text = call("import", tmp_path / "drive.bag", "-o", tmp_path / "other", "--left", "/a", "--right", "/b", code=3)
    assert "has no topic /a, /b" in text


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_latched_topics_of_ros_2_reach_late_subscribers(drive, drive_run, tmp_path, storage):
    """Their publishers offer what tf2 asks for of /tf_static; those of other topics have the default settings."""
    bags.export_recording(drive, tmp_path / "recording", storage=storage)
    bags.export_run(drive_run, tmp_path / "run", storage=storage)
    latched = {"/tf_static", "/spartan/recording", "/spartan/path", "/spartan/map", "/spartan/occupancy"}
    found = set()
    for name in ("recording", "run"):
        with AnyReader([tmp_path / name]) as reader:
            for connection in reader.connections:
                offered = [(q.history.name, q.depth, q.reliability.name, q.durability.name)
                           for q in connection.ext.offered_qos_profiles]
                expected = [("KEEP_LAST", 1, "RELIABLE", "TRANSIENT_LOCAL")] if connection.topic in latched else []
                assert offered == expected, connection.topic
                found.add(connection.topic)
        (file,) = set((tmp_path / name).iterdir()) - {tmp_path / name / "metadata.yaml"}
        assert b"durability: transient_local" in file.read_bytes()
    assert latched < found and "/tf" in found


def test_mcap_has_the_types_and_stamps(drive_run, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    bags.export_run(drive_run, tmp_path / "run", storage="mcap")
    (file,) = (tmp_path / "run").glob("*.mcap")
    expected = {topic: kind for topic, kind, _ in read_bag(tmp_path / "run")}
    found, stamps = {}, []
    with file.open("rb") as stream:
        for schema, channel, message in reader.make_reader(stream).iter_messages():
            assert schema.encoding == "ros2msg" and channel.message_encoding == "cdr" and schema.data
            found[channel.topic] = schema.name
            if channel.topic == "/spartan/pose":
                stamps.append(message.log_time)
    assert found == expected
    assert stamps == list(drive_run.trajectory().stamps_ns)
