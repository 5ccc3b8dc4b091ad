"""The commands of the program on the short recordings, as the trials of several classes use them."""
from dataclasses import dataclass
from typing import Callable


@dataclass
class Command:
    """`arguments(folder)`: what to run, with its output in `folder`; `busy_call` on `busy_path` (None: the output)
    happens while it works: see fault_shim.cpp. `code` without a fault."""

    arguments: Callable
    busy_call: str = "open"
    busy_path: str | None = None
    writes: bool = True
    code: int = 0
    interruptible: bool = True


def commands_of(lab):
    """By name. A command that needs the simulator is missing in a build without it."""
    drive = lab.recordings["drive"]
    left, right = (drive.path / f"image_{side}/000000.png" for side in (0, 1))
    calib, design = drive.path / "calib.txt", lab.source / "config/requirements/rover.yaml"
    found = {
        "run": Command(lambda out: lab.run_command(drive, out), "read", "image_1"),
        "stereo": Command(lambda out: ("stereo", left, right, "-o", out, "--calib", calib, "--threads", "1"),
                          busy_path="image_1"),
        "map_build": Command(lambda out: ("map", "build", left, right, "-o", out, "--rig", calib, "--threads", "1"),
                             busy_path="image_1"),
        "rig_inspect": Command(lambda out: ("rig", "inspect", calib, left, right, "--threads", "1"),
                               busy_path="image_1", writes=False),
        "rig_design": Command(lambda out: ("rig", "design", design, "-o", out), busy_path=design.name),
        "evaluate": Command(lambda out: ("evaluate", drive.run, "--truth", drive.path), busy_path="poses.txt",
                            writes=False, interruptible=False),
        "export_ply": Command(lambda out: ("export", drive.run, "--format", "ply", "-o", out), busy_path="run.sqlite",
                              interruptible=False),
        "config_dump": Command(lambda out: ("config", "dump"), writes=False, interruptible=False),
    }
    if "stops" in lab.recordings:
        stops = lab.recordings["stops"]
        scenario = lab.small_runs / "stops/small.yaml"
        found |= {
            "simulate": Command(lambda out: ("simulate", scenario, "-o", out, "--threads", "1"), "write"),
            "demo": Command(lambda out: ("demo", scenario, "-o", out, "--threads", "1"), "write", code=6),
            "map_merge": Command(lambda out: ("map", "merge", stops.run, stops.run, "-o", out), busy_path="run.sqlite"),
            "map_export": Command(lambda out: ("map", "export", stops.run, "-o", f"{out}.tif"), busy_path="run.sqlite"),
            "map_info": Command(lambda out: ("map", "info", stops.run), busy_path="run.sqlite", writes=False,
                                interruptible=False),
        }
    return found
