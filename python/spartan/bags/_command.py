"""The command `spartan-bag`."""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path

from spartan._errors import Error

# As the program `spartan` (docs/reference/command_line.md).
_EXIT_CODES = {"usage": 2, "input": 3, "frame_rejected": 3, "store_damaged": 3, "read_error": 3, "configuration": 4,
               "output": 5, "resources": 5, "interrupted": 130}


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
    read.add_argument("--pair-tolerance", type=float, default=0.005, metavar="S",
                      help="largest difference of the stamps of the images of a frame (default 0.005)")
    write = commands.add_parser("export", help="a recording or the results of a run become a bag")
    write.add_argument("input", help="folder of a recording, or a run folder")
    write.add_argument("-o", "--output", required=True, help="bag to create: of ROS 1 (a name with .bag), ROS 2 (any other name), an MCAP file with Foxglove's "
                            "schemas (.mcap), or, of a run, a recording of Rerun (.rrd)")
    write.add_argument("--storage", choices=("sqlite3", "mcap"), default="sqlite3", help="of ROS 2 (default sqlite3)")
    write.add_argument("--recording", help="of a run: its recording, whose images go into the .rrd file (default: none)")
    return parser


def _export(arguments: argparse.Namespace) -> None:
    from spartan import bags

    is_run = (Path(arguments.input) / "run.sqlite").exists()
    rerun = Path(arguments.output).suffix == ".rrd"
    if arguments.recording is not None and not rerun:
        raise Error("usage", "only .rrd files get images of the recording", "--recording", "leave it out")
    if rerun:
        if not is_run:
            raise Error("usage", "is not a run: only runs become recordings of Rerun", arguments.input)
        bags.export_rerun(arguments.input, arguments.output, recording=arguments.recording)
    elif is_run:
        bags.export_run(arguments.input, arguments.output, storage=arguments.storage)
    else:
        frames = bags.export_recording(arguments.input, arguments.output, storage=arguments.storage)
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
            print(f"{counts['frames']} frames, {counts['samples']} samples of sensors, {counts['unpaired']} images without "
                  f"a partner, {counts['rejected']} rejected; next: spartan run {arguments.output} -o RUN")
        else:
            _export(arguments)
    except ImportError as error:
        sys.exit(f"error: {error} (pip install 'spartan[bags,rerun]')")
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(_EXIT_CODES.get(error.code, 1))
    except KeyboardInterrupt:
        sys.exit(130)
