"""Units of ROS messages: the fields of the usual message types, which are in SI units (REP 103)."""

from __future__ import annotations

STANDARD = ("geometry_msgs/", "sensor_msgs/", "nav_msgs/", "trajectory_msgs/", "control_msgs/")
"""Packages whose fields are no quantities of a muscle by their names, except those in QUANTITY_FIELDS."""
FIELD_UNITS = {
    ("geometry_msgs/msg/Wrench", "force"): "N",
    ("geometry_msgs/msg/Wrench", "torque"): "N m",
    ("geometry_msgs/msg/Twist", "linear"): "m/s",
    ("geometry_msgs/msg/Twist", "angular"): "rad/s",
    ("geometry_msgs/msg/Accel", "linear"): "m/s^2",
    ("geometry_msgs/msg/Accel", "angular"): "rad/s^2",
    ("geometry_msgs/msg/Pose", "position"): "m",
    ("geometry_msgs/msg/Transform", "translation"): "m",
    ("geometry_msgs/msg/PointStamped", "point"): "m",
    ("sensor_msgs/msg/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/msg/Imu", "linear_acceleration"): "m/s^2",
    ("sensor_msgs/msg/JointState", "position"): "rad",
    ("sensor_msgs/msg/JointState", "velocity"): "rad/s",
    ("sensor_msgs/msg/JointState", "effort"): "N m",
    ("sensor_msgs/msg/Range", "range"): "m",
    ("sensor_msgs/msg/FluidPressure", "fluid_pressure"): "Pa(a)",
    ("sensor_msgs/msg/Temperature", "temperature"): "°C",
}
"""The unit of a field and of the numbers inside it, by type and name; those of JointState are of revolute joints."""
QUANTITY_FIELDS = {"fluid_pressure": "pressure", "temperature": "temperature"}
"""Fields of standard messages that are quantities, with the names of these."""


def is_quantity_field(message_type: str, field: str) -> bool:
    """Whether the name of a field may state a quantity; x, y and z are parts of a vector in every message."""
    return len(field) > 1 and not message_type.startswith(STANDARD)
