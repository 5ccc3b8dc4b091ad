"""Recordings and runs that make_small_runs has filled (tests/program/small_drive.h), and the program to compare with."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import spartan


@pytest.fixture(scope="session")
def small_runs() -> Path:
    folder = os.environ.get("SPARTAN_SMALL_RUNS")
    if not folder:
        pytest.skip("SPARTAN_SMALL_RUNS names no folder of make_small_runs")
    return Path(folder)


@pytest.fixture(scope="session")
def drive(small_runs: Path) -> Path:
    """Images of a synthetic world in the layout of KITTI, 320x240."""
    return small_runs / "drive"


@pytest.fixture(scope="session")
def drive_run(small_runs: Path) -> spartan.Run:
    """The run of that drive by the program."""
    return spartan.Run(small_runs / "drive_run")


def heights_above(world, points):
    """Heights of points above the free ground of a map; those elsewhere are left out."""
    samples = [(z, world.at(x, y)) for x, y, z in points]
    return [z - sample.elevation_m for z, sample in samples if sample is not None and sample.kind == "free"]


@pytest.fixture(scope="session")
def stops(small_runs: Path) -> Path:
    """A simulated recording with stops and all sensors."""
    return small_runs / "stops" / "rec"


@pytest.fixture(scope="session")
def stops_run(small_runs: Path) -> spartan.Run:
    return spartan.Run(small_runs / "stops" / "whole")


@pytest.fixture(scope="session")
def program():
    """Runs the program and returns what it printed."""
    path = os.environ.get("SPARTAN_PROGRAM")
    if not path:
        pytest.skip("SPARTAN_PROGRAM names no program")

    # A sanitized interpreter has its run-time preloaded; the program has its own.
    environment = {key: value for key, value in os.environ.items() if key != "LD_PRELOAD"}

    def call(*arguments: object) -> str:
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, timeout=300, env=environment)
        assert done.returncode in (0, 6), done.stderr
        return done.stdout

    return call


def frames_of(recording: spartan.Recording) -> list[spartan.StereoFrame]:
    return [sample for sample in recording if isinstance(sample, spartan.StereoFrame)]


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]
