"""Causes of a misfit, ranked by the share of the squared residuals that each explains.

Each cause has a form of its own: the residuals of another form of the law are a smooth surface over
pressure and contraction; those of friction follow the direction of the motion, from a turning point
on within a travel that is independent of the speed; those of a sensor are what a delay, a low-pass
filter or a moving average makes of the force of the law, or of the measured force where pressure or
length are later; those of creep are the slow response of a small share of the force, or a drift
from the beginning of each run; those of two muscles are a gain of a group of runs, those of a
temperature a stiffness of the wall of such a group; those of a coarse sensor have the variance of
its steps.

The surface is taken off first. Of the rest each cause takes up what its best form explains; the one
that explains the most is the first, and what it leaves is shared among the others in the same way.
A sensor has no free size: its delay or filter makes the whole of the residuals.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...recording import Recording
from ..inspection import (
    distinct_readings,
    estimate_noise,
    estimate_resolution,
    reading_numbers,
    rounding,
)
from .cause_names import (
    AVERAGE,
    CREEP,
    DELAY,
    FILTER,
    FORM,
    FRICTION,
    MUSCLES,
    RUNS,
    STEPS,
    TEMPERATURE,
    ZEROS,
    MisfitCause,
)
from .cause_traces import (
    Average,
    AverageAround,
    Delay,
    LowPass,
    SensorResponse,
    Traces,
    slipped,
)

SURFACE_DEGREE = 4
"""Total degree of the surface that takes up an error of the form of the law (chosen)."""
MIN_SHARE = 0.1
"""Minimum share of the squared residuals of a cause that is named (chosen)."""
ALIKE = 1.2
"""Ratio of the squares that two causes leave up to which the data do not tell them apart (chosen).
"""
MIN_ROWS = 30
"""Minimum number of rows in which causes are looked for (chosen)."""
HELD = 0.005
"""Range of the contraction at a held length (chosen)."""
MIN_READINGS = 4
MIN_ROWS_OF_READING = 3
MIN_REPEATED = 0.25
"""Least share of the rows that repeat the reading before them (chosen): of a ramp that was read at
even levels no row does."""
EVEN = 0.1
"""Number of readings of a ramp, rows of each, and relative difference of the steps between them,
from which they are those of a coarse sensor (chosen)."""
SENSOR_GAINS = (0.8, 1.25)
"""Residuals over those of a filter of the whole force (chosen)."""
MAX_CREEP = 0.3
"""Greatest share of the force that creeps (chosen)."""
LEAST_STEPS = 2.0
GREATEST_FILTER = 0.25
"""Least time of a filter in sample times, and greatest one in durations of a run (chosen)."""
CREEP_TIMES = (0.03, 3.0)
"""Times of creep in durations of a run (chosen)."""
PLAUSIBLE = 0.3
"""Least share that a sensor explains for which the law is fitted anew (chosen)."""
COARSE = 14
"""Number of times that are tried (chosen)."""
WIDTHS = (1.15, 1.03)
"""Ratios of the times of the parabolas that refine the best one (chosen)."""
SLIPS = np.array([0.02, 0.05, 0.1, 0.2])
"""Travels of friction from a turning point on, as fractions of the range (chosen)."""
NEGLIGIBLE = 1e-6
"""Size of what a combination of columns of unit length has beside others up to which it depends on
them (chosen)."""
ROWS_OF_RUN = 12.0
"""Number of independent rows of a run, against which the offsets and gains of all runs count
(chosen)."""
GROUPED = 0.9
"""Share of what single runs explain from which two groups of runs explain it (chosen)."""
SMOOTHING = (FILTER, AVERAGE)
"""Causes that smooth the steps of readings."""
GROUPS = (MUSCLES, TEMPERATURE, ZEROS)
"""Causes of two groups of runs."""
FORCE_IS_LATER = "the force is later"
FORCE_IS_EARLIER = "the pressure or the length is later"
AROUND = "around each row"


def misfit_causes(
    recordings: Sequence[Recording], residuals: Sequence[Array]
) -> tuple[MisfitCause, ...]:
    """The causes of the residuals (model - measured) [N] of a static law, the greatest share first.

    residuals  of the rows of each recording, NaN for rows that are not measured
    """
    traces = Traces.of(recordings, residuals)
    rest = traces.residual[traces.is_known]
    total = float(rest @ rest)
    if rest.size < MIN_ROWS or not total > 0.0:
        return ()
    surface = _basis_of(traces.rows(_surface(traces)))
    unexplained = _Unexplained(surface, _beside(surface, rest))
    causes = [MisfitCause(FORM, 1.0 - unexplained.squares / total)]
    forms = [_best(group, unexplained) for group in _groups_of_forms(traces, unexplained.rest)]
    steps = _share_of_steps(_steps(recordings, traces), forms, unexplained, total)
    causes.append(steps)
    if steps.share > MIN_SHARE:
        forms = [form for form in forms if form.name not in SMOOTHING]
    while forms := _without_single_runs(forms, unexplained):
        best = max(forms, key=unexplained.taken_up)
        taken_up = unexplained.taken_up(best)
        if taken_up < MIN_SHARE * total:
            break
        rival = _rival(best, forms, unexplained)
        causes.append(MisfitCause(best.name, taken_up / total, best.detail, rival))
        unexplained = unexplained.without(best)
        forms = [form._replace(left=None) for form in forms if form is not best]
    named = [cause for cause in causes if cause.share >= MIN_SHARE]
    return tuple(sorted(named, key=lambda cause: -cause.share))


class _Form(NamedTuple):
    """A form of the residuals of a cause: columns (N, K) of the known rows."""

    name: str
    columns: Array
    limits: tuple[float, float] | None = None
    """Limits of the factor of a single column."""
    detail: str = ""
    time: float = 0.0
    penalty: float = 0.0
    """Share of what is left that as many columns take up by chance."""
    left: float | None = None
    """Squares that are left where the law is fitted with this cause; None where it is not."""


class _Unexplained(NamedTuple):
    """What is left of the residuals (N,) beside an orthonormal basis (N, B)."""

    basis: Array
    rest: Array

    @property
    def squares(self) -> float:
        return float(self.rest @ self.rest)

    def fitted(self, form: _Form) -> Array:
        """What a form takes up of the rest (N,)."""
        if form.limits is not None:
            (column,) = _beside(self.basis, form.columns).T
            square = float(column @ column)
            factor = float(column @ self.rest) / square if square > 0.0 else 0.0
            return np.asarray(np.clip(factor, *form.limits) * column)
        columns = _basis_of(form.columns, self.basis)
        return np.asarray(columns @ (columns.T @ self.rest))

    def taken_up(self, form: _Form) -> float:
        """The squares that a form takes up, less those that it would by chance."""
        if form.left is not None:
            return self.squares - form.left
        left = self.rest - self.fitted(form)
        return self.squares - float(left @ left) * (1.0 + form.penalty)

    def left_by(self, form: _Form) -> float:
        """The squares that a form leaves."""
        return self.squares - self.taken_up(form)

    def without(self, form: _Form) -> "_Unexplained":
        """What the form leaves."""
        further = _basis_of(form.columns, self.basis)
        return _Unexplained(np.hstack([self.basis, further]), self.rest - self.fitted(form))


def _beside(basis: Array, values: Array) -> Array:
    """What values (N, ...) have beside an orthonormal basis (N, B)."""
    return np.asarray(values - basis @ (basis.T @ values))


def _basis_of(columns: Array, beside: Array | None = None) -> Array:
    """An orthonormal basis (N, B) of what columns (N, K) have beside an orthonormal one.

    What depends on the others adds nothing, such as a fourth power at four levels: its direction
    would be that of the rounding errors.
    """
    lengths = np.linalg.norm(columns, axis=0)
    units = columns / np.where(lengths > 0.0, lengths, 1.0)
    if beside is not None:
        units = _beside(beside, units)
    directions, triangle = np.linalg.qr(units)
    parts, sizes, _ = np.linalg.svd(triangle)
    basis = directions @ parts[:, sizes > NEGLIGIBLE]
    if beside is not None:
        # the second time removes what rounding has left
        basis = np.linalg.qr(_beside(beside, basis))[0]
    return np.asarray(basis)


def _best(forms: Iterator[_Form], unexplained: _Unexplained) -> _Form:
    """The form of one cause that explains the most."""
    return max(forms, key=unexplained.taken_up)


def _rival(best: _Form, forms: Sequence[_Form], unexplained: _Unexplained) -> str:
    """The cause that leaves nearly as little as the best one; empty if none does."""
    if best.name == RUNS:
        return ""
    rivals = [form for form in forms if form.name not in (best.name, RUNS)]
    if not rivals:
        return ""
    second = max(rivals, key=unexplained.taken_up)
    left = unexplained.left_by(best)
    left_by_second = unexplained.left_by(second)
    is_alike = left_by_second <= ALIKE * left
    return second.name if is_alike else ""


def _without_single_runs(forms: Sequence[_Form], unexplained: _Unexplained) -> list[_Form]:
    """The forms without the offsets and gains of all runs, where two groups of runs explain nearly
    as much."""
    of_groups = 0.0
    of_runs = 0.0
    for form in forms:
        taken_up = unexplained.taken_up(form)
        if form.name == RUNS:
            of_runs = taken_up
        elif form.name in GROUPS:
            of_groups = max(of_groups, taken_up)
    if of_groups <= GROUPED * of_runs:
        return list(forms)
    return [form for form in forms if form.name != RUNS]


def _groups_of_forms(traces: Traces, rest: Array) -> Iterator[Iterator[_Form]]:
    """The forms of each cause."""
    if np.any(traces.direction != 0.0):
        yield _frictions(traces)
    if traces.is_timed:
        for name, response in SENSORS:
            yield _sensor_forms(traces, name, response, rest)
        yield _creeps(traces)
    if len(traces.step) > 1:
        yield iter([_single_runs(traces)])
    contraction = traces.relative_contraction
    for name, columns in (
        (MUSCLES, [traces.modelled]),
        (TEMPERATURE, [contraction, contraction**2]),
        (ZEROS, [np.ones(contraction.shape)]),
    ):
        form = _two_groups(traces, name, columns, rest)
        if form is not None:
            yield iter([form])


def _surface(traces: Traces) -> Array:
    """The columns (R, n, K) of a polynomial surface over pressure and contraction, and the force of
    the law."""
    columns = []
    for total in range(SURFACE_DEGREE + 1):
        for order in range(total + 1):
            of_contraction = traces.contraction**order
            of_pressure = traces.pressure ** (total - order)
            columns.append(of_pressure * of_contraction)
    greatest = float(np.max(np.abs(traces.modelled)))
    columns.append(traces.modelled / max(greatest, 1e-300))
    return np.stack(columns, axis=2)


def _frictions(traces: Traces) -> Iterator[_Form]:
    """Friction that changes its sign at once, or within a travel, and whose size follows pressure
    and contraction."""
    travel = 0.5 * (traces.pressure + traces.contraction)
    signs = np.concatenate([traces.direction[:, :, None], slipped(travel, SLIPS)], axis=2)
    sizes = np.stack(
        [
            np.ones(travel.shape),
            traces.pressure,
            traces.contraction,
            traces.pressure * traces.contraction,
        ],
        axis=2,
    )
    for number in range(signs.shape[2]):
        yield _Form(FRICTION, traces.rows(signs[:, :, [number]] * sizes))


SENSORS: tuple[tuple[str, tuple[SensorResponse, ...]], ...] = (
    (DELAY, (Delay(),)),
    (FILTER, (LowPass(),)),
    (AVERAGE, (Average(), AverageAround())),
)


class _Sensor(NamedTuple):
    """A response of the sensor of the force, or of those of pressure and length."""

    traces: Traces
    name: str
    response: SensorResponse
    is_force: bool

    def forms(self, times: Array) -> list[_Form]:
        """What the sensor makes of the force of the law with each of these times [s]; where
        pressure or length are later, of the measured force."""
        traces = self.traces
        signals = traces.modelled if self.is_force else traces.measured
        change = signals[:, :, None] - self.response(signals, times / traces.step[:, None])
        columns = traces.rows(change if self.is_force else -change)
        later = FORCE_IS_LATER if self.is_force else FORCE_IS_EARLIER
        where = AROUND if isinstance(self.response, AverageAround) else later
        return [
            _Form(self.name, columns[:, [k]], SENSOR_GAINS, f"{_seconds(time)}, {where}", time)
            for k, time in enumerate(times.tolist())
        ]

    def left(self, time: float) -> float:
        """Squares that a surface leaves whose force the sensor shows later by a time [s]; where
        pressure or length are later, those of the force as such a sensor would show it, with the
        noise that it removes."""
        traces = self.traces
        pulling = _surface(traces) * traces.is_known[:, :, None]
        rows = time / traces.step[:, None]
        if self.is_force:
            target = traces.rows(traces.measured)
            columns = traces.rows(self._shown(pulling, rows))
            return _squares_beside(columns, target)
        target = traces.rows(self.response(traces.measured, rows)[:, :, 0])
        noise = float(np.median([estimate_noise(run) for run in traces.measured]))
        removed = 1.0 - self.response.noise_left(float(np.median(rows)))
        return _squares_beside(traces.rows(pulling), target) + target.size * noise**2 * removed

    def _shown(self, columns: Array, rows: Array) -> Array:
        """Columns (R, n, K) as the sensor shows them with times (R, 1) in rows."""
        shown = []
        for number in range(columns.shape[2]):
            response = self.response(columns[:, :, number], rows)
            shown.append(response[:, :, 0])
        return np.stack(shown, axis=2)


def _squares_beside(columns: Array, target: Array) -> float:
    """The squares of a target (N,) that columns (N, K) leave."""
    left = _beside(_basis_of(columns), target)
    return float(left @ left)


def _sensor_forms(
    traces: Traces, name: str, responses: Sequence[SensorResponse], rest: Array
) -> Iterator[_Form]:
    """What a sensor with different times makes of the force of the law; where pressure or length
    are later, of the measured force. The law is fitted anew with the times that explain the most.
    """
    step = float(np.median(traces.step))
    longest = max(GREATEST_FILTER * traces.duration, 2.0 * LEAST_STEPS * step)
    coarse = np.geomspace(LEAST_STEPS * step, longest, COARSE)
    for response, is_force in itertools.product(responses, (True, False)):
        sensor = _Sensor(traces, name, response, is_force)
        forms = sensor.forms(coarse)
        best = max(forms, key=lambda form: _alone(form, rest))
        start = best.time * _factor(best, rest)
        if is_force and isinstance(response, AverageAround):
            # it opens no loop, so that the law has followed most of it
            start = min(coarse.tolist(), key=sensor.left)
        elif _alone(best, rest) < (PLAUSIBLE - 1.0) * float(rest @ rest):
            yield best
            continue
        time, left = _refined(sensor.left, start)
        (form,) = sensor.forms(np.array([time]))
        yield form._replace(left=left)


def _factor(form: _Form, rest: Array) -> float:
    """The residuals over a single column, within the limits of a sensor: loops are proportional to
    the time of a sensor, so that this is a factor of the time."""
    column = form.columns[:, 0]
    square = float(column @ column)
    return float(np.clip(column @ rest / square, *SENSOR_GAINS)) if square > 0.0 else 1.0


def _refined(left: Callable[[float], float], time: float) -> tuple[float, float]:
    """The time with the least squares that are left, and these, by parabolas through three times
    around the best one."""
    tried = {time: left(time)}
    for width in WIDTHS:
        middle = min(tried, key=tried.__getitem__)
        around = (middle / width, middle, middle * width)
        for trial in around:
            if trial not in tried:
                tried[trial] = left(trial)
        vertex = _vertex(np.array(around), np.array([tried[trial] for trial in around]))
        tried[vertex] = left(vertex)
    best = min(tried, key=tried.__getitem__)
    return best, tried[best]


def _vertex(times: Array, squares: Array) -> float:
    """The least of the parabola through three points, within them; their best without one."""
    curvature, slope, _ = np.polyfit(times, squares, 2)
    if not curvature > 0.0:
        return float(times[np.argmin(squares)])
    least = -0.5 * slope / curvature
    return float(np.clip(least, times[0], times[-1]))


def _alone(form: _Form, rest: Array) -> float:
    """The squares of the residuals that a form takes up as it is."""
    left = rest - form.columns[:, 0]
    return -float(left @ left)


def _seconds(time: float) -> str:
    return f"{1e3 * time:.3g} ms" if time < 1.0 else f"{time:.3g} s"


def _creeps(traces: Traces) -> Iterator[_Form]:
    """A slow response of a share of the force, and a drift of force and gain from the beginning of
    each run."""
    times = traces.duration * np.geomspace(*CREEP_TIMES, COARSE)
    limits = (-MAX_CREEP, MAX_CREEP)
    for time in times.tolist():
        detail = f"about {_seconds(time)}"
        rows = time / traces.step[:, None]
        response = LowPass()(traces.modelled, rows)
        slow = traces.modelled[:, :, None] - response
        yield _Form(CREEP, traces.rows(slow), limits, detail)
        elapsed = -np.expm1(-traces.time / time)
        drift = np.stack([elapsed, elapsed * traces.modelled], axis=2)
        yield _Form(CREEP, traces.rows(drift), detail=detail)


def _single_runs(traces: Traces) -> _Form:
    """An offset and a gain of the force in each run."""
    columns = []
    for run in range(len(traces.modelled)):
        offset = np.zeros(traces.modelled.shape)
        offset[run] = 1.0
        columns.append(offset)
        columns.append(offset * traces.modelled)
    stacked = np.stack(columns, axis=2)
    return _Form(RUNS, traces.rows(stacked), penalty=2.0 / ROWS_OF_RUN)


def _two_groups(traces: Traces, name: str, columns: Sequence[Array], rest: Array) -> _Form | None:
    """Columns that count in a group of two or more runs, and not in the two or more others; None
    with fewer runs. The groups are those of least squares of the factors of the first column in the
    runs."""
    column = columns[0]
    residual = np.zeros(column.shape)
    residual[traces.is_known] = rest
    known = np.where(traces.is_known, column, 0.0)
    weights = np.sum(known**2, axis=1)
    products = np.sum(column * residual, axis=1)
    if weights.size < 4:
        return None
    is_member = _upper_group(weights, products)
    members = np.stack(columns, axis=2) * is_member[:, None, None]
    return _Form(name, traces.rows(members))


def _upper_group(weights: Array, products: Array) -> npt.NDArray[np.bool_]:
    """The runs (R,) of one of the two groups whose common factors explain the most, from the
    squares of a column in each run and its products with the residuals."""
    order = np.argsort(products / np.maximum(weights, 1e-300), kind="stable")
    explained = []
    for size in range(2, order.size - 1):
        group = order[:size]
        others = order[size:]
        parts = [_explained(weights[runs], products[runs]) for runs in (group, others)]
        explained.append(sum(parts))
    size = int(np.argmax(explained)) + 2
    is_upper = np.ones(order.size, dtype=bool)
    is_upper[order[:size]] = False
    return is_upper


def _explained(weights: Array, products: Array) -> float:
    """The squares that a common factor of some runs explains."""
    return float(np.sum(products) ** 2 / max(float(np.sum(weights)), 1e-300))


class _Steps(NamedTuple):
    """The quantity whose readings are coarse, and the variance of the force that follows [N^2]."""

    quantity: str
    variance: float


def _share_of_steps(
    steps: _Steps, forms: Sequence[_Form], unexplained: _Unexplained, total: float
) -> MisfitCause:
    """The share of steps is their variance, and no more than what all other causes leave but a
    filter or an average, which smooths steps as well."""
    others = [form for form in forms if form.name not in SMOOTHING]
    taken_up = max(map(unexplained.taken_up, others), default=0.0)
    squares = min(steps.variance * unexplained.rest.size, unexplained.squares - taken_up)
    return MisfitCause(STEPS.format(steps.quantity), squares / total)


def _steps(recordings: Sequence[Recording], traces: Traces) -> _Steps:
    """The quantity whose steps give the greatest variance of the force."""
    slopes = _slopes(traces)
    steps_of = []
    for quantity, slope in slopes.items():
        step = max((_step(recording, quantity) for recording in recordings), default=0.0)
        steps_of.append(_Steps(quantity, (slope * step) ** 2 / 12.0))
    return max(steps_of, key=lambda steps: steps.variance)


def _step(recording: Recording, quantity: str) -> float:
    """The step of the readings of a run [SI]; also where it is so great that there are few
    readings, if a ramp goes through them while the other quantity is held. 0 of a held one.
    """
    values = recording[quantity][np.isfinite(recording[quantity])]
    tolerance = rounding(quantity, values)
    readings = distinct_readings(values, tolerance)
    numbers = reading_numbers(values, tolerance)
    repeated = float(np.mean(np.diff(numbers) == 0)) if values.size > 1 else 0.0
    if readings.size < MIN_READINGS or repeated < MIN_REPEATED:
        return 0.0
    step = estimate_resolution(values)
    if step > 0.0 or quantity != "pressure" or not _is_held_ramp(recording):
        return step
    few = readings.size <= values.size / MIN_ROWS_OF_READING
    gaps = np.diff(readings)
    is_even = few and float(np.ptp(gaps)) <= EVEN * float(np.median(gaps))
    return float(np.median(gaps)) if is_even else 0.0


def _is_held_ramp(recording: Recording) -> bool:
    """Whether the contraction of a run with time is held."""
    contraction = recording["contraction"][np.isfinite(recording["contraction"])]
    return "time" in recording and contraction.size > 0 and float(np.ptp(contraction)) < HELD


def _slopes(traces: Traces) -> dict[str, float]:
    """The root mean square slope of the force over each quantity [N/SI], of a bilinear surface."""
    columns = traces.rows(
        np.stack(
            [
                np.ones(traces.pressure.shape),
                traces.pressure,
                traces.contraction,
                traces.pressure * traces.contraction,
            ],
            axis=2,
        )
    )
    factors = np.linalg.lstsq(columns, traces.measured[traces.is_known], rcond=1e-9)[0]
    _, pressure, contraction, _ = columns.T
    of_pressure = factors[1] + factors[3] * contraction
    of_contraction = factors[2] + factors[3] * pressure
    return {
        "pressure": _root_mean_square(of_pressure) * traces.pressure_scale,
        "contraction": _root_mean_square(of_contraction) * traces.contraction_scale,
        "force": 1.0,
    }


def _root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
