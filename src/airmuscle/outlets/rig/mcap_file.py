"""Writer of MCAP files: numbers over time as messages std_msgs/msg/Float64, one topic a column.

The file has one uncompressed chunk and a summary section (MCAP specification 1.0, mcap.dev/spec),
so that it is read without an index of its own and played by `ros2 bag play -s mcap`.
"""

import dataclasses
import struct
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...core import Array

MAGIC = b"\x89MCAP0\r\n"
HEADER = 1
FOOTER = 2
SCHEMA = 3
CHANNEL = 4
MESSAGE = 5
CHUNK = 6
MESSAGE_INDEX = 7
CHUNK_INDEX = 8
STATISTICS = 11
DATA_END = 15
"""Opcodes of the records."""
MESSAGE_TYPE = "std_msgs/msg/Float64"
DEFINITION = b"float64 data"
CDR = b"\x00\x01\x00\x00"
"""Encapsulation of a little-endian CDR message."""
NANOSECONDS = 1e9


def mcap_bytes(times: Array, columns: Mapping[str, Array]) -> bytes:
    """A file with one topic for each column (N,) at times [s]; a dot of a name is a slash of its
    topic.
    """
    nanoseconds = np.rint(NANOSECONDS * np.asarray(times))
    stamps = nanoseconds.astype(np.int64).tolist()
    definitions = _schema()
    for number, name in enumerate(columns):
        definitions += _channel(number, name)
    content = _filled_chunk(definitions, stamps, columns)
    head = MAGIC + _record(HEADER, _text("ros2") + _text("airmuscle"))
    chunk = _record(CHUNK, _chunk(stamps, bytes(content.records)))
    data = head + chunk
    offsets = [len(data)]
    for record in content.index_records():
        data += record
        offsets.append(len(data))
    data += _record(DATA_END, bytes(4))
    place = _ChunkPlace(len(head), len(chunk), len(content.records), offsets)
    summary = definitions
    summary += _statistics(stamps, len(columns))
    summary += _chunk_index(stamps, place)
    footer = struct.pack("<QQI", len(data), 0, 0)
    return data + summary + _record(FOOTER, footer) + MAGIC


def _filled_chunk(definitions: bytes, stamps: list[int], columns: Mapping[str, Array]) -> "_Chunk":
    """The chunk with a message of each column at each time [ns]."""
    chunk = _Chunk(bytearray(definitions), [bytearray() for _ in columns])
    rows = np.column_stack(list(columns.values())).tolist()
    for number, stamp in enumerate(stamps):
        chunk.add(number, stamp, rows[number])
    return chunk


@dataclasses.dataclass(eq=False)
class _Chunk:
    """Records of a chunk, and for each channel the times and offsets of its messages."""

    records: bytearray
    indexes: list[bytearray]

    def add(self, row: int, stamp: int, values: list[float]) -> None:
        """Add a message for each channel."""
        for channel, value in enumerate(values):
            offset = len(self.records)
            self.indexes[channel] += struct.pack("<QQ", stamp, offset)
            head = struct.pack("<HIQQ", channel, row, stamp, stamp)
            data = CDR + struct.pack("<d", value)
            self.records += _record(MESSAGE, head + data)

    def index_records(self) -> list[bytes]:
        """The record of each index."""
        records = []
        for channel, index in enumerate(self.indexes):
            head = struct.pack("<HI", channel, len(index))
            records.append(_record(MESSAGE_INDEX, head + bytes(index)))
        return records


class _ChunkPlace(NamedTuple):
    """Where a chunk of `length` begins, the size of its records, and the offsets of its message
    indexes, which end with that behind the last one.
    """

    start: int
    length: int
    size: int
    offsets: list[int]


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def _schema() -> bytes:
    content = struct.pack("<H", 1) + _text(MESSAGE_TYPE) + _text("ros2msg")
    return _record(SCHEMA, content + struct.pack("<I", len(DEFINITION)) + DEFINITION)


def _channel(number: int, name: str) -> bytes:
    topic = "/" + name.replace(".", "/")
    content = struct.pack("<HH", number, 1) + _text(topic) + _text("cdr")
    return _record(CHANNEL, content + struct.pack("<I", 0))


def _chunk(stamps: list[int], messages: bytes) -> bytes:
    head = struct.pack("<QQQI", stamps[0], stamps[-1], len(messages), 0)
    return head + _text("") + struct.pack("<Q", len(messages)) + messages


def _statistics(stamps: list[int], count: int) -> bytes:
    counts = b"".join(struct.pack("<HQ", number, len(stamps)) for number in range(count))
    content = struct.pack("<QHIIIIQQ", count * len(stamps), 1, count, 0, 0, 1, *_ends(stamps))
    return _record(STATISTICS, content + struct.pack("<I", len(counts)) + counts)


def _chunk_index(stamps: list[int], place: _ChunkPlace) -> bytes:
    """The record that locates a chunk and its message indexes."""
    indexes = bytearray()
    for channel, offset in enumerate(place.offsets[:-1]):
        indexes += struct.pack("<HQ", channel, offset)
    length = place.offsets[-1] - place.offsets[0]
    first, last = _ends(stamps)
    parts = (
        struct.pack("<QQQQ", first, last, place.start, place.length),
        struct.pack("<I", len(indexes)),
        bytes(indexes),
        struct.pack("<Q", length),
        _text(""),
        struct.pack("<QQ", place.size, place.size),
    )
    return _record(CHUNK_INDEX, b"".join(parts))


def _ends(stamps: list[int]) -> tuple[int, int]:
    return stamps[0], stamps[-1]
