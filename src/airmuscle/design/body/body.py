"""Body with muscle routes: its joints with their ranges, and the routes of its tendons."""

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core import FileError, ParameterError, ShortRepr, check_known, counted, listed
from .body_file import BodyFile
from .joints import BodyJoint, Coupling
from .simulator import load_simulator
from .xml_source import XmlSource

LARGEST_BODY = 20.0
"""Greatest distance [m] between points of the routes of a body (chosen): beyond, its lengths are
taken for millimetres."""
WRAPS = "around "
"""Beginning of the name of a point that is a geom around which a route wraps."""
LOOPS = {0: "connect", 1: "weld", 3: "tendon"}
"""Types of MuJoCo's equality constraints that close a loop."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BodyRoute(ShortRepr):
    """A route of a muscle along a body.

    name          of its actuator, or of its tendon if it has none or several
    tendon        name of the tendon
    index         of the tendon in MuJoCo's model
    is_path       whether it is a path through points, which has a length; a fixed tendon has
                  changes of length alone
    joints        names of the joints that change its length, coupled ones by their leaders
    points        names of its sites and of the geoms around which it wraps
    actuator      name of its actuator; empty without
    stated_range  range of lengths [m] that its actuator states; None without
    stated_force  greatest force [N] that its actuator states; None without
    place         file and line
    """

    name: str
    tendon: str
    index: int
    is_path: bool
    joints: tuple[str, ...]
    points: tuple[str, ...]
    actuator: str
    stated_range: tuple[float, float] | None
    stated_force: float | None
    place: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Body(ShortRepr):
    """A body with its routes.

    file      the files from which it was read
    model     `mujoco.MjModel`
    source    the text with lines of elements
    joints    hinges and slides by name
    routes    routes of muscles, in the order of the tendons
    remarks   what the file contains that the study does not use, with element and line
    loops     equality constraints that close a loop over a joint of a route, with element and line
    """

    file: BodyFile
    model: Any
    source: XmlSource
    joints: Mapping[str, BodyJoint]
    routes: tuple[BodyRoute, ...]
    remarks: tuple[str, ...]
    loops: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        return self.file.path.stem

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the joints that change the length of a route, without those that follow
        others.
        """
        names = {name for route in self.routes for name in route.joints}
        return tuple(name for name in self.joints if name in names)

    def route(self, name: str) -> BodyRoute:
        """The route of a name. Raises ParameterError."""
        known = {route.name: route for route in self.routes}
        check_known(f"{self.file.path}: there is no route", [name], known)
        return known[name]


def read_body(
    path: str | Path,
    *,
    routes: str | Path | None = None,
    ranges: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    leave_out: Collection[str] = (),
    folder: str | Path | None = None,
    without_meshes: bool = False,
) -> Body:
    """The body of an MJCF or URDF file, with its routes.

    routes          TOML file of further routes, `[[route]]` with name and points
    ranges          range (low, high) [rad or m] of joints by name
    leave_out       names of routes that are left out
    folder          folder from which the body may read; that of the file by default
    without_meshes  whether geoms and textures of files are left out

    Every spatial tendon that is no spring alone is a route, and every fixed tendon of a muscle: a
    pulley, whose coefficients are radii [m]. Raises FileError for files that cannot be read or are
    refused, ParameterError for a body without routes, whose lengths are in mm, or for unknown
    names.
    """
    file = BodyFile(
        Path(path),
        None if routes is None else Path(routes),
        ranges,
        None if folder is None else Path(folder),
        without_meshes,
    )
    source = file.source()
    return _BodyReader(file, source, file.compiled(file.specification())).body(leave_out)


class _BodyReader:
    """Reader of the joints and routes of a compiled model."""

    def __init__(self, file: BodyFile, source: XmlSource, model: Any) -> None:
        self.mujoco = load_simulator()
        self.file = file
        self.source = source
        self.model = model
        self.remarks: list[str] = []

    def body(self, leave_out: Collection[str]) -> Body:
        self._check_size()
        joints = self._joints()
        routes = self._routes(joints)
        names = [route.name for route in routes]
        check_known(f"{self.file.path}: there is no route", leave_out, names)
        routes = [route for route in routes if route.name not in leave_out]
        if not routes:
            raise ParameterError(
                f"{self.file.path}: the body has no route: no spatial tendon, and no actuator at a"
                " tendon. Add <tendon><spatial> to the MJCF, or give routes in a TOML file with"
                " --routes (routes=...)."
            )
        loops = tuple(self._loops({name for route in routes for name in route.joints}))
        return Body(
            self.file,
            self.model,
            self.source,
            joints,
            tuple(routes),
            tuple(self.remarks),
            loops,
        )

    def _name(self, kind: str, index: int) -> str:
        label: str = getattr(self.model, kind)(index).name
        return label or f"{kind}{index}"

    def _check_size(self) -> None:
        """Raise ParameterError for a body whose lengths are in mm."""
        data = self.mujoco.MjData(self.model)
        self.mujoco.mj_kinematics(self.model, data)
        moving = self.model.body_dofnum > 0
        points = data.xipos[moving]
        if len(points) == 0:
            return
        extent = float(np.ptp(points, axis=0).max())
        if self.model.nsite:
            extent = max(extent, float(np.ptp(data.site_xpos, axis=0).max()))
        if extent > LARGEST_BODY:
            raise ParameterError(
                f"{self.file.path}: the body is {extent:.4g} m large, so that its lengths are"
                " probably in mm, as those of a CAD export; MuJoCo takes them in m. Export it in"
                " m, or multiply all positions and sizes by 0.001."
            )

    def _joints(self) -> dict[str, BodyJoint]:
        model = self.model
        couplings = self._couplings()
        joints: dict[str, BodyJoint] = {}
        for index in range(model.njnt):
            kind = int(model.jnt_type[index])
            name = self._name("joint", index)
            place = self.source.place(name, "joint", "freejoint")
            if kind in (0, 1):  # free, ball
                word = "a free joint" if kind == 0 else "a ball joint"
                self.remarks.append(
                    f"{place} is {word}; the study holds it at its reference position."
                )
                continue
            low, high = (float(limit) for limit in model.jnt_range[index])
            if not model.jnt_limited[index]:
                low = -np.inf
                high = np.inf
            position = int(model.jnt_qposadr[index])
            reference = float(model.qpos0[position])
            joints[name] = BodyJoint(
                name,
                kind == 3,
                low,
                high,
                reference,
                position,
                int(model.jnt_dofadr[index]),
                place,
                couplings.get(name),
            )
        return joints

    def _couplings(self) -> dict[str, Coupling]:
        """The joints that follow another one, by joint equality constraints."""
        model = self.model
        couplings = {}
        for index in range(model.neq):
            if int(model.eq_type[index]) != 2 or not model.eq_active0[index]:
                continue
            follower = int(model.eq_obj1id[index])
            leader = int(model.eq_obj2id[index])
            if leader < 0:
                continue
            reference = tuple(
                float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (follower, leader)
            )
            couplings[self._name("joint", follower)] = Coupling(
                self._name("joint", leader),
                tuple(map(float, model.eq_data[index][:5])),
                (reference[0], reference[1]),
            )
        return couplings

    def _routes(self, joints: Mapping[str, BodyJoint]) -> list[BodyRoute]:
        model = self.model
        actuators: dict[int, list[int]] = {}
        at_joints = []
        for index in range(model.nu):
            if int(model.actuator_trntype[index]) == int(self.mujoco.mjtTrn.mjTRN_TENDON):
                actuators.setdefault(int(model.actuator_trnid[index, 0]), []).append(index)
            else:
                at_joints.append(self._name("actuator", index))
        if at_joints:
            self.remarks.append(
                f"{counted(len(at_joints), 'actuator')} at joints or sites, which have no route:"
                f" {listed(at_joints)}."
            )
        routes = []
        for tendon in range(model.ntendon):
            acting = actuators.get(tendon, [])
            if self._is_passive(tendon, acting):
                continue
            routes.append(self._route(tendon, acting, joints))
        return routes

    def _is_passive(self, tendon: int, acting: list[int]) -> bool:
        """Whether a tendon is no route: a spring without an actuator, or a fixed tendon whose
        actuator is no muscle.
        """
        name = self._name("tendon", tendon)
        place = self.source.place(name, "spatial", "fixed")
        first = int(self.model.tendon_adr[tendon])
        if int(self.model.wrap_type[first]) == int(self.mujoco.mjtWrap.mjWRAP_JOINT):
            muscle = int(self.mujoco.mjtGain.mjGAIN_MUSCLE)
            if muscle in (int(self.model.actuator_gaintype[index]) for index in acting):
                return False
            self.remarks.append(
                f"{place} is a fixed tendon without a muscle, a sum of joints and no route."
            )
            return True
        if acting:
            return False
        stiffness = float(self.model.tendon_stiffness[tendon])
        if stiffness > 0.0:
            self.remarks.append(f"{place} is a spring of {stiffness:.4g} N/m, not a route.")
            return True
        return False

    def _route(self, tendon: int, acting: list[int], joints: Mapping[str, BodyJoint]) -> BodyRoute:
        model = self.model
        first = int(model.tendon_adr[tendon])
        members = range(first, first + int(model.tendon_num[tendon]))
        tendon_name = self._name("tendon", tendon)
        place = self.source.place(tendon_name, "spatial", "fixed")
        is_path = int(model.wrap_type[first]) != int(self.mujoco.mjtWrap.mjWRAP_JOINT)
        if is_path:
            indices = self._crossed(members)
            points = tuple(self._points(members))
        else:
            indices = {int(model.wrap_objid[member]) for member in members}
            points = tuple(self._name("joint", index) for index in sorted(indices))
        actuator = self._name("actuator", acting[0]) if len(acting) == 1 else ""
        return BodyRoute(
            actuator or tendon_name,
            tendon_name,
            tendon,
            is_path,
            self._leaders(indices, joints, place),
            points,
            actuator,
            self._stated_range(acting),
            self._stated_force(acting),
            place,
        )

    def _points(self, members: range) -> Iterator[str]:
        for member in members:
            kind = self.mujoco.mjtWrap(int(self.model.wrap_type[member]))
            index = int(self.model.wrap_objid[member])
            if kind == self.mujoco.mjtWrap.mjWRAP_SITE:
                yield self._name("site", index)
            elif kind != self.mujoco.mjtWrap.mjWRAP_PULLEY:
                yield f"{WRAPS}{self._name('geom', index)}"

    def _crossed(self, members: range) -> set[int]:
        """Indices of the joints between the bodies of consecutive points of a path."""
        model = self.model
        crossed: set[int] = set()
        previous: int | None = None
        for member in members:
            kind = self.mujoco.mjtWrap(int(model.wrap_type[member]))
            index = int(model.wrap_objid[member])
            if kind == self.mujoco.mjtWrap.mjWRAP_PULLEY:
                previous = None
                continue
            is_site = kind == self.mujoco.mjtWrap.mjWRAP_SITE
            body = int(model.site_bodyid[index] if is_site else model.geom_bodyid[index])
            if previous is not None:
                crossed |= self._ancestors(previous) ^ self._ancestors(body)
            previous = body
        return crossed

    def _ancestors(self, body: int) -> set[int]:
        """Indices of the joints between the world and a body."""
        joints: set[int] = set()
        while body > 0:
            first = int(self.model.body_jntadr[body])
            joints |= set(range(first, first + int(self.model.body_jntnum[body])))
            body = int(self.model.body_parentid[body])
        return joints

    def _leaders(
        self, indices: Collection[int], joints: Mapping[str, BodyJoint], place: str
    ) -> tuple[str, ...]:
        """Names of the joints that are moved, for those that a route crosses. Raises
        ParameterError for one across a free or ball joint.
        """
        names = set()
        for index in indices:
            joint = joints.get(self._name("joint", index))
            if joint is None:
                name = self._name("joint", index)
                raise ParameterError(
                    f"{place}: the route crosses {self.source.place(name, 'joint', 'freejoint')},"
                    " a free or ball joint, over which its length has no range. Replace the joint"
                    " by hinges, or leave the route out with --leave-out (leave_out=...)."
                )
            while joint.coupling is not None:
                joint = joints[joint.coupling.leader]
            names.add(joint.name)
        return tuple(name for name in joints if name in names)

    def _stated_range(self, acting: list[int]) -> tuple[float, float] | None:
        if len(acting) != 1:
            return None
        low, high = (float(limit) for limit in self.model.actuator_lengthrange[acting[0]])
        return (low, high) if low < high else None

    def _stated_force(self, acting: list[int]) -> float | None:
        """The greatest pull that actuators state: of a muscle its peak force, else the limit."""
        total = 0.0
        for index in acting:
            is_muscle = int(self.model.actuator_gaintype[index]) == int(
                self.mujoco.mjtGain.mjGAIN_MUSCLE
            )
            if is_muscle:
                total += max(float(self.model.actuator_gainprm[index, 2]), 0.0)
            elif self.model.actuator_forcelimited[index]:
                total += max(0.0, -float(self.model.actuator_forcerange[index, 0]))
        return total or None

    def _loops(self, moving: Collection[str]) -> Iterator[str]:
        """The equality constraints that close a loop over joints of routes."""
        model = self.model
        for index in range(model.neq):
            kind = LOOPS.get(int(model.eq_type[index]))
            if kind is None or not model.eq_active0[index]:
                continue
            first = int(model.eq_obj1id[index])
            second = int(model.eq_obj2id[index])
            if kind == "tendon":
                crossed = self._joints_of_tendon(first)
            else:
                if int(model.eq_objtype[index]) == int(self.mujoco.mjtObj.mjOBJ_SITE):
                    first = int(model.site_bodyid[first])
                    second = int(model.site_bodyid[second])
                crossed = self._ancestors(first) ^ self._ancestors(second)
            if {self._name("joint", joint) for joint in crossed} & set(moving):
                yield self.source.place(self._name("equality", index), kind)

    def _joints_of_tendon(self, tendon: int) -> set[int]:
        first = int(self.model.tendon_adr[tendon])
        members = range(first, first + int(self.model.tendon_num[tendon]))
        if int(self.model.wrap_type[first]) == int(self.mujoco.mjtWrap.mjWRAP_JOINT):
            return {int(self.model.wrap_objid[member]) for member in members}
        return self._crossed(members)


def check_limits(body: Body) -> None:
    """Raise ParameterError for joints of routes without limits, and FileError for loops that a
    sweep cannot close.
    """
    if body.loops:
        raise FileError(
            f"{body.loops[0]}: the equality constraint closes a loop over joints of routes, so that"
            " a grid of their positions contains poses that the body does not reach. Give poses"
            " that satisfy it with --poses (poses=...)."
        )
    unlimited = [body.joints[name] for name in body.moving if not body.joints[name].is_limited]
    if unlimited:
        places = "; ".join(joint.place for joint in unlimited[:5])
        joint = unlimited[0]
        example = "-30 deg..60 deg" if joint.is_hinge else "0 mm..50 mm"
        raise ParameterError(
            f"joints of routes without a range: {places}. State their ranges in the file, or with"
            f" --range '{joint.name}={example}' (ranges=...)."
        )
