"""Spartan: stereo vision for rovers. Where the rover is, and what the ground around it looks like.

    import spartan

    run = spartan.run("kitti_06", "run_06")
    run.trajectory().positions   # metres, shape (n, 3)
    run.map().view()["elevation_m"]

Units are SI and radians, stamps are integer nanoseconds, images and maps are arrays of numpy. Frames and covariances:
docs/conventions.md.
"""

from spartan import _core
from spartan._core import *  # noqa: F403
from spartan._errors import Error as Error
from spartan._run import Run as Run
from spartan._run import run as run

__version__: str = getattr(_core, "__version__")
__all__ = [*(name for name in dir(_core) if not name.startswith("_")), "Error", "Run", "run"]
