"""Episodes of an arm: every format gives the same numbers, and what a record hides or contradicts
is named.
"""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from arm_episodes import STEP, changed, made_episodes
from command_line import airmuscle

from airmuscle.bench import fit_joint, inspect_episodes, propose_mapping, read_episodes
from airmuscle.bench.joint.episodes import cut, long_enough, speed_of
from airmuscle.errors import ColumnError, FileError, IdentificationError, ParameterError

MADE = made_episodes(3)
JOINT = made_episodes(20, delay=3)
ONE_FILE = """
sample_time = "10 ms"
starts = "start"
[angles]
columns = ["q"]
unit = "deg"
[speeds]
columns = "v"
scale = 10
[pressures]
columns = ["counts"]
divisors = "divisors"
scale = "1 kPa"
"""
COLUMNS = """
time = "t"
[angles]
columns = ["q1"]
[pressures]
columns = ["p1", "p2"]
"""


def by_columns(run):
    return {
        "t": STEP * np.arange(len(run)),
        "q1": run.angle[:, 0],
        "p1": run.pressure[:, 0],
        "p2": run.pressure[:, 1],
    }


def write_csv(folder, run, number):
    table = by_columns(run)
    rows = "\n".join(
        ",".join(map(repr, map(float, row))) for row in zip(*table.values(), strict=True)
    )
    (folder / f"{number}.csv").write_text(",".join(table) + "\n" + rows + "\n")


def write_npz(folder, run, number):
    np.savez(folder / f"{number}.npz", **by_columns(run))


def write_json(folder, run, number):
    (folder / f"{number}.json").write_text(
        json.dumps({n: c.tolist() for n, c in by_columns(run).items()})
    )


def write_hdf5(folder, run, number):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / f"{number}.h5", "w") as file:
        for name, column in by_columns(run).items():
            file[name] = column


def write_parquet(folder, run, number):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table(by_columns(run)), folder / f"{number}.parquet")


@pytest.fixture
def mapping(tmp_path):
    def write(text):
        path = tmp_path / "mapping.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("write", [write_csv, write_npz, write_json, write_hdf5, write_parquet])
def test_a_folder_with_one_file_for_each_episode(tmp_path, mapping, write):
    folder = tmp_path / "episodes"
    folder.mkdir()
    for number, run in enumerate(MADE.runs):
        write(folder, run, number)
    read = read_episodes(folder, mapping(COLUMNS))
    assert read.sample_time == pytest.approx(STEP)
    for one, other in zip(read.runs, MADE.runs, strict=True):
        np.testing.assert_allclose(one.angle, other.angle, rtol=1e-12)
        np.testing.assert_allclose(one.pressure, other.pressure, rtol=1e-12)
        np.testing.assert_allclose(one.speed[5:-5], other.speed[5:-5], atol=0.3)


def steps_of(run):
    """The steps of an episode as RLDS has them: an observation and an action each, and flags."""
    return [
        {
            "observation": {"q": a.tolist(), "p": p.tolist()},
            "action": p.tolist(),
            "is_first": k == 0,
        }
        for k, (a, p) in enumerate(zip(run.angle, run.pressure, strict=True))
    ]


def write_steps(folder, run, number):
    (folder / f"{number}.json").write_text(
        json.dumps({"steps": steps_of(run), "episode_metadata": {"name": "x"}})
    )


def write_step_lines(folder, run, number):
    (folder / f"{number}.jsonl").write_text("\n".join(map(json.dumps, steps_of(run))))


def write_step_arrays(folder, run, number):
    arrays = {
        "steps/observation/q": run.angle,
        "steps/observation/p": run.pressure,
        "steps/action": run.pressure,
    }
    np.savez(folder / f"{number}.npz", **arrays)


def write_step_groups(folder, run, number):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / f"{number}.h5", "w") as file:
        file["steps/observation/q"] = run.angle
        file["steps/observation/p"] = run.pressure
        file["steps/action"] = run.pressure


def write_step_table(folder, run, number):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.Table.from_pylist(steps_of(run)), folder / f"{number}.parquet")


RLDS = """
sample_time = "10 ms"
[angles]
columns = "observation.q"
[pressures]
columns = "observation.p"
[commands]
columns = "action"
"""


@pytest.mark.parametrize(
    "write", [write_steps, write_step_lines, write_step_arrays, write_step_groups, write_step_table]
)
def test_a_folder_of_steps_with_observation_and_action(tmp_path, mapping, write):
    folder = tmp_path / "episodes"
    folder.mkdir()
    for number, run in enumerate(MADE.runs):
        write(folder, run, number)
    read = read_episodes(folder, mapping(RLDS))
    for one, other in zip(read.runs, MADE.runs, strict=True):
        np.testing.assert_allclose(one.angle, other.angle, rtol=1e-12)
        np.testing.assert_allclose(one.pressure, other.pressure, rtol=1e-12)
        np.testing.assert_array_equal(one.command, one.pressure)
    assert f"{read.notes[0]}".startswith("3 episodes from 3 files (.")


def test_flags_of_first_steps_split_one_table(tmp_path, mapping):
    np.savez(
        tmp_path / "all.npz",
        q=MADE.rows("angle"),
        p=MADE.rows("pressure"),
        is_first=np.concatenate([np.arange(len(run)) == 0 for run in MADE.runs]),
    )
    text = (
        'sample_time = "10 ms"\nstarts = "is_first"\n[angles]\ncolumns = "q"\n[pressures]\ncolumns'
        ' = "p"\n'
    )
    read = read_episodes(tmp_path / "all.npz", mapping(text))
    assert [len(run) for run in read.runs] == [len(run) for run in MADE.runs]


@pytest.fixture
def bags(tmp_path):
    """A folder with one ROS 2 bag for each episode: joint states and pressures, whose messages come
    unevenly.
    """
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys", reason="needs the package rosbags")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    state, several = (
        store.types[n] for n in ("sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray")
    )
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    header = store.types["std_msgs/msg/Header"](
        store.types["builtin_interfaces/msg/Time"](1, 0), ""
    )
    rng = np.random.default_rng(0)
    folder = tmp_path / "bags"
    folder.mkdir()
    for number, run in enumerate(MADE.runs):
        with rosbag2.Writer(folder / f"episode{number}", version=9) as writer:
            joints = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
            pressures = writer.add_connection("/pressures", several.__msgtype__, typestore=store)
            for k, (a, v, p) in enumerate(zip(run.angle, run.speed, run.pressure, strict=True)):
                stamp = 10**9 + k * 10**7 + int(rng.uniform(-1e6, 1e6))
                message = state(header, ["elbow"], a, v, np.array([]))
                writer.write(joints, stamp, store.serialize_cdr(message, state.__msgtype__))
                writer.write(
                    pressures,
                    stamp - 10**5,
                    store.serialize_cdr(several(layout, p), several.__msgtype__),
                )
    return folder


def test_a_folder_of_bags_is_read_by_its_proposed_mapping(bags, mapping):
    text = propose_mapping(bags)
    assert 'sample_time = "10 ms"' in text
    read = read_episodes(bags, mapping(text))
    assert len(read) == 3
    assert read.sample_time == STEP
    for one, other in zip(read.runs, MADE.runs, strict=True):
        rows = (
            min(len(one), len(other) - 1) - 1
        )  # the first message, of the pressures, has no angle before it
        assert rows > len(other) - 4
        assert np.abs(one.angle - other.angle[1 : 1 + len(one)])[:rows].max() < 0.05 * np.ptp(
            other.angle
        )
        assert np.abs(one.pressure - other.pressure[1 : 1 + len(one)])[:rows].max() < 0.1 * np.ptp(
            other.pressure
        )
    assert "intervals of messages differ by" in "".join(read.notes)
    alone = read_episodes(bags / "episode1", mapping(text))
    np.testing.assert_array_equal(alone.runs[0].angle, read.runs[1].angle)


def test_a_mapping_is_proposed_from_names_and_sizes(tmp_path, mapping):
    np.savez(
        tmp_path / "all.npz",
        start=np.cumsum([0, *map(len, MADE.runs)]),
        joint_angle=np.degrees(MADE.rows("angle")),
        joint_speed=np.degrees(MADE.rows("speed")),
        pressure=MADE.rows("pressure") / 1e5,
        valve_command=MADE.rows("pressure"),
        note=np.zeros(3),
    )
    text = propose_mapping(tmp_path / "all.npz")
    assert 'unit = "?"  # bar or psi? the numbers reach' in text
    with pytest.raises(FileError, match="the unit of the pressures is open"):
        read_episodes(tmp_path / "all.npz", mapping(text))
    text = text.replace('unit = "?"', 'unit = "bar"')
    read = read_episodes(tmp_path / "all.npz", mapping(text))
    assert read.sample_time == pytest.approx(
        STEP, rel=0.05
    )  # with which the angles move as fast as the speeds
    for name in ("angle", "speed", "pressure"):
        np.testing.assert_allclose(read.rows(name), MADE.rows(name), rtol=1e-9, atol=1e-12)
    assert read.runs[0].command is not None
    assert "note (3,)" in text
    shown = airmuscle("fit-joint", str(tmp_path / "all.npz"), "--inspect")
    assert shown.exit_code != 0
    assert "a mapping file is needed, which states what the columns are" in " ".join(
        shown.output.split()
    )
    assert 'unit = "deg"' in shown.output


def test_one_file_for_all_with_starts_scales_and_divisors(tmp_path, mapping):
    lengths = np.cumsum([0, *map(len, MADE.runs)])
    np.savez(
        tmp_path / "all.npz",
        start=lengths,
        q=np.degrees(MADE.rows("angle")),
        v=MADE.rows("speed") / 10,
        counts=MADE.rows("pressure") * 2,
        divisors=np.array([2e3, 2e3]),
    )
    read = read_episodes(tmp_path / "all.npz", mapping(ONE_FILE))
    assert [len(run) for run in read.runs] == [len(run) for run in MADE.runs]
    for name in ("angle", "speed", "pressure"):
        np.testing.assert_allclose(read.rows(name), MADE.rows(name), rtol=1e-12)


def test_speeds_are_those_of_each_episode_where_one_file_holds_all(tmp_path, mapping):
    table = {
        "start": np.cumsum([0, *map(len, MADE.runs)]),
        "q": np.degrees(MADE.rows("angle")),
        "p": MADE.rows("pressure"),
    }
    np.savez(tmp_path / "all.npz", **table)
    text = (
        'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = "q"\nunit ='
        ' "deg"\n[pressures]\ncolumns = "p"\nunit = "kPa"\n'
    )
    read = read_episodes(tmp_path / "all.npz", mapping(text))
    for run, made in zip(read.runs, MADE.runs, strict=True):
        np.testing.assert_allclose(run.speed, speed_of(made.angle, STEP), rtol=1e-9)
        np.testing.assert_allclose(run.pressure, 1e3 * made.pressure)
    for starts in ([0, 5000, 10], [0, 95.5], [0, 400], []):
        np.savez(tmp_path / "bad.npz", **{**table, "start": np.array(starts)})
        with pytest.raises(
            ColumnError,
            match=r"starts, column 'start', must be the first rows .* rising below 285 rows",
        ):
            read_episodes(tmp_path / "bad.npz", mapping(text))


def test_a_sample_time_that_contradicts_the_column_of_times_is_named(tmp_path, mapping):
    np.savez(
        tmp_path / "0.npz",
        **{**by_columns(MADE.runs[0]), "t": 1e3 * STEP * np.arange(len(MADE.runs[0]))},
    )
    stated = COLUMNS.replace('time = "t"', 'sample_time = "10 ms"')
    assert (
        read_episodes(tmp_path / "0.npz", mapping(stated)).sample_time == STEP
    )  # the times are ms
    with pytest.raises(
        ColumnError,
        match="column 't' advances by 10 in a row, the mapping file states a sample time of 20 ms",
    ):
        read_episodes(tmp_path / "0.npz", mapping(stated.replace("10", "20")))


def test_json_holds_a_list_of_episodes(tmp_path, mapping):
    tables = [{n: c.tolist() for n, c in by_columns(run).items()} for run in MADE.runs]
    (tmp_path / "all.json").write_text(json.dumps(tables))
    assert len(read_episodes(tmp_path / "all.json", mapping(COLUMNS))) == 3
    (tmp_path / "all.json").write_text("[1, 2]")
    with pytest.raises(
        FileError, match="an object of lists is expected, or a list of such objects"
    ):
        read_episodes(tmp_path / "all.json", mapping(COLUMNS))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[angles]\ncolumns=["q1"]\n', r"no table \[pressures\]; name its columns"),
        (COLUMNS.replace('time = "t"', ""), "state either sample_time"),
        (
            COLUMNS + "[arm]\npairs = [[1, 1]]\n",
            "give for each joint the numbers of two muscles, each muscle once",
        ),
        (COLUMNS + '[arm]\naxes = ["w"]\n', "arm.axes holds 'w'; allowed: x, "),
        (
            COLUMNS.replace("[angles]\n", '[angles]\nunit = "turn"\n'),
            "angles.unit is 'turn'; allowed: rad, deg",
        ),
        (
            COLUMNS.replace("[pressures]\n", '[pressures]\nunit = "mm"\n'),
            "pressures.unit is 'mm'; allowed: Pa, hPa",
        ),
        (COLUMNS + "[commands]\nunit = 3\ncolumns = 'p1'", "commands.unit is '3'; allowed: none"),
        (COLUMNS + "[arm]\npairs = 3\n", "arm.pairs is 3; give for each joint"),
        (
            COLUMNS + "[arm]\npairs = [['a', 'b']]\n",
            "give for each joint the numbers of two muscles",
        ),
        (COLUMNS + "[arm]\naxes = [[0, 0, 1]]\n", r"arm.axes holds '\[0, 0, 1\]'; allowed: x, "),
        (
            COLUMNS.replace('columns = ["q1"]', "columns = 3"),
            "angles.columns must be a name or a list of names",
        ),
        ("tim = 3\n" + COLUMNS, "unknown key 'tim'"),
    ],
)
def test_errors_of_a_mapping_file(tmp_path, mapping, text, message):
    write_npz(tmp_path, MADE.runs[0], 0)
    with pytest.raises(FileError, match=message):
        read_episodes(tmp_path / "0.npz", mapping(text))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q1": None}, "no column 'q1'; there are t, p1, p2"),
        ({"p1": np.full(95, np.nan)}, "row 1 of p1, p2 .column 1. is not a finite number"),
        ({"q1": np.zeros(90)}, "pressures have 95 rows, angles 90; they must have as many"),
        ({"q1": np.zeros(0)}, "q1 has no row"),
        ({"t": np.r_[0:40, 20:75] * STEP}, "the times of column 't' do not rise from row to row"),
    ],
)
def test_errors_of_an_episode(tmp_path, mapping, change, message):
    table = {n: c for n, c in {**by_columns(MADE.runs[0]), **change}.items() if c is not None}
    np.savez(tmp_path / "0.npz", **table)
    with pytest.raises(ColumnError, match=message):
        read_episodes(tmp_path / "0.npz", mapping(COLUMNS))


def written(tmp_path, table, text, mapping):
    """The episodes of a table of columns, read by a mapping."""
    np.savez(tmp_path / "0.npz", **table)
    return read_episodes(tmp_path / "0.npz", mapping(text))


def test_rows_at_uneven_times_are_interpolated_and_said(tmp_path, mapping):
    """Of a clock that jitters by 30 % the even rows are those of the motion."""
    rng = np.random.default_rng(0)
    even = STEP * np.arange(200)
    time = even + 0.3 * STEP * rng.uniform(-1.0, 1.0, 200)
    pressure = 1e5 + 5e4 * np.cos(3.0 * time)
    table = {"t": time, "q1": np.sin(3.0 * time), "p1": pressure, "p2": pressure}
    read = written(tmp_path, table, 'sample_time = "10 ms"\n' + COLUMNS, mapping)
    (run,) = read.runs
    at = time[0] + STEP * np.arange(len(run))
    assert read.sample_time == STEP
    np.testing.assert_allclose(run.angle[:, 0], np.sin(3.0 * at), atol=2e-4)
    np.testing.assert_allclose(run.pressure[:, 0], 1e5 + 5e4 * np.cos(3.0 * at), atol=10.0)
    assert any("rows are interpolated to it" in note for note in read.notes)


def test_a_record_is_cut_at_the_gaps_of_its_times(tmp_path, mapping):
    table = by_columns(MADE.runs[0]) | {"t": np.r_[0:40, 60:115] * STEP}
    read = written(tmp_path, table, COLUMNS, mapping)
    assert [len(run) for run in read.runs] == [40, 55]
    np.testing.assert_array_equal(read.runs[1].angle[:, 0], MADE.runs[0].angle[40:, 0])
    assert any("cut at 1 gap of more than 5 sample times" in note for note in read.notes)


RESTS = 'sample_time = "10 ms"\nrests = "0.2 s"\n[angles]\ncolumns = ["q"]\n'
RESTS += '[pressures]\ncolumns = ["p"]\n'


def resting_record():
    """Five motions of 60 rows, with rests of 40 rows between them."""
    motion = np.concatenate([0.3 * np.sin(np.linspace(0, 2 * np.pi, 60)), np.zeros(40)])
    angle = np.tile(motion, 5)[:-40]
    return {"q": angle[:, None], "p": 1e5 + 1e4 * np.random.default_rng(0).normal(size=(460, 2))}


def test_one_long_record_is_cut_in_the_middle_of_its_rests(tmp_path, mapping):
    read = written(tmp_path, resting_record(), RESTS, mapping)
    assert len(read) == 5
    assert all(abs(len(run) - 92) <= 12 for run in read.runs)
    assert sum(map(len, read.runs)) == 460
    assert all(np.abs(run.angle[0]).max() < 0.02 for run in read.runs)
    assert any("cut at 4 rests" in note for note in read.notes)


def test_a_record_without_a_rest_says_what_to_state(tmp_path, mapping):
    table = resting_record() | {"q": np.sin(0.1 * np.arange(460))[:, None]}
    with pytest.raises(ColumnError, match=r"no rest of 0\.2 s, .* state shorter rests"):
        written(tmp_path, table, RESTS, mapping)


def test_commands_alone_stand_for_pressures(tmp_path, mapping):
    text = COLUMNS.replace("[pressures]", "[commands]")
    read = written(tmp_path, by_columns(MADE.runs[0]), text, mapping)
    np.testing.assert_array_equal(read.runs[0].pressure, MADE.runs[0].pressure)
    assert read.runs[0].command is None
    assert any("commands stand for pressures" in note for note in read.notes)


def test_a_position_is_no_angle_and_its_scale_makes_it_one(tmp_path, mapping):
    unit = COLUMNS.replace('columns = ["q1"]', 'columns = ["q1"]\nunit = "mm"')
    with pytest.raises(FileError, match=r"a position is no angle.*scale = 0\.02 millimetres"):
        written(tmp_path, by_columns(MADE.runs[0]), unit, mapping)
    scaled = COLUMNS.replace('columns = ["q1"]', 'columns = ["q1"]\nscale = 0.02')
    position = by_columns(MADE.runs[0]) | {"q1": 50.0 * MADE.runs[0].angle[:, 0]}
    read = written(tmp_path, position, scaled, mapping)
    np.testing.assert_allclose(read.runs[0].angle, MADE.runs[0].angle, rtol=1e-12)


def test_episodes_of_mat_are_those_that_were_written(tmp_path, mapping):
    scipy = pytest.importorskip("scipy.io")
    for number, run in enumerate(MADE.runs):
        table = {name: column[:, None] for name, column in by_columns(run).items()}
        scipy.savemat(tmp_path / f"{number}.mat", table)
    read = read_episodes(tmp_path, mapping(COLUMNS))
    assert len(read) == 3
    np.testing.assert_allclose(read.rows("angle"), MADE.rows("angle"), rtol=1e-12)
    np.testing.assert_allclose(read.rows("pressure"), MADE.rows("pressure"), rtol=1e-12)


def test_a_folder_without_episodes_and_a_foreign_format_are_refused(tmp_path, mapping):
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileError, match="the folder holds no file of episodes; supported are"):
        read_episodes(tmp_path / "empty", mapping(COLUMNS))
    (tmp_path / "empty" / "arm-train.tfrecord-00000-of-00001").write_bytes(b"x")
    with pytest.raises(
        FileError,
        match=r"TFRecord files are not read\. Write each episode with the package that made them",
    ):
        read_episodes(tmp_path / "empty", mapping(COLUMNS))
    (tmp_path / "a.doc").write_text("x")
    with pytest.raises(FileError, match="no format of episodes; supported are"):
        read_episodes(tmp_path / "a.doc", mapping(COLUMNS))


def test_episodes_of_one_arm_have_one_shape():
    with pytest.raises(ParameterError, match="runs have different numbers of joints and muscles"):
        replace(MADE, runs=(*MADE.runs, made_episodes(1, joints=2).runs[0]))
    with pytest.raises(ParameterError, match=r"0 runs at a sample time of 0\.01 s are given"):
        replace(MADE, runs=())


# Inspection


def test_an_inspection_finds_the_muscles_of_each_joint_and_that_the_sensors_lag():
    two = made_episodes(30, joints=2, delay=3)
    swapped = changed(two, pressure=lambda p: p[:, [3, 0, 2, 1]])
    found = inspect_episodes(swapped)
    assert found.pairs == ((2, 4), (3, 1))
    assert inspect_episodes(two).delay > inspect_episodes(made_episodes(30, joints=2)).delay
    assert not found.errors
    assert "pressure 1 lowers angle 2 (t = " in str(found)
    (table,) = pickle.loads(pickle.dumps(found)).chapter().tables
    angles = np.quantile(two.rows("angle"), (0.01, 0.99), axis=0).T
    assert np.array(table.columns["range of 98 %"].values[:2]) == pytest.approx(angles)
    assert "<td" in found._repr_html_()
    assert ">deg<" in found._repr_html_()


def test_pressures_without_an_effect_are_not_assigned():
    rng = np.random.default_rng(1)
    found = inspect_episodes(changed(JOINT, pressure=lambda p: rng.uniform(0.0, 3e5, p.shape)))
    with pytest.raises(
        IdentificationError,
        match="joint 1: 0 pressures with certainty for raising its angle, 0 for lowering it; one",
    ):
        _ = found.pairs


def jumped(angle):
    angle[50:] += 2 * np.pi
    return angle


def dead(pressure):
    """A sensor that records its noise alone."""
    pressure[:, 1] = 1e5 + 100.0 * np.random.default_rng(0).standard_normal(len(pressure))
    return pressure


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"angle": jumped},
            r"episode 1: angle 1 jumps from .* at row 51, as an encoder does that wraps",
        ),
        (
            {"pressure": lambda p: p * [1.0, 0.0]},
            "pressure 2 never varies, it is 0 to 0 Pa in 98 % of",
        ),
        (
            {"pressure": dead},
            r"pressure 2 never varies, it is 9.\d+e\+04 to 1.00\d+e\+05 Pa in 98 % of the rows",
        ),
        (
            {"angle": lambda q: 0.1 + 0 * q},
            "angle 1 never varies, it is 0.1 to 0.1 rad in 98 % of the rows",
        ),
        (
            {"angle": np.degrees},
            r"angle 1 reaches .* rad, further than a joint turns: state its unit .* \[angles\]",
        ),
        (
            {"pressure": lambda p: 1e3 * p},
            r"pressure 1 reaches .* Pa, more than a muscle bears: .* \[pressures\]",
        ),
        (
            {"speed": np.degrees},
            'speeds multiplied by 0.0174., as speeds in degrees have: unit = "deg/s". State',
        ),
        (
            {"speed": lambda v: v / 1.5},
            r"angles move 1\.(49\d?|5) times as fast as the speeds say: the sample time of 10 ms",
        ),
    ],
)
def test_what_forbids_a_fit_is_named(change, message):
    with pytest.raises(IdentificationError, match=message):
        fit_joint(changed(JOINT, **change))


def test_the_t_values_of_one_episode_are_no_certainty():
    """They were 4e14, because one cluster of errors has no scatter."""
    assert all(
        2.0 < action.t_value < 100.0
        for action in inspect_episodes(made_episodes(1, rows=400)).actions
    )


def test_exchanged_muscles_are_named():
    found = inspect_episodes(JOINT, pairs=((2, 1),))
    assert (
        "the mapping says that pressure 2 raises angle 1, the record that pressure 2 lowers angle 1"
        in found.errors[0]
    )
    assert not inspect_episodes(JOINT, pairs=((1, 2),)).errors


def test_saturated_readings_and_counts_are_remarked():
    (saturated,) = inspect_episodes(
        changed(JOINT, pressure=lambda p: np.minimum(p, [2e5, 1e9]))
    ).remarks
    assert "pressure 1 is 2e+05 Pa in 752 of 1900 rows (40 %)" in saturated
    assert "its reading saturates there" in saturated
    (counts,) = inspect_episodes(changed(JOINT, pressure=lambda p: np.round(p / 10.0))).remarks
    assert "they are whole numbers, as counts" in counts


def test_angles_whose_range_is_that_of_another_unit_are_remarked():
    """Eight degrees labelled rad, and radians labelled deg, were fitted without a word."""
    for change, text in (
        (lambda q: np.degrees(0.1 * q), "degrees read as radians"),
        (np.radians, "radians read as deg"),
    ):
        (remark,) = inspect_episodes(changed(JOINT, angle=change, speed=change)).remarks
        assert remark.startswith("angle 1 spans ")
        assert text in remark


def test_noise_and_outliers_of_the_readings_are_no_wrong_sample_time():
    """One joint of a measured arm, whose angle has wrong readings, was refused by itself: its
    slopes said 0.86.
    """
    rng = np.random.default_rng(0)
    noisy = changed(
        JOINT,
        speed=lambda v: v + rng.normal(0.0, 0.5 * np.std(v), v.shape),
        angle=lambda q: np.where(rng.random(q.shape) < 0.01, q + 1.0, q),
    )
    assert not inspect_episodes(noisy).errors
    assert "angles move 1.4" in inspect_episodes(changed(noisy, speed=lambda v: v / 1.5)).errors[0]


def test_a_sample_time_that_nothing_confirms_is_remarked(tmp_path, mapping):
    write_npz(tmp_path, JOINT.runs[0], 0)
    stated = COLUMNS.replace('time = "t"', 'sample_time = "10 ms"')
    with_times = read_episodes(tmp_path / "0.npz", mapping(stated))
    assert not inspect_episodes(with_times).remarks
    np.savez(tmp_path / "0.npz", **{n: c for n, c in by_columns(JOINT.runs[0]).items() if n != "t"})
    (remark,) = inspect_episodes(read_episodes(tmp_path / "0.npz", mapping(stated))).remarks
    assert remark.startswith(
        "the sample time of 10 ms cannot be checked, because the record has neither times nor"
    )


def test_episodes_shorter_than_a_window_are_refused():
    with pytest.raises(IdentificationError, match="the longest has 45 rows, a window needs 52"):
        fit_joint(made_episodes(20, rows=45))
    assert len(cut(made_episodes(2, rows=62))) == 2
    mixed = replace(JOINT, runs=(*JOINT.runs[:4], *made_episodes(2, rows=45).runs))
    kept, (remark,) = long_enough(mixed, 40)
    assert kept.runs == JOINT.runs[:4]
    assert (
        remark
        == "2 of 6 episodes, shorter than a window of 52 rows, left out: episode 1 (45 rows),"
        " episode 2 (45 rows)"
    )
    assert remark in inspect_episodes(mixed).remarks
    assert not inspect_episodes(mixed, rows=30).remarks
    assert (
        "the longest has 45 rows, a window needs 52"
        in inspect_episodes(made_episodes(20, rows=45)).errors[0]
    )


def test_a_window_reads_no_pressure_after_its_end():
    """With a delay of the sensors the last reading is held, so that a prediction uses nothing from
    beyond.
    """
    ramp = changed(MADE, pressure=lambda p: np.tile(np.arange(len(p), dtype=float)[:, None], 2))
    windows = cut(ramp, delay=3)
    assert windows.pressure[0, 10, 0] == windows.first[0] + 3
    assert windows.pressure[0, -4:, 0].tolist() == [windows.first[0] + 40.0] * 4


def test_a_dataset_of_lerobot_is_read_with_the_names_of_its_features(tmp_path, mapping):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    names = ["elbow_angle_deg", "p_upper_kPa", "p_lower_kPa"]
    info = {"fps": 1 / STEP, "features": {"observation.state": {"names": names}}}
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info), encoding="utf-8")
    chunk = tmp_path / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    angle = np.degrees(MADE.rows("angle")[:, 0])
    pressure = MADE.rows("pressure")[:, :2] / 1e3
    state = np.column_stack([angle, pressure])
    index = np.concatenate([np.full(len(run), i) for i, run in enumerate(MADE.runs)])
    table = {
        "observation.state": state.tolist(),
        "timestamp": np.concatenate([STEP * np.arange(len(run)) for run in MADE.runs]),
        "episode_index": index,
    }
    parquet.write_table(pyarrow.table(table), chunk / "episode_000000.parquet")
    text = propose_mapping(tmp_path)
    assert 'unit = "deg"  # by the names' in text
    assert 'unit = "kPa"  # by the names' in text
    read = read_episodes(tmp_path, mapping(text))
    assert len(read) == len(MADE.runs)
    np.testing.assert_allclose(read.rows("pressure"), MADE.rows("pressure")[:, :2], rtol=1e-9)
