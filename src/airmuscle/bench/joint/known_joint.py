"""Identification of the few unknown numbers of an arm of library muscles and mechanisms, from
episodes.
"""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from ...core import (
    Array,
    ParameterError,
    StateVariable,
    System,
    Value,
    Values,
    model,
    parameter,
    suggestion,
    tree,
)
from ...engine.distribution import stored_result
from ...physics import PressureDriven
from ..estimation import (
    Accuracy,
    FreeParameter,
    Guard,
    Modelled,
    ProblemSearch,
    Runs,
    SimulatedProblem,
    SoftL1,
    SolvedProblem,
)
from .descent import CLIP, OUTLIER, with_slopes, with_values
from .episode_inspection import checked_inspection, faults_of_judge, without_saturated
from .episodes import (
    HISTORY,
    ROWS,
    Episodes,
    Windows,
    band,
    count_fitted,
    cut,
    long_enough,
    start_of,
)
from .fit import SeparatedEstimates, not_separated, separated
from .free_run import baseline_errors
from .result import ArmFit

FIELDS = ("inertia", "damping", "offset", "weight_torque", "coulomb_torque")
"""Fields of a mechanism that are estimated unless others are named."""
READINGS = {"zeros": " Pa", "gains": ""}
"""Names that stand for the zeros and the gains of all pressures, with the units of their values."""
SAMPLE = 300
EVALUATIONS = 150
"""Windows and evaluations of the search (chosen)."""
FAR = 10.0
"""Ratio of an estimate to its first value, or of what must be positive its inverse, that is doubted
(chosen).
"""
SIZES = {"zeros": 1e4, "gains": 1.0, "offset": 0.05}
"""Typical sizes [SI] of parameters that may start at 0 (chosen)."""


@model
class ReadPressures(System):
    """An arm whose pressures are read with a gain and a zero, p = g (r - z); states and inputs are
    the readings r.
    """

    from_file: ClassVar[bool] = False

    arm: PressureDriven
    gains: tuple[float, ...] = parameter("1", "g", "pressure over reading", bounds=(0.1, 10.0))
    zeros: tuple[float, ...] = parameter(
        "Pa", "z", "reading at ambient pressure", bounds=(-5e5, 5e5)
    )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return self.arm.states

    @property
    def inputs(self) -> tuple[str, ...]:
        return self.arm.inputs

    def rates(self, state: Values, inputs: Values) -> dict[str, Value]:
        acting = dict(state)
        readings = dict(inputs)
        for prefix, gain, zero in zip(self.arm.prefixes, self.gains, self.zeros, strict=True):
            pressure = f"{prefix}pressure"
            reading = f"{prefix}measured_pressure"
            acting[pressure] = gain * (state[pressure] - zero)
            readings[reading] = gain * (inputs[reading] - zero)
        rates = self.arm.rates(acting, readings)
        for prefix, gain in zip(self.arm.prefixes, self.gains, strict=True):
            pressure = f"{prefix}pressure"
            rates[pressure] = rates[pressure] / gain
        return rates

    def outputs(self, state: Values, inputs: Values) -> dict[str, Value]:
        return {}


def fit_known_joint(
    arm: PressureDriven,
    episodes: Episodes,
    free: Sequence[str] = (),
    *,
    pairs: Sequence[tuple[int, int]] = (),
    left_out: float | None = None,
    rows: int = ROWS,
    progress: Callable[[str], None] = lambda text: None,
) -> ArmFit:
    """Estimate the unknown numbers of an arm of known muscles and geometry, such as those of the
    library.

    arm   muscle i has the pressure i of the episodes, coordinate j their angle j; the search starts
          from its values
    free  paths of its parameters, `zeros`, `gains` and `lags` for those of all pressure readings;
          by default inertia, damping, offset, weight and dry friction of the mechanism, the lags
          and the zeros

    The objective is the robust error of the free run over windows, with exact gradients. Gains and
    inertia together are separated by forces alone that do not grow with the pressure, such as that
    of the rubber. Other arguments and the result are those of `fit_joint`. Raises
    IdentificationError for episodes that `inspect_episodes` refuses, ParameterError for another
    number of pressures or angles, other pairs, and a path that the arm does not have.
    """
    count = len(arm.muscle)
    joints = len(arm.mechanism.coordinates)
    episodes, short = long_enough(episodes, rows)
    split = count_fitted(episodes, left_out)
    if (episodes.muscles, episodes.joints, count) != (count, joints, 2 * joints):
        raise ParameterError(
            f"fit_known_joint: the episodes have {episodes.muscles} pressures and {episodes.joints}"
            f" angles, the arm {count} muscles and {joints} coordinates; give two muscles for each"
            " angle, in the order of the columns."
        )
    joint_pairs = _pairs(arm, episodes[:split])
    if pairs and tuple(pairs) != joint_pairs:
        raise ParameterError(
            f"fit_known_joint: the mapping states the pairs {list(pairs)}, the joint has"
            f" {list(joint_pairs)}; leave pairs out of the mapping file, or order its columns of"
            " pressures as the muscles of the joint."
        )
    inspection = checked_inspection(episodes[:split], joint_pairs, rows)
    system = ReadPressures(arm, (1.0,) * count, (0.0,) * count)
    paths = _paths(system, free)
    progress(f"{len(paths)} parameters; delay of the pressures: {inspection.delay} rows")
    judge, fit_windows = (
        cut(part, inspection.delay, rows) for part in (episodes[split:], episodes[:split])
    )
    train, clipped = without_saturated(fit_windows, episodes[:split])
    sample = train.part(range(0, len(train), -(-len(train) // SAMPLE)))
    problem = FreeRunProblem(system, tuple(paths), sample)
    system = stored_result(f"{__name__}:search", problem, problem.solve)
    errors = np.nan_to_num(_run(system, (), judge)[0], nan=OUTLIER)
    progress(
        f"{np.degrees(np.sqrt(np.mean(errors**2))):.3g} deg rms over {rows} rows on episodes"
        " left out"
    )
    estimates, covariance, remarks = problem.separate(system)
    of_arm = [i for i, path in enumerate(paths) if path.startswith("arm.")]
    return ArmFit(
        system.arm,
        inspection,
        joint_pairs,
        errors,
        judge.episode,
        baseline_errors(episodes[:split], episodes[split:], rows),
        band(errors),
        tuple(estimates[i] for i in of_arm),
        (*short, *inspection.remarks, *faults_of_judge(episodes[split:]), *clipped, *remarks),
        split,
        covariance=covariance[np.ix_(of_arm, of_arm)],
        columns=tuple(range(1, count + 1)),
        gains=system.gains,
        zeros=system.zeros,
        solved=(problem.solved(system),),
    )


def _pairs(arm: PressureDriven, episodes: Episodes) -> tuple[tuple[int, int], ...]:
    """For each coordinate its muscles, from 1, first the one with the greater moment arm at the
    median angles.
    """
    names = [c.name for c in arm.mechanism.coordinates]
    median = np.median(episodes.rows("angle"), axis=0).tolist()
    pose = dict(zip(names, median, strict=True))
    moments = []
    for tensions in np.eye(len(arm.muscle)).tolist():
        moments.append(arm.mechanism.generalised_forces(pose, tensions, arm.resting_lengths))
    pairs = []
    for j, name in enumerate(names):
        first = 2 * j + 1
        second = 2 * j + 2
        is_swapped = moments[second - 1][name] > moments[first - 1][name]
        pairs.append((second, first) if is_swapped else (first, second))
    return tuple(pairs)


def _paths(system: ReadPressures, free: Sequence[str]) -> list[str]:
    """The paths in the system of what is estimated."""
    leaves = [leaf.path for leaf in tree.leaves(system)]
    if not free:
        fields = [
            path
            for path in leaves
            if path.startswith("arm.mechanism.") and path.rsplit(".")[-1] in FIELDS
        ]
        free = [*(path.removeprefix("arm.") for path in fields), "lags", "zeros"]
    paths = []
    for name in free:
        full_name = name if name.split("[")[0] in READINGS else f"arm.{name}"
        matching = [
            path for path in leaves if path == full_name or path.startswith(f"{full_name}[")
        ]
        if not matching:
            raise ParameterError(
                f"fit_known_joint: the arm has no parameter '{name}'; allowed are zeros, gains and"
                " the paths of its parameters, such as"
                f" {leaves[-1].removeprefix('arm.')}.{suggestion(full_name, leaves)}"
            )
        paths += matching
    return list(dict.fromkeys(paths))


def _run(system: ReadPressures, paths: Sequence[str], windows: Windows) -> tuple[Array, Array]:
    """Errors (N, rows, J) [rad] of the free run, and their derivatives (N, rows, J, P) by the
    parameters.
    """
    arm = system.arm
    step = windows.sample_time
    state = start_of(arm, windows)
    names = [coordinate.name for coordinate in arm.mechanism.coordinates]
    inputs = windows.pressure[:, HISTORY:]
    simulated, slopes = with_slopes(system, paths, inputs, step, state, names)
    error = simulated[:, 1:] - windows.angle[:, HISTORY + 1 :]
    counts = windows.counts[:, HISTORY + 1 :, None]
    error = np.where(counts, error, 0.0)
    slopes = np.where(counts[..., None], slopes[:, 1:], 0.0)
    return error, slopes


@dataclasses.dataclass(frozen=True, eq=False)
class FreeRunProblem(SimulatedProblem):
    """Errors of the angles [rad] in the free run over windows, and the parameters of these paths;
    an error that is lost, or beyond OUTLIER, counts as OUTLIER.
    """

    system: ReadPressures
    paths: tuple[str, ...]
    windows: Windows
    name = "joint"
    origin = "episodes"
    quantity = "angle"
    # The steps of the integrator are fixed.
    accuracy = Accuracy(1e-8, 1e-10)

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        leaves = {leaf.path: leaf for leaf in tree.leaves(self.system)}
        parameters = []
        for path in self.paths:
            leaf = leaves[path]
            value = float(leaf.value)
            field = path.rsplit(".", 1)[-1].split("[")[0]
            size = max(abs(value), SIZES.get(field, abs(value) or 1.0))
            declared = leaf.declared
            name = path.removeprefix("arm.")
            parameters.append(
                FreeParameter(
                    name, name, value, declared.bounds, declared.unit, declared.meaning, size=size
                )
            )
        return tuple(parameters)

    @functools.cached_property
    def target(self) -> Array:  # type: ignore[override]
        rows = self.windows.angle[:, HISTORY + 1 :]
        return np.zeros(rows.size)

    @functools.cached_property
    def runs(self) -> Runs:
        """The window of each angle."""
        windows, rows, joints = self.windows.angle[:, HISTORY + 1 :].shape
        window = np.repeat(np.arange(windows), rows * joints)
        return Runs(window, np.zeros(window.size, dtype=np.intp), in_time=True)

    def at(self, values: Array) -> ReadPressures:
        """The system with these parameters."""
        return with_values(self.system, self.paths, values)

    def evaluate(self, values: Array, guard: Guard | None = None) -> Modelled:
        error, slope = _run(self.at(values), self.paths, self.windows)
        is_finite = np.isfinite(error) & np.isfinite(slope).all(axis=-1)
        lost = ~is_finite | (np.abs(error) > OUTLIER)
        error = np.where(lost, OUTLIER, error)
        slope = np.where(lost[..., None], 0.0, slope)
        return Modelled(error.ravel(), slope.reshape(-1, len(self.paths)))

    def solve(self) -> ReadPressures:
        """The system with the estimates."""
        search = ProblemSearch(self, SoftL1(CLIP), self.initial_values)
        return self.at(search.check_start().run(EVALUATIONS).values)

    def solved(self, system: ReadPressures) -> SolvedProblem:
        """The problem with the parameters of a system."""
        fitted = dataclasses.replace(self, system=system)
        return SolvedProblem(fitted, fitted.initial_values, SoftL1(CLIP))

    def separate(self, system: ReadPressures) -> SeparatedEstimates:
        """Estimates, their covariance along what the record separates, and remarks; a window is one
        observation.
        """
        leaves = {leaf.path: float(leaf.value) for leaf in tree.leaves(system)}
        values = np.array([leaves[path] for path in self.paths])
        error, jacobian = self.evaluate(values)
        assert jacobian is not None
        sizes = self.coordinates.sizes
        flat = jacobian * sizes
        names = self.names
        information = flat.T @ flat / (np.mean(error**2) * self.windows.rows)
        estimates, covariance, shares = separated(information, names, values, sizes)
        remarks = []
        for estimate in estimates:
            field, _, number = estimate.path.partition("[")
            if field in READINGS:
                standard_error = float(f"{estimate.standard_error:.2g}")
                remarks.append(
                    f"{field[:-1]} of pressure {int(number[:-1]) + 1}: {estimate.value:.4g} ±"
                    f" {standard_error:g}{READINGS[field]}"
                )
        far = []  # estimates that no such joint has
        starts = zip(names, values, self.initial_values, *self.bounds, strict=True)
        for name, value, first_value, low, high in starts:
            is_greater = abs(value) > FAR * abs(first_value) > 0.0
            is_smaller = low > 0.0 and value < first_value / FAR
            if is_greater or is_smaller:
                far.append(
                    f"{name} is {value:.3g}, {value / first_value:.3g} times its first value"
                )
            elif value and np.isclose(value, [low, high], 1e-3).any():
                far.append(f"{name} ends at the limit of its range, {value:.3g}")
        text = (
            f"{'; '.join(far)}: another joint, or a wrong sample time (inertia grows with its"
            " square, damping and lags with it), or a wrong scale of angles or pressures; do not"
            " use the numbers before this is explained"
        )
        if far:
            remarks.append(text)
        remarks += not_separated("", names, shares)
        return SeparatedEstimates(estimates, covariance, remarks)
