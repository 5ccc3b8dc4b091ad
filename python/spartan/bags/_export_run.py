"""The results of a run as a bag: poses, terrain, maps, and the frames that connect them."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan import _core
from spartan._errors import Error
from spartan._run import Run
from spartan.bags._export_recording import optical_frame
from spartan.bags._messages import Messages, world_covariance
from spartan.bags._writer import MessageWriter, open_writer


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


def _point_cloud(messages: Messages, stamp_ns: int, cloud: _core.PointCloud, base_from_map: _core.Pose) -> Any:
    """In `base_link` at the time of the image; rgb as PCL packs it."""
    points = np.zeros(len(cloud), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4"), ("sigma_m", "<f4")])
    moved = np.asarray(base_from_map @ cloud.positions)
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
    frame = f"{pair}_left_rectified_frame"
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


def _write_terrain(out: MessageWriter, run: Run) -> None:
    imager = _core.Imager(run.rig, run.options.imaging, threads=1, mask_folder=run.path)
    records, files = {record.stamp_ns: record for record in run.frames}, run.path / "terrain"
    for stamp in run.terrain_stamps_ns:
        record = records[stamp]
        best = best_pose(record)
        if best is None or not (files / f"{stamp}.pfm").exists():  # the disk was full
            continue
        values = _core.read_disparity(files / f"{stamp}.pfm")
        out.write(f"/{record.pair}/disparity", stamp,
                  _disparity(out.messages, stamp, record.pair, values, imager.geometry(record.pair)))
        cloud = _core.PointCloud.load(files / f"{stamp}.ply")
        out.write("/spartan/terrain", stamp, _point_cloud(out.messages, stamp, cloud, best.pose.inverse()))


def export_run(run: Run | str | os.PathLike[str], bag: str | os.PathLike[str], *, storage: str = "sqlite3") -> None:
    """Writes the results of a run as a bag of ROS 1 (`bag` ends with .bag) or ROS 2 (a folder), or as an
    MCAP file with Foxglove's schemas (.mcap).

    `/spartan/odometry` (vision alone, in `odom`), `/spartan/pose` and `/spartan/path` (the best trajectory, in `map`), `/tf`
    (`map` to `odom` to `base_link`), `/tf_static` (cameras on the body), `/<pair>/disparity`, `/spartan/terrain` (points in
    `base_link`), `/spartan/map` (GridMap with all layers) and `/spartan/occupancy`.
    """
    opened = run if isinstance(run, Run) else Run(run)
    if not opened.frames:
        raise Error("input", "has no frames", str(opened.path))
    with open_writer(bag, storage) as out:
        messages, start, end = out.messages, opened.frames[0].stamp_ns, opened.frames[-1].stamp_ns
        rig = opened.rig
        fixed = [messages.transform(start, "base_link", optical_frame(pair.name, side),
                                    rig.body_from_camera(getattr(pair, side)))
                 for pair in rig.pairs for side in ("left", "right") if rig.camera(getattr(pair, side)).mount == "body"]
        if fixed:
            out.write("/tf_static", start, messages.transforms(fixed), latched=True)
        _write_poses(out, opened)
        _write_terrain(out, opened)
        try:
            view = opened.map().view()
        except Error as error:
            if error.code != "input":  # a run by odometry alone has no map
                raise
        else:
            out.write("/spartan/map", end, _grid_map(messages, end, view), latched=True)
            out.write("/spartan/occupancy", end, _occupancy(messages, end, view), latched=True)
