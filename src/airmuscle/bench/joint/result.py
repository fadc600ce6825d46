"""ArmFit: an arm identified from episodes, with its free-run errors beside the baselines, and its plant."""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import Array, ParameterError, ShortRepr, plotting, tree
from ...physics import Plant, PressureDriven, ProportionalRegulator, SecondOrderLag, Supply, Valve
from ...report import Chapter, NamedValue, Plot, Table, TableColumn
from ..identify.prediction import PlantUncertainty
from ..reported import Reported
from .episode_inspection import EpisodeInspection
from .episodes import COVERAGE, Episode, Episodes, coverage, in_pairs, rms
from .free_run import RegulatorLag, ResidualGain, angles

SUPPLY = 6e5
"""Gauge pressure [Pa] of the supply of the plant (chosen)."""


@dataclasses.dataclass(frozen=True)
class ArmParameter:
    """A parameter by its path in the arm, its value and its standard error [SI], a window as one observation."""

    path: str
    value: float
    standard_error: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ArmFit(Reported):
    """An arm identified from the first episodes and judged on the last ones; `print` it.

    arm          the arm along measured pressures, with the identified parameters
    inspection   of all episodes
    pairs        muscles, from 1, that raise and lower each angle; muscle 2j and 2j + 1 of `arm` are the pair of joint j
    errors       (N, rows, J) [rad] of the free run on the episodes left out; `episode` (N,) their numbers
    by_baseline  errors of the same windows by the name of the baseline
    band         (rows, J) half-width of the band of the free run that holds 95 % of these errors [rad]
    estimates    parameters with their standard errors
    remarks      what the record does not separate, and what the fit left out
    fitted       number of the episodes, the first ones, of the fit
    regulators   of the muscles of `arm`, between command and pressure; empty where the episodes have no commands
    commanded    errors as `errors`, of the free run from the commands alone, or None
    covariance   (P, P) of `estimates` [SI] along what the record separates; with others the arm moves alike
    gain         errors of the physics alone and of the hybrid law, where one was asked for, or None
    """

    arm: PressureDriven
    inspection: EpisodeInspection
    pairs: tuple[tuple[int, int], ...]
    errors: Array
    episode: Array
    by_baseline: Mapping[str, Array]
    band: Array
    estimates: tuple[ArmParameter, ...]
    remarks: tuple[str, ...]
    fitted: int
    regulators: tuple[RegulatorLag, ...] = ()
    commanded: Array | None = None
    covariance: Array = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    gain: ResidualGain | None = None

    @property
    def rms(self) -> Array:
        """Root mean square error (J,) [rad] of the free run on the episodes left out."""
        return rms(self.errors)

    @property
    def best_baseline(self) -> tuple[str, ...]:
        """Name of the baseline with the smallest error, by joint."""
        names = list(self.by_baseline)
        levels = np.array([rms(errors) for errors in self.by_baseline.values()])
        return tuple(names[i] for i in np.argmin(levels, axis=0))

    @property
    def skill(self) -> Array:
        """1 - error/error of the best baseline (J,): 1 for a perfect prediction, 0 for none beyond the baseline."""
        return np.asarray(1.0 - self.rms / np.min([rms(errors) for errors in self.by_baseline.values()], axis=0))

    @property
    def coverage(self) -> Array:
        """Share (J,) of errors on one half of the episodes left out inside a band from the other half."""
        return coverage(self.errors, self.episode)

    @property
    def horizon(self) -> Array:
        """Times [s] after the start of a window at which `band` and the errors stand."""
        return np.asarray(self.inspection.episodes.sample_time * np.arange(1, self.errors.shape[1] + 1))

    def plant(self) -> Plant:
        """The arm with a proportional regulator for each muscle, whose time constant is the lag of its pressure.

        Supply, orifices and volumes of the muscles are chosen: the record does not contain them.
        """
        valve = Valve(3e-8, 0.3)
        regulators = tuple(
            ProportionalRegulator(Supply(SUPPLY), valve, valve, SecondOrderLag(1 / (2 * np.pi * lag), 1.0), 2e4, SUPPLY)
            for lag in self.arm.lags
        )
        return Plant(self.arm.muscle, regulators, self.arm.mechanism)

    def uncertainty(self) -> PlantUncertainty:
        """That of `plant()`: rms errors of its angles, and the covariance of its parameters, for randomisation.

        A parameter at a bound of its range has no variance.
        """
        paths, slopes = [], []
        bounds = {leaf.path: leaf.declared.bounds for leaf in tree.leaves(self.arm)}
        for each in self.estimates:
            lag = re.fullmatch(r"lags(\[\d+\])", each.path)
            paths.append((f"circuit{lag[1]}.lag.frequency" if lag else each.path,))
            slopes.append(-1 / (2 * np.pi * each.value**2) if lag else float(each.value not in bounds[each.path]))
        errors = {c.name: float(rms) for c, rms in zip(self.arm.mechanism.coordinates, self.rms, strict=True)}
        return PlantUncertainty(errors, tuple(paths), self.covariance * np.outer(slopes, slopes))

    def chapter(self) -> Chapter:
        """The description of the fit: errors beside those of the baselines, skill, band, muscles and parameters."""
        end, count = self.horizon[-1], len(np.unique(self.episode))
        skill = ", ".join(f"joint {j}: {value:.2f}" for j, value in enumerate(self.skill, start=1))
        caption = (
            "Root mean square error against the horizon: the model, its baselines, and the 95 % band of the model "
            "(shaded), which is the 95th percentile of the errors at each row."
        )
        return Chapter(
            name="joint",
            title="Identified arm",
            summary=f"Angles are predicted from the state at the start of a window and from the pressures alone: free "
            f"run over {end:.3g} s on {count} episodes left out, {len(self.errors)} windows. Skill, 1 - error/error of "
            f"the best baseline: {skill}.",
            values=(
                NamedValue("horizon", float(end), "s", digits=3, brief=False),
                NamedValue("windows", len(self.errors), brief=False),
                NamedValue("delay in rows", self.inspection.delay, brief=False),
            ),
            tables=(self._error_table(), self._joint_table(), self._band_table(), self._parameter_table()),
            plots=(Plot("horizon", caption, self._horizon_figure),),
            notes=self.remarks,
        )

    def _error_table(self) -> Table:
        found = {**self.by_baseline, "model": self.errors, "model, from commands": self.commanded}
        if self.gain is not None:
            found |= {"physics alone": self.gain.physics, "hybrid law": self.gain.hybrid}
        rows = {name: rms(errors) for name, errors in found.items() if errors is not None}
        columns: dict[str, Any] = {"prediction by": list(rows)}
        for j in range(self.errors.shape[2]):
            columns[f"joint {j + 1}"] = TableColumn([values[j] for values in rows.values()], "rad", "deg", 3)
        return Table("joint-errors", "Root mean square error of the free run", columns, brief=len(rows))

    def _joint_table(self) -> Table:
        columns: dict[str, Any] = {
            "joint": list(range(1, len(self.pairs) + 1)),
            "raised by muscle": [raising for raising, _ in self.pairs],
            "lowered by muscle": [lowering for _, lowering in self.pairs],
            "skill": TableColumn(self.skill, digits=3),
            "best baseline": TableColumn(list(self.best_baseline), brief=False),
            "95 % band at the horizon ±": TableColumn(self.band[-1], "rad", "deg", 3),
            "share inside the band": TableColumn(self.coverage, "1", "%", 3, short="inside"),
        }
        return Table("joints", "Joints", columns, brief=len(self.pairs))

    def _band_table(self) -> Table:
        columns: dict[str, Any] = {"horizon": TableColumn(self.horizon, "s")}
        columns |= {f"joint {j}": TableColumn(band, "rad", "deg") for j, band in enumerate(self.band.T, start=1)}
        return Table("joint-band", "Half width of the 95 % band", columns, shown=False)

    def _parameter_table(self) -> Table:
        columns: dict[str, Any] = {
            "parameter": [each.path for each in self.estimates],
            "value [SI]": [each.value for each in self.estimates],
            "standard error [SI]": [each.standard_error for each in self.estimates],
        }
        return Table("joint-parameters", "Identified parameters", columns, key="parameters")

    def _horizon_figure(self) -> Any:
        """Error of every joint against the horizon, one panel each."""
        figure, panels = plotting.new_figure(1, self.errors.shape[2], squeeze=False)
        for j, axes in enumerate(panels[0]):
            for i, (name, errors) in enumerate([("model", self.errors), *self.by_baseline.items()]):
                axes.plot(self.horizon, np.degrees(rms(errors, axis=(0,))[:, j]), color=plotting.LINES[i], label=name)
            band = np.degrees(self.band[:, j])
            axes.fill_between(self.horizon, 0.0, band, color=plotting.LINES[0], alpha=0.15, linewidth=0)
            axes.set(title=f"joint {j + 1}", xlabel="horizon [s]", ylabel="error [deg]" if j == 0 else "")
        lines, names = panels[0][0].get_legend_handles_labels()
        figure.legend(lines, names, loc="outside upper center", ncols=len(names))
        return figure


# Angles from the pressures alone: free runs from the poses in which episodes begin

MEMBERS, CALIBRATED = 12, 200
"""Poses from which every episode is run, and episodes of the fit whose errors make the band (chosen)."""
UNSEEN = 0.5
"""Spread of the runs, relative to that of their poses, above which the pressures do not determine an angle (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AngleEstimate(ShortRepr):
    """Angles of episodes from their pressures; N episodes of at most R rows, NaN after their ends; `print` it.

    angle     (N, R, J) [rad] mean of the runs from all poses
    spread    (N, R, J) [rad] standard deviation of these runs: large where the joint has not moved since the start
    band      (R, J) [rad] half-width that holds 95 % of the errors of the fitted episodes at this row
    measured  (N, R, J) [rad]; `range` (J,) [rad] of the fitted angles between their 1 and 99 % quantiles
    unseen    (J,) share of the rows where pressures alone do not determine the angle: motion is needed to see it
    """

    angle: Array
    spread: Array
    band: Array
    measured: Array
    range: Array
    unseen: Array

    @property
    def rms(self) -> Array:
        """Root mean square error (J,) [rad]."""
        return np.asarray(np.sqrt(np.nanmean((self.angle - self.measured) ** 2, axis=(0, 1))))

    @property
    def coverage(self) -> Array:
        """Share (J,) of the rows inside the band."""
        inside = np.abs(self.angle - self.measured) <= self.band  # false after the end of an episode
        return np.asarray(inside.sum(axis=(0, 1)) / np.isfinite(self.measured).sum(axis=(0, 1)))

    def __str__(self) -> str:
        return "\n".join(
            f"joint {j}: {np.degrees(error):.3g} deg rms from pressures alone, {100 * error / span:.3g} % of its "
            f"range, {100 * inside:.3g} % inside the 95 % band; in {100 * unseen:.3g} % of the rows the angle is not "
            "seen until the joint moves"
            for j, (error, span, inside, unseen) in enumerate(
                zip(self.rms, self.range, self.coverage, self.unseen, strict=True), start=1
            )
        )


def estimate_angles(fit: ArmFit, episodes: Episodes, *, any_pose: bool = False, seed: int = 0) -> AngleEstimate:
    """Angles and bands of episodes that are known by their pressures only.

    The identified arm runs freely from each of 12 poses. These are first rows of the fitted episodes, because an arm
    begins in a place that is known from them; with `any_pose` they are rows anywhere in these episodes. What differs
    between the runs is what the pressures do not tell: an angle that stiction holds is not seen until it moves. Speeds
    at the start are 0; readings count until the delay of their sensors after each row. The measured angles serve only
    for `rms` and `coverage`. Raises ParameterError for other numbers of joints and muscles than those of the fit.
    """
    if episodes.muscles != len(fit.arm.muscle) or episodes.joints != len(fit.pairs):
        raise ParameterError(
            f"estimate_angles: the episodes have {episodes.joints} joints and {episodes.muscles} pressures, the fit "
            f"{len(fit.pairs)} and {len(fit.arm.muscle)}; give episodes of the same arm."
        )
    fitted = in_pairs(fit.inspection.episodes[: fit.fitted], fit.pairs)
    rng = np.random.default_rng(seed)
    rows = fitted.rows("angle") if any_pose else np.array([run.angle[0] for run in fitted.runs])
    poses = rows[rng.choice(len(rows), min(MEMBERS, len(rows)), replace=False)]
    known = fitted[-CALIBRATED:]
    angle, _ = _runs(fit.arm, known.runs, known.sample_time, fit.inspection.delay, poses)
    level = min(1.0, COVERAGE * (1 + 1 / len(known)))  # so that it holds for one further episode, too
    limits = np.nanquantile(np.abs(angle - _padded(known.runs, "angle")), level, axis=0, method="higher")
    own = in_pairs(episodes, fit.pairs)
    angle, spread = _runs(fit.arm, own.runs, own.sample_time, fit.inspection.delay, poses)
    measured = _padded(own.runs, "angle")
    limits = limits[np.minimum(np.arange(angle.shape[1]), len(limits) - 1)]
    unseen = np.where(np.isfinite(measured), spread > UNSEEN * poses.std(axis=0), np.nan)
    span = np.ptp(np.quantile(fitted.rows("angle"), (0.01, 0.99), axis=0), axis=0)
    return AngleEstimate(angle, spread, limits, measured, span, np.nanmean(unseen, axis=(0, 1)))


def _runs(
    arm: PressureDriven, runs: Sequence[Episode], sample_time: float, delay: int, poses: Array
) -> tuple[Array, Array]:
    """Mean and standard deviation (N, R, J) of the free runs from all poses; NaN after the end of an episode."""
    pressure = _padded(runs, "pressure", held=True)
    rows, names = pressure.shape[1], [c.name for c in arm.mechanism.coordinates]
    later = np.minimum(np.arange(rows) + delay, rows - 1)
    state = {s.name: np.zeros(len(runs) * len(poses)) for s in arm.states}
    state |= {name: np.tile(poses[:, j], len(runs)) for j, name in enumerate(names)}
    state |= {f"{p}pressure": np.repeat(pressure[:, later[0], i], len(poses)) for i, p in enumerate(arm.prefixes)}
    found = angles(arm, np.repeat(pressure[:, later], len(poses), axis=0), state, sample_time)
    stacked = found.reshape(len(runs), len(poses), rows, len(names))
    ended = np.isnan(_padded(runs, "angle"))
    return np.where(ended, np.nan, stacked.mean(axis=1)), np.where(ended, np.nan, stacked.std(axis=1))


def _padded(runs: Sequence[Episode], name: str, held: bool = False) -> Array:
    """One quantity of all episodes (N, R, columns), its last row held or NaN after the end of an episode."""
    columns = [getattr(run, name) for run in runs]
    longest = max(len(c) for c in columns)
    ends = [c[-1:] if held else np.full_like(c[-1:], np.nan) for c in columns]
    return np.stack(
        [np.concatenate([c, np.repeat(e, longest - len(c), axis=0)]) for c, e in zip(columns, ends, strict=True)]
    )
