"""Writes bags of ROS 1 and ROS 2."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from spartan._errors import Error
from spartan.bags._messages import Messages


class MessageWriter(Protocol):
    """Writes messages of ROS, which `messages` makes."""

    messages: Messages

    def write(self, topic: str, stamp_ns: int, message: Any, *, latched: bool = False) -> None: ...
    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def open_writer(path: str | os.PathLike[str], storage: str = "sqlite3") -> MessageWriter:
    """By the name: `.bag` is a bag of ROS 1, `.mcap` a file with Foxglove's schemas, others are bags of ROS 2."""
    if Path(path).suffix == ".mcap":
        from spartan.bags._foxglove import FoxgloveWriter

        return FoxgloveWriter(path)
    return BagWriter(path, storage)


class BagWriter:
    """A bag that is written: `path` with the extension .bag is one of ROS 1, else a folder of ROS 2.

    storage: of ROS 2, `sqlite3` or `mcap`.
    """

    def __init__(self, path: str | os.PathLike[str], storage: str = "sqlite3") -> None:
        self.path = Path(path)
        if self.path.exists():
            raise Error("output", "exists", str(path), "choose another name")
        self.messages = Messages(ros1=self.path.suffix == ".bag")
        self._writer: Writer1 | Writer2
        if self.messages.ros1:
            self._writer = Writer1(self.path)
        else:
            plugin = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}[storage]
            self._writer = Writer2(self.path, version=9, storage_plugin=plugin)
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> Self:
        try:
            self._writer.open()
        except OSError as error:
            raise Error("output", str(error), str(self.path)) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.close()

    def write(self, topic: str, stamp_ns: int, message: Any, *, latched: bool = False) -> None:
        """Appends a message; the type of a topic is that of its first message. Latched topics reach late readers."""
        store, kind = self.messages.store, message.__msgtype__
        if topic not in self._connections:
            if isinstance(self._writer, Writer1):
                connection = self._writer.add_connection(topic, kind, typestore=store, latching=int(latched))
            else:
                connection = self._writer.add_connection(topic, kind, typestore=store)
            self._connections[topic] = connection
        ros1 = self.messages.ros1
        raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
        self._writer.write(self._connections[topic], stamp_ns, raw)
