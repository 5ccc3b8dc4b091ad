"""The results of a run as a recording of Rerun (.rrd)."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan._errors import Error
from spartan._run import Run
from spartan.bags._export_run import best_pose, map_view, terrain_of
from spartan.bags._rectified import RectifiedCameras
from spartan.bags._rigs import without_masks
from spartan.bags._writer import UnfinishedOutput

_MOST_POINTS = 50_000  # of a terrain view
_COLOURS = {"odometry": (230, 159, 0), "slam": (86, 180, 233), "localization": (0, 114, 178), "smoothed": (204, 121, 167)}


def _log_trajectories(rr: Any, out: Any, run: Run) -> None:
    for kind in run.trajectories:
        line = run.trajectory(kind).positions
        out.log(f"map/trajectory/{kind}", rr.LineStrips3D([line], colors=[_COLOURS[kind]]), static=True)


def _log_map(rr: Any, out: Any, run: Run) -> None:
    """The surface as a mesh, coloured as the figure of the map."""
    view = map_view(run)
    if view is None:
        return
    heights, colours = view["elevation_m"], view.render()
    west, _, _, north = view.extent
    rows, columns = heights.shape
    x = west + (np.arange(columns) + 0.5) * view.cell_m
    y = north - (np.arange(rows) + 0.5) * view.cell_m
    known = np.isfinite(heights)
    numbers = np.cumsum(known).reshape(known.shape) - 1
    square = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    a, b, c, d = (part[square] for part in (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    gridx, gridy = np.meshgrid(x, y)
    vertices = np.stack([gridx[known], gridy[known], heights[known]], axis=-1)
    out.log("map/surface", rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, vertex_colors=colours[known]),
            static=True)


def _log_frames(rr: Any, out: Any, run: Run, recording: _core.Recording | None) -> None:
    imager = None
    if recording is not None:
        imager = _core.Imager(without_masks(run.rig), run.options.imaging, threads=1)
    for record in run.frames:
        out.set_time("stamp", timestamp=np.datetime64(record.stamp_ns, "ns"))
        out.set_time("frame", sequence=record.frame_id)
        out.log("health/status", rr.TextLog(f"{record.status} {record.message}".strip()))
        out.log("health/inliers", rr.Scalars(record.motion.inliers))
        out.log("health/rms_px", rr.Scalars(record.motion.rms_px))
        best = best_pose(record)
        if best is None:
            continue
        pose = best.pose
        out.log("map/base_link", rr.Transform3D(translation=pose.translation, mat3x3=pose.rotation))
        sigma = np.sqrt(np.maximum(0, np.diag(best.covariance)[:3]))
        out.log("map/base_link/three_sigma", rr.Ellipsoids3D(centers=[[0, 0, 0]], half_sizes=[3 * sigma]))
        if recording is not None and imager is not None and not record.fault:  # both images are there
            _log_image(rr, out, recording, imager, record)


def _log_image(rr: Any, out: Any, recording: _core.Recording, imager: _core.Imager, record: _core.FrameRecord) -> None:
    pair = imager.process(recording.frame_at(record.pair, record.stamp_ns))
    geometry, camera = pair.geometry, pair.body_from_left
    entity = f"map/base_link/{record.pair}_left"
    width, height = geometry.size
    out.log(entity, rr.Transform3D(translation=camera.translation, mat3x3=camera.rotation))
    out.log(entity, rr.Pinhole(focal_length=geometry.focal_px, principal_point=geometry.centre_px, width=width,
                               height=height, camera_xyz=rr.ViewCoordinates.RDF))
    out.log(entity, rr.Image(np.array(pair.left)).compress(jpeg_quality=80))


def terrain_in_map(run: Run) -> Iterator[tuple[_core.FrameRecord, npt.NDArray[np.float64], npt.NDArray[np.uint8]]]:
    """Frame, positions in `map` (m, shape (n, 3)) and colours of each terrain view, at most _MOST_POINTS points of it."""
    for view in terrain_of(run, RectifiedCameras(run.rig, run.options.imaging)):
        best = best_pose(view.record)
        assert best is not None  # terrain_of()
        step = -(-len(view.cloud) // _MOST_POINTS) or 1
        positions = (best.pose @ view.base_from_world) @ view.cloud.positions[::step]
        yield view.record, np.asarray(positions), view.cloud.colours[::step]


def _log_terrain(rr: Any, out: Any, run: Run) -> None:
    for record, positions, colours in terrain_in_map(run):
        out.set_time("stamp", timestamp=np.datetime64(record.stamp_ns, "ns"))
        out.set_time("frame", sequence=record.frame_id)
        out.log("map/terrain", rr.Points3D(positions, colors=colours))


def export_rerun(
    run: Run | str | os.PathLike[str], path: str | os.PathLike[str], *,
    recording: str | os.PathLike[str] | _core.Recording | None = None
) -> None:
    """Writes the results of a run for Rerun (`rerun FILE`): the surface of the map, trajectories, the pose of the rover with
    its three standard deviations, terrain points, and health, by time and by frame. With the `recording` that was run,
    open or its path, also the rectified left images, in front of their camera.

    Needs `pip install spartan[rerun]`. Raises Error, after which there is no file; ImportError without Rerun.
    """
    rr: Any = importlib.import_module("rerun")
    opened = run if isinstance(run, Run) else Run(run)
    if not opened.frames:
        raise Error("input", "has no frames", str(opened.path))
    output = UnfinishedOutput(path)
    if recording is not None and not isinstance(recording, _core.Recording):
        recording = _core.open_recording(recording)
    output.begin()
    try:
        out = rr.RecordingStream("spartan", recording_id=opened.path.name)
        out.save(output.part)
        out.log("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        _log_trajectories(rr, out, opened)
        _log_map(rr, out, opened)
        _log_frames(rr, out, opened, recording)
        _log_terrain(rr, out, opened)
        out.flush()
        out.disconnect()
        output.finish()
    except (OSError, RuntimeError) as error:  # of Rerun's thread that writes the file
        raise Error("output", f"cannot be written: {error}", str(path),
                    "free space there, or choose a place that can be written") from error
    finally:
        output.discard()
