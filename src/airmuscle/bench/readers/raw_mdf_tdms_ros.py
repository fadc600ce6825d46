"""Readers of channels with times of their own: MDF 3 and 4 (ASAM), TDMS (LabVIEW), and bags of
messages (ROS).
"""

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, FileError, check_known
from .channels import Channel, RawTable, merge_channels
from .separate_process import import_lab_package, in_separate_process, reading
from .time_base import Decimation, Downsampling, Reduction

_TIME_MASTER = 1
"""Type of a master channel that contains time, in both versions of the format."""


@in_separate_process("asammdf")
def read_mdf_tables(
    path: Path, group: str | None = None, downsampling: Downsampling = Decimation()
) -> tuple[RawTable, ...]:
    """Read one table from all channels, or from the named channel group. Raises FileError or
    ColumnError. A channel group with more than `downsampling.max_rows` rows is read by pieces and
    reduced."""
    with reading(path, "MDF"), import_lab_package("asammdf", path).MDF(path) as file:
        names = [
            str(getattr(g.channel_group, "acq_name", "") or f"group {i}")
            for i, g in enumerate(file.groups, 1)
        ]
        check_known(
            f"{path.name}: no group",
            [] if group is None else group,
            names,
            "the groups are",
            FileError,
        )
        reductions = {
            i: Reduction(downsampling, int(file.groups[i].channel_group.cycles_nr))
            for i, name in enumerate(names)
            if group in (None, name)
        }
        table = merge_channels(path.name, list(_channels(file, reductions)), {})
        notes = [
            f"Channel group '{names[i]}': {each.note}"
            for i, each in reductions.items()
            if each.note
        ]
        return (table.noted(*notes),)


def _channels(file: Any, reductions: Mapping[int, Reduction]) -> Iterator[Channel]:
    """The channels of groups by their indices."""
    for i, reduction in reductions.items():
        master = file.masters_db.get(i)
        channels = file.groups[i].channels
        time = None
        timed = (
            master is not None
            and getattr(channels[master], "sync_type", _TIME_MASTER) == _TIME_MASTER
        )
        for j, channel in enumerate(channels):
            if j == master and timed:
                continue
            if reduction.step == 1:
                signal = file.get(group=i, index=j)
                time = np.asarray(signal.timestamps, dtype=float) if timed else None
                yield Channel(channel.name, signal.samples, time, signal.unit or "")
                continue
            if timed and time is None:
                time = reduction.read(functools.partial(_times, file, i), reduction.rows)
            samples = reduction.read(functools.partial(_samples, file, i, j), reduction.rows)
            unit = file.get(group=i, index=j, record_offset=0, record_count=1).unit or ""
            yield Channel(channel.name, samples, time, unit)


def _times(file: Any, group: int, first: int, end: int) -> Array:
    return np.asarray(
        file.get_master(group, record_offset=first, record_count=end - first), dtype=float
    )


def _samples(file: Any, group: int, channel: int, first: int, end: int) -> Any:
    return file.get(
        group=group, index=channel, record_offset=first, record_count=end - first
    ).samples


NO_DATE = np.datetime64("1904-01-01T00:00:00", "us")
"""The date that LabVIEW writes where none is set, the origin of its time."""


def read_tdms_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """Read one table from each group with channels, or from the named group. Raises FileError or
    ColumnError.
    """
    nptdms = import_lab_package("nptdms", path)
    nptdms.log.log_manager.set_level(
        "CRITICAL"
    )  # what it prints of a damaged file is the contents of the file
    with reading(path, "TDMS"), nptdms.TdmsFile.open(path) as file:
        nonempty = {g.name: g for g in file.groups() if any(len(c) for c in g.channels())}
        if not nonempty:
            raise FileError(f"{path.name}: no channel contains values.")
        check_known(
            f"{path.name}: no group",
            [] if group is None else group,
            nonempty,
            "the groups are",
            FileError,
        )
        selected = [each for name, each in nonempty.items() if group in (None, name)]
        tables = list[RawTable]()
        for each in selected:
            constants = {
                name: value
                for name, value in {**file.properties, **each.properties}.items()
                if isinstance(value, float | int | str)
                and name not in ("name", "description", "title", "author")
            }
            channels = []
            for channel, start in zip(each.channels(), _start_times(each.channels()), strict=True):
                unit = str(
                    channel.properties.get("unit_string")
                    or channel.properties.get("NI_UnitDescription")
                    or ""
                )
                time = None
                step = _step(channel)
                if step > 0.0:
                    offset = float(channel.properties.get("wf_start_offset", 0.0))
                    time = np.asarray(start + offset + step * np.arange(len(channel)))
                channels.append(Channel(channel.name, channel[:], time, unit))
            origin = f"{path.name}, group '{each.name}'" if len(selected) > 1 else path.name
            tables.append(merge_channels(origin, channels, constants))
        return tuple(tables)


def _start_times(channels: list[Any]) -> list[float]:
    """The start of each waveform after that of the first [s]; 0 for all unless each waveform states
    its date.
    """
    dates = {
        i: c.properties.get("wf_start_time")
        for i, c in enumerate(channels)
        if _step(c) > 0.0 and len(c)
    }
    if any(date is None or np.datetime64(date) <= NO_DATE for date in dates.values()):
        return [0.0] * len(channels)
    instants = {i: np.datetime64(date, "us") for i, date in dates.items()}
    first = min(instants.values(), default=NO_DATE)
    return [
        float((instants.get(i, first) - first) / np.timedelta64(1, "s"))
        for i in range(len(channels))
    ]


def _step(channel: Any) -> float:
    """The sample time of a waveform [s]; 0 for other channels, for which LabVIEW writes none or one
    of zero.
    """
    return float(channel.properties.get("wf_increment", 0.0))


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

MAX_ELEMENTS = 64
"""Elements of a list of numbers that become columns at most (chosen): joints, not pictures."""


@dataclasses.dataclass(frozen=True)
class _Field:
    """A number of a message: its path, its unit, and whether its name may state a quantity."""

    name: str
    unit: str
    is_quantity: bool


def read_rosbag_tables(path: Path, group: str | None = None) -> tuple[RawTable, ...]:
    """One table from a bag of ROS 1 (.bag) or ROS 2 (.db3 or .mcap, in a folder with
    metadata.yaml).

    Columns are named `topic.field`: `joint_states.position.elbow`, with the name of the joint where
    a message has some. The field `data` alone is named by its topic. Fields of standard messages
    have the units of their type, and are no quantities by their names, except those of
    FluidPressure (absolute) and Temperature. The time is that at which a message was recorded, from
    the first one on. `group` selects one topic. Files of one ROS 2 bag are read together. Raises
    FileError or ColumnError.
    """
    highlevel = import_lab_package("rosbags.highlevel", path)
    folder = path if path.suffix == ".bag" else path.parent
    if path.suffix != ".bag" and not (folder / "metadata.yaml").exists():
        raise FileError(
            f"{path}: there is no metadata.yaml next to it; copy the whole folder of the ROS 2 bag."
        )
    if path.suffix != ".bag" and path != min(
        p for p in folder.iterdir() if p.suffix == path.suffix
    ):
        return ()
    topics: dict[str, list[tuple[float, dict[_Field, float]]]] = {}
    with reading(path, "ROS bag"):
        typestore = import_lab_package("rosbags.typesys", path)
        default = typestore.get_typestore(typestore.Stores.ROS2_HUMBLE)
        with highlevel.AnyReader([folder], default_typestore=default) as bag:
            chosen = [
                c
                for c in bag.connections
                if group is None or c.topic.strip("/") == group.strip("/")
            ]
            for connection, stamp, raw in bag.messages(connections=chosen) if chosen else ():
                numbers = dict(_numbers(bag.deserialize(raw, connection.msgtype), ""))
                topic = connection.topic.strip("/").replace("/", ".")
                if numbers:
                    topics.setdefault(topic, []).append(((stamp - bag.start_time) * 1e-9, numbers))
    channels = [
        channel
        for topic, messages in topics.items()
        for channel in _topic_channels(topic, messages)
    ]
    if not channels:
        raise FileError(
            f"{path}: no topic contains"
            f" numbers{f', or there is no topic {group}' if group else ''}."
        )
    return (merge_channels(folder.name, channels, {}, "message"),)


def _numbers(value: Any, path: str, unit: str = "") -> Iterator[tuple[_Field, float]]:
    """The numbers of a message by their fields; headers are left out."""
    names = getattr(value, "name", None)
    kind = str(getattr(value, "__msgtype__", ""))
    labels = [str(n) for n in names] if isinstance(names, list | tuple) else []
    for field in getattr(value, "__dataclass_fields__", {}):
        item = getattr(value, field)
        within = FIELD_UNITS.get(kind, {}).get(field, unit)
        stated = bool(within) and field in QUANTITY_FIELDS
        inner = ".".join([*([path] if path else []), QUANTITY_FIELDS[field] if stated else field])
        if field in ("header", "layout", "__msgtype__") or field.endswith("covariance"):
            continue
        if isinstance(item, bool | int | float | np.number):
            number = item.item() if isinstance(item, np.number) else item
            own = len(field) > 1 and not kind.startswith(
                STANDARD
            )  # x, y and z are parts of a vector in every message
            yield _Field(inner, within, stated or own), number
        elif (
            isinstance(item, np.ndarray)
            and item.dtype.kind in "biuf"
            and 0 < item.size <= MAX_ELEMENTS
        ):
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
        rows = [(time, numbers[field]) for time, numbers in messages if field in numbers]
        time, values = map(
            np.array, zip(*rows, strict=True)
        )  # integers remain integers: held between messages
        first = np.concatenate([[True], np.diff(time) > 0])
        name = topic if field.name == "data" else f"{topic}.{field.name}"
        channels.append(Channel(name, values[first], time[first], field.unit, field.is_quantity))
    return channels
