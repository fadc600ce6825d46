"""Stochastic Gauss-Newton descent of the free run over windows, joint by joint, with exact
gradients.
"""

import dataclasses
import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, NamedTuple, TypeVar, cast

import numpy as np
import numpy.typing as npt

from ...core import Array, StateVariable, System, Value, Values, model, tree
from ...engine import RungeKutta4, WithSensitivities, sensitivity, simulate_batch
from ...physics import PressureDriven, SerialArm, WithStickSlip, friction_load
from ..estimation import (
    FreeParameter,
    Guard,
    Modelled,
    Prior,
    Runs,
    SampledDescent,
    SampledProblem,
    SearchStage,
    SoftL1,
    SolvedProblem,
)
from .episodes import HISTORY, Windows, WindowSignal, start_of

Arm = TypeVar("Arm", bound=System)
SUBSTEPS = 3
"""Steps of the integrator in a row."""
CLIP = 0.3
OUTLIER = 3.0
"""Errors [rad] from which a residual counts less, and not at all: contact or a lost sensor
(chosen).
"""
SAMPLE = 1600
"""Windows from which the cost of a search is computed (chosen)."""
PRIOR = 5.0
"""Weight of a prior value, in windows times rows with an error of one standard deviation
(chosen).
"""
LOW = {
    "presliding_angle": 1.5e-3,
    "lags": 2e-3,
    "rotor_inertia": 1e-3,
    "stribeck_speed": 0.1,
    "slack_width": 0.3,
}
"""Lower limits of a search above those of the model, which the step of the integrator resolves
(chosen).
"""
SIZES = {
    "damping": 0.3,
    "coulomb_torque": 0.5,
    "load_arms": 4e-3,
    "presliding_angle": 2e-3,
    "lags": 0.01,
    "mass": 1.0,
    "static_excess": 0.3,
    "stribeck_speed": 1.0,
    "zero_angle": 1.0,
    "rotor_inertia": 0.03,
    "centre": 0.2,
    "slack_width": 5.0,
    "inertia": 0.03,
    "energies": 1.0,
    "friction_logs": 0.3,
    "bearing_arms": 0.05,
}
"""Typical sizes [SI] of parameters that may start at 0 (chosen)."""


def joint_errors(arm: PressureDriven, joint: int, windows: Windows) -> Array:
    """Errors (N, rows) [rad] of the free run of one joint; the other joints move as measured."""
    return _run_of_joint(arm, joint, (), windows)[0]


class DescentEnd(NamedTuple):
    """The end of a search: its cost [rad^2] and its arm."""

    cost: float
    arm: PressureDriven


@dataclasses.dataclass(frozen=True, eq=False)
class JointProblem(SampledProblem):
    """The angles of one joint, and the parameters of an arm, by their paths in it, on which its
    motion depends; the groups of rows are the windows.
    """

    arm: PressureDriven
    windows: Windows
    joint: int
    paths: tuple[str, ...]
    seed: int = 0
    prior: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Values towards which parameters are drawn that the record hardly determines, by path; with
    `ridge` as weight.
    """
    ridge: float = PRIOR
    errors: Callable[[PressureDriven, int, Windows], Array] = joint_errors
    """Errors (N, rows) [rad] of the joint, from which the cost comes: in its own free run or in
    that of all joints.
    """
    clip: ClassVar[float] = CLIP

    @property
    def name(self) -> str:
        return f"joint {self.joint + 1}"

    origin = "episodes"
    quantity = "angle"

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        leaves = {leaf.path: leaf for leaf in tree.leaves(self.arm)}
        return tuple(self._parameter(path, leaves) for path in self.paths)

    def _parameter(self, path: str, leaves: Mapping[str, tree.Leaf]) -> FreeParameter:
        declared = leaves[path].declared
        low, high = declared.bounds
        size = typical_size(path, leaves)
        prior = None
        if path in self.prior:
            prior = Prior(self.prior[path], size / float(np.sqrt(self.ridge)))
        return FreeParameter(
            path,
            path,
            float(leaves[path].value),
            (max(low, LOW.get(_field(path), -np.inf)), high),
            declared.unit,
            declared.meaning,
            size=size,
            prior=prior,
        )

    @property
    def group_count(self) -> int:
        return len(self.windows)

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        return np.zeros(self.windows.counts[:, HISTORY + 1 :].size)

    @functools.cached_property
    def runs(self) -> Runs:
        """The window of each angle."""
        count, rows = self.windows.counts[:, HISTORY + 1 :].shape
        window = np.repeat(np.arange(count), rows)
        return Runs(window, np.zeros(window.size, dtype=np.intp), in_time=True)

    def describe_row(self, row: int) -> str:
        window, place = divmod(row, self.windows.rows)
        return f"row {place + 1} of window {window + 1}"

    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        """Errors [rad] of the free run in all windows, and their derivatives."""
        every = np.arange(self.group_count)
        errors, gradient = self.linearise(values, every, self.windows.rows)
        return Modelled(errors.ravel(), gradient.reshape(-1, len(self.paths)))

    @property
    def solved(self) -> SolvedProblem:
        """The problem with the parameters of its arm."""
        return SolvedProblem(self, self.initial_values, SoftL1(CLIP))

    def search(self, stages: Sequence[SearchStage]) -> DescentEnd:
        """The arm with the smallest cost [rad^2] after these stages of a descent."""
        search = SampledDescent(self.initial_values, self.seed)
        ends = [self.descend(search, stage, i) for i, stage in enumerate(stages, 1)]
        return ends[-1]

    def descend(self, search: SampledDescent, stage: SearchStage, number: int) -> DescentEnd:
        """The end of one stage of a descent, from its last values on."""
        limited = dataclasses.replace(stage, rows=min(stage.rows, self.windows.rows))
        cost = search.run(self, limited, f"{self.name}, stage {number}")
        return DescentEnd(cost, with_values(self.arm, self.paths, search.values))

    def linearise(
        self, values: Array, groups: npt.NDArray[np.intp], rows: int
    ) -> tuple[Array, Array]:
        arm = with_values(self.arm, self.paths, values)
        return gradients(arm, self.joint, self.paths, self.windows.part(groups.tolist(), rows))

    def cost(self, values: Array, rows: int) -> float:
        arm = with_values(self.arm, self.paths, values)
        sampled = self.windows.sample(SAMPLE, rows)
        errors = self.errors(arm, self.joint, sampled)
        limited = np.clip(np.abs(errors), 0.0, OUTLIER)
        limited = np.where(np.isfinite(errors), limited, OUTLIER)
        counted = limited[sampled.counts[:, HISTORY + 1 :]]
        losses = 2 * CLIP**2 * (np.sqrt(1 + (counted / CLIP) ** 2) - 1)
        return float(np.mean(losses))


def with_slopes(
    system: System,
    paths: Sequence[str],
    inputs: Array,
    step: float,
    state: Mapping[str, Array],
    names: Sequence[str],
) -> tuple[Array, Array]:
    """Columns (N, R, J) of a system from states (N,) under inputs (N, R, m) at rows of `step` [s],
    linear between them, and their derivatives (N, R, J, P) by the parameters of these paths;
    `state` may have those of the initial state.
    """
    observed = system
    keep = list(names)
    slope_names = [[sensitivity(n, k) for k in range(len(paths))] for n in names]
    if paths:
        zeros = np.zeros(len(inputs))
        state = {
            sensitivity(s.name, k): zeros for s in system.states for k in range(len(paths))
        } | dict(state)
        observed = WithSensitivities(
            system, tuple((p,) for p in paths), (1.0,) * len(paths), observed=tuple(names)
        )
        keep += itertools.chain(*slope_names)
    times = step * np.arange(inputs.shape[1])
    signals = [WindowSignal(np.ascontiguousarray(u), step) for u in inputs]
    run = simulate_batch(
        observed,
        {},
        signals,
        duration=float(times[-1]),
        initial_states=state,
        keep=keep,
        output_times=times,
        integrator=RungeKutta4(step / SUBSTEPS),
    )
    columns = np.stack([run[name] for name in names], axis=-1)
    slopes = [np.stack([run[name] for name in row], axis=-1) for row in slope_names if row]
    return columns, np.stack(slopes, axis=2) if slopes else np.zeros((*columns.shape, 0))


def gradients(
    arm: PressureDriven, joint: int, paths: Sequence[str], windows: Windows
) -> tuple[Array, Array]:
    """Errors (N, rows) [rad] of the free run of one joint and their derivatives (N, rows, P) by the
    parameters, both 0 in rows of outliers; the other joints move as measured."""
    error, gradient = _run_of_joint(arm, joint, paths, windows)
    is_finite = np.isfinite(error) & np.isfinite(gradient).all(axis=-1)
    counts = windows.counts[:, HISTORY + 1 :]
    lost = ~is_finite | (np.abs(error) > OUTLIER) | np.logical_not(counts)
    error = np.where(lost, 0.0, error)
    gradient = np.where(lost[..., None], 0.0, gradient)
    return error, gradient


def _run_of_joint(
    arm: PressureDriven, joint: int, paths: Sequence[str], windows: Windows
) -> tuple[Array, Array]:
    """Errors and derivatives as of `gradients`, also those of outliers."""
    system = OneJoint(arm, joint)
    known = start_of(arm, windows)
    names = [s.name for s in system.states]
    state = {name: known[name] for name in names}
    values = {leaf.path: float(leaf.value) for leaf in tree.leaves(arm)}
    for k, path in enumerate(paths):
        if _field(path) not in ("presliding_angle", "lags"):
            continue  # the initial state depends on these parameters alone
        step = 1e-4 * values[path]
        changed = with_values(arm, [path], [values[path] + step])
        moved = start_of(changed, windows)
        for name in names:
            state[sensitivity(name, k)] = (moved[name] - known[name]) / step
    measured = (windows.angle, windows.rate, windows.acceleration)
    motion = [column[:, HISTORY:, i, None] for i in system.others for column in measured]
    inputs = np.concatenate([windows.pressure[:, HISTORY:], *motion], axis=-1)
    of_arm = [f"arm.{path}" for path in paths]
    simulated, slopes = with_slopes(system, of_arm, inputs, windows.sample_time, state, names[:1])
    angle = simulated[:, 1:, 0]
    errors = angle - windows.angle[:, HISTORY + 1 :, joint]
    return np.asarray(errors), slopes[:, 1:, 0]


def with_values(arm: Arm, paths: Sequence[str], values: Sequence[float] | Array) -> Arm:
    """The arm with other values of these parameters."""
    index_of = {leaf.path: i for i, leaf in enumerate(tree.leaves(arm))}
    indices = [index_of[path] for path in paths]
    flat = np.array(tree.flatten(arm))
    flat[indices] = values
    changed: Arm = tree.unflatten(arm, flat.tolist())
    return changed


def _field(path: str) -> str:
    return path.rsplit(".", 1)[-1].split("[", maxsplit=1)[0]


def typical_size(path: str, leaves: Mapping[str, tree.Leaf]) -> float:
    """Typical size of a parameter; the coefficients of a polynomial in the contraction grow tenfold
    with each power.
    """
    field = _field(path)
    if field not in ("area", "passive_force"):
        return SIZES[field]
    first = path[: path.rindex("[")] + "[0]"
    return float(max(abs(leaves[first].value), 1e-9) * 10.0 ** int(path[path.rindex("[") + 1 : -1]))


@model
class OneJoint(System):
    """Joint j of an arm: M_jj theta_j'' = tau_j - sum_i M_ji theta_i'' - h_j + Q_f, the other
    joints i as inputs.

    M, h and the friction Q_f are those of the arm, so that a fit of all its joints in this form
    finds the parameters of the arm, but no system has more states than one joint. Inputs are the
    measured pressures, and angle, speed and acceleration of the other joints. The muscles of the
    joint act with their lags; the tensions of the others, which load its friction, follow their
    readings at once.
    """

    arm: PressureDriven
    joint: int
    """Number of the joint, from 0."""

    @property
    def mechanism(self) -> SerialArm:
        """The arm without its friction."""
        return cast(SerialArm, cast(WithStickSlip, self.arm.mechanism).inner)

    @functools.cached_property
    def own(self) -> tuple[int, ...]:
        """Numbers of the muscles that cross the joint."""
        return tuple(
            i for i, route in enumerate(self.mechanism.routes) if self.joint + 1 in route.joints
        )

    @functools.cached_property
    def others(self) -> tuple[int, ...]:
        """Numbers of the other joints."""
        return tuple(i for i in range(len(self.mechanism.links)) if i != self.joint)

    @functools.cached_property
    def states(self) -> tuple[StateVariable, ...]:
        c = self.mechanism.coordinates[self.joint]
        bristle = cast(WithStickSlip, self.arm.mechanism).inner_states[self.joint]
        lagged = {f"{self.arm.prefixes[i]}pressure" for i in self.own}
        return (*c.states, bristle, *(s for s in self.arm.states if s.name in lagged))

    @functools.cached_property
    def inputs(self) -> tuple[str, ...]:
        motion = [self.mechanism.coordinates[i] for i in self.others]
        return (*self.arm.inputs, *(n for c in motion for n in (c.name, c.speed, c.acceleration)))

    def rates(self, state: Values, inputs: Values) -> dict[str, Value]:
        mechanism = self.mechanism
        c = self.mechanism.coordinates[self.joint]
        place = {**inputs, **state}
        lengths = self.arm.resting_lengths
        pressures = [
            state[f"{p}pressure"] if i in self.own else inputs[f"{p}measured_pressure"]
            for i, p in enumerate(self.arm.prefixes)
        ]
        acting = zip(
            self.arm.muscle, pressures, mechanism.contractions(place, lengths), strict=True
        )
        tensions = [muscle.tension(p, eps) for muscle, p, eps in acting]
        accelerations = {
            mechanism.coordinates[i].name: inputs[mechanism.coordinates[i].acceleration]
            for i in self.others
        }
        needed = mechanism.inverse_dynamics(place, place, {**accelerations, c.name: 0.0})[c.name]
        outer = cast(WithStickSlip, self.arm.mechanism)
        read = {
            f"{prefix}pressure": p for prefix, p in zip(self.arm.prefixes, pressures, strict=True)
        }
        forces = outer.generalised_forces({**place, **read}, tensions, lengths)
        torque = forces[c.name]
        load = forces[friction_load(c)]
        element = outer.elements[self.joint]
        bristle = state[self.states[2].name]
        if element.bearing_arms:
            load += outer.bearing_load(self.joint, place, place, accelerations)
        friction = element.torque(bristle, load, state[c.speed])
        rates = {
            c.name: state[c.speed],
            c.speed: (
                (torque + friction - needed) / mechanism.mass_matrix(place)[self.joint][self.joint]
            ),
            self.states[2].name: element.bristle_rate(bristle, state[c.speed]),
        }
        for i in self.own:
            prefix = self.arm.prefixes[i]
            reading = inputs[f"{prefix}measured_pressure"]
            rates[f"{prefix}pressure"] = (reading - state[f"{prefix}pressure"]) / self.arm.lags[i]
        return rates

    def outputs(self, state: Values, inputs: Values) -> dict[str, Value]:
        return {}
