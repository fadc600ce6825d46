"""Played signals: nothing moves without a start, and whatever ends a run leaves the rig vented."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import SignalLimits, check_record, fit_regulator, read_csv, write
from airmuscle.errors import ParameterError, RigError
from airmuscle.outlets import (
    Ros2Rig,
    SerialDevice,
    SerialRig,
    SimulatedRig,
    framed,
    play,
    unframed,
)
from airmuscle.recording import Recording

STEP = 0.01
PLANT = am.load("vessel-smc-itv2050").plant
LIMITS = SignalLimits(3e5)
TIME = STEP * np.arange(500)
SIGNALS = Recording(
    {"time": TIME, "setpoint": 1.5e5 + 1e5 * np.sign(np.sin(2 * np.pi * TIME))}, "steps"
)


def jumping():
    now = [0.0]
    return {
        "clock": lambda: now[0],
        "pause": lambda duration: now.__setitem__(0, now[0] + duration),
    }


class Failing(SimulatedRig):
    """A rig whose n-th call of a function raises an exception, or reads a value."""

    def __init__(self, function, number, fault):
        super().__init__(PLANT, STEP)
        self.plan = (function, number, fault)
        self.calls = {"write": 0, "read": 0}

    def _count(self, function):
        self.calls[function] += 1
        wanted, number, fault = self.plan
        if function == wanted and self.calls[function] == number:
            if isinstance(fault, type):
                raise fault("injected")
            return fault
        return None

    def write(self, commands):
        super().write(commands)
        self._count("write")

    def read(self):
        return self._count("read") or super().read()


FAULTS = [
    RigError,
    OSError,
    ZeroDivisionError,
    KeyboardInterrupt,
    {"pressure": np.nan},
    {"pressure": 3.4e5},
]
MOMENTS = [
    (function, number, fault)
    for number in (1, 7, 250)
    for function in ("write", "read")
    for fault in FAULTS
    if function == "read" or isinstance(fault, type)
]


def test_thirty_moments_are_tried():
    assert len(MOMENTS) >= 30


@pytest.mark.parametrize(("function", "number", "fault"), MOMENTS)
def test_every_fault_vents_and_keeps_the_rows_before_it(function, number, fault):
    rig = Failing(function, number, fault)
    played = play(rig, SIGNALS, LIMITS, start=True, **jumping())
    assert rig.is_vented
    assert played.is_vented
    assert played.reason
    rows = number if isinstance(fault, dict) else number - 1
    assert len(played.recording["time"]) == rows


def test_an_exit_of_the_program_vents():
    rig = Failing("read", 20, SystemExit)
    with pytest.raises(SystemExit):
        play(rig, SIGNALS, LIMITS, start=True, **jumping())
    assert rig.is_vented


def test_a_vented_rig_loses_its_pressure():
    rig = SimulatedRig(PLANT, STEP)
    rig.write({"setpoint": 3e5})
    assert rig.advance(2.0)["pressure"] == pytest.approx(3e5, rel=0.05)
    rig.stop()
    assert rig.advance(3.0)["pressure"] < 2e4


def test_nothing_moves_without_a_start():
    rig = Failing("write", 0, RigError)
    with pytest.raises(ParameterError, match="start=True"):
        play(rig, SIGNALS, LIMITS)
    assert rig.calls == {"write": 0, "read": 0}


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        (SignalLimits(2e5), "the limits are 0 to 200 kPa"),
        (SignalLimits(3e5, 1e5), "the limits are 100 to 300 kPa"),
        (SignalLimits(3e5, 0.0, 1e6), "the limit is 10 bar/s"),
    ],
)
def test_commands_beyond_the_limits_are_refused_before_the_start(limits, text):
    rig = Failing("write", 0, RigError)
    with pytest.raises(ParameterError, match=text):
        play(rig, SIGNALS, limits, start=True)
    assert rig.calls["write"] == 0


def test_a_late_row_vents():
    now = [0.0]

    class Slow(SimulatedRig):
        def read(self):
            now[0] += 0.5 if now[0] > 1.0 else 0.0
            return super().read()

    rig = Slow(PLANT, STEP)
    played = play(
        rig,
        SIGNALS,
        LIMITS,
        start=True,
        clock=lambda: now[0],
        pause=lambda duration: now.__setitem__(0, now[0] + duration),
    )
    assert "late" in played.reason
    assert rig.is_vented


def test_an_angle_beyond_its_travel_vents():
    plant = am.load("joint-dmsp-20-regulators").plant
    columns = {"left.setpoint": 1e5 + 1e5 * TIME, "right.setpoint": np.full(500, 1e5)}
    signals = Recording({"time": TIME, **columns}, "ramp")
    rig = SimulatedRig(plant, STEP)
    limits = SignalLimits(6e5, travel={"angle": (-0.2, 0.2)})
    played = play(rig, signals, limits, start=True, **jumping())
    assert "angle is" in played.reason
    assert rig.is_vented
    assert np.abs(played.recording["angle"][:-1]).max() <= 0.2


def test_a_rig_that_does_not_confirm_is_named():
    class Deaf(SimulatedRig):
        def stop(self):
            raise RigError("no answer")

    played = play(Deaf(PLANT, STEP), SIGNALS, LIMITS, start=True, **jumping())
    assert not played.is_vented
    assert "cut its supply" in played.chapter().problems[0]


def test_the_record_is_read_checked_and_fitted(tmp_path):
    played = play(SimulatedRig(PLANT, STEP), SIGNALS, LIMITS, start=True, **jumping())
    assert played.reason == ""
    path = write(played.recording, tmp_path / "record.csv")
    record = read_csv(path)
    assert list(record) == ["time", "setpoint", "pressure"]
    assert check_record(record).faults == ()
    fit = fit_regulator(
        [record], supply_pressure=5.78e5, initial=PLANT.circuits[0], free=("pilot_time",), starts=1
    )
    assert fit.regulator.pilot_time == pytest.approx(PLANT.circuits[0].pilot_time, rel=0.2)


# The serial line, over a pseudo-terminal with a simulated rig behind it


class Line:
    """A pseudo-terminal with a device in a thread."""

    def __init__(self, watchdog=0.1):
        self.controller, port = pty.openpty()
        self.port = os.ttyname(port)
        self._port = port
        self.rig = SimulatedRig(PLANT, STEP)
        self.device = SerialDevice(self.rig, self.controller, watchdog)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self.device.serve, args=(self._over.is_set,))

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *exception):
        self._over.set()
        self._thread.join()
        os.close(self.controller)
        os.close(self._port)


def test_signals_are_played_over_a_serial_line():
    short = Recording({name: SIGNALS[name][:60] for name in SIGNALS}, "short")
    with Line(watchdog=2.0) as line, SerialRig(line.port, timeout=2.0) as rig:
        assert rig.commands == ("setpoint",)
        assert rig.sensors == ("pressure",)
        played = play(rig, short, LIMITS, start=True, max_late=2.0)
        assert played.reason == ""
        assert line.rig.is_vented
    pressure = played.recording["pressure"]
    assert pressure[0] < 5e3
    assert pressure[-1] > 1e5


def test_a_silent_program_lets_the_device_vent():
    with Line(watchdog=0.1) as line, SerialRig(line.port, timeout=2.0) as rig:
        rig.write({"setpoint": 2e5})
        rig.read()
        assert not line.rig.is_vented
        deadline = time.monotonic() + 5.0
        while not line.rig.is_vented and time.monotonic() < deadline:
            time.sleep(0.01)
        assert line.rig.is_vented
        rig.write({"setpoint": 2e5})
        with pytest.raises(RigError, match="not started"):
            rig.read()


def test_a_line_without_a_device_is_refused():
    controller, port = pty.openpty()
    with pytest.raises(RigError, match="no answer within"):
        SerialRig(os.ttyname(port), timeout=0.02)
    os.close(controller)
    os.close(port)
    with pytest.raises(RigError, match="cannot be opened"):
        SerialRig("/dev/no-such-port")


def test_a_damaged_line_is_no_command():
    device = SerialDevice(SimulatedRig(PLANT, STEP), 0)
    line = framed("SET 1 200000")
    assert unframed(line) == "SET 1 200000"
    for place in range(len(line) - 1):
        damaged = line[:place] + bytes([line[place] ^ 1]) + line[place + 1 :]
        assert unframed(damaged) is None
    assert device.answer("SET 1 200000") == "ERR not started"
    assert device.answer("START") == "OK START"
    assert device.answer("SET 1 much") == "ERR unreadable values"
    assert device.answer("OPEN").startswith("ERR unknown")


PLAYERS = """
import os, sys, time
import numpy as np
from airmuscle.bench import SignalLimits
from airmuscle.outlets import SerialRig, play
from airmuscle.recording import Recording

time_column = 0.01 * np.arange(3000)
signals = Recording({"time": time_column, "setpoint": np.full(3000, 2e5)}, "held")
for port in sys.argv[1:]:
    child = os.fork()
    if child == 0:
        with SerialRig(port, timeout=5.0) as rig:
            played = play(rig, signals, SignalLimits(3e5), start=True, max_late=20.0)
        os._exit(3 if played.reason else 0)
    print(child, flush=True)
for port in sys.argv[1:]:
    os.wait()
"""


def test_a_killed_program_vents_at_thirty_moments():
    """By SIGKILL the watchdog of the device vents, by other signals the program does."""
    numbers = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT]
    rng = np.random.default_rng(1)
    for _ in range(3):
        lines = [Line(watchdog=1.0) for _ in range(10)]
        for line in lines:
            line.__enter__()
        ports = [line.port for line in lines]
        with subprocess.Popen(
            [sys.executable, "-c", PLAYERS, *ports], stdout=subprocess.PIPE, text=True
        ) as players:
            processes = [int(players.stdout.readline()) for _ in ports]
            deadline = time.monotonic() + 30.0
            while any(line.rig.is_vented for line in lines) and time.monotonic() < deadline:
                time.sleep(0.005)
            assert not any(line.rig.is_vented for line in lines)
            for place in rng.permutation(10).tolist():
                time.sleep(float(rng.uniform(0.0, 0.03)))
                os.kill(processes[place], numbers[place % len(numbers)])
        deadline = time.monotonic() + 5.0
        while not all(line.rig.is_vented for line in lines) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert all(line.rig.is_vented for line in lines)
        for line in lines:
            line.__exit__()


# ROS 2, against a stand-in of rclpy


class Node:
    """A node whose set points come back as readings."""

    def __init__(self):
        self.published = []
        self.callback = None
        self.answers = True

    def create_publisher(self, kind, topic, depth):
        def publish(message):
            self.published.append((topic, message))

        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, depth):
        self.callback = callback

    def destroy_node(self):
        self.published.append(("destroyed", None))


@pytest.fixture
def node(monkeypatch):
    node = Node()

    def spin_once(_, timeout_sec):
        if node.answers:
            last = [message for topic, message in node.published if topic == "/rig/setpoints"][-1]
            node.callback(types.SimpleNamespace(data=[value - 100.0 for value in last.data]))
        else:
            time.sleep(min(timeout_sec, 0.01))

    rclpy = types.SimpleNamespace(
        ok=lambda: False, init=lambda: None, create_node=lambda name: node, spin_once=spin_once
    )
    messages = types.SimpleNamespace(
        Empty=types.SimpleNamespace, Float64MultiArray=types.SimpleNamespace
    )
    monkeypatch.setitem(sys.modules, "rclpy", rclpy)
    monkeypatch.setitem(sys.modules, "std_msgs", types.SimpleNamespace(msg=messages))
    monkeypatch.setitem(sys.modules, "std_msgs.msg", messages)
    return node


def test_topics_of_ros2_are_played(node):
    rig = Ros2Rig(["setpoint"], ["pressure"], "/rig", timeout=0.05)
    played = play(rig, SIGNALS, LIMITS, start=True, **jumping())
    assert played.reason == ""
    assert played.recording["pressure"] == pytest.approx(SIGNALS["setpoint"] - 100.0)
    assert [topic for topic, _ in node.published[-2:]] == ["/rig/stop", "/rig/setpoints"]
    assert node.published[-1][1].data == [0.0]


def test_a_silent_topic_vents(node):
    rig = Ros2Rig(["setpoint"], ["pressure"], "/rig", timeout=0.05)
    node.answers = False
    played = play(rig, SIGNALS, LIMITS, start=True, **jumping())
    assert "no reading" in played.reason
    assert node.published[-1][1].data == [0.0]


def test_a_missing_rclpy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(RigError, match="rclpy is missing"):
        Ros2Rig(["setpoint"], ["pressure"])


# The command


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    return write(SIGNALS, tmp_path_factory.mktemp("plan") / "plan.csv")


def test_the_command_moves_nothing_without_start(plan, tmp_path):
    out = tmp_path / "record"
    result = airmuscle(
        "play", plan, "--serial", "/dev/no-such-port", "--max-pressure", "3 bar", "--out", out
    )
    assert result.exit_code == 0, result.output
    assert "Nothing was moved" in result.stdout
    assert not out.exists()


def test_the_command_records_a_simulated_rig(plan, tmp_path):
    out = tmp_path / "record"
    result = airmuscle(
        "play",
        plan,
        "--simulate",
        "vessel-smc-itv2050",
        "--max-pressure",
        "3 bar",
        "--start",
        "--out",
        out,
        "--json",
    )
    assert result.exit_code == 0, result.output
    for command in ("inspect", "check"):
        assert airmuscle(command, out / "record.csv").exit_code == 0


def test_the_command_ends_with_an_error_and_the_rows_so_far(plan, tmp_path):
    out = tmp_path / "record"
    result = airmuscle(
        "play",
        plan,
        "--simulate",
        "joint-dmsp-20-regulators",
        "--max-pressure",
        "3 bar",
        "--min-angle",
        "-1 rad",
        "--max-angle",
        "1 rad",
        "--start",
        "--out",
        out,
    )
    assert result.exit_code == 1
    assert "Ended early after 0 rows" in result.stdout


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ((), "give one of --serial, --ros2 and --simulate"),
        (("--simulate", "vessel-smc-itv2050", "--ros2", "/rig"), "2 rigs given"),
        (("--serial", "/dev/x", "--min-angle", "0 deg"), "together with --max-angle"),
    ],
)
def test_half_a_request_is_refused(plan, options, text):
    result = airmuscle("play", plan, "--max-pressure", "3 bar", *options)
    assert result.exit_code != 0
    assert text in " ".join(result.output.split())


def test_a_joint_without_limits_of_its_angle_is_refused(plan):
    result = airmuscle(
        "play", plan, "--simulate", "joint-dmsp-20-regulators", "--max-pressure", "3 bar", "--start"
    )
    assert result.exit_code != 0
    assert "--min-angle" in result.output
