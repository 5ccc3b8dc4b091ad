"""Frames of the results of a run: all of them are connected, and what is in them lies where it belongs."""

import shutil
import sqlite3

import numpy as np
import pytest

import spartan
from conftest import heights_above

bags = pytest.importorskip("spartan.bags")
from bag_files import pose_of, read_bag, stamp_of  # noqa: E402


@pytest.fixture(scope="module")
def panned(drive, tmp_path_factory):
    """The run of the drive with its pair on a pan-tilt unit that looks aside."""
    folder = tmp_path_factory.mktemp("panned")
    text = spartan.open_recording(drive).rig.to_yaml().replace('mount: "body"', 'mount: "mast"')
    text = text.replace("pose_convention: left_optical", "pose_convention: body")
    unit = ("pan_tilt_units:\n  mast:\n    translation_m: [0.1, 0, 0.3]\n    quaternion_xyzw: [0, 0, 0, 1]\n"
            "    rest_angles_rad: [0, 0]\n")
    writer = spartan.RecordingWriter(folder / "rec", spartan.Rig.from_yaml(text.replace("cameras:", unit + "cameras:", 1)))
    for frame in spartan.open_recording(drive):
        writer.add(spartan.StereoFrame(frame.left, frame.right, frame.stamp_ns, frame.right_stamp_ns, pair=frame.pair,
                                       frame_id=frame.frame_id, pan_rad=0.3, tilt_rad=0.1))
    writer.finish()
    return spartan.run(folder / "rec", folder / "run")


def frames_in(message):
    """The frames that a message, or a part of it, refers to."""
    if hasattr(message, "header"):
        yield message.header.frame_id
    for name in getattr(message, "__dataclass_fields__", {}):
        part = getattr(message, name)
        for each in part if isinstance(part, list) else [part]:
            yield from frames_in(each)


def tree_at(messages, stamp):
    """Parent and parent_from_child of each frame, by /tf_static and the messages of /tf of this stamp."""
    return {each.child_frame_id: (each.header.frame_id, pose_of(each.transform))
            for topic, _, message in messages if topic in ("/tf", "/tf_static")
            for each in message.transforms if topic == "/tf_static" or stamp_of(each) == stamp}


def map_from(tree, frame):
    pose = spartan.Pose()
    while frame != "map":
        assert frame in tree, f"{frame} is not connected with map"
        frame, parent_from_child = tree[frame]
        pose = parent_from_child @ pose
    return pose


def points_of(cloud):
    return np.array(cloud.data).view(np.float32).reshape(-1, cloud.point_step // 4)[:, :3].astype(np.float64)


@pytest.mark.parametrize("which", ["drive_run", "stops_run", "panned"])
def test_every_frame_is_connected_with_the_map(request, tmp_path, which):
    run = request.getfixturevalue(which)
    bags.export_run(run, tmp_path / "run.bag")
    messages = read_bag(tmp_path / "run.bag")
    for topic, _, message in messages:
        if topic not in ("/tf", "/tf_static"):
            stamps = [stamp_of(message)] if hasattr(message, "header") else []  # a GridMap of ROS 1 has none
            for frame in {frame for frame in frames_in(message) if frame}:
                map_from(tree_at(messages, stamps[0] if stamps else run.frames[-1].stamp_ns), frame)
    assert {frame for _, _, message in messages for frame in frames_in(message)} >= {"map", "odom", "base_link"}


@pytest.mark.parametrize("which", ["drive_run", "stops_run", "panned"])
def test_disparities_lie_on_the_point_clouds(request, tmp_path, which):
    """Points of a DisparityImage in its frame are those of the cloud of the same view in base_link."""
    run = request.getfixturevalue(which)
    bags.export_run(run, tmp_path / "run.bag")
    messages = read_bag(tmp_path / "run.bag")
    clouds = {stamp_of(message): message for topic, _, message in messages if topic == "/spartan/terrain"}
    images = [message for topic, _, message in messages if topic.endswith("/disparity")]
    assert len(images) == len(clouds) == len(run.terrain_stamps_ns) > 0
    imager = spartan.Imager(run.rig, run.options.imaging)
    for image in images:
        values = np.array(image.image.data).view(np.float32).reshape(image.image.height, image.image.width)
        v, u = np.nonzero(values > max(image.min_disparity, 0))
        in_left = imager.geometry(run.frames[0].pair).triangulate(np.stack([u, v, values[v, u]], axis=-1))
        tree, cloud = tree_at(messages, stamp_of(image)), clouds[stamp_of(image)]
        points = map_from(tree, image.header.frame_id) @ in_left
        expected = map_from(tree, cloud.header.frame_id) @ points_of(cloud)
        for point in expected[:: len(expected) // 20]:
            assert np.linalg.norm(points - point, axis=1).min() < 1e-4


@pytest.fixture(scope="module", params=["odometry", "localization"])
def drifted(request, drive_run, tmp_path_factory):
    """A copy of the run of the drive in which the odometry drifts away from the localization and the maps. The clouds are
    in the world of the `odometry`, as those of former versions, or of the `localization`."""
    path = tmp_path_factory.mktemp("drifted") / "run"
    shutil.copytree(drive_run.path, path)
    with sqlite3.connect(path / "run.sqlite") as store:
        for i, record in enumerate(drive_run.frames):
            drift = spartan.Pose.exp(np.array([0.02, 0.03, 0.01, 0.002, -0.001, 0.004]) * i)
            pose = drift @ record.odometry.pose
            store.execute("UPDATE frames SET tx=?, ty=?, tz=?, qx=?, qy=?, qz=?, qw=? WHERE stamp_ns=?",
                          (*map(float, pose.translation), *map(float, pose.quaternion_xyzw), record.stamp_ns))
            cloud = path / "terrain" / f"{record.stamp_ns}.ply"
            if request.param == "odometry" and cloud.exists():
                content = cloud.read_bytes()
                begin = content.index(b"end_header\n") + len(b"end_header\n")
                points = np.frombuffer(content[begin:], [("xyz", "<f4", 3), ("other", "u1", 15)]).copy()
                points["xyz"] = drift @ points["xyz"]
                cloud.write_bytes(content[:begin] + points.tobytes())
    store.close()
    return spartan.Run(path)


@pytest.mark.parametrize("name", ["run.bag", "run.rrd"])
def test_clouds_lie_on_the_map_though_the_odometry_drifts(drifted, tmp_path, name):
    positions = []  # in map
    if name.endswith(".rrd"):
        from spartan.bags import _export_rerun

        positions = [points for _, points, _ in _export_rerun.terrain_in_map(drifted)]
    else:
        bags.export_run(drifted, tmp_path / name)
        messages = read_bag(tmp_path / name)
        for topic, _, message in messages:
            if topic == "/spartan/terrain":
                positions.append(map_from(tree_at(messages, stamp_of(message)), "base_link") @ points_of(message))
    assert len(positions) == len(drifted.terrain_stamps_ns) > 1
    drift = drifted.frames[-1].odometry.pose.translation - drifted.frames[-1].localization.pose.translation
    assert np.linalg.norm(drift) > 0.3
    heights = [heights_above(drifted.map(), points[::7]) for points in positions]
    assert sum(map(len, heights)) > 200
    assert all(abs(np.median(each)) < 0.02 for each in heights if len(each) > 20)
    assert abs(np.median(np.concatenate(heights))) < 0.01 and np.percentile(np.abs(np.concatenate(heights)), 90) < 0.05


@pytest.mark.parametrize("far_m", [0, 10_000, 50_000])
@pytest.mark.parametrize("limits", [{}, {"max_range_m": 3.0}, {"point_step_px": 5, "max_range_error": 0.05}])
def test_the_camera_of_a_cloud(far_m, limits):
    """Of the points that the options keep; positions are float32, whose steps are 1 mm at 10 km, 4 mm at 50 km."""
    from spartan.bags._rectified import camera_of_cloud

    options = spartan.TerrainOptions(**limits)
    geometry = spartan.RectifiedStereo((80, 60), 100, [40, 30], 0.12)
    rng = np.random.default_rng(3)
    disparity = rng.uniform(1.5, 40, (60, 80)).astype(np.float32)
    disparity[rng.random(disparity.shape) < 0.3] = np.nan
    kept = np.where(disparity < 0.3 / options.max_range_error, np.nan, disparity)
    world_from_left = spartan.Pose.from_quaternion([0.5, 0.4, -0.2, 1], [far_m, -far_m / 2, 3])
    cloud = spartan.PointCloud.from_disparity(kept, np.ones_like(kept), np.zeros(kept.shape, np.uint8), geometry, world_from_left,
                                              step_px=options.point_step_px, max_range_m=options.max_range_m)
    found = camera_of_cloud(disparity, cloud, geometry, options)
    assert found is not None and len(cloud) > 30
    error = (world_from_left.inverse() @ found).log()
    assert np.linalg.norm(error[:3]) < 1e-4 + 1e-7 * far_m and np.linalg.norm(error[3:]) < 1e-4 + 1e-7 * far_m / 3
    assert camera_of_cloud(disparity[::-1], cloud, geometry, options) is None
