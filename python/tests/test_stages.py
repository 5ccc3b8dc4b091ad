"""The stages one by one: imaging, stereo, odometry, localization, mapping."""

import gc
import threading

import numpy as np
import pytest

import spartan
from conftest import address, frames_of


@pytest.fixture(scope="module")
def recording(drive):
    return spartan.open_recording(str(drive))


@pytest.fixture(scope="module")
def frames(recording):
    return frames_of(recording)


@pytest.fixture(scope="module")
def pairs(recording, frames):
    imager = spartan.Imager(recording.rig, threads=1)
    return [imager.process(frame) for frame in frames[:6]]


def test_rectified_pairs_own_their_images(pairs, frames):
    assert pairs[0].left.shape == frames[0].left.shape and pairs[0].left.dtype == np.uint8
    assert address(pairs[0].left) != address(pairs[1].left)
    assert not np.array_equal(pairs[0].left, pairs[1].left)
    assert not pairs[0].left.flags.writeable
    assert pairs[0].geometry.baseline_m == pytest.approx(0.12)


def test_a_frame_of_another_size_is_refused(recording):
    imager = spartan.Imager(recording.rig)
    pair = recording.rig.pairs[0].name
    with pytest.raises(spartan.Error) as raised:
        imager.process(spartan.StereoFrame(np.zeros((10, 10), np.uint8), np.zeros((10, 10), np.uint8), 0, pair=pair))
    assert raised.value.code == "frame_rejected"
    with pytest.raises(KeyError):
        imager.geometry("no pair")


def test_disparities_are_those_of_the_program(pairs, program, drive, tmp_path):
    images = sorted((drive / "image_0").iterdir())[0], sorted((drive / "image_1").iterdir())[0]
    program("stereo", *images, "-o", tmp_path / "out", "--max-disparity", 63)
    expected = spartan.read_disparity(str(tmp_path / "out" / "disparity.pfm"))
    import PIL.Image

    left, right = (np.array(PIL.Image.open(image)) for image in images)
    for threads in (1, 2):
        found = spartan.DisparityComputer(threads=threads).compute(left, right, 63)
        assert np.array_equal(found.disparity, expected, equal_nan=True)
    assert found.sigma.shape == expected.shape and (found.outlier_percent[np.isnan(expected)] == 100).all()
    scores = spartan.evaluate_disparity(found.disparity, expected)
    assert scores.all.bad_0_5 == 0 and scores.nonocc is None


def test_the_arrays_of_a_disparity_image_keep_it(pairs):
    found = spartan.DisparityComputer().compute(pairs[0])
    disparity, expected = found.disparity, np.array(found.disparity)
    assert address(disparity) == address(found.disparity)  # no copy
    del found
    gc.collect()
    [spartan.DisparityComputer().compute(pair) for pair in pairs[:2]]
    assert np.array_equal(disparity, expected, equal_nan=True)


@pytest.mark.parametrize("arguments, error", [
    ((np.zeros((20, 30), np.uint8), np.zeros((20, 31), np.uint8), 8), spartan.Error),
    ((np.zeros((20, 30), np.uint8), np.zeros((20, 30), np.uint8), 40), spartan.Error),
    ((np.zeros((20, 30), np.uint8), np.zeros((20, 30), np.uint8), -1), spartan.Error),
    ((np.zeros((0, 0), np.uint8), np.zeros((0, 0), np.uint8), 8), spartan.Error),
    ((np.zeros((20, 30)), np.zeros((20, 30)), 8), TypeError),
    ((np.zeros((20, 60), np.uint8)[:, ::2], np.zeros((20, 30), np.uint8), 8), ValueError),
])
def test_images_that_cannot_be_matched(arguments, error):
    with pytest.raises(error):
        spartan.DisparityComputer().compute(*arguments)


def test_depth_and_points_agree(pairs):
    found = spartan.DisparityComputer().compute(pairs[0])
    geometry = pairs[0].geometry
    depth = geometry.depth(found.disparity)
    known = np.isfinite(found.disparity) & (found.disparity > 0.5)
    np.testing.assert_allclose(depth[known], geometry.focal_px * geometry.baseline_m / found.disparity[known], rtol=1e-6)
    cloud = spartan.PointCloud.from_disparity(found.disparity, found.sigma, pairs[0].left, geometry)
    rows, columns = np.nonzero(known & np.isfinite(found.sigma))
    expected = geometry.triangulate(np.column_stack([columns, rows, found.disparity[rows, columns]]))
    np.testing.assert_allclose(cloud.positions, expected, rtol=1e-5, atol=1e-6)
    assert np.array_equal(cloud.colours[:, 0], pairs[0].left[rows, columns])
    assert cloud.positions.base is not None and len(cloud) == len(cloud.sigma_m) == len(cloud.times_s)
    assert np.isnan(geometry.triangulate([[1, 2, 0]])).all()


def test_a_point_cloud_is_written_and_read(pairs, tmp_path):
    found = spartan.DisparityComputer().compute(pairs[0])
    cloud = spartan.PointCloud.from_disparity(found.disparity, found.sigma, pairs[0].left, pairs[0].geometry, step_px=4)
    cloud.save(str(tmp_path / "cloud.ply"))
    again = spartan.PointCloud.load(str(tmp_path / "cloud.ply"))
    assert np.array_equal(again.positions, cloud.positions) and np.array_equal(again.colours, cloud.colours)
    with pytest.raises(ValueError, match=".ply or .pcd"):
        cloud.save(str(tmp_path / "cloud.obj"))
    positions = again.positions
    del again, cloud
    gc.collect()
    assert np.isfinite(positions).all()


def test_the_odometry_is_that_of_the_run(pairs, drive_run):
    odometer = spartan.Odometer()
    motions = [odometer.add(pair) for pair in pairs]
    assert motions[0].first and all(motion.status == "tracking" for motion in motions[1:])
    recorded = drive_run.frames[1].motion
    assert np.array_equal(recorded.previous_from_current.matrix(), motions[1].previous_from_current.matrix())
    np.testing.assert_allclose(motions[1].covariance, motions[1].covariance.T, atol=1e-12)


def test_a_localizer_follows_its_motions():
    localizer = spartan.Localizer()
    for i in range(100):
        localizer.add(spartan.ImuSample(i * 10**7, [0, 0, 0], [0, 0, 9.81]))
    localizer.start(10**9, [1, 0, 0])
    step = spartan.Pose.exp([0.1, 0, 0, 0, 0, 0])
    for i in range(10):
        at = 10**9 + i * 10**8
        assert localizer.add_motion(at, at + 10**8, step, 1e-6 * np.identity(6))
    estimate = localizer.estimate()
    np.testing.assert_allclose(estimate.world_from_body.pose.translation, [1, 0, 0], atol=0.05)
    assert estimate.gravity_measured and estimate.health["vision"].state == "ok"
    assert estimate.health["wheels"].state == "missing"
    assert localizer.estimate_at(0) is None
    with pytest.raises(ValueError, match="covariance"):
        localizer.add_motion(2 * 10**9, 3 * 10**9, step, np.identity(3))


def test_the_map_of_a_stop_is_that_of_the_run(stops, stops_run):
    recording, options, stop = spartan.open_recording(str(stops)), stops_run.options, stops_run.stops[0]
    imager = spartan.Imager(recording.rig, options.imaging)
    mapper = spartan.StopMapper(options.mapping, options.reconstruction)
    with pytest.raises(spartan.Error, match="no view"):
        mapper.map()
    views = [frame for frame in frames_of(recording) if frame.position_id == stop.position_id]
    for frame in views:
        mapper.add(imager.process(frame), recording.rig.pair(frame.pair).nearest_m)
    local = mapper.map(stop.world_from_body.pose)
    elevation = local["elevation_m"]
    assert elevation.dtype == np.float32 and len(views) == stop.views
    assert np.isfinite(elevation).sum() == stop.known_cells > 20
    assert address(elevation) == address(local.layers["elevation_m"])
    west, east, south, north = local.extent
    assert east - west == pytest.approx(elevation.shape[1] * local.cell_m)
    assert north - south == pytest.approx(elevation.shape[0] * local.cell_m)
    assert local.render().shape == (*elevation.shape, 3)
    with pytest.raises(KeyError):
        local["colour"]
    expected = np.array(elevation)
    del local, mapper
    gc.collect()
    assert np.array_equal(elevation, expected, equal_nan=True)


def test_threads_of_python_share_an_object(pairs):
    computer = spartan.DisparityComputer(threads=1)
    expected = [computer.compute(pair).disparity for pair in pairs[:2]]
    wrong = []

    def work(i):
        for _ in range(10):
            if not np.array_equal(computer.compute(pairs[i]).disparity, expected[i], equal_nan=True):
                wrong.append(i)

    threads = [threading.Thread(target=work, args=(i % 2,)) for i in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert not wrong


def test_a_calibration_is_checked_by_its_images(recording, frames):
    good = spartan.check_calibration(recording.rig, [(frame.left, frame.right) for frame in frames[::4]])
    assert good.matches > 100 and good.row_errors.mean_px < 0.5
    swapped = spartan.check_calibration(recording.rig, [(frame.right, frame.left) for frame in frames[::4]])
    assert swapped.grade == "bad" and "swapped_eyes" in {finding.id for finding in swapped.findings}
    with pytest.raises(TypeError):
        spartan.check_calibration(recording.rig, [(np.zeros((240, 320)), np.zeros((240, 320)))])
    with pytest.raises(spartan.Error):
        spartan.check_calibration(recording.rig, [])
