"""Rigs that are changed for bags, by the text of their rig.yaml, which Rig.to_yaml() writes with a key on a line."""

from __future__ import annotations

import json
import re
from pathlib import Path

from spartan import _core
from spartan._errors import Error

_MASK = re.compile(r'^    self_mask: (".*")\n', re.MULTILINE)
_STORED_MASK = re.compile(r"masks/\d+\.\w+")


def with_readings_in_body(rig: _core.Rig) -> _core.Rig:
    """The rig of IMU samples that are in the axes of the body already, as those of an open recording are: without the
    rotation of the IMU, which would be applied a second time. Its position stays."""
    text = re.sub(r"^(imu:\n  translation_m: .*\n  quaternion_xyzw: ).*$", r"\1[0, 0, 0, 1]", rig.to_yaml(), flags=re.MULTILINE)
    return _core.Rig.from_yaml(text)


def mounts_imu(rig: _core.Rig) -> bool:
    """Whether the axes of an IMU are known: by a pose, else as those of the body. A calibration of two cameras alone has the
    left one for its body, as which no IMU is turned."""
    return len(rig.pairs) > 1 or re.search("^(pose_convention: body|imu:)$", rig.to_yaml(), re.MULTILINE) is not None


def with_layouts(rig: _core.Rig, layouts: dict[str, str]) -> _core.Rig:
    """The rig whose cameras, by their names, deliver images of these layouts."""
    text = rig.to_yaml()
    for name, layout in layouts.items():
        camera = re.escape(json.dumps(name, ensure_ascii=False))
        text = re.sub(rf"^(  {camera}:\n(?:    .*\n)*?    pixel_layout: ).*$", rf"\g<1>{layout}", text, flags=re.MULTILINE)
    return _core.Rig.from_yaml(text)


def without_masks(rig: _core.Rig) -> _core.Rig:
    """The rig without self-masks. Its geometry is the same."""
    return _core.Rig.from_yaml(_MASK.sub("", rig.to_yaml()))


def with_masks_of(rig: _core.Rig, folder: Path) -> tuple[_core.Rig, dict[str, bytes]]:
    """The rig whose self-masks, files relative to `folder`, have the names masks/0.png …, and the contents of these
    files. Raises Error with the code `configuration` where one cannot be read."""
    files: dict[str, bytes] = {}

    def stored(found: re.Match[str]) -> str:
        file = folder / json.loads(found[1])
        name = f"masks/{len(files)}{file.suffix or '.png'}"
        try:
            files[name] = file.read_bytes()
        except OSError as error:
            raise Error("configuration", f"cannot be read: {error}", str(file), "the rig names it as self_mask") from error
        return f'    self_mask: "{name}"\n'

    return _core.Rig.from_yaml(_MASK.sub(stored, rig.to_yaml())), files


def with_known_masks(rig: _core.Rig, files: dict[str, bytes]) -> tuple[_core.Rig, list[str]]:
    """The rig without the self-masks that are not among `files`, and their names."""
    missing = []

    def known(found: re.Match[str]) -> str:
        name = json.loads(found[1])
        if name in files and _STORED_MASK.fullmatch(name):
            return found[0]
        missing.append(name)
        return ""

    return _core.Rig.from_yaml(_MASK.sub(known, rig.to_yaml())), missing


def write_masks(folder: Path, files: dict[str, bytes]) -> None:
    """Writes the files of self-masks into the folder of rig.yaml. Raises Error with the code `output`."""
    for name, content in files.items():
        if not _STORED_MASK.fullmatch(name):
            continue
        try:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content)
        except OSError as error:
            raise Error("output", f"cannot be written: {error}", str(folder / name)) from error


def of_gray_images(rig: _core.Rig) -> _core.Rig:
    """The rig without self-masks, whose cameras deliver 8-bit gray images. Its geometry is the same."""
    text = _MASK.sub("", rig.to_yaml())
    for key, value in (("pixel_layout", "gray"), ("bits", "8"), ("bit_alignment", "low")):
        text = re.sub(rf"^    {key}: .*$", f"    {key}: {value}", text, flags=re.MULTILINE)
    return _core.Rig.from_yaml(text)
