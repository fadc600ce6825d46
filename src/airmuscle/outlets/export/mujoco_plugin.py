"""MuJoCo engine plugins: a muscle with its valves as an actuator of a MuJoCo model, with its states
in `act`.
"""

import dataclasses
import functools
import hashlib
import math
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core import (
    AirmuscleWarning,
    Array,
    Input,
    ParameterError,
    ShortRepr,
    check_known,
    leaves,
    with_parameters,
)
from ...engine.compile.program import compile_system
from ...engine.loop import Schedule
from ...engine.run import simulate
from ...engine.run.integrators import Rodas4
from ...physics.mechanism import HangingMass
from ...physics.plant import Plant, open_plant
from .actuator import control_range, controls_of, single_muscle
from .c_source import c_files
from .compiler import compile_library
from .identifiers import (
    block_comment,
    c_integers,
    c_number,
    c_strings,
    filled,
    program_name,
    provenance,
)
from .printed_system import export_system
from .write import write_files

OLDEST = (3, 17)
NEWEST = (4, 0)
"""First version of MuJoCo whose plugin actuators have several states, and the last one with which
the plugins were tried.
"""
SELF_TEST_STEPS = 20
SELF_TEST_TOLERANCE = 1e-4
"""Steps of a self-test, and the greatest difference of a state from the library that it permits,
relative to its change (chosen).
"""
TOLERANCE = 1e-7
"""Relative tolerance of the integration of the muscle within a step of MuJoCo; chosen."""
REST_LENGTH = "rest_length"
"""Attribute: the length of the transmission [m] at which the muscle has its resting length."""
_TESTED: set[str] = set()
"""The plugins of this process that were tested against the library."""
_LOADED: dict[str, str] = {}
"""The plugins of this process by name, each with the digest of its library."""
NOTE = (
    "The actuator does not report where a run leaves the validity range of a characteristic or of"
    " another component. Under Euler, implicit and implicitfast its own solver integrates the"
    " muscle within each step of MuJoCo; RK4 of MuJoCo integrates it with MuJoCo's step, which does"
    " not resolve fast states."
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MuscleActuator(ShortRepr):
    """A muscle with its valves that can be added to MuJoCo models.

    plant    the muscle with its circuit, and shortening and speed as inputs
    library  the shared library of the plugin; None where it was not built, which `remark` explains

    The control opens the only input of the circuit, such as a spool, in its range; of a circuit
    with two inputs, such as fill and discharge valve, a positive control opens the first, a
    negative one the second.
    """

    plant: Plant
    name: str
    source: Path
    library: Path | None
    remark: str
    controls: tuple[Input, ...]

    @property
    def files(self) -> list[Path]:
        """The source, and the library if it was built."""
        return [path for path in (self.source, self.library) if path is not None]

    @property
    def plugin_name(self) -> str:
        """The name of the plugin in MJCF."""
        return f"airmuscle.{self.name}"

    @property
    def control_range(self) -> tuple[float, float]:
        """Lowest and highest control."""
        return control_range(self.controls)

    def add_to(
        self,
        spec: Any,
        *,
        name: str,
        tendon: str = "",
        joint: str = "",
        gear: float = 1.0,
        rest_length: float | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> Any:
        """Add an actuator to a `mujoco.MjSpec`; returns its MjsActuator.

        tendon, joint  the transmission, one of the two
        gear           length of the transmission per length of the tendon, or per angle of the
                       joint [m/rad]
        rest_length    length of the transmission [m] at which the muscle has its resting length;
                       that length by default
        parameters     parameters of this actuator by path, such as {"muscle.force": 600.0}, in SI
                       units

        Raises ParameterError without a library, for an unsuitable MuJoCo, and for a wrong
        transmission or parameter.
        """
        mujoco = check_mujoco()
        if self.library is None:
            raise ParameterError(f"the plugin {self.plugin_name} was not built: {self.remark}.")
        if bool(tendon) == bool(joint):
            raise ParameterError("MuscleActuator: give either a tendon or a joint as transmission.")
        check_known("MuscleActuator: there is no parameter", parameters or {}, self.parameters)
        config = {
            **(parameters or {}),
            **({} if rest_length is None else {REST_LENGTH: rest_length}),
        }
        for path in (path for path, value in config.items() if not math.isfinite(value)):
            raise ParameterError(f"MuscleActuator: {path} is {config[path]}; it must be finite.")
        for leaf in leaves(self.plant):
            low, high = leaf.declared.bounds
            if leaf.path in config and not low <= config[leaf.path] <= high:
                raise ParameterError(
                    f"MuscleActuator: {leaf.path} is {config[leaf.path]:.6g}; allowed range:"
                    f" {low:g} to {high:g} {leaf.declared.unit}."
                )
        _load(self.plugin_name, self.library)
        if is_unread(mujoco) and self.plugin_name not in _TESTED:
            self.self_test()
        if self.plugin_name not in {p.plugin_name for p in spec.plugins}:
            spec.activate_plugin(self.plugin_name)
        instance = spec.add_plugin(name=f"{name}_plugin", plugin_name=self.plugin_name)
        instance.config = {path: repr(float(value)) for path, value in config.items()}
        actuator = spec.add_actuator(name=name, target=tendon or joint)
        actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON if tendon else mujoco.mjtTrn.mjTRN_JOINT
        actuator.gear[0] = gear
        actuator.dyntype, actuator.actdim = mujoco.mjtDyn.mjDYN_USER, len(self.plant.states) + 1
        actuator.ctrlrange = list(self.control_range)
        actuator.ctrllimited = 1
        actuator.plugin.name = instance.name
        actuator.plugin.plugin_name = self.plugin_name
        actuator.plugin.active = True
        return actuator

    def self_test(self) -> float:
        """Run the muscle at a constant length in MuJoCo and in the library; the greatest difference
        of its states, relative to their changes.

        `add_to` does this once with a version of MuJoCo that is newer than those with which the
        plugins were tried. Raises ParameterError where they differ.
        """
        mujoco = check_mujoco(warn=False)
        _TESTED.add(self.plugin_name)
        spec = mujoco.MjSpec()
        body = spec.worldbody.add_body()
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0], mass=1e12)
        body.add_joint(name="held", type=mujoco.mjtJoint.mjJNT_SLIDE)
        spec.option.gravity = [0.0, 0.0, 0.0]
        self.add_to(spec, name="muscle", joint="held", rest_length=0.0)
        model = spec.compile()
        data = mujoco.MjData(model)
        level = 0.5 * self.control_range[1]
        before = self.initialise(model, data, "muscle", pressure=1e5).copy()
        data.ctrl[0] = level
        for _ in range(SELF_TEST_STEPS):
            mujoco.mj_step(model, data)
        found = data.act[: before.size]
        duration = SELF_TEST_STEPS * float(model.opt.timestep)
        wanted = self._run_of_library(level, duration)
        size = np.maximum(np.abs(wanted - before), 1e-3 * np.abs(before) + 1e-12)
        difference = float((np.abs(found - wanted) / size).max())
        if not difference <= SELF_TEST_TOLERANCE:
            raise ParameterError(
                f"MuJoCo {mujoco.__version__} does not run the plugin {self.plugin_name} as the"
                f" library runs the muscle: states differ by {difference:.2g} of their change."
                f" Install mujoco>={version_text(OLDEST)},<={version_text(NEWEST)}.*."
            )
        return difference

    def _run_of_library(self, level: float, duration: float) -> Array:
        """The states of the muscle after a time at constant length, with a control."""
        plant = open_plant(self.plant, (0.0,))
        inputs = Schedule({self.controls[0].name: ((0.0, level),)})
        start = plant.state_at(pressure=1e5)
        record = simulate(plant, inputs, duration=duration, initial_state=start)
        return np.array([record[state.name][-1] for state in self.plant.states])

    def initialise(self, model: Any, data: Any, name: str, *, pressure: float = 0.0) -> Array:
        """Set the states of an actuator to a gauge pressure [Pa] at its present length; returns
        them.

        Parameters are those of the plant. Call it after the position was set. Raises
        ParameterError.
        """
        check_mujoco().mj_fwdPosition(model, data)
        which = model.actuator(name).id
        attributes = (*self.parameters, REST_LENGTH)
        raw: bytes = model.plugin_attr[
            int(model.plugin_attradr[int(model.actuator_plugin[which])]) :
        ].tobytes()
        texts = raw.split(b"\0")[: len(attributes)]
        stated = {path: text.decode() for path, text in zip(attributes, texts, strict=True) if text}
        values = [float(stated.get(path, value)) for path, value in self.parameters.items()]
        plant = with_parameters(self.plant, values)
        rest = float(stated.get(REST_LENGTH, plant.muscles[0].geometry.resting_length))
        shortening = rest - float(data.actuator_length[which])
        state = open_plant(plant, (shortening,)).state_at(pressure=pressure)
        first = int(model.actuator_actadr[which])
        data.act[first : first + len(state) + 1] = [*state.values(), 0.0]
        initial: Array = data.act[first : first + len(state)]
        return initial

    @functools.cached_property
    def parameters(self) -> dict[str, float]:
        """The parameters that an actuator can change, by path, with their values in the plant."""
        return {leaf.path: float(leaf.value) for leaf in leaves(self.plant)}


def write_mujoco_plugin(
    plant: Plant, folder: str | Path, *, name: str = "", muscle: str = ""
) -> MuscleActuator:
    """Write a MuJoCo engine plugin for one muscle of a plant, and build it if MuJoCo and a C
    compiler are there.

    plant   its load is left out: MuJoCo carries it
    muscle  name of the muscle, if the plant has several, each with its own circuit

    The folder contains the C sources `NAME_plugin.c`, `NAME.c` and `NAME.h`, and the shared
    library, which belongs to the version of MuJoCo that it was built with. Raises ParameterError
    for a plant that cannot be exported, and FileError.
    """
    part = open_plant(single_muscle(plant, muscle))
    program = program_name(name, part.muscles[0].name)
    controls = controls_of(part)
    lines = provenance(f"Muscle {part.muscles[0].name} for MuJoCo", part, (), [NOTE])
    system = export_system(
        compile_system(dataclasses.replace(part, mechanism=HangingMass(1.0)))
    )  # mass set by MuJoCo
    paths = [leaf.path for leaf in system.tunable]
    states = system.known.state_names
    part_paths = [leaf.path for leaf in leaves(part)]
    places = [*(system.known.input_names.index(i.name) for i in controls), -1, -1]
    values = {
        "provenance": block_comment(lines),
        "name": f"airmuscle.{program}",
        "file": program,
        "attribute_names": c_strings([*part_paths, REST_LENGTH]),
        "places": c_integers([paths.index(path) for path in part_paths]),
        "own_states": c_integers([states.index(state.name) for state in part.states]),
        "rest_length": c_number(part.muscles[0].geometry.resting_length),
        "attributes": str(len(part_paths) + 1),
        "first": str(places[0]),
        "second": str(places[1]),
    }
    texts = c_files(program, system, Rodas4(TOLERANCE), lines)
    texts[f"{program}_plugin.c"] = filled("mujoco_plugin.c", values, program)
    files = {file: text.encode() for file, text in texts.items()}
    library = f"lib{program}_plugin.so"
    remark = ""
    try:
        installed = Path(check_mujoco().__file__).parent
        linked = [str(path) for path in sorted(installed.glob("libmujoco.*"))[:1]]
        units = [file for file in files if file.endswith(".c")]
        files[library] = compile_library(
            files, units, library, [f"-I{installed / 'include'}", *linked]
        )
    except ParameterError as reason:
        remark = str(reason)
    written = dict(zip(files, write_files(files, folder), strict=True))
    return MuscleActuator(
        part, program, written[f"{program}_plugin.c"], written.get(library), remark, controls
    )


def version_text(numbers: tuple[int, ...]) -> str:
    """A version as text."""
    return ".".join(map(str, numbers))


def version_of(mujoco: Any) -> tuple[int, ...]:
    """The first two numbers of the version of a module."""
    return tuple(int(n) for n in re.findall(r"\d+", mujoco.__version__)[:2])


def is_unread(mujoco: Any) -> bool:
    """Whether a version of MuJoCo is newer than those with which the plugins were tried."""
    return version_of(mujoco) > NEWEST


def check_mujoco(*, warn: bool = True) -> Any:
    """The module mujoco, with a warning of a version that was not tried. Raises ParameterError
    where it is missing or too old.
    """
    try:
        import mujoco
    except ImportError:
        raise ParameterError("the package mujoco is not installed; install mujoco>=3.17") from None
    if version_of(mujoco) < OLDEST:
        raise ParameterError(
            f"MuJoCo {mujoco.__version__} is not supported, because its plugin actuators cannot"
            " have several states; install mujoco>=3.17"
        )
    if warn and is_unread(mujoco):
        warnings.warn(
            f"MuJoCo {mujoco.__version__} is newer than {version_text(NEWEST)}, the last version"
            " with which the plugins were tried; the first actuator is tested against the library"
            " before it is used.",
            AirmuscleWarning,
            stacklevel=2,
        )
    return mujoco


def _load(plugin: str, library: Path) -> None:
    """Load a plugin once in a process. Raises ParameterError where another one has its name."""
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    if _LOADED.get(plugin) == digest:
        return
    mujoco = check_mujoco()
    try:
        if plugin not in _LOADED:
            mujoco.mj_loadPluginLibrary(str(library))
            _LOADED[plugin] = digest
            return
    except mujoco.FatalError as reason:
        _LOADED.setdefault(plugin, f"refused: {reason}")
    raise ParameterError(
        f"the plugin {plugin} of this process is another one than {library}, and MuJoCo cannot"
        " replace it; write this plugin with another name, or start a new process."
    )
