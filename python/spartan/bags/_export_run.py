"""The results of a run as a bag: poses, terrain, maps, and the frames that connect them."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan._errors import Error
from spartan._run import Run
from spartan.bags._export_recording import optical_frame
from spartan.bags._messages import Messages, world_covariance
from spartan.bags._rectified import RectifiedCameras, camera_of_cloud
from spartan.bags._writer import MessageWriter, open_writer

_LOG = logging.getLogger("spartan")


def rectified_frame(pair: str) -> str:
    """Optical frame of the rectified left images of a pair."""
    return f"{pair}_left_rectified_frame"


def _with_covariance(messages: Messages, pose: _core.UncertainPose) -> Any:
    return messages.make("geometry_msgs/PoseWithCovariance", pose=messages.pose(pose.pose),
                         covariance=world_covariance(pose).reshape(-1))


def _odometry(messages: Messages, record: _core.FrameRecord) -> Any:
    """The pose by vision alone in `odom`. A run has no velocities: the covariance of the twist begins with -1."""
    unknown = np.zeros(36)
    unknown[0] = -1
    zero = messages.vector([0, 0, 0])
    twist = messages.make("geometry_msgs/TwistWithCovariance", covariance=unknown,
                          twist=messages.make("geometry_msgs/Twist", linear=zero, angular=zero))
    return messages.make("nav_msgs/Odometry", header=messages.header(record.stamp_ns, "odom"), child_frame_id="base_link",
                         pose=_with_covariance(messages, record.odometry), twist=twist)


def _point_cloud(messages: Messages, stamp_ns: int, cloud: _core.PointCloud, base_from_world: _core.Pose) -> Any:
    """In `base_link` at the time of the image; rgb as PCL packs it."""
    points = np.zeros(len(cloud), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("sigma_m", "<f4")])
    moved = np.asarray(base_from_world @ cloud.positions)
    for i, axis in enumerate("xyz"):
        points[axis] = moved[:, i]
    colours = cloud.colours.astype(np.uint32)
    points["rgb"] = colours[:, 0] << 16 | colours[:, 1] << 8 | colours[:, 2]
    points["sigma_m"] = cloud.sigma_m
    fields = [messages.make("sensor_msgs/PointField", name=name, offset=4 * i, datatype=7, count=1)  # FLOAT32
              for i, name in enumerate(points.dtype.names or ())]
    return messages.make("sensor_msgs/PointCloud2", header=messages.header(stamp_ns, "base_link"), height=1,
                         width=len(points), fields=fields, is_bigendian=False, point_step=points.itemsize,
                         row_step=points.nbytes, data=points.view(np.uint8).reshape(-1), is_dense=True)


def _disparity(messages: Messages, stamp_ns: int, pair: str, values: npt.NDArray[np.float32],
               geometry: _core.RectifiedStereo) -> Any:
    """Unknown pixels are below min_disparity, as stereo_image_proc writes them."""
    least = float(np.nanmin(values, initial=0.0))  # of distant points, a little below 0
    known = np.where(np.isfinite(values), values, np.float32(least - 1))
    frame = rectified_frame(pair)
    window = messages.make("sensor_msgs/RegionOfInterest", x_offset=0, y_offset=0, height=values.shape[0],
                           width=values.shape[1], do_rectify=False)
    baseline = {"T" if messages.ros1 else "t": geometry.baseline_m}
    return messages.make("stereo_msgs/DisparityImage", header=messages.header(stamp_ns, frame),
                         image=messages.image(stamp_ns, frame, known, "32FC1"), f=geometry.focal_px,
                         valid_window=window, min_disparity=least, max_disparity=float(known.max(initial=0.0)),
                         delta_d=1 / 16, **baseline)


def _grid_map(messages: Messages, stamp_ns: int, view: _core.MapView) -> Any:
    """grid_map counts rows against x and columns against y, and stores columns one after the other."""
    west, east, south, north = view.extent
    pose = messages.pose(_core.Pose.from_quaternion([0, 0, 0, 1], [(west + east) / 2, (south + north) / 2, 0]))
    info_header = {"header": messages.header(stamp_ns, "map")} if messages.ros1 else {}
    info = messages.make("grid_map_msgs/GridMapInfo", resolution=view.cell_m, length_x=east - west,
                         length_y=north - south, pose=pose, **info_header)
    data = []
    for layer in view.layers.values():
        matrix = layer[:, ::-1].T
        rows, columns = matrix.shape
        dimensions = [messages.make("std_msgs/MultiArrayDimension", label="column_index", size=columns, stride=rows * columns),
                      messages.make("std_msgs/MultiArrayDimension", label="row_index", size=rows, stride=rows)]
        layout = messages.make("std_msgs/MultiArrayLayout", dim=dimensions, data_offset=0)
        data.append(messages.make("std_msgs/Float32MultiArray", layout=layout, data=matrix.reshape(-1, order="F").copy()))
    header = {} if messages.ros1 else {"header": messages.header(stamp_ns, "map")}
    return messages.make("grid_map_msgs/GridMap", info=info, layers=list(view.layers), basic_layers=["elevation_m"],
                         data=data, outer_start_index=0, inner_start_index=0, **header)


def _occupancy(messages: Messages, stamp_ns: int, view: _core.MapView) -> Any:
    """Probabilities of an obstacle or a cavity in percent, -1 where the class is unknown; the first row is the southern."""
    odds, known = view["occupancy_logodds"], view["class"] > 0
    percent = np.where(known, np.rint(100 / (1 + np.exp(-odds.astype(np.float64)))), -1).astype(np.int8)[::-1]
    west, _, south, _ = view.extent
    origin = messages.pose(_core.Pose.from_quaternion([0, 0, 0, 1], [west, south, 0]))
    info = messages.make("nav_msgs/MapMetaData", map_load_time=messages.time(stamp_ns), resolution=view.cell_m,
                         width=percent.shape[1], height=percent.shape[0], origin=origin)
    return messages.make("nav_msgs/OccupancyGrid", header=messages.header(stamp_ns, "map"), info=info,
                         data=percent.reshape(-1).copy())


def best_pose(record: _core.FrameRecord) -> _core.UncertainPose | None:
    return record.localization or record.slam or (record.odometry if record.has_pose else None)


def _write_poses(out: MessageWriter, run: Run) -> None:
    messages, path = out.messages, []
    for record in run.frames:
        best, stamp = best_pose(record), record.stamp_ns
        if best is None:
            continue
        if record.has_pose:
            out.write("/spartan/odometry", stamp, _odometry(messages, record))
        header = messages.header(stamp, "map")
        out.write("/spartan/pose", stamp, messages.make("geometry_msgs/PoseWithCovarianceStamped", header=header,
                                                        pose=_with_covariance(messages, best)))
        odom_from_body = record.odometry.pose
        out.write("/tf", stamp, messages.transforms([
            messages.transform(stamp, "map", "odom", best.pose @ odom_from_body.inverse()),
            messages.transform(stamp, "odom", "base_link", odom_from_body)]))
        path.append(messages.make("geometry_msgs/PoseStamped", header=header, pose=messages.pose(best.pose)))
    if path:
        end = run.frames[-1].stamp_ns
        message = messages.make("nav_msgs/Path", header=messages.header(end, "map"), poses=path)
        out.write("/spartan/path", end, message, latched=True)


@dataclass
class Terrain:
    """A terrain view of a run."""

    record: _core.FrameRecord
    disparities: npt.NDArray[np.float32]
    cloud: _core.PointCloud
    base_from_world: _core.Pose  # of the points of the cloud, at the time of the image
    base_from_left: _core.Pose | None  # of the rectified left camera; None where it is not known


def terrain_of(run: Run, cameras: RectifiedCameras) -> Iterator[Terrain]:
    """The terrain views of frames that have a pose. After a full disk the files of some are not there.

    The pose of the camera in the world of the cloud is found from the cloud itself. With a camera that is fixed to the
    body it gives that of the body, whether the cloud is in the world of the localization or, as in runs of former
    versions, of the odometry. The angles of a pan-tilt unit are not in a run: the body has the pose of the localization.
    """
    records = {record.stamp_ns: record for record in run.frames}
    for stamp in run.terrain_stamps_ns:
        record, files = records[stamp], run.path / "terrain" / str(stamp)
        if best_pose(record) is None or not files.with_suffix(".pfm").exists():
            continue
        disparities = _core.read_disparity(files.with_suffix(".pfm"))
        cloud = _core.PointCloud.load(files.with_suffix(".ply"))
        world_from_left = camera_of_cloud(disparities, cloud, cameras.geometry(record.pair), run.options.terrain)
        base_from_left = cameras.body_from_left(record.pair)
        if world_from_left is not None and base_from_left is not None:
            base_from_world = base_from_left @ world_from_left.inverse()
        else:
            base_from_world = (record.localization or record.odometry).pose.inverse()
            if world_from_left is not None:
                base_from_left = base_from_world @ world_from_left
        yield Terrain(record, disparities, cloud, base_from_world, base_from_left)


def _write_static_frames(out: MessageWriter, rig: _core.Rig, cameras: RectifiedCameras, stamp_ns: int) -> None:
    """Cameras that are fixed to the body, and the frames of their rectified images."""
    fixed = [(optical_frame(pair.name, side), rig.body_from_camera(getattr(pair, side)))
             for pair in rig.pairs for side in ("left", "right") if rig.camera(getattr(pair, side)).mount == "body"]
    fixed += [(rectified_frame(pair.name), pose) for pair in rig.pairs if (pose := cameras.body_from_left(pair.name))]
    if fixed:
        transforms = [out.messages.transform(stamp_ns, "base_link", frame, pose) for frame, pose in fixed]
        out.write("/tf_static", stamp_ns, out.messages.transforms(transforms), latched=True)


def _write_terrain(out: MessageWriter, run: Run, cameras: RectifiedCameras) -> None:
    messages = out.messages
    for view in terrain_of(run, cameras):
        pair, stamp, camera = view.record.pair, view.record.stamp_ns, view.base_from_left
        if camera is None:
            _LOG.warning("%s: the disparities of the terrain view %d are left out: the angles of its pan-tilt unit are not known",
                         run.path, stamp)
        else:
            if cameras.body_from_left(pair) is None:
                moved = messages.transform(stamp, "base_link", rectified_frame(pair), camera)
                out.write("/tf", stamp, messages.transforms([moved]))
            image = _disparity(messages, stamp, pair, view.disparities, cameras.geometry(pair))
            out.write(f"/{pair}/disparity", stamp, image)
        out.write("/spartan/terrain", stamp, _point_cloud(messages, stamp, view.cloud, view.base_from_world))


def map_view(run: Run) -> _core.MapView | None:
    """The whole map; None where the run has none, or one that is too large for a view, which is logged."""
    try:
        return run.map().view()
    except Error as error:
        if error.code == "usage":
            _LOG.warning("%s: the map is left out: %s; `spartan map export` writes it", run.path, error.what)
        elif error.code != "input":  # a run by odometry alone has no map
            raise
    return None


def export_run(run: Run | str | os.PathLike[str], bag: str | os.PathLike[str], *, storage: str = "sqlite3") -> None:
    """Writes the results of a run as a bag of ROS 1 (`bag` ends with .bag) or ROS 2 (a folder), or as an
    MCAP file with Foxglove's schemas (.mcap).

    `/spartan/odometry` (vision alone, in `odom`), `/spartan/pose` and `/spartan/path` (the best trajectory, in `map`), `/tf`
    (`map` to `odom` to `base_link`, and rectified cameras on a pan-tilt unit), `/tf_static` (cameras on the body),
    `/<pair>/disparity`, `/spartan/terrain` (points in `base_link`), `/spartan/map` (GridMap with all layers) and
    `/spartan/occupancy`. A map of more than 8 million cells is left out. Raises Error; after one there is no bag.
    """
    opened = run if isinstance(run, Run) else Run(run)
    if not opened.frames:
        raise Error("input", "has no frames", str(opened.path))
    cameras, view = RectifiedCameras(opened.rig, opened.options.imaging), map_view(opened)
    with open_writer(bag, storage) as out:
        messages, end = out.messages, opened.frames[-1].stamp_ns
        _write_static_frames(out, opened.rig, cameras, opened.frames[0].stamp_ns)
        _write_poses(out, opened)
        _write_terrain(out, opened, cameras)
        if view is not None:
            out.write("/spartan/map", end, _grid_map(messages, end, view), latched=True)
            out.write("/spartan/occupancy", end, _occupancy(messages, end, view), latched=True)
