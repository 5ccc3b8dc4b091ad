"""Poses, trajectories, camera models and rigs."""

import copy
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

import spartan


def random_pose(rng) -> spartan.Pose:
    return spartan.Pose.from_quaternion(rng.normal(size=4), rng.normal(size=3))


def test_a_pose_is_its_matrix():
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b = random_pose(rng), random_pose(rng)
        np.testing.assert_allclose((a @ b).matrix(), a.matrix() @ b.matrix(), atol=1e-12)
        np.testing.assert_allclose(a.inverse().matrix(), np.linalg.inv(a.matrix()), atol=1e-12)
        points = rng.normal(size=(7, 3))
        np.testing.assert_allclose(a @ points, points @ a.rotation.T + a.translation, atol=1e-12)
        np.testing.assert_allclose(a @ points[0], (a @ points)[0])
        np.testing.assert_allclose(Rotation.from_quat(a.quaternion_xyzw).as_matrix(), a.rotation, atol=1e-12)


def test_the_exponential_is_that_of_the_matrix():
    rng = np.random.default_rng(2)
    for _ in range(20):
        t = rng.normal(size=6)
        x, y, z = t[3:]
        twist = np.array([[0, -z, y, t[0]], [z, 0, -x, t[1]], [-y, x, 0, t[2]], [0, 0, 0, 0]])
        pose = spartan.Pose.exp(t)
        np.testing.assert_allclose(pose.matrix(), scipy.linalg.expm(twist), atol=1e-10)
        np.testing.assert_allclose(spartan.Pose.exp(pose.log()).matrix(), pose.matrix(), atol=1e-10)


@pytest.mark.parametrize("bad", [np.identity(3), 2 * np.identity(4), np.diag([1, 1, -1, 1]), np.full((4, 4), np.nan)])
def test_a_matrix_that_is_no_rigid_transform_is_refused(bad):
    with pytest.raises(ValueError, match="matrix"):
        spartan.Pose(bad)


def test_covariances_compose():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(6, 6))
    a = spartan.UncertainPose(random_pose(rng), root @ root.T)
    np.testing.assert_allclose((a @ a.inverse()).pose.matrix(), np.identity(4), atol=1e-12)
    np.testing.assert_allclose(a.sigma**2, np.diag(a.covariance))
    with pytest.raises(ValueError, match="covariance"):
        spartan.UncertainPose(a.pose, np.identity(3))


def test_poses_are_pickled():
    pose = random_pose(np.random.default_rng(4))
    assert np.array_equal(pickle.loads(pickle.dumps(pose)).matrix(), pose.matrix())


@pytest.mark.parametrize("format", ["tum", "kitti", "euroc"])
def test_a_trajectory_is_written_and_read(tmp_path, format):
    rng = np.random.default_rng(5)
    stamps = np.cumsum(rng.integers(1, 10**9, 30)).astype(np.int64)
    written = spartan.Trajectory(stamps, rng.normal(size=(30, 3)), rng.normal(size=(30, 4)))
    written.save(str(tmp_path / "poses.txt"), format)
    read = spartan.Trajectory.load(str(tmp_path / "poses.txt"))
    np.testing.assert_allclose(read.positions, written.positions, atol=1e-8)
    same = np.abs(np.sum(read.quaternions_xyzw * written.quaternions_xyzw, axis=1))
    np.testing.assert_allclose(same, 1, atol=1e-8)
    if format != "kitti":  # which has no stamps
        assert np.array_equal(read.stamps_ns, stamps)
    assert len(read) == 30 and read[-1].stamp_ns == read.stamps_ns[-1]
    assert written.length_m == pytest.approx(np.sum(np.linalg.norm(np.diff(written.positions, axis=0), axis=1)))
    with pytest.raises(IndexError):
        read[30]


def test_a_trajectory_refuses_arrays_that_do_not_fit():
    with pytest.raises(ValueError, match="equal lengths"):
        spartan.Trajectory(np.arange(3), np.zeros((2, 3)), np.ones((3, 4)))
    with pytest.raises(ValueError, match="increase"):
        spartan.Trajectory(np.zeros(2, np.int64), np.zeros((2, 3)), np.ones((2, 4)))
    with pytest.raises(TypeError):
        spartan.Trajectory(np.zeros(2, str), np.zeros((2, 3)), np.ones((2, 4)))


def test_a_pinhole_projects_by_its_formula():
    model = spartan.CameraModel("pinhole", focal_px=[700, 710], centre_px=[320, 240])
    points = np.random.default_rng(6).normal(size=(50, 3)) + [0, 0, 4]
    seen = points[:, 2] > 0
    expected = points[:, :2] / points[:, 2:] * [700, 710] + [320, 240]
    np.testing.assert_allclose(model.project(points)[seen], expected[seen])
    assert np.isnan(model.project([[0, 0, -1]])).all()


@pytest.mark.parametrize("model", [
    spartan.CameraModel("pinhole", focal_px=[500, 500], centre_px=[320, 240]),
    spartan.CameraModel("radial_tangential", focal_px=[500, 505], centre_px=[320, 240], distortion=[-0.3, 0.1, 1e-3, -1e-3]),
    spartan.CameraModel("equidistant", focal_px=[300, 300], centre_px=[320, 240], distortion=[0.02, -0.01, 0.003, -0.001]),
])
def test_a_pixel_is_the_projection_of_its_ray(model):
    pixels = np.random.default_rng(7).uniform([100, 80], [540, 400], size=(100, 2))
    origins, directions = model.unproject(pixels)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    np.testing.assert_allclose(model.project(origins + 3 * directions), pixels, atol=1e-6)
    points = origins + 3 * directions
    step = 1e-6
    numeric = np.stack([(model.project(points + step * axis) - model.project(points - step * axis)) / (2 * step)
                        for axis in np.identity(3)], axis=2)
    np.testing.assert_allclose(model.project_jacobian(points), numeric, rtol=1e-5, atol=1e-4)


def test_a_camera_model_is_made_of_the_keys_of_rig_yaml():
    model = spartan.CameraModel("equidistant", focal_px=[300, 301], centre_px=[320, 240], distortion=[0.02, -0.01, 0.003, -0.001])
    assert spartan.CameraModel(model.kind, **model.parameters) == model
    with pytest.raises(ValueError, match="there is no camera model 'fish'; models: pinhole"):
        spartan.CameraModel("fish")
    with pytest.raises(TypeError, match="focal_px is missing"):
        spartan.CameraModel("pinhole", centre_px=[1, 2])
    with pytest.raises(ValueError, match="focal_px: must have 2 values"):
        spartan.CameraModel("pinhole", focal_px=[1, 2, 3], centre_px=[1, 2])
    with pytest.raises(ValueError, match="not possible"):
        spartan.CameraModel("pinhole", focal_px=[-1, 2], centre_px=[1, 2])


def stereo_rig() -> spartan.Rig:
    model = spartan.CameraModel("pinhole", focal_px=[260, 260], centre_px=[159.5, 119.5])
    cameras = [spartan.Camera(name, (320, 240), model) for name in ("left", "right")]
    return spartan.Rig.stereo(*cameras, spartan.Pose.exp([-0.12, 0, 0, 0, 0, 0]))


def test_a_rig_of_two_cameras():
    rig = stereo_rig()
    assert rig.baseline_m(rig.pairs[0].name) == pytest.approx(0.12)
    assert rig.camera("left").size == (320, 240)
    np.testing.assert_allclose(rig.body_from_camera("left").rotation @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    assert spartan.Rig.from_yaml(rig.to_yaml()) == rig
    assert pickle.loads(pickle.dumps(rig)) == rig
    with pytest.raises(KeyError):
        rig.camera("middle")
    with pytest.raises(spartan.Error) as raised:
        spartan.Rig.from_yaml("schema: 1\nname: x\n")
    assert raised.value.code == "configuration" and "rig.yaml:1: cameras: is missing" in str(raised.value)
    with pytest.raises(spartan.Error):  # both cameras at one place
        spartan.Rig.stereo(rig.camera("left"), rig.camera("right"), spartan.Pose())


@pytest.mark.parametrize("name", ["rig.yaml", "calib.txt", "camchain.yaml", "stereo.yml", "left.yaml,right.yaml"])
def test_a_rig_is_written_and_read_in_other_formats(tmp_path, name):
    rig = stereo_rig()
    path = ",".join(str(tmp_path / part) for part in name.split(","))
    format = {"calib.txt": "kitti", "camchain.yaml": "kalibr", "stereo.yml": "opencv", "left.yaml,right.yaml": "ros"}.get(name)
    spartan.write_calibration(rig, path, format)
    again = spartan.read_calibration(path, size=(320, 240))
    pair = again.rig.pairs[0]
    assert again.rig.baseline_m(pair.name) == pytest.approx(0.12)
    assert again.rig.camera(pair.left).model.project([[0, 0, 1]]) == pytest.approx(np.array([[159.5, 119.5]]))
    assert again.format in spartan.calibration_formats()


def test_a_rig_is_designed_as_by_the_program(program):
    requirements = Path(__file__).parents[2] / "config/requirements/rover.yaml"
    assert spartan.design_rig(requirements) == json.loads(program("rig", "design", requirements, "--json"))
    wide = spartan.design_rig(requirements, whole_set=True)["wide"]
    assert len(wide["feasible"]) == wide["feasible_count"] and wide["feasible"][0] == wide["best"]
    with pytest.raises(spartan.Error, match="no_such.yaml"):
        spartan.design_rig("no_such.yaml")


def test_options_are_described_once():
    options = spartan.RunOptions()
    assert options == copy.deepcopy(options)
    options.odometry.detection.landmarks = 800
    options.set("reconstruction.method=block")
    assert options.reconstruction.method == "block"
    assert options != spartan.RunOptions()
    assert spartan.RunOptions.from_yaml(options.to_yaml()) == options
    assert pickle.loads(pickle.dumps(options)) == options
    assert "odometry.detection.landmarks=800" in repr(options)
    assert "Bounds: 20 to 100000" in spartan.DetectionOptions.landmarks.__doc__
    options.odometry = spartan.OdometryOptions()
    assert options.odometry.detection.landmarks == spartan.DetectionOptions().landmarks


def test_options_out_of_bounds_are_refused_at_once():
    options = spartan.DetectionOptions(landmarks=100)
    with pytest.raises(ValueError, match="landmarks = 5: must be 20 to 100000"):
        options.landmarks = 5
    with pytest.raises(ValueError, match="detector = 'corner': must be one of surf, harris"):
        options.detector = "corner"
    with pytest.raises(TypeError, match="has no option 'landmark'"):
        spartan.DetectionOptions(landmark=100)
    with pytest.raises(ValueError, match="finite"):
        options.spacing_px = float("nan")
    with pytest.raises(spartan.Error) as raised:
        spartan.RunOptions.from_yaml("odometry: {detection: {landmarks: 1}}")
    assert raised.value.code == "configuration"


def test_the_group_of_options_that_are_gone_lives_on():
    detection = spartan.RunOptions().odometry.detection
    detection.landmarks = 321
    assert detection.landmarks == 321
