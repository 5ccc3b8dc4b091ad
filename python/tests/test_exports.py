"""Files of runs for other programs."""

import csv
import shutil
import sqlite3

import numpy as np
import pytest

import spartan


@pytest.mark.parametrize("kind", ["odometry", "localization"])
def test_exported_trajectories_are_read_by_others(drive_run, tmp_path, kind):
    """TUM, EuRoC and KITTI by evo, csv by the module csv."""
    from evo.tools import file_interface

    ours = drive_run.trajectory(kind)
    for name in ("tum", "euroc", "kitti", "csv"):
        drive_run.export(name, tmp_path / name, trajectory=kind)
    stamped = [file_interface.read_tum_trajectory_file(str(tmp_path / "tum")),
               file_interface.read_euroc_csv_trajectory(str(tmp_path / "euroc"))]
    for read in stamped:
        assert np.allclose(read.timestamps, np.array(ours.stamps_ns) / 1e9, rtol=0, atol=1e-9)
        assert np.allclose(read.positions_xyz, ours.positions, rtol=0, atol=1e-9)
        assert np.allclose(read.orientations_quat_wxyz, np.roll(ours.quaternions_xyzw, 1, axis=1), rtol=0, atol=1e-9)
    with open(tmp_path / "csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["stamp_ns"]) for row in rows] == list(ours.stamps_ns)
    numbers = [[float(row[key]) for key in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")] for row in rows]
    assert np.allclose(numbers, np.hstack([ours.positions, ours.quaternions_xyzw]), rtol=0, atol=1e-9)
    sigma = np.sqrt(np.diagonal(drive_run.covariances(kind), axis1=1, axis2=2))
    names = ("sigma_x_m", "sigma_y_m", "sigma_z_m", "sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad")
    assert np.allclose([[float(row[key]) for key in names] for row in rows], sigma, rtol=1e-4)
    # KITTI's poses have no stamps, and begin at the first left camera: the motions between the poses are the same.
    kitti = file_interface.read_kitti_poses_file(str(tmp_path / "kitti")).poses_se3
    lengths = [np.linalg.norm(np.diff(np.array([pose[:3, 3] for pose in poses]), axis=0), axis=1)
               for poses in (kitti, [pose.pose.matrix() for pose in ours])]
    assert len(kitti) == len(ours) and np.allclose(*lengths, rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", ["odometry", "localization"])
def test_points_of_colmap_are_in_the_world_of_its_images(drive, drive_run, tmp_path, kind):
    """Also where the odometry has drifted away from the localization, in whose world the files have the points."""
    import pycolmap

    run = tmp_path / "run"
    shutil.copytree(drive_run.path, run)
    with sqlite3.connect(run / "run.sqlite") as store:
        for i, record in enumerate(drive_run.frames):
            pose = spartan.Pose.exp(np.array([0.02, 0.03, 0.01, 0.002, -0.001, 0.004]) * i) @ record.odometry.pose
            store.execute("UPDATE frames SET tx=?, ty=?, tz=?, qx=?, qy=?, qz=?, qw=? WHERE stamp_ns=?",
                          (*map(float, pose.translation), *map(float, pose.quaternion_xyzw), record.stamp_ns))
    store.close()
    drifted = spartan.Run(run)
    drifted.export("colmap", tmp_path / "model", trajectory=kind, recording=drive)
    model, expected = pycolmap.Reconstruction(tmp_path / "model" / "sparse" / "0"), []
    records = {record.stamp_ns: record for record in drifted.frames}
    for stamp in drifted.terrain_stamps_ns:
        chosen, localized = getattr(records[stamp], kind).pose, records[stamp].localization.pose
        cloud = spartan.PointCloud.load(run / "terrain" / f"{stamp}.ply")
        expected.append((chosen @ localized.inverse()) @ cloud.positions)
    points = [model.points3D[i].xyz for i in sorted(model.points3D)]
    np.testing.assert_allclose(points, np.concatenate(expected), atol=2e-4)
