"""Images of messages as arrays."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import numpy.typing as npt

from spartan._errors import Error

# Without RGB of 16 bits, which a recording cannot hold.
_LAYOUTS = {
    "mono8": "gray", "8UC1": "gray", "mono16": "gray", "16UC1": "gray", "rgb8": "rgb", "bgr8": "rgb", "8UC3": "rgb",
    "rgba8": "rgb", "bgra8": "rgb", "8UC4": "rgb",
    **{f"bayer_{pattern}{bits}": f"bayer_{pattern}" for pattern in ("rggb", "grbg", "gbrg", "bggr") for bits in (8, 16)},
}


def stamp_of(message: Any) -> int:
    """Of the header, ns."""
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def _decompressed(message: Any) -> npt.NDArray[Any]:
    import PIL.Image

    decoded: PIL.Image.Image = PIL.Image.open(io.BytesIO(bytes(message.data)))
    return np.array(decoded if decoded.mode in ("L", "I;16") else decoded.convert("RGB"))


def _unpacked(message: Any, layout: str) -> npt.NDArray[Any]:
    """The rows of an image that is not compressed, without their padding."""
    wide = message.encoding.endswith("16") or message.encoding.startswith("16")
    kind = np.dtype(np.uint16 if wide else np.uint8).newbyteorder(">" if message.is_bigendian else "<")
    channels = 1 if layout != "rgb" else 4 if message.encoding in ("rgba8", "bgra8", "8UC4") else 3
    used = message.width * channels * kind.itemsize
    if used == 0 or message.height == 0 or message.step < used or len(message.data) < message.step * message.height:
        raise ValueError(f"it has {len(message.data)} bytes for {message.width} x {message.height} pixels")
    rows = np.frombuffer(bytes(message.data), np.uint8)[: message.step * message.height].reshape(message.height, -1)
    pixels = np.ascontiguousarray(rows[:, :used]).view(kind).astype(kind.newbyteorder("="), copy=False)
    if layout == "rgb":  # without alpha; encodings that name no colours are those of OpenCV
        pixels = pixels.reshape(message.height, message.width, channels)[:, :, :3]
        pixels = np.ascontiguousarray(pixels if message.encoding.startswith("rgb") else pixels[:, :, ::-1])
    return pixels


def pixels_of(message: Any, topic: str) -> tuple[npt.NDArray[Any], str]:
    """The image as an array, of shape (height, width) or (height, width, 3), and its layout. Raises Error with the code
    `input` where it cannot be decoded."""
    compressed = hasattr(message, "format")
    if not compressed and message.encoding not in _LAYOUTS:
        raise Error("input", f"images of encoding '{message.encoding}' are not read", topic, f"known: {', '.join(_LAYOUTS)}")
    layout = "" if compressed else _LAYOUTS[message.encoding]
    try:
        pixels = _decompressed(message) if compressed else _unpacked(message, layout)
    except Exception as error:  # of PIL, whose decoders raise many kinds, or of a damaged message
        raise Error("input", f"the image of stamp {stamp_of(message)} ns cannot be decoded: {error}", topic,
                    "the bag is damaged there; record it again, or filter this message out") from error
    if compressed:  # "bayer_rggb8; png compressed ": the encoding before compression, or a codec alone
        encoded = _LAYOUTS.get(message.format.split(";")[0].strip(), "gray")
        layout = "rgb" if pixels.ndim == 3 else encoded if encoded.startswith("bayer") else "gray"
    return pixels, layout
