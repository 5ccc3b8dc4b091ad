"""Runs: a recording or a live stream becomes a run folder, and what a run folder contains."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan._errors import Error

StrPath = str | os.PathLike[str]


class Run:
    """A run folder (docs/reference/files.md): trajectories, maps, terrain, and the record of every frame."""

    def __init__(self, path: StrPath) -> None:
        """Opens a run folder. Raises Error where it is not one."""
        self._results = _core.RunResults(path)

    @property
    def path(self) -> Path:
        return Path(self._results.path)

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json (docs/reference/json.md)."""
        return dict(json.loads((self.path / "summary.json").read_text(encoding="utf-8")))

    @property
    def rig(self) -> _core.Rig:
        """The rig as it was used."""
        return self._results.rig

    @property
    def options(self) -> _core.RunOptions:
        """The options as they were used."""
        return self._results.options

    @property
    def frames(self) -> list[_core.FrameRecord]:
        """The records of all frames of the odometry's pair, in order of time."""
        return self._results.frames

    @property
    def stops(self) -> list[_core.MapRecord]:
        """The local maps that were made, of stops or keyframes."""
        return self._results.stops

    @property
    def trajectories(self) -> list[str]:
        """Names of the trajectories that the run has: `odometry`, `slam`, `localization`, `smoothed`."""
        return self._results.trajectories

    def trajectory(self, kind: str | None = None) -> _core.Trajectory:
        """All measured poses `world_from_body`. Without a kind, the best one that was known at each frame."""
        return self._results.trajectory(kind)

    def covariances(self, kind: str | None = None) -> npt.NDArray[np.float64]:
        """Covariances of the poses of trajectory(), shape (n, 6, 6), order (translation, rotation), of the right
        perturbation; m and rad."""
        return self._results.covariances(kind)

    def map(self) -> _core.GlobalMap:
        """The global map. Raises Error where the run has none."""
        return _core.GlobalMap.open(self._results.path)

    @property
    def terrain_stamps_ns(self) -> list[int]:
        """Stamps of the terrain views along the path; their files are `terrain/<stamp>.pfm` and `.ply`."""
        return self._results.terrain_stamps_ns

    def point_clouds(self) -> list[_core.PointCloud]:
        """The terrain along the path in the world frame, a cloud for each view."""
        folder = self.path / "terrain"
        files = [folder / f"{stamp}.ply" for stamp in self.terrain_stamps_ns]
        return [_core.PointCloud.load(str(file)) for file in files if file.exists()]

    def export(
        self,
        format: str,
        path: StrPath,
        *,
        trajectory: str | None = None,
        threads: int | None = None,
        recording: StrPath | _core.Recording | None = None,
    ) -> None:
        """Writes the run as `tum`, `kitti`, `euroc`, `csv` (trajectory), `colmap` (folder with rectified images and poses;
        `recording`: the one that was run, open or its path), `geotiff`, `gltf`, `octomap` (map), `ply` or `pcd` (terrain)."""
        if recording is not None and not isinstance(recording, _core.Recording):
            recording = _core.open_recording(recording)
        self._results.export(format, path, trajectory, threads, recording)

    def __repr__(self) -> str:
        return f"<Run '{self._results.path}': {len(self.frames)} frames>"


def run(
    input: StrPath,
    output: StrPath,
    options: _core.RunOptions | None = None,
    *,
    rig: StrPath | None = None,
    format: str | None = None,
    left: str | None = None,
    right: str | None = None,
    times: StrPath | None = None,
    fps: float = 0,
    bits: int = 0,
    pair_tolerance_s: float = 0.005,
    threads: int | None = None,
    max_frames: int = 0,
    resume: bool = False,
    replace: bool = False,
    speed: float = 1,
    passes: int = 1,
    sensors: StrPath | None = None,
    truth: StrPath | None = None,
    report: bool = False,
    progress: Callable[[_core.RunProgress], object] | None = None,
    frame: Callable[[_core.FrameRecord], object] | None = None,
) -> Run:
    """Processes a recording or a live stream into a run folder, as `spartan run` does: the same bytes.

    input: folder or video of a recording, or the address of a live stream (`replay:FOLDER`, `live:RIG`, `sim:SCENARIO`).
    output: run folder to create. An existing one raises Error without `resume` or `replace`.
    rig, format, left, right, times, fps, bits, pair_tolerance_s: how to read the recording, see open_recording().
    threads: None is all cores.
    max_frames: number of stereo frames to process; 0: all.
    speed: pace of a replay or a simulation.
    passes: how often a replay plays its recording.
    sensors: of cameras, a FIFO, created if there is none, whose lines are samples of the other sensors
        (docs/tutorials/rover.md).
    truth: ground truth for the report, a trajectory file or a recording; None: that of the recording.
    report: also write the report page, `report/index.html`, of a recording. Where that fails, a warning says why.
    progress, frame: called after each frame. An exception that one raises ends the run; so does Ctrl-C. What was done
        is in the folder, and `resume=True` goes on.

    Messages go to the logger `spartan` of the module logging, which prints warnings where nothing else is configured.

    Raises Error, e.g. with the code `input` (no usable recording), `configuration` or `output`.
    """
    reading = _core.OpenOptions(
        rig=rig, format=format, left=left, right=right, times=times, fps=fps, bits=bits, pair_tolerance_s=pair_tolerance_s
    )
    _core.run_into_folder(
        input,
        output,
        options,
        open=reading,
        threads=threads,
        max_frames=max_frames,
        resume=resume,
        replace=replace,
        speed=speed,
        passes=passes,
        sensors=sensors,
        progress=progress,
        frame=frame,
        log=logging.getLogger("spartan").log,
    )
    finished = Run(output)
    if report:
        page = finished.path / "report" / "index.html"
        page.parent.mkdir(exist_ok=True)
        try:
            _core.write_report(output, input, reading, page, truth, threads)
        except Error as error:
            logging.getLogger("spartan").warning("no report was written: %s", error)
    return finished
