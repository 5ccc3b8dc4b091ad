"""The tutorial as a doctest, and the notebook executed."""

import doctest
import importlib.util
import os
from pathlib import Path

import pytest

SOURCE = Path(os.environ.get("SPARTAN_SOURCE_DIR", Path(__file__).resolve().parents[2]))


def test_the_tutorial_is_true(drive, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kitti").symlink_to(drive)
    failed, tried = doctest.testfile(str(SOURCE / "docs/tutorials/python.md"), module_relative=False,
                                     optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert failed == 0 and tried > 30
    assert (tmp_path / "map.png").stat().st_size > 5000


@pytest.mark.parametrize("name", ["map_layers", "covariances"])
def test_other_tutorials_are_true(stops_run, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_run").symlink_to(stops_run.path)
    failed, tried = doctest.testfile(str(SOURCE / f"docs/tutorials/{name}.md"), module_relative=False)
    assert failed == 0 and tried >= 3


@pytest.mark.skipif(importlib.util.find_spec("nbclient") is None, reason="nbclient is not installed")
def test_the_notebook_runs(drive, tmp_path, monkeypatch):
    import nbclient
    import nbformat

    monkeypatch.setenv("RECORDING", str(drive))
    notebook = nbformat.read(SOURCE / "docs/tutorials/kitti.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    images = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(images) == 3 and "TrajectoryMetrics" in outputs[-1]["data"]["text/plain"]
    if keep := os.environ.get("SPARTAN_KEEP_NOTEBOOK"):
        nbformat.write(notebook, keep)
