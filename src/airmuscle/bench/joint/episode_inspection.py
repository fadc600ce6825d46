"""Inspection of episodes: rates, ranges, which pressure acts on which angle, and what forbids an
identification.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ...core import Array, IdentificationError, counted
from ...report.chapter import BY_ROW, Chapter, Table, TableColumn
from ..inspection import Sensor, estimate_resolution, rounding
from ..reported import Reported
from .episodes import HISTORY, ROWS, Episodes, Windows, long_enough, speed_of

MAX_DELAY = 8
"""Greatest delay of the pressure sensors that is looked for [rows] (chosen)."""
CERTAIN = 5.0
CLEAR = 1.25
"""t-value from which a pressure acts on an angle, and its ratio to that of the next joint
(chosen).
"""
TURN = 10.0
BURST = 1e7
"""Greatest angle [rad] of a joint and gauge pressure [Pa] of a muscle (chosen)."""
WIDE = 1.5 * np.pi
NARROW = 0.035
"""Range of an angle [rad] above and below which its unit is doubted (chosen)."""
PIECES = 20
"""Independent pieces of the record at least, from which a t-value comes (chosen)."""
DEAD = 0.01
"""Spread of a reading, relative to the greatest of its kind, up to which it is none (chosen)."""
JUMP = np.pi
"""Change of an angle between two rows [rad] that no arm makes."""
SPEED_RATIO = 1.15
TRAVEL = 5
"""Ratio of the motion to that of the speeds, or its inverse, that a wrong sample time explains;
rows of it (chosen).
"""
SATURATED = 0.02
"""Share of rows at an end of the range of a reading that counts as saturation (chosen)."""
SETTLED = 3
LEAST = 0.2
"""Rows after which a wrong reading is forgotten before the start of a window; least share of rows
of a fit (chosen).
"""


@dataclasses.dataclass(frozen=True)
class PressureAction:
    """Muscle (from 1) and the joint (from 1) on whose acceleration its pressure acts most. `sign`
    of the action, t-value of its regression coefficient, and that of the next joint."""

    muscle: int
    joint: int
    sign: int
    t_value: float
    next_t_value: float

    @property
    def certain(self) -> bool:
        return self.t_value > CERTAIN and self.t_value > CLEAR * self.next_t_value

    def __str__(self) -> str:
        way = "raises" if self.sign > 0 else "lowers"
        doubt = "" if self.certain else ", uncertain"
        t = f"t = {self.t_value:.0f}, next joint {self.next_t_value:.0f}{doubt}"
        return f"pressure {self.muscle} {way} angle {self.joint} ({t})"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class EpisodeInspection(Reported):
    """Findings on episodes; `print` it. `errors` forbid a fit, `remarks` do not; `delay` of the
    pressures [rows].
    """

    episodes: Episodes
    delay: int
    actions: tuple[PressureAction, ...]
    errors: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """For each joint the muscle, from 1, that raises its angle and the one that lowers it.
        Raises IdentificationError where the pressures do not show it with certainty."""
        pairs = []
        for joint in range(1, self.episodes.joints + 1):
            certain_actions = [a for a in self.actions if a.joint == joint and a.certain]
            up = [a.muscle for a in certain_actions if a.sign > 0]
            down = [a.muscle for a in certain_actions if a.sign < 0]
            if (len(up), len(down)) != (1, 1):
                raise IdentificationError(
                    f"joint {joint}: {counted(len(up), 'pressure')} with certainty for raising its"
                    f" angle, {len(down)} for lowering it; one of each is needed. State the muscles"
                    " of each joint in the mapping file: pairs = [[1, 2], ...]."
                )
            pairs.append((up[0], down[0]))
        return tuple(pairs)

    def chapter(self) -> Chapter:
        """The description: ranges of the readings, which pressure acts on which angle, and
        findings.
        """
        e = self.episodes
        lengths = [len(run) for run in self.episodes.runs]
        total = sum(lengths) * e.sample_time
        rows = " to ".join(dict.fromkeys(map(str, (min(lengths), max(lengths)))))
        contents = (
            f"{counted(len(e), 'episode')} of {rows} rows at {1 / e.sample_time:.4g} Hz,"
            f" {total:.4g} s; {counted(e.joints, 'joint')}, {counted(e.muscles, 'pressure')} with a"
            f" lag of {counted(self.delay, 'row')} ({1e3 * self.delay * e.sample_time:.3g} ms)"
            " behind the motion"
        )
        counts = (e.joints, e.muscles)
        names = [
            f"{kind} {i + 1}"
            for kind, n in zip(("angle", "pressure"), counts, strict=True)
            for i in range(n)
        ]
        readings = np.concatenate([e.rows("angle"), e.rows("pressure")], axis=1)
        low, middle, high = np.quantile(readings, (0.01, 0.5, 0.99), axis=0).tolist()
        units, shown = (
            np.repeat(units_of_kinds, counts).tolist()
            for units_of_kinds in (("rad", "Pa"), ("deg", "kPa"))
        )
        columns = {
            "reading": names,
            "range of 98 %": TableColumn(list(zip(low, high, strict=True)), BY_ROW),
            "median": TableColumn(middle, BY_ROW),
            "unit": TableColumn(units, shown=shown),
        }
        return Chapter(
            "episodes",
            "Episodes",
            (contents, *e.notes, *map(str, self.actions)),
            problems=self.errors,
            tables=(Table("readings", "Readings", columns, brief=len(names)),),
            notes=self.remarks,
        )

    def __str__(self) -> str:
        e = self.episodes
        said = self.chapter().paragraphs
        lines = [
            *said[: 1 + len(e.notes)],
            *(
                _range_line(f"angle {i}", np.degrees(x), "deg")
                for i, x in enumerate(e.rows("angle").T, 1)
            ),
            *(
                _range_line(f"pressure {i}", x / 1e3, "kPa")
                for i, x in enumerate(e.rows("pressure").T, 1)
            ),
            *said[1 + len(e.notes) :],
            *(f"remark: {remark}" for remark in self.remarks),
            *(f"error: {error}" for error in self.errors),
        ]
        return "\n".join(lines)


def inspect_episodes(
    episodes: Episodes, pairs: Sequence[tuple[int, int]] = (), rows: int = ROWS
) -> EpisodeInspection:
    """Inspect episodes before a fit over `rows` rows; `pairs` are the muscles said to raise and
    lower each angle.
    """
    errors = [*_units(episodes), *jumps(episodes), *constant_readings(episodes)]
    errors = errors or _sample_time(episodes)
    short = list[str]()
    try:
        _, short = long_enough(episodes, rows)
    except IdentificationError as error:
        errors.append(str(error))
    delay, actions = (0, ()) if errors else pressure_actions(episodes)
    for text in exchanged(actions, pairs, "the mapping"):
        errors.append(f"{text} Correct pairs in the mapping file.")
    remarks = (*short, *saturated(episodes)[1], *_doubtful(episodes))
    return EpisodeInspection(episodes, delay, actions, tuple(errors), remarks)


def exchanged(
    actions: Sequence[PressureAction], pairs: Sequence[tuple[int, int]], source: str
) -> list[str]:
    """What a source of pairs says of muscles, and the record contradicts with certainty."""
    certain = {action.muscle: action for action in actions if action.certain}
    texts = []
    for joint, pair in enumerate(pairs, start=1):
        for muscle, sign in zip(pair, (1, -1), strict=True):
            seen = certain.get(muscle)
            if seen is not None and (seen.joint, seen.sign) != (joint, sign):
                way = "raises" if sign > 0 else "lowers"
                texts.append(
                    f"muscles are exchanged: {source} says that pressure {muscle} {way} angle"
                    f" {joint}, the record that {seen}."
                )
    return texts


def faults_of_readings(episodes: Episodes) -> list[str]:
    """Units, jumps of angles and a sample time that no arm has: what makes any use of episodes
    wrong.
    """
    return [*_units(episodes), *jumps(episodes)] or _sample_time(episodes)


def faults_of_judge(episodes: Episodes) -> list[str]:
    """Remarks on faults of the episodes that judge a fit: they change no parameter of it."""
    return [
        f"the episodes left out, which judge the fit, are no such record, and their errors say"
        f" nothing: {fault}"
        for fault in faults_of_readings(episodes)
    ]


def checked_inspection(
    episodes: Episodes, pairs: Sequence[tuple[int, int]], rows: int
) -> EpisodeInspection:
    """The inspection of episodes. Raises IdentificationError with the first finding that forbids a
    fit.
    """
    inspection = inspect_episodes(episodes, pairs, rows)
    if inspection.errors:
        raise IdentificationError(inspection.errors[0])
    return inspection


def _range_line(name: str, values: Array, unit: str) -> str:
    low, middle, high = np.quantile(values, (0.01, 0.5, 0.99))
    return f"{name}: {low:.4g} to {high:.4g} {unit} (1 to 99 %), median {middle:.4g}"


def _units(episodes: Episodes) -> list[str]:
    """Readings beyond what an arm has, whose unit is another one."""
    turn = ("rad", TURN, "further than a joint turns")
    burst = ("Pa", BURST, "more than a muscle bears")
    return [
        f"{name} {i} reaches {high:.4g} {unit}, {why}: state its unit or scale in the mapping file,"
        f" [{name}s]."
        for name, (unit, limit, why) in (("angle", turn), ("pressure", burst))
        for i, high in enumerate(np.quantile(np.abs(episodes.rows(name)), 0.99, axis=0), start=1)
        if high > limit
    ]


def jumps(episodes: Episodes) -> list[str]:
    """The first jump of an angle that no arm makes."""
    for run in episodes.runs:
        rows, joints = np.nonzero(np.abs(np.diff(run.angle, axis=0)) > JUMP)
        if len(rows):
            a, b = np.degrees(run.angle[rows[0] : rows[0] + 2, joints[0]])
            return [
                f"{run.name}: angle {joints[0] + 1} jumps from {a:.4g} to {b:.4g} deg at row"
                f" {rows[0] + 2}, as an encoder does that wraps after a turn. Unwrap the angles"
                " (numpy.unwrap) and write the files again."
            ]
    return []


def _doubtful(episodes: Episodes) -> list[str]:
    """Remarks on what may have another unit or scale: ranges of angles, sizes of pressures, and the
    sample time.
    """
    spans = np.ptp(np.quantile(episodes.rows("angle"), (0.01, 0.99), axis=0), axis=0)
    remarks = list[str]()
    for i, x in enumerate(spans, 1):
        if not NARROW < x < WIDE:
            kind = "degrees read as radians" if x > WIDE else "radians read as degrees"
            text = f"angle {i} spans {np.degrees(x):.3g} deg, as {kind} do"
            remarks.append(f"{text}: check its unit in the mapping file, [angles]")
    pressure = episodes.rows("pressure")
    high = float(np.quantile(np.abs(pressure), 0.99))
    is_integral = bool(np.all(pressure == np.round(pressure)))
    if high < 1e4 or is_integral:
        kind = "whole numbers, as counts" if is_integral else "small, as shares of a range"
        remarks.append(
            f"pressures look like a scale and not like Pa: they are {kind}, up to {high:.4g}. Zero"
            " and gain are absorbed by the reduced law; state pressures.scale for forces of the"
            " right size"
        )
    if not episodes.confirmed:
        remarks.append(
            f"the sample time of {1e3 * episodes.sample_time:.4g} ms cannot be checked, because the"
            " record has neither times nor speeds: with another one other inertias, dampings and"
            " lags explain the same rows"
        )
    return remarks


def constant_readings(episodes: Episodes) -> list[str]:
    """Pressures and angles that never vary."""
    errors = []
    for name, unit in (("pressure", "Pa"), ("angle", "rad")):
        low, high = np.quantile(episodes.rows(name), (0.01, 0.99), axis=0)
        dead = np.flatnonzero(high - low <= DEAD * np.max(high - low))
        errors += [
            f"{name} {i + 1} never varies, it is {low[i]:.4g} to {high[i]:.4g} {unit} in 98 % of"
            " the rows: its sensor does not record. Leave its joint out, or give commands in place"
            " of pressures."
            for i in dead
        ]
    return errors


def _sample_time(episodes: Episodes) -> list[str]:
    """Motion against that of the measured speeds, whose ratio a wrong sample time multiplies:
    medians of the quarter of the rows with most motion, because single readings have noise and
    outliers."""
    path = [
        np.cumsum(run.speed[1:] + run.speed[:-1], axis=0) * (0.5 * episodes.sample_time)
        for run in episodes.runs
    ]
    said = np.concatenate([integral[TRAVEL:] - integral[:-TRAVEL] for integral in path])
    moved = np.concatenate(
        [run.angle[1 + TRAVEL :] - run.angle[1:-TRAVEL] for run in episodes.runs]
    )
    far = np.abs(said) >= np.maximum(np.quantile(np.abs(said), 0.75, axis=0), 1e-12)
    of_joints = [
        np.median(moved[rows, joint] / said[rows, joint])
        for joint, rows in enumerate(far.T)
        if rows.any()
    ]
    if not of_joints:  # nothing moves
        return []
    ratio = np.median(of_joints)
    if 1 / SPEED_RATIO < ratio < SPEED_RATIO:
        return []
    hint = (
        ', as speeds in degrees have: unit = "deg/s"'
        if 1 / SPEED_RATIO < np.degrees(ratio) < SPEED_RATIO
        else ""
    )
    return [
        f"angles move {ratio:.3g} times as fast as the speeds say: the sample time of"
        f" {1e3 * episodes.sample_time:.4g} ms or the scale of the speeds is wrong. They agree with"
        f" {1e3 * ratio * episodes.sample_time:.4g} ms, or with speeds multiplied by"
        f" {ratio:.4g}{hint}. State sample_time or speeds.scale in the mapping file."
    ]


def pressure_actions(episodes: Episodes) -> tuple[int, tuple[PressureAction, ...]]:
    """Delay of the pressures, and what each acts on: regression of accelerations on pressures,
    angles and speeds.
    """
    step = episodes.sample_time
    moved = [
        (run, speed_of(run.angle, step)) for run in episodes.runs if len(run) >= 2 * MAX_DELAY + 8
    ]
    blocks = [
        (speed_of(v, step), np.concatenate([run.angle, v], axis=1), run.pressure)
        for run, v in moved
    ]
    if not blocks:
        return 0, ()
    regressions = [_regress(blocks, delay) for delay in range(MAX_DELAY + 1)]
    delay = int(np.argmin([residual for _, residual in regressions]))
    actions = []
    for muscle, row in enumerate(regressions[delay][0], start=1):
        joint, *further_joints = np.argsort(-np.abs(row)).tolist()
        following = float(abs(row[further_joints[0]])) if further_joints else 0.0
        sign = int(np.sign(row[joint]))
        t_value = float(abs(row[joint]))
        actions.append(PressureAction(muscle, joint + 1, sign, t_value, following))
    return delay, tuple(actions)


def _regress(blocks: Sequence[tuple[Array, Array, Array]], delay: int) -> tuple[Array, float]:
    """t-values (M, J) of the pressures, with errors independent between episodes or PIECES only;
    and the residual.
    """
    rows = slice(4, -MAX_DELAY - 1)
    parts = []
    for _, motion, pressure in blocks:
        delayed = pressure[4 + delay : len(pressure) - MAX_DELAY - 1 + delay]
        parts.append(np.concatenate([delayed, motion[rows]], axis=1))
    regressors = np.concatenate(parts)
    target = np.concatenate([acceleration[rows] for acceleration, _, _ in blocks])
    mean = regressors.mean(axis=0)
    spread = regressors.std(axis=0) + 1e-12
    design = np.column_stack([(regressors - mean) / spread, np.ones(len(regressors))])
    inverse = np.linalg.pinv(design.T @ design)
    coefficients = inverse @ (design.T @ target)
    residual = target - design @ coefficients
    muscles = blocks[0][2].shape[1]
    ends = np.cumsum([len(part) for part in parts])[:-1]
    if len(parts) < PIECES:
        ends = np.linspace(0, len(regressors), PIECES + 1).astype(int)[1:-1]
    pieces = zip(np.split(design, ends), np.split(residual, ends), strict=True)
    scores = np.array([regressor.T @ error for regressor, error in pieces])
    t_values = np.empty((muscles, target.shape[1]))
    for j in range(target.shape[1]):
        score = scores[:, :, j]
        covariance = inverse @ (score.T @ score) @ inverse
        variances = np.maximum(np.diag(covariance)[:muscles], 1e-300)
        t_values[:, j] = coefficients[:muscles, j] / np.sqrt(variances)
    unexplained = residual.var(axis=0) / target.var(axis=0)
    return t_values, float(np.sum(unexplained))


def saturated(episodes: Episodes) -> tuple[Array, list[str]]:
    """Upper ends (M,) of the readings at which they saturate, infinite without one, and remarks on
    both ends.
    """
    top = np.full(episodes.muscles, np.inf)
    remarks = []
    for i, values in enumerate(episodes.rows("pressure").T):
        least = rounding("pressure", values)
        sensor = Sensor("pressure", estimate_resolution(values), 0.0, rounding=least)
        if not np.ptp(values) > sensor.jitter:
            continue
        low = -_end_of_readings(-values, sensor)
        high = _end_of_readings(values, sensor)
        top[i] = high - sensor.tolerance
        for edge, cause in (
            (low, "the muscle is empty"),
            (high, "it has the pressure of its supply"),
        ):
            if np.isfinite(edge):
                beyond = values <= edge if cause == "the muscle is empty" else values >= edge
                count = int(np.count_nonzero(beyond | (np.abs(values - edge) <= sensor.tolerance)))
                remarks.append(
                    f"pressure {i + 1} is {edge:.4g} Pa in {count} of {len(values)} rows "
                    f"({100 * count / len(values):.0f} %): its reading saturates there, or {cause}"
                )
    return top, remarks


def _end_of_readings(values: Array, sensor: Sensor) -> float:
    """The greatest reading, if more than `SATURATED` of the rows are there; the count below it, if
    they are only with those that jitter by one count; else infinite."""
    top = float(values.max())
    at_top = float(np.mean(values >= top - sensor.tolerance))
    near = float(np.mean(values >= top - sensor.jitter))
    if at_top > SATURATED:
        return top
    return top - sensor.resolution if near > SATURATED and 4.0 * at_top > near else math.inf


def without_saturated(windows: Windows, episodes: Episodes) -> tuple[Windows, list[str]]:
    """The windows of a fit, in which rows after a reading at an upper end at which it saturates do
    not count, and a remark on these; all rows count where less than LEAST would be left."""
    ends = np.any(windows.pressure[:, HISTORY - SETTLED :] >= saturated(episodes)[0], axis=-1)
    hit = np.cumsum(ends, axis=1)[:, SETTLED:] > 0
    leaves_enough = hit[:, 1:].mean() <= 1.0 - LEAST
    text = (
        f"{hit[:, 1:].sum()} of {hit[:, 1:].size} rows of the fit follow a pressure reading at its"
        " upper end, whose true value is unknown: they "
        + (
            "do not count, except in the errors of the report"
            if leaves_enough
            else "are too many to leave out"
        )
    )
    counts = np.concatenate([windows.counts[:, :HISTORY], ~hit], axis=1)
    return dataclasses.replace(windows, counts=counts) if leaves_enough else windows, (
        [text] if hit.any() else []
    )
