"""A ROS 2 node that is a pneumatic joint: it takes the valve commands and publishes joint state and
pressures.

    source /opt/ros/jazzy/setup.bash && python examples/ros2_joint_node.py
    ros2 topic pub /valves std_msgs/msg/Float64MultiArray "{data: [0.3, 0.0, 0.0, 0.3]}"

Messages are in SI units with gauge pressures. The node is tested against a stand-in of rclpy, not
with ROS itself.
"""

import sys

import airmuscle as am

PERIOD = 0.01
"""Time between two published states [s]."""

try:
    import rclpy
    from rclpy.node import Node
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray
except ImportError:
    print("this example needs ROS 2 (rclpy, sensor_msgs, std_msgs)")
    sys.exit()


class PneumaticJoint(Node):
    """The joint of the library with its valves, stepped in real time."""

    def __init__(self) -> None:
        super().__init__("pneumatic_joint")
        plant = am.load("joint-dmsp-20-matrix").plant
        self.stepper = am.Stepper(
            plant, plant.state_at(pressure=2e5), integrator=am.RungeKutta4(1e-3)
        )
        self.opening = [0.0] * len(self.stepper.input_names)
        self.states = self.create_publisher(JointState, "joint_states", 10)
        self.pressures = self.create_publisher(Float64MultiArray, "pressures", 10)
        self.create_subscription(Float64MultiArray, "valves", self.receive, 10)
        self.create_timer(PERIOD, self.step)
        self.get_logger().info(f"valves: {', '.join(self.stepper.input_names)}, each from 0 to 1")

    def receive(self, message: Float64MultiArray) -> None:
        """Keep the openings of a message; a wrong number of them is refused."""
        if len(message.data) == len(self.opening):
            self.opening = [min(max(float(value), 0.0), 1.0) for value in message.data]
        else:
            self.get_logger().warning(
                f"{len(message.data)} openings; there are {len(self.opening)} valves"
            )

    def step(self) -> None:
        """Advance the joint by one period and publish it; a step that fails leaves the state as it
        was.
        """
        try:
            self.stepper.step(self.opening, PERIOD)
        except am.errors.AirmuscleError as error:
            self.get_logger().error(str(error))
        state = JointState(
            name=["joint"],
            position=[self.stepper["angle"]],
            velocity=[self.stepper["angular_speed"]],
        )
        state.header.stamp = self.get_clock().now().to_msg()
        self.states.publish(state)
        pressures = [self.stepper[f"{muscle}.pressure"] for muscle in ("left", "right")]
        self.pressures.publish(Float64MultiArray(data=pressures))


def main() -> None:
    """Run the node until it is interrupted."""
    rclpy.init()
    rclpy.spin(PneumaticJoint())


if __name__ == "__main__":
    main()
