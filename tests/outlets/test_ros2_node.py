"""The ROS 2 node of the examples, against a stand-in of rclpy: commands move the joint as the
library does.
"""

from __future__ import annotations

import importlib.util
import sys
import types
from pathlib import Path

import pytest

import airmuscle as am

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_joint_node.py"


class Message(types.SimpleNamespace):
    """A message with the fields that it is given, and a header."""

    def __init__(self, **fields):
        super().__init__(header=types.SimpleNamespace(stamp=None), **fields)


class Node:
    """The calls of rclpy.node.Node that the example makes; what is published and logged is kept."""

    def __init__(self, name):
        self.name = name
        self.published = {}
        self.said = []
        self.timers = []
        self.topics = {}

    def create_publisher(self, kind, topic, depth):
        self.published[topic] = []
        return types.SimpleNamespace(publish=self.published[topic].append)

    def create_subscription(self, kind, topic, callback, depth):
        self.topics[topic] = callback

    def create_timer(self, period, callback):
        self.timers.append((period, callback))

    def get_logger(self):
        return types.SimpleNamespace(
            info=self.said.append, warning=self.said.append, error=self.said.append
        )

    def get_clock(self):
        return types.SimpleNamespace(
            now=lambda: types.SimpleNamespace(to_msg=lambda: len(self.published))
        )


@pytest.fixture
def node(monkeypatch):
    parts = {
        "rclpy": types.ModuleType("rclpy"),
        "rclpy.node": types.SimpleNamespace(Node=Node),
        "sensor_msgs": types.ModuleType("sensor_msgs"),
        "sensor_msgs.msg": types.SimpleNamespace(JointState=Message),
        "std_msgs": types.ModuleType("std_msgs"),
        "std_msgs.msg": types.SimpleNamespace(Float64MultiArray=Message),
    }
    for name, part in parts.items():
        monkeypatch.setitem(sys.modules, name, part)
    spec = importlib.util.spec_from_file_location("ros2_joint_node", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.PneumaticJoint()


def test_commands_move_the_joint_as_the_library_does(node):
    plant = am.load("joint-dmsp-20-matrix").plant
    own = am.Stepper(plant, plant.state_at(pressure=2e5), integrator=am.RungeKutta4(1e-3))
    ((period, step),) = node.timers
    node.topics["valves"](Message(data=[0.3, 0.0, 0.0, 0.3]))
    for _ in range(30):
        step()
        own.step([0.3, 0.0, 0.0, 0.3], period)
    assert [m.position for m in node.published["joint_states"]][-1] == [own["angle"]]
    assert node.published["pressures"][-1].data == [own["left.pressure"], own["right.pressure"]]
    assert abs(own["angle"] - node.published["joint_states"][0].position[0]) > 0.01


def test_a_wrong_number_of_openings_is_refused_and_beyond_its_range_limited(node):
    node.topics["valves"](Message(data=[1.0]))
    assert node.opening == [0.0] * 4
    assert node.said[-1] == "1 openings; there are 4 valves"
    node.topics["valves"](Message(data=[1.5, -1.0, 0.0, 0.2]))
    assert node.opening == [1.0, 0.0, 0.0, 0.2]
