"""Reader of bags of ROS 1 and ROS 2: the numbers of all topics with the times of their messages."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core import FileError
from ....recording.recording import RowNote
from ..tables import Channel, RawTable, Selection, import_lab_package, merge_channels, reading

STANDARD = ("geometry_msgs/", "sensor_msgs/", "nav_msgs/", "trajectory_msgs/", "control_msgs/")
"""Packages whose fields are no quantities of a muscle by their names, except those in
QUANTITY_FIELDS.
"""
FIELD_UNITS = {
    "geometry_msgs/msg/Wrench": {"force": "N", "torque": "N m"},
    "geometry_msgs/msg/Twist": {"linear": "m/s", "angular": "rad/s"},
    "geometry_msgs/msg/Accel": {"linear": "m/s^2", "angular": "rad/s^2"},
    "geometry_msgs/msg/Pose": {"position": "m"},
    "geometry_msgs/msg/Transform": {"translation": "m"},
    "geometry_msgs/msg/PointStamped": {"point": "m"},
    "sensor_msgs/msg/Imu": {"angular_velocity": "rad/s", "linear_acceleration": "m/s^2"},
    "sensor_msgs/msg/JointState": {"position": "rad", "velocity": "rad/s", "effort": "N m"},
    "sensor_msgs/msg/Range": {"range": "m"},
    "sensor_msgs/msg/FluidPressure": {"fluid_pressure": "Pa(a)"},
    "sensor_msgs/msg/Temperature": {"temperature": "°C"},
}
"""The unit of a field and of the numbers inside it, by type and name; those of JointState are of
revolute joints.
"""
QUANTITY_FIELDS = {"fluid_pressure": "pressure", "temperature": "temperature"}
"""Fields of standard messages that are quantities, with the names of these."""

LOGS = ("/Log", "/DiagnosticArray", "/DiagnosticStatus", "/ParameterEvent")
"""Ends of the types of messages that report on programs, whose numbers are no measurements; they
are read if their topic is selected.
"""

MAX_ELEMENTS = 64
"""Elements of a list of numbers that become columns at most (chosen): joints, not pictures."""


@dataclasses.dataclass(frozen=True)
class _Field:
    """A number of a message: its path, its unit, and whether its name may state a quantity."""

    name: str
    unit: str
    is_quantity: bool


def read_rosbag_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """One table from a bag of ROS 1 (.bag) or ROS 2 (.db3 or .mcap, in a folder with
    metadata.yaml; an MCAP file also alone).

    Columns are named `topic.field`: `joint_states.position.elbow`, with the name of the joint where
    a message has some. The field `data` alone is named by its topic. Fields of standard messages
    have the units of their type, and are no quantities by their names, except those of
    FluidPressure (absolute) and Temperature. The time is that at which a message was recorded, from
    the first one on. `selection.group` names
    topics. Files of one ROS 2 bag are read together. Raises
    FileError or ColumnError.
    """
    highlevel = import_lab_package("rosbags.highlevel", path)
    has_metadata = (path.parent / "metadata.yaml").exists()
    if path.suffix == ".db3" and not has_metadata:
        raise FileError(
            f"{path}: there is no metadata.yaml next to it; copy the whole folder of the ROS 2 bag."
        )
    # An MCAP file describes its topics itself.
    is_alone = path.suffix == ".bag" or not has_metadata
    bag_path = path if is_alone else path.parent
    name = path.stem if path.suffix == ".mcap" and is_alone else bag_path.name
    if not is_alone:
        parts = [part for part in path.parent.iterdir() if part.suffix == path.suffix]
        if path != min(parts):
            return ()  # the first file of the folder stands for all of them
    with reading(path, "ROS bag"):
        typestore = import_lab_package("rosbags.typesys", path)
        default = typestore.get_typestore(typestore.Stores.ROS2_HUMBLE)
        with highlevel.AnyReader([bag_path], default_typestore=default) as bag:
            topics = _messages_by_topic(bag, name, selection)
    channels = list[Channel]()
    for topic, messages in topics.items():
        channels += _topic_channels(topic, messages)
    if not channels:
        raise FileError(f"{path}: no topic contains numbers.")
    table = merge_channels(name, channels, {}, "message", selection.columns)
    return (table.noted(*_repeated_times(topics)),)


def _repeated_times(topics: Mapping[str, Sequence[tuple[float, Any]]]) -> Iterator[RowNote]:
    """Notes on the messages that are left out because they have the time of the one before."""
    for topic, messages in topics.items():
        times = [time for time, _ in messages]
        count = int(np.sum(np.diff(times) <= 0.0))
        if count:
            yield RowNote(
                f"{len(times) - count} of {len(times)} messages of topic '{topic}' are read: the"
                " others have the time of the message before."
            )


Topics = dict[str, list[tuple[float, dict[_Field, float]]]]
"""The times [s] and the numbers of the messages of each topic."""


def _messages_by_topic(bag: Any, origin: str, selection: Selection) -> Topics:
    """The times [s] and the numbers of the messages of the selected topics."""
    names = dict.fromkeys(connection.topic for connection in bag.connections)
    selected = selection.groups(origin, "topic", names)
    chosen = [connection for connection in bag.connections if connection.topic in selected]
    if selection.group is None:  # logs are read on demand only
        chosen = [c for c in chosen if not c.msgtype.endswith(LOGS)]
    topics: Topics = {}
    if not chosen:  # without connections, a bag returns the messages of all of them
        return topics
    for connection, stamp, raw in bag.messages(connections=chosen):
        numbers = dict(_numbers(bag.deserialize(raw, connection.msgtype), ""))
        topic = connection.topic.strip("/").replace("/", ".")
        if numbers:
            time = (stamp - bag.start_time) * 1e-9
            topics.setdefault(topic, []).append((time, numbers))
    return topics


def _is_vector(item: Any) -> bool:
    """Whether a field is a vector of numbers that is short enough for columns of a table."""
    is_numeric = isinstance(item, np.ndarray) and item.dtype.kind in "biuf"
    return is_numeric and 0 < item.size <= MAX_ELEMENTS


def _numbers(value: Any, path: str, unit: str = "") -> Iterator[tuple[_Field, float]]:
    """The numbers of a message by their fields; headers are left out."""
    names = getattr(value, "name", None)
    kind = str(getattr(value, "__msgtype__", ""))
    labels = [str(n) for n in names] if isinstance(names, list | tuple) else []
    for field in getattr(value, "__dataclass_fields__", {}):
        if field in ("header", "layout", "__msgtype__") or field.endswith("covariance"):
            continue
        item = getattr(value, field)
        within = FIELD_UNITS.get(kind, {}).get(field, unit)
        stated = bool(within) and field in QUANTITY_FIELDS
        name = QUANTITY_FIELDS[field] if stated else field
        inner = f"{path}.{name}" if path else name
        if isinstance(item, bool | int | float | np.number):
            number = item.item() if isinstance(item, np.number) else item
            # x, y and z are parts of a vector in every message
            is_named = len(field) > 1 and not kind.startswith(STANDARD)
            yield _Field(inner, within, stated or is_named), number
        elif _is_vector(item):
            words = labels if len(labels) == item.size else [str(i) for i in range(item.size)]
            fields = (_Field(f"{inner}.{word}", within, False) for word in words)
            yield from zip(fields, item.ravel().tolist(), strict=True)
        elif hasattr(item, "__dataclass_fields__"):
            yield from _numbers(item, inner, within)


def _topic_channels(topic: str, messages: list[tuple[float, dict[_Field, float]]]) -> list[Channel]:
    """One channel for each number of a topic; where a message lacks it, there is no row."""
    fields = dict.fromkeys(field for _, numbers in messages for field in numbers)
    channels = []
    for field in fields:
        rows = []
        for instant, numbers in messages:
            if field in numbers:
                rows.append((instant, numbers[field]))
        time = np.array([instant for instant, _ in rows])
        # integers remain integers, which are held between messages
        values = np.array([value for _, value in rows])
        first = np.concatenate([[True], np.diff(time) > 0])
        name = topic if field.name == "data" else f"{topic}.{field.name}"
        channels.append(Channel(name, values[first], time[first], field.unit, field.is_quantity))
    return channels
