"""Writes bags of ROS 1 and ROS 2."""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag1.writer import WriterError as WriterError1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.rosbag2.errors import WriterError as WriterError2

from spartan._errors import Error
from spartan.bags._messages import Messages

_UNSPECIFIED = QosTime(0, 0)
# The publisher of a latched topic of ROS 2: it keeps its last message for subscribers that come later. tf2 subscribes to
# /tf_static with these settings, and would get nothing from a publisher with those of other topics.
_LATCHED = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, _UNSPECIFIED, _UNSPECIFIED,
               QosLiveliness.AUTOMATIC, _UNSPECIFIED, False)


class MessageWriter(Protocol):
    """Writes messages of ROS, which `messages` makes."""

    messages: Messages

    def write(self, topic: str, stamp_ns: int, message: Any, *, latched: bool = False) -> None: ...
    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None: ...


@contextmanager
def output_errors(path: Path) -> Iterator[None]:
    """Raises Error with the code `output` where the block cannot write `path`."""
    try:
        yield
    except (OSError, sqlite3.Error, WriterError1, WriterError2) as error:
        raise Error("output", f"cannot be written: {error}", str(path),
                    "free space there, or choose a place that can be written") from error


class UnfinishedOutput:
    """A file or folder that is written beside `path`, under `part`, and gets its name when it is complete.

    After an error nothing is left of it. Raises Error where `path` exists.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if self.path.exists():
            raise Error("output", "exists", str(path), "choose another name")
        self.part = self.path

    def begin(self) -> None:
        """Makes the folder around `part`, whose last name is that of `path`: bags of ROS 2 contain it."""
        with output_errors(self.path):
            folder = tempfile.mkdtemp(prefix=f".{self.path.name[:64]}.", dir=self.path.parent)
        self.part = Path(folder) / self.path.name

    def finish(self) -> None:
        with output_errors(self.path):
            self.part.rename(self.path)
        self.discard()

    def discard(self) -> None:
        if self.part != self.path:
            shutil.rmtree(self.part.parent, ignore_errors=True)


def open_writer(path: str | os.PathLike[str], storage: str = "sqlite3") -> MessageWriter:
    """By the name: `.bag` is a bag of ROS 1, `.mcap` a file with Foxglove's schemas, others are bags of ROS 2."""
    if Path(path).suffix == ".mcap":
        from spartan.bags._foxglove import FoxgloveWriter

        return FoxgloveWriter(path)
    return BagWriter(path, storage)


class BagWriter:
    """A bag that is written: `path` with the extension .bag is one of ROS 1, else a folder of ROS 2.

    It is there when the `with` block has ended without an error; after an error, nothing is. storage: of ROS 2, `sqlite3`
    or `mcap`. Raises Error with the code `output` where it cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], storage: str = "sqlite3") -> None:
        self._output = UnfinishedOutput(path)
        self.path = self._output.path
        self.messages = Messages(ros1=self.path.suffix == ".bag")
        self._storage = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}[storage]
        self._writer: Writer1 | Writer2
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> Self:
        with output_errors(self.path):
            if not self.messages.ros1:
                self.path.parent.mkdir(parents=True, exist_ok=True)
        self._output.begin()
        try:
            with output_errors(self.path):
                if self.messages.ros1:
                    self._writer = Writer1(self._output.part)
                else:
                    self._writer = Writer2(self._output.part, version=9, storage_plugin=self._storage)
                self._writer.open()
        except BaseException:
            self._output.discard()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with output_errors(self.path):
                self._writer.__exit__(kind, value, trace)
            if kind is None:
                self._output.finish()
        finally:
            self._output.discard()

    def write(self, topic: str, stamp_ns: int, message: Any, *, latched: bool = False) -> None:
        """Appends a message; the type of a topic is that of its first message. Latched topics reach late readers."""
        store, kind = self.messages.store, message.__msgtype__
        ros1 = self.messages.ros1
        raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
        with output_errors(self.path):
            if topic not in self._connections:
                self._connections[topic] = self._connect(topic, kind, latched)
            self._writer.write(self._connections[topic], stamp_ns, raw)

    def _connect(self, topic: str, kind: str, latched: bool) -> Connection:
        store = self.messages.store
        if isinstance(self._writer, Writer1):
            return self._writer.add_connection(topic, kind, typestore=store, latching=int(latched))
        offered = [_LATCHED] if latched else []
        return self._writer.add_connection(topic, kind, typestore=store, offered_qos_profiles=offered)
