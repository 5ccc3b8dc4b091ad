"""The command `spartan-bag`."""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path
from typing import Any

from spartan import _core
from spartan._errors import Error

# As the program `spartan` (docs/reference/command_line.md).
_EXIT_CODES = {"usage": 2, "input": 3, "frame_rejected": 3, "store_damaged": 3, "read_error": 3, "configuration": 4,
               "output": 5, "resources": 5, "interrupted": 130}
_PAIR_TOLERANCE_S = 0.005
# Options that say how a recording is read, as `spartan run` has them: argument of open_recording(), type, placeholder, help.
_READING: dict[str, tuple[str, type, str, str]] = {
    "--rig": ("rig", str, "FILE", "calibration file in any supported format (default: that of the recording)"),
    "--format": ("format", str, "LAYOUT", "layout of the recording: spartan, kitti, kitti-raw, euroc, images or video "
                                          "(default: detected)"),
    "--left": ("left", str, "IMAGES", "of the left camera: a folder, a quoted pattern of file names or a video, relative to the "
                                      "recording (default: as the layout has them)"),
    "--right": ("right", str, "IMAGES", "of the right camera, likewise"),
    "--times": ("times", str, "FILE", "of frame times (default: times.txt of the recording, else the file names)"),
    "--fps": ("fps", float, "F", "frames per second, instead of times"),
    "--bits": ("bits", int, "N", "significant bits of the samples of 16-bit images (default: by the calibration or the images)"),
    "--pair-tolerance": ("pair_tolerance_s", float, "S", "largest difference of the stamps of the images of a frame "
                                                         f"(default {_PAIR_TOLERANCE_S})"),
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="spartan-bag", description="Bags of ROS 1 and ROS 2, in and out.")
    commands = parser.add_subparsers(dest="command", required=True)
    read = commands.add_parser("import", help="a bag becomes a recording for `spartan run`")
    read.add_argument("bag", help="file of ROS 1, folder of ROS 2, or MCAP file with Foxglove's schemas")
    read.add_argument("-o", "--output", required=True, help="folder of the recording to create")
    for option, what in (("--left", "of the left images"), ("--right", "of the right images"),
                         ("--imu", "of sensor_msgs/Imu"), ("--wheels", "of nav_msgs/Odometry by the wheels")):
        read.add_argument(option, metavar="TOPIC", help=f"topic {what} (default: guessed by types and names)")
    read.add_argument("--rig", help="calibration file in any supported format (default: camera_info and tf_static)")
    read.add_argument("--pair-tolerance", type=float, default=_PAIR_TOLERANCE_S, metavar="S",
                      help=f"largest difference of the stamps of the images of a frame (default {_PAIR_TOLERANCE_S})")
    write = commands.add_parser("export", help="a recording or the results of a run become a bag")
    write.add_argument("input", help="folder of a recording, or a run folder")
    write.add_argument("-o", "--output", required=True, help="bag to create: of ROS 1 (a name with .bag), ROS 2 (any other name), an MCAP file with Foxglove's "
                            "schemas (.mcap), or, of a run, a recording of Rerun (.rrd)")
    write.add_argument("--storage", choices=("sqlite3", "mcap"), default="sqlite3", help="of ROS 2 (default sqlite3)")
    write.add_argument("--recording", help="of a run: its recording, whose images go into the .rrd file (default: none)")
    for option, (name, kind, metavar, what) in _READING.items():
        write.add_argument(option, dest=name, type=kind, metavar=metavar, help=what)
    return parser


def _given_reading(arguments: argparse.Namespace) -> dict[str, Any]:
    """The arguments of open_recording() that the command line states."""
    values = {name: getattr(arguments, name) for name, *_ in _READING.values()}
    return {name: value for name, value in values.items() if value is not None}


def _opened(path: str, arguments: argparse.Namespace) -> _core.Recording:
    try:
        return _core.open_recording(path, **_given_reading(arguments))
    except ValueError as error:  # a number out of its bounds
        raise Error("usage", str(error), path) from error


def _export(arguments: argparse.Namespace) -> None:
    from spartan import bags

    is_run = (Path(arguments.input) / "run.sqlite").exists()
    rerun = Path(arguments.output).suffix == ".rrd"
    if arguments.recording is not None and not rerun:
        raise Error("usage", "only .rrd files get images of the recording", "--recording", "leave it out")
    if is_run and arguments.recording is None and (unused := _given_reading(arguments)):
        options = ", ".join(option for option, (name, *_) in _READING.items() if name in unused)
        raise Error("usage", "no recording is read", options, "name that of the run with --recording, for an .rrd file")
    if rerun:
        if not is_run:
            raise Error("usage", "is not a run: only runs become recordings of Rerun", arguments.input)
        recording = None if arguments.recording is None else _opened(arguments.recording, arguments)
        bags.export_rerun(arguments.input, arguments.output, recording=recording)
    elif is_run:
        bags.export_run(arguments.input, arguments.output, storage=arguments.storage)
    else:
        frames = bags.export_recording(_opened(arguments.input, arguments), arguments.output, storage=arguments.storage)
        print(f"{frames} frames")


def main() -> None:
    arguments = _parser().parse_args()
    try:
        from spartan import bags
    except ImportError as error:
        sys.exit(f"error: {error} (pip install 'spartan[bags]')")
    try:
        if arguments.command == "import":
            logging.basicConfig(format="%(message)s")
            logging.getLogger("spartan").setLevel(logging.INFO)  # the topics and mounts that were chosen
            counts = bags.import_bag(
                arguments.bag, arguments.output, left=arguments.left, right=arguments.right, imu=arguments.imu,
                wheels=arguments.wheels, rig=arguments.rig, pair_tolerance_s=arguments.pair_tolerance)
            tolerance = arguments.pair_tolerance  # by the default, frames that a larger one has made are left out
            option = f" --pair-tolerance {tolerance}" if tolerance > _PAIR_TOLERANCE_S else ""
            print(f"{counts['frames']} frames, {counts['samples']} samples of sensors, {counts['unpaired']} images without "
                  f"a partner, {counts['rejected']} rejected; next: spartan run {arguments.output} -o RUN{option}")
        else:
            _export(arguments)
    except ImportError as error:
        sys.exit(f"error: {error} (pip install 'spartan[bags,rerun]')")
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(_EXIT_CODES.get(error.code, 1))
    except KeyboardInterrupt:
        sys.exit(130)
