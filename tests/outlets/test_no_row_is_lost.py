"""No row is lost and no column is read as another silently: rows in are rows out, or the number of
both is said; only measured channels decide which rows there are; columns are counted as in the file.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from measurement_files import FILES, ROWS, STEP, UNITS, WRITERS, table_of_cells

from airmuscle.bench import ColumnMapping, NoTime, read
from airmuscle.bench.readers import Channel, merge_channels
from airmuscle.bench.readers.formats import format_table
from airmuscle.bench.readers.tables import constants
from airmuscle.errors import AirmuscleWarning, ColumnError
from airmuscle.recording import columns

TIME = STEP * np.arange(ROWS)
PRESSURE = Channel("pressure [bar]", 1.0 + TIME, TIME)
ONCE = Channel("room", np.array([20.0]), np.array([0.3]))
LEVEL = Channel("level", np.array([2, 3]), np.array([-0.1, 0.3]))
WORD = Channel("state", np.array(["a", "b"]), np.array([0.0, 0.3]))
LATE_WORD = Channel("message", np.array(["a", "b"]), np.array([0.2, 0.3]))
SLOW = Channel("battery", np.linspace(0.0, 1.0, 7), np.linspace(0.0, 0.6, 7))
SHORT = Channel("gripper", np.linspace(0.0, 1.0, 20), 0.2 + STEP * np.arange(20))
UNTIMED = Channel("settings", np.zeros(7))
BACKWARDS = Channel("tick", np.arange(9.0), np.arange(9.0)[::-1])


@pytest.mark.parametrize(
    ("channel", "note"),
    [
        (ONCE, "Channel 'room' was written once and is held in all rows."),
        (LEVEL, "Channel 'level' has its own time vector: its 2 rows are held to the 60 rows"),
        (WORD, "Channel 'state' has its own time vector: its 2 rows are held to the 60 rows"),
        (LATE_WORD, "Channel 'message' is left out: it has 2 of 60 rows, from 0.2 s to 0.3 s"),
        (SLOW, "Channel 'battery' has its own time vector: its 7 rows are interpolated"),
        (SHORT, "Channel 'gripper' is left out: it has 20 of 60 rows, from 0.2 s to 0.39 s"),
        (UNTIMED, "Channel 'settings' is left out: it has 7 of 60 rows, and no time."),
        (BACKWARDS, "Channel 'tick' is left out"),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
@pytest.mark.parametrize("first", [True, False])
def test_a_channel_that_is_no_quantity_takes_no_row_from_the_measured_ones(channel, note, first):
    channels = [channel, PRESSURE] if first else [PRESSURE, channel]
    table = merge_channels("made", channels, {})
    columns = dict(zip(table.headings, table.columns, strict=True))
    assert np.array_equal(columns["pressure [bar]"], PRESSURE.values)
    assert note in " ".join(table.notes)
    assert (channel.name in columns) == ("left out" not in note)


def test_values_of_channels_with_their_own_times():
    table = merge_channels("made", [PRESSURE, ONCE, LEVEL, WORD, SLOW], {})
    columns = dict(zip(table.headings, table.columns, strict=True))
    before = TIME < 0.3 - 1e-9
    assert columns["room"].tolist() == [20.0] * ROWS
    assert np.array_equal(columns["level"], np.where(before, 2, 3))
    assert columns["state"] == ["a" if early else "b" for early in before]
    assert columns["battery"] == pytest.approx(TIME / 0.6)


def test_a_measured_channel_that_covers_fewer_rows_is_said_with_both_numbers():
    force = Channel("force [N]", np.arange(20.0), SHORT.time)
    table = merge_channels("made", [PRESSURE, force], {})
    assert len(table.rows) == 20
    (said,) = [note for note in table.notes if "rows of channel" in note]
    assert said.startswith("20 of 60 rows of channel 'pressure [bar]' are read")
    assert "(pressure [bar], force [N])" in said


def test_a_mapped_channel_decides_as_a_quantity_does():
    table = merge_channels("made", [PRESSURE, SHORT], {}, mapped=("gripper",))
    assert len(table.rows) == 20
    assert "gripper" in table.headings


def test_measured_channels_that_do_not_overlap_are_named_with_the_remedy(tmp_path: Path):
    late = Channel("force [N]", np.arange(5.0), 9.0 + np.arange(5.0))
    with pytest.raises(ColumnError, match=r"'pressure \[bar\]' ends before 'force \[N\]' begins"):
        merge_channels("made", [PRESSURE, late], {})


# Every reader


@pytest.mark.parametrize("name", FILES)
def test_every_row_of_every_format_is_read(tmp_path: Path, name: str):
    WRITERS[name](tmp_path / name)
    if format_table.format_of(tmp_path / name).tables is None:
        pytest.skip("episodes alone")
    (recording,) = read(tmp_path / name, ColumnMapping(units=UNITS))
    assert len(recording) == ROWS
    assert not [note for note in recording.notes if f" of {ROWS} rows" in note]


def mdf_with(path: Path, *channels: Channel) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        for channel in channels:
            name, _, unit = channel.name.rstrip("]").partition(" [")
            file.append([asammdf.Signal(channel.values, channel.time, name=name, unit=unit)])
        file.save(path, overwrite=True)


def tdms_with(path: Path, *channels: Channel) -> None:
    nptdms = pytest.importorskip("nptdms")
    written = []
    for channel in channels:
        name, _, unit = channel.name.rstrip("]").partition(" [")
        step = float(channel.time[1] - channel.time[0]) if len(channel.time) > 1 else STEP
        properties = {
            "unit_string": unit,
            "wf_increment": step,
            "wf_start_offset": float(channel.time[0]),
        }
        written.append(nptdms.ChannelObject("run", name, channel.values, properties=properties))
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(written)


def bag_with(path: Path, *channels: Channel) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    with rosbag1.Writer(path) as writer:
        for channel in channels:
            whole = np.asarray(channel.values).dtype.kind == "i"
            kind = store.types[f"std_msgs/msg/{'Int32' if whole else 'Float64'}"]
            name = channel.name.partition(" ")[0]
            topic = writer.add_connection(f"/{name}", kind.__msgtype__, typestore=store)
            for time, value in zip(channel.time, channel.values, strict=True):
                message = store.serialize_ros1(kind(value.item()), kind.__msgtype__)
                writer.write(topic, round(1e9 * (5.0 + time)), message)
        log = store.types["rosgraph_msgs/msg/Log"]
        header = store.types["std_msgs/msg/Header"](
            0, store.types["builtin_interfaces/msg/Time"](1, 0), ""
        )
        topic = writer.add_connection("/rosout", log.__msgtype__, typestore=store)
        text = store.serialize_ros1(
            log(
                header=header, level=2, name="n", msg="m", file="f", function="g", line=3, topics=[]
            ),
            log.__msgtype__,
        )
        writer.write(topic, round(4.5e9), text)


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("run.mf4", mdf_with),
        ("run.tdms", tdms_with),
        pytest.param("run.bag", bag_with, marks=pytest.mark.tool),
    ],
)
def test_channels_that_measure_nothing_take_no_row_of_a_file(
    tmp_path: Path, name: str, write: Callable[..., None]
):
    write(tmp_path / name, ONCE, SHORT, PRESSURE, SLOW)
    (recording,) = read(tmp_path / name, ColumnMapping(units={"pressure": "bar"}))
    assert recording["pressure"] == pytest.approx(1e5 * (1.0 + TIME))
    assert recording["battery"] == pytest.approx(TIME / 0.6, abs=1e-6)
    assert recording["room"].tolist() == [20.0] * ROWS
    assert "gripper" not in recording
    assert "Channel 'gripper' is left out" in " ".join(recording.notes)
    assert not any(column.startswith("rosout") for column in recording)


def test_the_command_says_how_many_rows_it_writes(tmp_path: Path):
    force = Channel("force [N]", np.arange(20.0), SHORT.time)
    mdf_with(tmp_path / "run.mf4", PRESSURE, force)
    done = airmuscle("convert", tmp_path / "run.mf4", tmp_path / "run.csv")
    assert done.exit_code == 0
    assert "20 of 60 rows of channel 'pressure' are read" in " ".join(done.output.split())


@pytest.mark.parametrize(
    ("name", "write"),
    [("run.mf4", mdf_with), pytest.param("run.bag", bag_with, marks=pytest.mark.tool)],
)
def test_several_groups_are_selected_at_once(tmp_path: Path, name: str, write):
    force = Channel("force [N]", np.arange(60.0), TIME)
    write(tmp_path / name, PRESSURE, SLOW, force)
    group = "/pressure, /force" if name == "run.bag" else "group 1, group 3"
    mapping = ColumnMapping(group=group, units={"pressure": "bar", "force": "N"})
    (recording,) = read(tmp_path / name, mapping)
    assert {*recording} == {"time", "pressure", "force"}
    assert len(recording) == ROWS


# Columns are counted as in the file


SIDE_BY_SIDE = [
    ["pressure (kPa)", "force (N)", None, "pressure (kPa)", "force (N)"],
    [0, 0, None, 0, 1],
    [40, 8, None, 40, 6],
    [80, 16, None, 80, 11],
]


@pytest.mark.parametrize("name", ["run.csv", "run.xlsx"])
def test_messages_and_mappings_count_the_columns_of_the_file(tmp_path: Path, name: str):
    apart = [[*row[:2], "" if i else "remark", *row[3:]] for i, row in enumerate(SIDE_BY_SIDE)]
    table_of_cells(tmp_path / f"apart-{name}", apart)
    with pytest.raises(ColumnError, match=r"\(numbers 2 and 5\) both contain the force"):
        read(tmp_path / f"apart-{name}")
    table_of_cells(tmp_path / name, SIDE_BY_SIDE)
    first, second = read(tmp_path / name)  # groups side by side
    assert first["force"].tolist() == [0.0, 8.0, 16.0]
    assert second["force"].tolist() == [1.0, 6.0, 11.0]
    (recording,) = read(tmp_path / name, ColumnMapping(columns={"2": ""}))  # the remedy works
    assert recording["force"].tolist() == [1.0, 6.0, 11.0]


@pytest.mark.parametrize("name", ["force", "length", "pressure", "torque", "left.angle", "volume"])
def test_a_unit_behind_an_underscore_is_that_in_brackets(tmp_path: Path, name: str):
    units = [
        unit
        for unit in columns.known_suffixes(columns.parse_heading(name).target)
        if " " not in unit
    ]
    assert len(units) > 3
    for unit in units:
        joined = columns.parse_heading(f"{name}_{unit}")
        bracketed = columns.parse_heading(f"{name} [{unit}]")
        assert (joined.name, joined.unit) == (bracketed.name, bracketed.unit) == (name, unit)
        assert constants.file_conversion(unit, joined.target).factor > 0.0


# A mapping against the headings of a file


def warned(path: Path, mapping: ColumnMapping) -> str:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        read(path, mapping)
    return " ".join(str(each.message) for each in caught)


@pytest.mark.parametrize(
    ("heading", "read_as", "contradicts"),
    [
        ("pressure (kPa)", "force [N]", True),
        ("pressure [kPa]", "pressure [bar]", True),
        ("channel 1 [kPa]", "force [N]", True),
        ("channel 1 [kPa]", "pressure [MPa]", True),
        ("pressure [bara]", "pressure [barg]", True),
        ("pressure [kPa]", "pressure [kPa(a)]", False),
        ("channel 1 [kPa]", "pressure [kPa]", False),
        ("channel 1 (left)", "force [N]", False),
        ("load [kg]", "force [kg]", False),
        ("displacement [mm]", "shortening [mm]", False),
        ("pressure [kPa]", "setpoint [kPa]", False),
    ],
)
def test_a_mapping_that_contradicts_a_heading_is_a_warning(
    tmp_path: Path, heading: str, read_as: str, contradicts: bool
):
    (tmp_path / "run.csv").write_text(f"time [s],{heading}\n0,200\n1,210\n2,220\n")
    said = warned(tmp_path / "run.csv", ColumnMapping(columns={"2": read_as}))
    assert (f"column 2, '{heading}', is read as '{read_as}'" in said) == contradicts


# Time


@pytest.mark.parametrize("heading", ["time", "timestamp", "stamp", "Epoch", "unix_time"])
@pytest.mark.parametrize("number", [1.0, 1e3, 1e6, 1e9])
def test_times_from_1970_are_seconds_from_the_first_row(
    tmp_path: Path, heading: str, number: float
):
    stamps = (1_700_000_000.0 + TIME) * number
    rows = "\n".join(f"{stamp:.6f},{k}" for k, stamp in enumerate(stamps))
    (tmp_path / "run.csv").write_text(f"{heading},force [N]\n{rows}\n")
    (recording,) = read(tmp_path / "run.csv")
    assert recording["time"] == pytest.approx(TIME, abs=1e-6)
    assert "2023-11-14 22:13:20 UTC" in " ".join(recording.notes)


def test_a_time_that_does_not_count_from_1970_needs_its_unit(tmp_path: Path):
    (tmp_path / "run.csv").write_text("timestamp,force [N]\n0,1\n1,2\n")
    (recording,) = read(tmp_path / "run.csv", ColumnMapping(units={"time": "ms"}))
    assert recording["time"].tolist() == [0.0, 0.001]


@pytest.mark.parametrize("rate", ["speed [mm/s]", "elbow_vel", "left.angular_speed [rad/s]"])
def test_rates_without_time_are_no_steady_states(tmp_path: Path, rate: str):
    (tmp_path / "run.csv").write_text(f"pressure [kPa],{rate}\n100,1\n110,2\n120,3\n")
    said = warned(tmp_path / "run.csv", ColumnMapping())
    assert "there is no time, but" in said
    assert "there is no time, but" not in warned(tmp_path / "run.csv", ColumnMapping(time=NoTime()))


def test_what_does_not_vary_is_no_rate(tmp_path: Path):
    (tmp_path / "run.csv").write_text("pressure [kPa],speed [mm/s]\n100,0\n110,0\n120,0\n")
    assert "there is no time" not in warned(tmp_path / "run.csv", ColumnMapping())
