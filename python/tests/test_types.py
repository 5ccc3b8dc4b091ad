"""The type stubs, and a typed program that uses them."""

import importlib.util
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import spartan

mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")


def check(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    package = Path(spartan.__file__).parent.parent
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(cwd / "cache"), *map(str, arguments)],
                          capture_output=True, text=True, cwd=cwd, env={**os.environ, "MYPYPATH": str(package)})


@mypy
def test_the_package_is_typed(tmp_path):
    done = check("-p", "spartan", cwd=tmp_path)
    assert done.returncode == 0, done.stdout


@mypy
def test_a_wrong_use_is_found(tmp_path):
    (tmp_path / "use.py").write_text(textwrap.dedent("""
        from pathlib import Path
        import numpy as np
        import spartan

        def depth(left: np.typing.NDArray[np.uint8], geometry: spartan.RectifiedStereo) -> np.typing.NDArray[np.float32]:
            found = spartan.DisparityComputer(spartan.DisparityOptions(p1=20)).compute(left, left, 64)
            return geometry.depth(found.disparity)

        run: spartan.Run = spartan.run(Path("in"), "out", progress=lambda p: print(p.done))
        positions = run.trajectory().positions
        options = spartan.RunOptions()
        options.odometry.detection.landmarks = 3
    """))
    done = check("use.py", cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    wrong = 'options.reconstruction.method = "magic"\nrun.trajectory(3)\nspartan.Pose().nothing()\n'
    (tmp_path / "wrong.py").write_text("import spartan\noptions = spartan.RunOptions()\nrun = spartan.Run('x')\n" + wrong)
    done = check("wrong.py", cwd=tmp_path)
    assert done.stdout.count(": error:") == 3, done.stdout


def test_everything_public_is_documented():
    missing = [name for name, each in vars(spartan).items()
               if not name.startswith("_") and callable(each) and not (each.__doc__ or "").strip()]
    assert missing == []


def test_the_public_names_are_those_of_the_package():
    """Reference and `from spartan import *` have what the extension defines and what is written in Python."""
    names = set(spartan.__all__)
    assert {"Imager", "Pose", "design_rig", "Error", "Run", "run"} <= names
    assert all(hasattr(spartan, name) and not name.startswith("_") for name in names)
