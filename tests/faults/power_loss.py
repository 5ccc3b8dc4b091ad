"""What a disk may hold after a loss of power: a model over the trace of fault_shim.cpp.

Durable are the content of a file at its last fsync and the names in a folder at the folder's last fsync. Everything
later may have reached the disk or not, each write and each name on its own and in any order.
"""
import random
import struct
from pathlib import Path


def read_trace(path):
    """Records (kind, path, other, offset, data) in the order in which they happened."""
    data, at, records = Path(path).read_bytes(), 0, []

    def field():
        nonlocal at
        (size,) = struct.unpack_from("<Q", data, at)
        at += 8 + size
        return data[at - size : at]

    while at < len(data):
        kind, file, other, offset, content = field().decode(), field(), field(), struct.unpack("<Q", field())[0], field()
        records.append((kind, file.decode(errors="surrogateescape"), other.decode(errors="surrogateescape"), offset, content))
    return records


class Disk:
    """Files as bytes, with what is durable and what is only in memory."""

    def __init__(self):
        self.content = {}  # inode -> durable content
        self.pending = {}  # inode -> writes and truncations since then
        self.names = {}  # path -> inode, as programs see it
        self.durable = {}  # path -> inode, as after the last fsync of its folder
        self.later = []  # changes of names since then, in order: (folder, path, inode or None)
        self.next_inode = 0

    def _set_name(self, path, inode):
        if inode is None:
            self.names.pop(path, None)
        else:
            self.names[path] = inode
        self.later.append((str(Path(path).parent), path, inode))

    def apply(self, kind, path, other, offset, data):
        if kind == "C" or (kind in "WST" and path not in self.names):
            self.content[self.next_inode] = b""
            self.pending[self.next_inode] = []
            self._set_name(path, self.next_inode)
            self.next_inode += 1
        if kind in "WT":
            self.pending[self.names[path]].append((kind, offset, data))
        elif kind == "S":
            self.content[self.names[path]] = data
            self.pending[self.names[path]] = []
        elif kind == "R":
            inode = self.names.get(path)
            self._set_name(path, None)
            self._set_name(other, inode)
        elif kind == "U":
            self._set_name(path, None)
        elif kind == "D":
            for folder, name, inode in self.later:
                if folder == path:
                    self._make_durable(name, inode)
            self.later = [change for change in self.later if change[0] != path]

    def _make_durable(self, name, inode):
        if inode is None:
            self.durable.pop(name, None)
        else:
            self.durable[name] = inode

    def after_power_loss(self, draw):
        """Path -> content; `draw` is a random.Random."""
        names = dict(self.durable)
        for _, name, inode in self.later:
            if draw.random() < 0.5:
                if inode is None:
                    names.pop(name, None)
                else:
                    names[name] = inode
        return {name: self._content(inode, draw) for name, inode in names.items() if inode is not None}

    def _content(self, inode, draw):
        content = bytearray(self.content[inode])
        kept = [write for write in self.pending[inode] if draw.random() < 0.5]
        draw.shuffle(kept)
        for kind, offset, data in kept:
            if kind == "T":
                del content[offset:]
            else:
                content.extend(b"\0" * (offset - len(content)))
                content[offset : offset + len(data)] = data
        return bytes(content)


def state_after(records, count, seed):
    """What the disk holds if power is lost after the first `count` records."""
    disk = Disk()
    for record in records[:count]:
        disk.apply(*record)
    return disk.after_power_loss(random.Random(seed))
