"""Robot descriptions of joints and arms: MJCF for MuJoCo, with the muscles as plugin actuators, and
URDF.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from ...core import STANDARD_GRAVITY, ParameterError
from ...physics import (
    AntagonisticJoint,
    Mechanism,
    MuscleRoute,
    PlanarArm,
    SerialArm,
    SpatialLink,
    WithStickSlip,
)
from ...physics.mechanism.antagonistic_joint import ConstantRadius
from ...physics.plant import Plant, open_plant
from .identifiers import program_name, provenance
from .mujoco_plugin import REST_LENGTH, MuscleActuator, write_mujoco_plugin
from .write import write_files

LOAD = 100.0
"""Tension of a muscle and load of a bearing [N] at which the friction that they cause is stated
(chosen).
"""
LEAST = 1e-9
"""Mass [kg] and moment of inertia [kg m2] that stand for zero, which simulators refuse (chosen)."""


@dataclasses.dataclass(frozen=True)
class RobotModel:
    """Links in series with the names of their joints, whose z axes point upwards at rest, and
    routes of the muscles.

    gravity    acceleration of gravity [m/s2]
    frictions  dry friction of each joint [N m]
    left_out   what else the mechanism has, in words
    """

    joints: Sequence[str]
    links: Sequence[SpatialLink]
    routes: Sequence[MuscleRoute]
    gravity: float
    frictions: Sequence[float]
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for number, route in enumerate(self.routes, start=1):
            if any(not isinstance(profile, ConstantRadius) for profile in route.profiles):
                raise ParameterError(
                    f"the pulley of muscle {number} is not circular; a tendon of a robot"
                    " description has a constant moment arm. Use ConstantRadius, or export the"
                    " plant with --to fmu."
                )


@functools.singledispatch
def robot_model(mechanism: Mechanism) -> RobotModel:
    """The rigid bodies of a mechanism. Raises ParameterError for one that is no joint or arm with
    circular pulleys.
    """
    raise ParameterError(
        f"{type(mechanism).__name__} has no robot description; AntagonisticJoint, PlanarArm and"
        " SerialArm have one, also in WithStickSlip. Export the plant with --to fmu, or one of its"
        " muscles with --to mujoco."
    )


@robot_model.register
def _joint_model(mechanism: AntagonisticJoint) -> RobotModel:
    """One link with the inertia and the weight torque of the joint: half of the inertia is that of
    the mass at its distance from the axis (chosen; only inertia and torque act)."""
    joint = mechanism
    distance = (
        0.5 * joint.inertia * STANDARD_GRAVITY / joint.weight_torque if joint.weight_torque else 0.0
    )
    mass = joint.weight_torque / (STANDARD_GRAVITY * distance) if distance else 1.0
    central_inertia = joint.inertia - mass * distance**2
    centre = (
        distance * math.sin(joint.weight_angle),
        0.0,
        -distance * math.cos(joint.weight_angle),
    )
    link = SpatialLink(
        (0, -1, 0), (0.0, 0.0, 0.0), mass, centre, central_inertia, 0.0, joint.damping
    )
    routes = [
        MuscleRoute((1,), (sign * joint.radius,), joint.offset, (joint.profile,))
        for sign in (1.0, -1.0)
    ]
    return RobotModel(["angle"], [link], routes, STANDARD_GRAVITY, [0.0])


@robot_model.register
def _planar_model(mechanism: PlanarArm) -> RobotModel:
    links = []
    before = 0.0
    for number, link in enumerate(mechanism.links, start=1):
        tip = mechanism.payload if number == len(mechanism.links) else 0.0
        mass = link.mass + tip
        centre = (link.mass * link.centre + tip * link.length) / mass
        link_inertia = link.inertia + link.mass * (link.centre - centre) ** 2
        inertia = link_inertia + tip * (link.length - centre) ** 2  # parallel axes
        position = (0.0, 0.0, -before)
        at = (0.0, 0.0, -centre)
        links.append(
            SpatialLink(
                (0, -1, 0),
                position,
                max(mass, LEAST),
                at,
                inertia,
                0.0,
                link.damping,
            )
        )
        before = link.length
    names = [c.name for c in mechanism.coordinates]
    frictions = [0.0] * len(links)
    return RobotModel(names, links, mechanism.routes, mechanism.gravity, frictions)


@robot_model.register
def _spatial_model(mechanism: SerialArm) -> RobotModel:
    names = [c.name for c in mechanism.coordinates]
    links = mechanism.links
    return RobotModel(names, links, mechanism.routes, mechanism.gravity, [0.0] * len(links))


@robot_model.register
def _stick_slip_model(mechanism: WithStickSlip) -> RobotModel:
    inner = robot_model(mechanism.inner)
    elements = mechanism.elements
    sizes = {
        f"the friction by the tensions of the muscles, at {LOAD:g} N each": [
            (LOAD * sum(element.load_arms), "N m") for element in elements
        ],
        f"the friction by the load of a bearing, at {LOAD:g} N": [
            (LOAD * sum(element.bearing_arms), "N m") for element in elements
        ],
        "stiction above the friction in sliding": [
            (element.static_excess * element.coulomb_torque, "N m") for element in elements
        ],
        "the deflection before sliding": [
            (math.degrees(element.presliding_angle), "deg") for element in elements
        ],
    }
    left_out = []
    for text, of_joints in sizes.items():
        stated = [
            f"{size:.3g} {unit} ({joint})"
            for joint, (size, unit) in zip(inner.joints, of_joints, strict=True)
            if size
        ]
        if stated:
            left_out.append(f"{text}: {', '.join(stated)}")
    if mechanism.residual is not None:
        energy = max(map(abs, mechanism.residual.energies), default=0.0)
        left_out.append(f"the residual law, of up to {energy:.3g} J for each centre")
    return dataclasses.replace(
        inner,
        frictions=[element.coulomb_torque for element in elements],
        left_out=tuple(left_out),
    )


@dataclasses.dataclass(frozen=True)
class WrittenRobot:
    """The path of a robot description; of MJCF also the plugins of its muscles, which MuJoCo loads
    before the file.

    left_out  what the mechanism has and the description cannot state, and libraries of plugins
              that were not built, in words
    """

    path: Path
    plugins: tuple[MuscleActuator, ...] = ()
    left_out: tuple[str, ...] = ()


def write_mjcf(plant: Plant, folder: str | Path, *, name: str = "robot") -> WrittenRobot:
    """Write `NAME.xml`, a MuJoCo model of a joint or an arm, and a plugin for each of its muscles
    beside it.

    Each muscle is a tendon with a plugin actuator that contains its valves, gas and friction
    (`write_mujoco_plugin`). The qpos of the joints are the angles of the plant; the keyframe
    `ambient` has zero angles and muscles at ambient pressure. Of the friction of `WithStickSlip`
    the joints have the constant share; what else it has is stated as left out, in the file too.
    Raises ParameterError for a plant whose mechanism is no joint or arm, whose pulleys are not
    circular, or whose muscles share a circuit, and FileError.
    """
    program = program_name(name, name)
    robot = robot_model(plant.mechanism)
    made = [
        write_mujoco_plugin(
            plant, folder, name=f"{program}_{program_name('', muscle.name)}", muscle=muscle.name
        )
        for muscle in plant.muscles
    ]
    root = ET.Element("mujoco", model=program)
    root.append(_comment(f"Robot {program} for MuJoCo", plant, robot))
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=f"0 0 {-robot.gravity!r}")
    extension = ET.SubElement(root, "extension")
    body = ET.SubElement(root, "worldbody")
    for number, link_facts in enumerate(
        zip(robot.joints, robot.links, robot.frictions, strict=True), start=1
    ):
        body = _mjcf_body(body, f"link{number}", *link_facts)
    tendons = ET.SubElement(root, "tendon")
    actuators = ET.SubElement(root, "actuator")
    states: list[float] = []
    for muscle, plugin, route in zip(plant.muscles, made, robot.routes, strict=True):
        rest = route.offset * muscle.geometry.resting_length
        element = ET.SubElement(extension, "plugin", plugin=plugin.plugin_name)
        instance = ET.SubElement(element, "instance", name=muscle.name)
        ET.SubElement(instance, "config", key=REST_LENGTH, value=repr(rest))
        tendon = ET.SubElement(tendons, "fixed", name=muscle.name)
        for joint, radius in zip(route.joints, route.radii, strict=True):
            ET.SubElement(tendon, "joint", joint=robot.joints[joint - 1], coef=repr(-radius))
        low, high = plugin.control_range
        ET.SubElement(
            actuators,
            "plugin",
            name=muscle.name,
            tendon=muscle.name,
            plugin=plugin.plugin_name,
            instance=muscle.name,
            actdim=str(len(plugin.plant.states) + 1),
            dyntype="user",
            ctrlrange=f"{low!r} {high!r}",
        )
        states += [*open_plant(plugin.plant, (rest,)).state_at(pressure=0.0).values(), 0.0]
    keyframe = ET.SubElement(root, "keyframe")
    ET.SubElement(
        keyframe,
        "key",
        name="ambient",
        qpos=_numbers((0.0,) * len(robot.links)),
        act=_numbers(states),
    )
    missing = tuple(
        f"the library of the plugin {plugin.plugin_name}: {plugin.remark}"
        for plugin in made
        if plugin.library is None
    )
    path = _written(root, folder, f"{program}.xml")
    return WrittenRobot(path, tuple(made), (*robot.left_out, *missing))


def _mjcf_body(
    parent: ET.Element, name: str, joint: str, link: SpatialLink, friction: float
) -> ET.Element:
    body = ET.SubElement(parent, "body", name=name, pos=_numbers(link.position))
    ET.SubElement(
        body,
        "joint",
        name=joint,
        type="hinge",
        axis=_numbers(link.axis),
        ref=repr(link.zero_angle),
        damping=repr(link.damping),
        armature=repr(link.rotor_inertia),
        frictionloss=repr(friction),
    )
    ET.SubElement(
        body,
        "inertial",
        pos=_numbers(link.centre),
        mass=repr(max(link.mass, LEAST)),
        diaginertia=_numbers((max(link.inertia, LEAST),) * 3),
    )
    end = link.centre if any(link.centre) else (0.0, 0.0, -0.05)
    ET.SubElement(
        body,
        "geom",
        type="capsule",
        fromto=_numbers((0.0, 0.0, 0.0, *end)),
        size="0.01",
        contype="0",
        conaffinity="0",
        mass="0",
    )
    return body


def write_urdf(plant: Plant, folder: str | Path, *, name: str = "robot") -> WrittenRobot:
    """Write `NAME.urdf`, the links and joints of a joint or an arm for ROS and simulators.

    URDF has neither tendons nor pneumatics: the muscles are stated in a comment, with their joints,
    moment arms and lengths; their torques come from an exported program of the plant. The joints
    are continuous, because the limits of the angles in the plant are no end stops. Rotor inertias
    beyond the first joint, which URDF cannot state, and what `write_mjcf` leaves out are named.
    Raises ParameterError as `write_mjcf`.
    """
    program = program_name(name, name)
    robot = robot_model(plant.mechanism)
    rotors = [
        f"the rotor inertia of {name}, {link.rotor_inertia:.3g} kg m2"
        for name, link in list(zip(robot.joints, robot.links, strict=True))[1:]
        if link.rotor_inertia
    ]
    robot = dataclasses.replace(robot, left_out=(*robot.left_out, *rotors))
    root = ET.Element("robot", name=program)
    lines = []
    for muscle, route in zip(plant.muscles, robot.routes, strict=True):
        arms = (
            f"{r!r} m about {robot.joints[j - 1]}"
            for j, r in zip(route.joints, route.radii, strict=True)
        )
        rest = (
            f"resting length {muscle.geometry.resting_length!r} m, contraction {route.offset!r} at"
            " angles 0"
        )
        lines.append(f"muscle {muscle.name}: {rest}, moment arms {', '.join(arms)}")
    root.append(_comment(f"Robot {program}", plant, robot, lines))
    ET.SubElement(root, "link", name="base")
    parent = "base"
    for number, joint in enumerate(
        zip(robot.joints, robot.links, robot.frictions, strict=True), start=1
    ):
        _urdf_link(root, parent, f"link{number}", *joint)
        parent = f"link{number}"
    return WrittenRobot(_written(root, folder, f"{program}.urdf"), (), robot.left_out)


def _urdf_link(
    root: ET.Element, parent: str, name: str, axis: str, link: SpatialLink, friction: float
) -> None:
    body = ET.SubElement(root, "link", name=name)
    inertial = ET.SubElement(body, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(link.centre))
    ET.SubElement(inertial, "mass", value=repr(max(link.mass, LEAST)))
    turning = (
        link.rotor_inertia if parent == "base" else 0.0
    )  # the first link turns about its axis alone
    moment = repr(max(link.inertia + turning, LEAST))
    ET.SubElement(
        inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0"
    )
    joint = ET.SubElement(root, "joint", name=axis, type="continuous")
    rotation = [
        -link.zero_angle * component for component in link.axis
    ]  # about one axis of the frame
    ET.SubElement(joint, "origin", xyz=_numbers(link.position), rpy=_numbers(rotation))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=name)
    ET.SubElement(joint, "axis", xyz=_numbers(link.axis))
    ET.SubElement(joint, "dynamics", damping=repr(link.damping), friction=repr(friction))


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)


def _comment(title: str, plant: Plant, robot: RobotModel, notes: Sequence[str] = ()) -> Any:
    """The provenance as a comment of XML, which contains no double hyphen, with what is left
    out.
    """
    lines = provenance(
        title, plant, (), [*notes, *(f"left out: {text}" for text in robot.left_out)]
    )
    return ET.Comment("\n" + "\n".join(lines).replace("--", "- -") + "\n")


def _written(root: Any, folder: str | Path, file: str) -> Path:
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return write_files({file: text + b"\n"}, folder)[0]


WRITERS: dict[str, Callable[..., WrittenRobot]] = {"mjcf": write_mjcf, "urdf": write_urdf}
"""Writers by the names of the option --to."""
