"""Reads the messages of bags."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from spartan._errors import Error


class MessageReader(Protocol):
    """The messages of a bag, read from the start as often as needed."""

    path: Path

    def close(self) -> None: ...
    def types(self) -> dict[str, str]:
        """The type of each topic."""

    def empty_topics(self) -> set[str]:
        """Topics without messages."""

    def messages(self, topics: set[str]) -> Iterator[tuple[str, Any]]:
        """Topic and message. Raises Error with the code `input` where the bag is damaged."""


def damaged(error: Exception, path: Path) -> Error:
    return Error("input", f"cannot be read: {type(error).__name__}: {error}", str(path),
                 "the bag is damaged: repair it (rosbag reindex, ros2 bag reindex), or record it again")


class Bag:
    """A bag of ROS 1 or ROS 2 (MessageReader)."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.exists():
            raise Error("input", "no such bag", str(path))
        # Damaged files make rosbags raise errors of many kinds, of struct and of SQLite among them.
        try:
            self._reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
            self._reader.open()
        except Exception as error:
            raise Error("input", f"is not a bag: {error}", str(path)) from error

    def close(self) -> None:
        with suppress(Exception):  # after an error of reading
            self._reader.close()

    def types(self) -> dict[str, str]:
        return {connection.topic: connection.msgtype for connection in self._reader.connections}

    def empty_topics(self) -> set[str]:
        filled = {connection.topic for connection in self._reader.connections if connection.msgcount}
        return set(self.types()) - filled

    def messages(self, topics: set[str]) -> Iterator[tuple[str, Any]]:
        wanted: list[Connection] = [each for each in self._reader.connections if each.topic in topics]
        try:
            for connection, _, raw in self._reader.messages(connections=wanted) if wanted else ():
                yield connection.topic, self._reader.deserialize(raw, connection.msgtype)
        except Exception as error:
            raise damaged(error, self.path) from error


def opened(path: str | os.PathLike[str]) -> MessageReader:
    """A bag, or an MCAP file with Foxglove's schemas, which gives the same messages."""
    if Path(path).suffix == ".mcap" and Path(path).is_file():
        from spartan.bags._foxglove import FoxgloveFile, is_foxglove_file

        if is_foxglove_file(path):
            return FoxgloveFile(path)
    return Bag(path)


def first_message(bag: MessageReader, topic: str) -> Any:
    """Raises Error with the code `input` where the topic has none."""
    for _, message in bag.messages({topic}):
        return message
    raise Error("input", f"has no messages of the topic {topic}", str(bag.path))
