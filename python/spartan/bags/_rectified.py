"""Where the rectified left cameras of a run are."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan.bags._rigs import of_gray_images

_LARGEST_RESIDUAL_M = 1e-3  # the median; more where the steps of the float32 coordinates are larger, beyond 8 km


class RectifiedCameras:
    """Geometry of the rectified pairs of a rig, and poses of their left cameras on the body, without any image."""

    def __init__(self, rig: _core.Rig, options: _core.ImagingOptions) -> None:
        """Raises Error where a pair cannot be rectified."""
        self._rig = of_gray_images(rig)  # neither self-masks nor pixels matter
        self._imager = _core.Imager(self._rig, options, threads=1)
        self._poses = {pair.name: self._pose(pair) for pair in self._rig.pairs}

    def _pose(self, pair: _core.StereoPair) -> _core.Pose | None:
        left, right = self._rig.camera(pair.left), self._rig.camera(pair.right)
        if left.mount != "body":
            return None
        black = [np.zeros(camera.size[::-1], np.uint8) for camera in (left, right)]
        return self._imager.process(_core.StereoFrame(black[0], black[1], 0, pair=pair.name)).body_from_left

    def geometry(self, pair: str) -> _core.RectifiedStereo:
        return self._imager.geometry(pair)

    def body_from_left(self, pair: str) -> _core.Pose | None:
        """Of the rectified left optical frame; None for a pair on a pan-tilt unit."""
        return self._poses[pair]


def _rigid_motion(source: npt.NDArray[np.float64], target: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The 4x4 matrix T that minimizes the squares of T source - target, both of shape (n, 3) (Kabsch 1976)."""
    means = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((target - means[1]).T @ (source - means[0]))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    matrix = np.identity(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, means[1] - rotation @ means[0]
    return matrix


def camera_of_cloud(values: npt.NDArray[np.float32], cloud: _core.PointCloud, geometry: _core.RectifiedStereo,
                    options: _core.TerrainOptions) -> _core.Pose | None:
    """world_from_left of a terrain view, from its disparities and the same points in the world.

    The points are those of every `point_step_px`-th pixel in raster order, within `max_range_m`, of the largest
    disparities. None where they do not correspond, as after filling.
    """
    step = options.point_step_px
    v, u = np.mgrid[0 : values.shape[0] : step, 0 : values.shape[1] : step]
    d = values[::step, ::step]
    known = np.isfinite(d) & (d > 0)
    pixels = np.stack([u[known], v[known], d[known]], axis=-1).astype(np.float64)
    points = geometry.triangulate(pixels)
    if options.max_range_m > 0:
        near = np.linalg.norm(points, axis=1) <= options.max_range_m
        pixels, points = pixels[near], points[near]
    count = len(cloud)
    if count < 3 or len(points) < count:
        return None
    chosen = np.sort(np.argsort(-pixels[:, 2], kind="stable")[:count])
    target = cloud.positions.astype(np.float64)
    matrix = _rigid_motion(points[chosen], target)
    residuals = np.linalg.norm(points[chosen] @ matrix[:3, :3].T + matrix[:3, 3] - target, axis=1)
    largest = max(_LARGEST_RESIDUAL_M, float(np.spacing(np.abs(cloud.positions).max())))
    return _core.Pose(matrix) if np.median(residuals) <= largest else None
