"""ROS bags: the numbers of all topics with the times of their messages."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import ColumnMapping, SignalLimits, SignalPlan, read
from airmuscle.errors import FileError
from airmuscle.outlets import signal_files

pytestmark = pytest.mark.tool


@pytest.fixture
def bag(tmp_path):
    """A ROS 2 bag with a pressure at 100 Hz and two joints at 50 Hz; the folder."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys", reason="needs the package rosbags")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    of = store.types
    number = of["std_msgs/msg/Float64"]
    state = of["sensor_msgs/msg/JointState"]
    header = of["std_msgs/msg/Header"](of["builtin_interfaces/msg/Time"](1, 0), "")
    folder = tmp_path / "bag"
    with rosbag2.Writer(folder, version=9) as writer:
        pressure = writer.add_connection("/pressure", number.__msgtype__, typestore=store)
        joints = writer.add_connection("/arm/joints", state.__msgtype__, typestore=store)
        for k in range(21):
            stamp = 5 * 10**9 + k * 10**7
            writer.write(
                pressure, stamp, store.serialize_cdr(number(1000.0 * k), number.__msgtype__)
            )
            if k % 2 == 0:
                angles = np.array([0.01 * k, -0.02 * k])
                message = state(header, ["elbow", "wrist"], angles, np.array([]), np.array([]))
                writer.write(joints, stamp, store.serialize_cdr(message, state.__msgtype__))
    return folder


def test_topics_become_columns_with_common_rows(bag):
    (run,) = read(bag, ColumnMapping(units={"pressure": "Pa"}))
    assert run["time"] == pytest.approx(0.01 * np.arange(21), abs=1e-12)
    assert run["pressure"].tolist() == [1000.0 * k for k in range(21)]
    assert run["arm.joints.position.wrist"] == pytest.approx(-0.02 * np.arange(21), abs=1e-12)


@pytest.mark.parametrize("kind", ["Bool", "Int32"])
def test_a_valve_of_a_slower_topic_switches_between_two_values(tmp_path, kind):
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys", reason="needs the package rosbags")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    force = store.types["std_msgs/msg/Float64"]
    valve = store.types[f"std_msgs/msg/{kind}"]
    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        names = ("/force", force), ("/valve", valve)
        forces, valves = (
            writer.add_connection(name, of.__msgtype__, typestore=store) for name, of in names
        )
        for k in range(21):
            stamp = 5 * 10**9 + k * 10**7
            writer.write(forces, stamp, store.serialize_cdr(force(1.0 * k), force.__msgtype__))
            if k % 10 == 0:
                writer.write(valves, stamp, store.serialize_cdr(valve(k == 10), valve.__msgtype__))
    (run,) = read(tmp_path / "bag", ColumnMapping(units={"force": "N"}))
    assert run["valve"].tolist() == [0.0] * 10 + [1.0] * 10 + [0.0]


@pytest.fixture
def standard_messages(tmp_path):
    """A bag with a vector, a wrench, an inertial sensor, a pose, joints with awkward names, a
    pressure, a temperature.
    """
    rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys", reason="needs the package rosbags")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    of = store.types
    vector = of["geometry_msgs/msg/Vector3"](1.0, 2.0, 3.0)
    point = of["geometry_msgs/msg/Point"](1.0, 2.0, 3.0)
    turn = of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    nine = np.zeros(9)
    header = of["std_msgs/msg/Header"](of["builtin_interfaces/msg/Time"](1, 0), "")
    of_joints = np.array([0.1, 0.2])
    messages = {
        "acc": vector,
        "ft": of["geometry_msgs/msg/Wrench"](vector, vector),
        "imu": of["sensor_msgs/msg/Imu"](header, turn, nine, vector, nine, vector, nine),
        "pose": of["geometry_msgs/msg/Pose"](point, turn),
        "joints": of["sensor_msgs/msg/JointState"](
            header, ["y", "wrist"], of_joints, of_joints, of_joints
        ),
        "line": of["sensor_msgs/msg/FluidPressure"](header, 301325.0, 0.0),
        "air": of["sensor_msgs/msg/Temperature"](header, 20.0, 0.0),
    }
    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        for topic, message in messages.items():
            connection = writer.add_connection(f"/{topic}", message.__msgtype__, typestore=store)
            for k in range(5):
                writer.write(
                    connection, 10**9 + k * 10**7, store.serialize_cdr(message, message.__msgtype__)
                )
    return tmp_path / "bag"


def test_fields_of_standard_messages_are_no_quantities(standard_messages):
    (run,) = read(standard_messages)
    for name in (
        "acc.y",
        "ft.force.y",
        "ft.torque.y",
        "imu.linear_acceleration.y",
        "pose.position.y",
    ):
        assert run[name].tolist() == [2.0] * 5
    assert run["joints.effort.y"].tolist() == [0.1] * 5
    assert run["joints.position.wrist"].tolist() == [0.2] * 5
    assert run["line.pressure"] == pytest.approx(np.full(5, 2e5))
    assert run["air.temperature"] == pytest.approx(np.full(5, 293.15))


def test_a_note_proposes_the_mapping_of_a_field_with_the_unit_of_its_message(standard_messages):
    (run,) = read(standard_messages)
    text = " ".join(run.notes)
    assert "Column 'ft.force.y' in N is a field of a message" in text
    assert "[columns] 'joints.effort.y' = 'torque [N m]' maps it" in text
    (mapped,) = read(
        standard_messages,
        ColumnMapping(columns={"joints.effort.y": "torque", "joints.position.y": "angle [deg]"}),
    )
    assert mapped["torque"].tolist() == [0.1] * 5
    assert mapped["angle"] == pytest.approx(np.radians(np.full(5, 0.1)))


def test_the_command_converts_a_bag_of_standard_messages(standard_messages, tmp_path):
    done = airmuscle("convert", standard_messages, tmp_path / "run.csv")
    assert done.exit_code == 0, done.output
    assert read(tmp_path / "run.csv")[0]["acc.y"].tolist() == [2.0] * 5


def test_one_topic_can_be_chosen(bag):
    (run,) = read(bag, ColumnMapping(group="/arm/joints"))
    assert list(run) == ["time", "arm.joints.position.elbow", "arm.joints.position.wrist"]
    assert len(run) == 11
    with pytest.raises(FileError, match="no topic 'nothing'; the topics are"):
        read(bag, ColumnMapping(group="nothing"))


def test_the_command_converts_a_bag(bag, tmp_path):
    """As the guide states, here to CSV: the same columns, rows and numbers."""
    target = tmp_path / "run.csv"
    mapping = tmp_path / "rig.toml"
    mapping.write_text('[columns]\n"pressure" = "pressure [Pa]"\n')
    done = airmuscle("convert", bag, target, "--mapping", mapping)
    assert done.exit_code == 0, done.output
    (run,) = read(bag, mapping=mapping)
    (written,) = read(target)
    assert list(written) == list(run)
    for name in run:
        assert written[name].tolist() == run[name].tolist()


def test_a_quantity_without_unit_is_refused_with_the_option_that_states_it(bag, tmp_path):
    done = airmuscle("convert", bag, tmp_path / "run.csv")
    assert done.exit_code == 1
    assert "To state the unit, use --unit 'pressure=...'." in " ".join(done.output.split())
    assert not (tmp_path / "run.csv").exists()


def test_a_bag_without_its_metadata_is_refused(bag):
    (bag / "metadata.yaml").unlink()
    with pytest.raises(FileError, match=r"no metadata\.yaml next to it; copy the whole folder"):
        read(bag)


def test_an_mcap_file_is_read_without_metadata(tmp_path):
    """The file of a plan, whose commands come back at their times."""
    pytest.importorskip("rosbags", reason="needs the package rosbags")
    commands = np.array([[1e5, 2e5], [1.5e5, 1e5], [3e5, 0.5e5]])
    names = ("left.setpoint", "right.setpoint")
    plan = SignalPlan(names, commands, 0.01, (), (), SignalLimits(4e5), 1.0, {})
    path = tmp_path / "plan.mcap"
    signal_files(plan)[path.name](path)
    (run,) = read(path, ColumnMapping(units=dict.fromkeys(names, "Pa")))
    assert run["time"] == pytest.approx([0.0, 0.01, 0.02])
    for name, column in zip(names, commands.T, strict=True):
        assert run[name] == pytest.approx(column)


def test_a_damaged_bag_is_refused(bag):
    file = next(bag.glob("*.db3"))
    file.write_bytes(b"nothing")
    with pytest.raises(FileError, match="cannot be read as ROS bag"):
        read(bag)


def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch):
    for name in [n for n in sys.modules if n.startswith("rosbags")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    (tmp_path / "run.bag").write_bytes(b"#ROSBAG V2.0")
    with pytest.raises(
        FileError, match=r"needs the package rosbags.highlevel.*pip install .airmuscle\[ros\]"
    ):
        read(tmp_path / "run.bag")
