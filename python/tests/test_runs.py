"""Pipelines, runs, maps, evaluation and simulation."""

import filecmp
import gc
import logging
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

import spartan
from conftest import address, frames_of

TRAJECTORIES = [f"trajectory_{kind}.tum" for kind in ("odometry", "slam", "localization", "smoothed")]


def same(a, b, names=TRAJECTORIES):
    return all(filecmp.cmp(a / name, b / name, shallow=False) for name in names)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_has_the_bytes_of_the_program(drive, drive_run, tmp_path, threads):
    seen = []
    run = spartan.run(drive, tmp_path / "run", threads=threads, progress=seen.append, frame=seen.append)
    assert same(run.path, drive_run.path)
    assert sorted(p.name for p in (run.path / "maps").iterdir()) == sorted(p.name for p in (drive_run.path / "maps").iterdir())
    progress = [each for each in seen if isinstance(each, spartan.RunProgress)]
    assert [p.done for p in progress] == list(range(1, len(run.frames) + 1)) and progress[-1].total == len(run.frames)
    assert [f.frame_id for f in seen if isinstance(f, spartan.FrameRecord)] == [f.frame_id for f in run.frames]


def test_what_a_run_contains(drive_run):
    run = drive_run
    assert run.trajectories == ["odometry", "slam", "localization", "smoothed"]
    best = run.trajectory()
    assert np.array_equal(best.positions, run.trajectory("localization").positions)
    file = spartan.Trajectory.load(str(run.path / "trajectory_localization.tum"))
    np.testing.assert_allclose(best.positions, file.positions, atol=1e-8)
    covariances = run.covariances("odometry")
    assert covariances.shape == (len(best), 6, 6)
    assert np.array_equal(covariances[3], run.frames[3].odometry.covariance)
    assert (np.linalg.eigvalsh(covariances[1:]) > -1e-15).all()
    assert run.summary["frames"] == len(run.frames) and run.frames[1].times_ms["odometry"] > 0
    assert run.frames[1].sensors["vision"][0] == "ok"
    assert run.options == spartan.RunOptions.load(str(run.path / "config.yaml"))
    assert run.rig.pairs[0].name == run.frames[0].pair
    assert sum(len(cloud) for cloud in run.point_clouds()) > 1000
    with pytest.raises(ValueError, match="kind"):
        run.trajectory("dream")
    with pytest.raises(spartan.Error) as raised:
        spartan.Run("/no/such/run")
    assert raised.value.code == "input"


def test_a_pipeline_gives_what_the_run_has(drive, drive_run):
    """The poses of the run have the ground of its first images as horizontal; the motions do not depend on it."""
    recording = spartan.open_recording(str(drive))
    pipeline = spartan.Pipeline(recording.rig, threads=1)
    results = [pipeline.add(sample) for sample in recording]
    assert pipeline.odometry_pair == recording.rig.pairs[0].name
    assert len(results) == len(drive_run.frames)
    for result, frame in zip(results, drive_run.frames):
        assert result.stamp_ns == frame.stamp_ns
        motion, recorded = result.motion.previous_from_current, frame.motion.previous_from_current
        assert np.array_equal(motion.matrix(), recorded.matrix())
    last = pipeline.finish_terrain()
    assert last is None or last.disparity.shape == last.left.shape
    assert pipeline.finish_terrain() is None
    while pipeline.finish_stop() is not None:
        pass
    assert pipeline.estimate().stamp_ns == results[-1].stamp_ns
    view = pipeline.map_view()
    assert np.isfinite(view["elevation_m"]).any()


def test_the_map_of_a_pipeline_has_the_costs_of_its_rover(stops, stops_run, tmp_path):
    """All layers are those of the run with the same options, whose costs are not those of the default rover."""
    recording, options = spartan.open_recording(stops), stops_run.options
    options.mapping.map.rover.max_slope_deg = 5
    options.mapping.map.rover.max_step_m = 0.03
    options.align_rows = False
    expected = spartan.run(stops, tmp_path / "run", options).map().view()
    pipeline = spartan.Pipeline(recording.rig, options, threads=1)
    for sample in recording:
        pipeline.add(sample)
    while pipeline.finish_stop() is not None:
        pass
    view = pipeline.map_view()
    for name, layer in expected.layers.items():
        assert np.array_equal(view[name], layer, equal_nan=True), name


def test_the_arrays_of_a_frame_result_keep_it(drive):
    recording = spartan.open_recording(str(drive))
    options = spartan.RunOptions()
    options.terrain.every_m = 0
    options.terrain.delay_frames = 0
    pipeline = spartan.Pipeline(recording.rig, options)
    results = [pipeline.add(frame) for frame in frames_of(recording)[:3]]
    terrain = next(result.terrain for result in results if result.terrain is not None)
    disparity = terrain.disparity
    assert address(disparity) == address(terrain.disparity)
    expected = np.array(disparity)
    del results, terrain, pipeline
    gc.collect()
    assert np.array_equal(disparity, expected, equal_nan=True)


def test_a_pipeline_takes_the_memory_of_the_caller_and_gives_it_back(drive):
    recording = spartan.open_recording(str(drive))
    pipeline = spartan.Pipeline(recording.rig)
    pair = recording.rig.pairs[0].name
    for frame in frames_of(recording)[:4]:
        left, right = np.array(frame.left), np.array(frame.right)
        result = pipeline.add(spartan.StereoFrame(left, right, frame.stamp_ns, pair=pair))
        assert result.motion.status in ("tracking", "stationary")
        del left, right
        gc.collect()


def test_a_pipeline_refuses_what_does_not_fit_and_goes_on(drive):
    recording = spartan.open_recording(str(drive))
    pipeline = spartan.Pipeline(recording.rig)
    frames = frames_of(recording)
    pipeline.add(frames[0])
    with pytest.raises(spartan.Error) as raised:
        pipeline.add(spartan.StereoFrame(np.zeros((8, 8), np.uint8), np.zeros((8, 8), np.uint8), 1, pair=frames[0].pair))
    assert raised.value.code == "frame_rejected"
    with pytest.raises(TypeError):
        pipeline.add(np.zeros((8, 8)))
    assert pipeline.add(frames[1]).motion.status == "tracking"
    options = spartan.RunOptions(odometry_pair="no pair")
    with pytest.raises(spartan.Error) as raised:
        spartan.Pipeline(recording.rig, options)
    assert raised.value.code == "configuration"


def test_an_exception_of_a_callback_ends_the_run_and_it_can_go_on(drive, drive_run, tmp_path):
    class Enough(Exception):
        pass

    def stop(progress):
        if progress.done == 5:
            raise Enough("at five")

    with pytest.raises(Enough, match="at five"):
        spartan.run(drive, tmp_path / "run", progress=stop)
    with pytest.raises(spartan.Error) as raised:
        spartan.run(drive, tmp_path / "run")
    assert raised.value.code == "output"
    assert same(spartan.run(drive, tmp_path / "run", resume=True).path, drive_run.path)


def test_ctrl_c_ends_a_run_and_it_can_go_on(drive, drive_run, tmp_path):
    script = textwrap.dedent("""
        import sys, spartan
        def frame(record):
            if record.frame_id == 4: print("now", flush=True)
            import time; time.sleep(0.05)
        try:
            spartan.run(sys.argv[1], sys.argv[2], frame=frame)
        except KeyboardInterrupt:
            sys.exit(42)
    """)
    child = subprocess.Popen([sys.executable, "-c", script, drive, tmp_path / "run"], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "now\n"
    child.send_signal(signal.SIGINT)
    assert child.wait(60) == 42
    run = spartan.run(drive, tmp_path / "run", resume=True)
    assert same(run.path, drive_run.path)


def test_other_threads_go_on_during_a_run(drive, tmp_path):
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            done.wait(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    run = spartan.run(drive, tmp_path / "run", threads=1)
    done.set()
    thread.join()
    assert counted[0] > 10 and len(run.frames) > 0


@pytest.mark.parametrize("arguments, error", [
    ({"max_frames": -1}, ValueError), ({"threads": 0}, ValueError), ({"format": "hologram"}, spartan.Error),
    ({"rig": "/no/such/rig.yaml"}, spartan.Error), ({"options": 3}, TypeError), ({"progress": 3}, TypeError)])
def test_a_run_refuses_wrong_arguments(drive, tmp_path, arguments, error):
    with pytest.raises(error):
        spartan.run(drive, tmp_path / "run", **arguments)


def test_a_replay_is_a_run(drive, tmp_path):
    run = spartan.run(f"replay:{drive}", tmp_path / "run", speed=20, max_frames=8)
    assert len(run.frames) == 8 and run.summary["live"]["dropped"]["odometry"] == 0


def test_a_replay_plays_twice(drive, tmp_path):
    once = len(list((drive / "image_0").iterdir()))
    run = spartan.run(f"replay:{drive}", tmp_path / "run", speed=20, passes=2)
    assert len(run.frames) + run.summary["live"]["dropped"]["odometry"] == 2 * once


@pytest.mark.parametrize("address", ["{}", "replay:{}", "sim:quick"])
def test_only_cameras_have_sensors_beside_them(drive, tmp_path, address):
    with pytest.raises(spartan.Error, match="sensors") as raised:
        spartan.run(address.format(drive), tmp_path / "run", sensors=tmp_path / "fifo")
    assert raised.value.code == "usage"


def test_a_report_is_written(drive, tmp_path):
    run = spartan.run(drive, tmp_path / "run", max_frames=5, report=True)
    page = (run.path / "report" / "index.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>") or "<html" in page[:200]


def test_the_map_of_a_run(stops_run, tmp_path):
    world = stops_run.map()
    assert len(world.stops) == len(stops_run.stops)
    whole = world.view()
    elevation = whole["elevation_m"]
    assert whole.extent == pytest.approx(world.extent) and address(elevation) == address(whole.layers["elevation_m"])
    rows, columns = np.nonzero(np.isfinite(elevation))
    west, east, south, north = whole.extent
    x, y = west + (columns + 0.5) * whole.cell_m, north - (rows + 0.5) * whole.cell_m
    known = [(world.at(*place), row, column) for *place, row, column in zip(x, y, rows, columns)]
    agree = [abs(sample.elevation_m - elevation[row, column]) < 1e-3 for sample, row, column in known if sample is not None]
    assert agree and all(agree)
    part = world.view((west, west + 1, north - 1, north))
    cells = part["elevation_m"].shape
    assert np.array_equal(part["elevation_m"], elevation[: cells[0], : cells[1]], equal_nan=True)
    expected = np.array(elevation)
    del world, whole, part
    gc.collect()
    assert np.array_equal(elevation, expected, equal_nan=True)


@pytest.mark.parametrize("extent", [(0, 0, 0, 1), (1, 0, 0, 1), (float("nan"), 1, 0, 1), (0, 1e9, 0, 1), (-9e5, 9e5, -9e5, 9e5)])
def test_rectangles_that_are_none(stops_run, extent):
    with pytest.raises(spartan.Error):
        stops_run.map().view(extent)


def test_a_map_is_exported(stops_run, tmp_path):
    import rasterio

    world = stops_run.map()
    world.export(str(tmp_path / "map.tif"))
    with rasterio.open(tmp_path / "map.tif") as file:
        assert np.array_equal(file.read(1), world.view()["elevation_m"], equal_nan=True)
    with pytest.raises(spartan.Error):
        world.export(str(tmp_path / "map.xyz"))
    world.export(tmp_path / "map.glb")
    assert (tmp_path / "map.glb").read_bytes()[:4] == b"glTF"
    stops_run.export("tum", tmp_path / "poses.tum")
    assert len(spartan.Trajectory.load(str(tmp_path / "poses.tum"))) == len(stops_run.trajectory())


def test_images_of_any_names(drive, tmp_path):
    """The options of reading a recording also apply to its report and to the model of its images."""
    import pycolmap

    images = tmp_path / "images"
    images.mkdir()
    for side, name in (("image_0", "l"), ("image_1", "r")):
        for path in (drive / side).glob("*.png"):
            shutil.copy(path, images / f"{name}{path.name}")
    reading = {"left": "l*.png", "right": "r*.png", "fps": 10, "rig": drive / "calib.txt"}
    run = spartan.run(images, tmp_path / "run", max_frames=4, report=True, **reading)
    assert (run.path / "report" / "index.html").stat().st_size > 10000
    with pytest.raises(spartan.Error):
        run.export("colmap", tmp_path / "none", recording=images)
    run.export("colmap", tmp_path / "model", recording=spartan.open_recording(images, **reading))
    assert pycolmap.Reconstruction(tmp_path / "model" / "sparse" / "0").num_images() == 8  # left and right


def test_a_report_that_fails_does_not_fail_the_run(drive, tmp_path, caplog):
    run = spartan.run(drive, tmp_path / "run", max_frames=2, report=True, truth=tmp_path / "none.txt")
    assert len(run.frames) == 2
    assert "no report was written" in caplog.text and "none.txt" in caplog.text


def test_evaluation_is_that_of_evo(drive, drive_run, tmp_path):
    from evo.core import metrics, sync
    from evo.tools import file_interface

    truth = spartan.Trajectory.load(str(drive / "poses.txt"))
    truth.save(str(tmp_path / "truth.tum"))
    drive_run.export("kitti", tmp_path / "estimate.txt", trajectory="odometry")
    kitti = spartan.Trajectory.load(str(tmp_path / "estimate.txt"))
    stamped = spartan.Trajectory(truth.stamps_ns, kitti.positions, kitti.quaternions_xyzw)
    stamped.save(str(tmp_path / "estimate.tum"))
    ours = spartan.evaluate_trajectory(stamped, truth, align="se3")
    reference, estimate = sync.associate_trajectories(
        file_interface.read_tum_trajectory_file(str(tmp_path / "truth.tum")),
        file_interface.read_tum_trajectory_file(str(tmp_path / "estimate.tum")))
    estimate.align(reference)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((reference, estimate))
    assert ours.ate_m.rmse == pytest.approx(ape.get_statistic(metrics.StatisticsType.rmse), abs=1e-9)
    assert ours.frames == len(truth)
    of_files = spartan.evaluate_run(str(drive_run.path), str(drive), align="se3", kind="odometry")
    assert of_files.ate_m.rmse == pytest.approx(ours.ate_m.rmse, rel=1e-6)
    with pytest.raises(ValueError, match="align"):
        spartan.evaluate_trajectory(stamped, truth, align="best")


def test_a_simulation_is_a_recording(tmp_path):
    seen = []
    count = spartan.simulate("quick", str(tmp_path / "drive"), set=["path.length_m=0.3", "capture.stops_m=[]", "samples=1"],
                             progress=lambda done, all: seen.append((done, all)))
    assert count == seen[-1][0] == seen[-1][1]
    recording = spartan.open_recording(str(tmp_path / "drive"))
    assert recording.truth_file and len(spartan.Trajectory.load(recording.truth_file)) > 0
    with pytest.raises(spartan.Error, match="shipped scenarios"):
        spartan.simulate("no scenario", str(tmp_path / "other"))
    with pytest.raises(spartan.Error) as raised:
        spartan.simulate("quick", str(tmp_path / "other"), set=["path.length_m=-1"])
    assert raised.value.code == "usage"


@pytest.mark.skipif("asan" in os.environ.get("LD_PRELOAD", ""), reason="the address sanitizer keeps freed memory")
def test_memory_is_flat_over_a_thousand_calls(drive):
    import resource

    recording = spartan.open_recording(str(drive))
    frames = frames_of(recording)
    imager, odometer = spartan.Imager(recording.rig, threads=1), spartan.Odometer(threads=1)
    computer = spartan.DisparityComputer(threads=1)
    model = recording.rig.cameras[0].model
    points = np.random.default_rng(1).normal(size=(10000, 3))

    def call(i):
        frame = spartan.StereoFrame(np.array(frames[i % 8].left), np.array(frames[i % 8].right), i, pair=frames[0].pair)
        pair = imager.process(frame)
        odometer.add(pair)
        spartan.PointCloud.from_disparity(*[np.zeros((240, 320), np.float32)] * 2, pair.left, pair.geometry).positions
        model.project(points)
        model.unproject(points[:, :2])
        frame.left, pair.left, pair.right
        if i % 10 == 0:
            found = computer.compute(pair)
            found.disparity, found.sigma

    def resident_kb():
        with open(f"/proc/{os.getpid()}/status", encoding="ascii") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))

    for i in range(200):
        call(i)
    before = resident_kb()
    for i in range(1000):
        call(i)
    assert resident_kb() - before < 4000  # kB; one image of each call would be 75 000
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 2_000_000


def test_a_folder_with_the_name_of_a_scenario_is_not_meant(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quick").mkdir()
    with pytest.raises(spartan.Error) as raised:
        spartan.simulate("quick", "drive", set=["samples=3"])
    assert raised.value.code == "configuration" and "samples" in str(raised.value)


def test_messages_go_to_logging(drive, tmp_path, caplog):
    folder = tmp_path / "drive"
    shutil.copytree(drive, folder)
    (folder / "image_0/000003.png").write_bytes(b"")
    with caplog.at_level(logging.DEBUG, logger="spartan"):
        run = spartan.run(folder, tmp_path / "run")
    levels = {record.levelname for record in caplog.records if record.name == "spartan"}
    assert {"INFO", "WARNING"} <= levels
    assert any("000003.png" in record.getMessage() for record in caplog.records)
    logged = (run.path / "log.txt").read_text(encoding="utf-8")
    assert all(record.getMessage() in logged for record in caplog.records if record.levelno >= logging.INFO)


def test_a_logger_that_raises_ends_the_run(drive, tmp_path):
    class Refuses(logging.Handler):
        def handle(self, record):
            raise ValueError("no more")

    logger, handler = logging.getLogger("spartan"), Refuses()
    logger.addHandler(handler)
    level = logger.level
    logger.setLevel(logging.INFO)
    try:
        with pytest.raises(ValueError, match="no more"):
            spartan.run(drive, tmp_path / "run")
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
