"""ROS 2 topics as a rig: set points are published, readings are subscribed to. Needs rclpy.

    COMMANDS   std_msgs/msg/Float64MultiArray   gauge pressures [Pa] in the order of `commands`
    SENSORS    std_msgs/msg/Float64MultiArray   readings [SI] in the order of `sensors`
    STOP       std_msgs/msg/Empty               vent

The node of the rig must vent on STOP, and when no COMMANDS arrive for 0.2 s.
"""

import time
from collections.abc import Mapping, Sequence
from typing import Any

from ...core import RigError

TIMEOUT = 0.2
"""Time within which a reading newer than the command must arrive [s] (chosen)."""
DEPTH = 1
"""Messages that a queue holds: only the last one counts."""


class Ros2Rig:
    """A rig behind three topics below `namespace`: `/setpoints`, `/sensors` and `/stop`.

    commands, sensors  names in the order of the numbers of a message

    Raises RigError without rclpy, or where no reading arrives in time.
    """

    def __init__(
        self,
        commands: Sequence[str],
        sensors: Sequence[str],
        namespace: str = "/airmuscle",
        timeout: float = TIMEOUT,
    ) -> None:
        try:
            import rclpy
            from std_msgs.msg import Empty, Float64MultiArray
        except ImportError:
            raise RigError(
                "ROS 2: the package rclpy is missing. Source the setup file of your ROS 2"
                " distribution, and start airmuscle with its Python."
            ) from None
        self.commands = tuple(commands)
        self.sensors = tuple(sensors)
        self.timeout = timeout
        self._rclpy = rclpy
        self._array = Float64MultiArray
        self._empty = Empty
        if not rclpy.ok():
            rclpy.init()
        self._node = rclpy.create_node("airmuscle_player")
        self._setpoints = self._node.create_publisher(
            Float64MultiArray, f"{namespace}/setpoints", DEPTH
        )
        self._stop = self._node.create_publisher(Empty, f"{namespace}/stop", DEPTH)
        self._node.create_subscription(
            Float64MultiArray, f"{namespace}/sensors", self._receive, DEPTH
        )
        self._reading: list[float] | None = None

    def write(self, commands: Mapping[str, float]) -> None:
        """Publish the gauge pressures [Pa]."""
        if set(commands) != set(self.commands):
            raise RigError(
                f"ROS 2: the commands are {', '.join(commands)}; the rig has"
                f" {', '.join(self.commands)}."
            )
        self._reading = None
        self._publish([float(commands[name]) for name in self.commands])

    def read(self) -> dict[str, float]:
        """The first readings [SI] that arrive after the command."""
        end = time.monotonic() + self.timeout
        while self._reading is None:
            remaining = end - time.monotonic()
            if remaining <= 0.0:
                raise RigError(f"ROS 2: no reading within {1e3 * self.timeout:.0f} ms.")
            self._rclpy.spin_once(self._node, timeout_sec=remaining)
        if len(self._reading) != len(self.sensors):
            raise RigError(
                f"ROS 2: {len(self._reading)} readings arrived for {len(self.sensors)} sensors."
            )
        return dict(zip(self.sensors, self._reading, strict=True))

    def stop(self) -> None:
        """Publish a stop and set points of 0."""
        self._stop.publish(self._empty())
        self._publish([0.0] * len(self.commands))

    def close(self) -> None:
        """Vent and end the node."""
        self.stop()
        self._node.destroy_node()

    def _publish(self, values: list[float]) -> None:
        message = self._array()
        message.data = values
        self._setpoints.publish(message)

    def _receive(self, message: Any) -> None:
        self._reading = [float(value) for value in message.data]
