"""ArmFit: an arm identified from episodes, with its free-run errors beside the baselines, and its
plant.
"""

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core import Array, plotting, tree
from ...physics import Plant, PressureDriven, ProportionalRegulator, SecondOrderLag, Supply, Valve
from ...report import Chapter, NamedValue, Plot, Table, TableColumn
from ..estimation import SolvedProblem
from ..prediction import PlantUncertainty
from ..reported import Reported
from .episode_inspection import EpisodeInspection
from .episodes import ENOUGH, coverage, rms
from .free_run import RegulatorLag, ResidualGain

SUPPLY = 6e5
"""Gauge pressure [Pa] of the supply of the plant (chosen)."""


@dataclasses.dataclass(frozen=True)
class ArmParameter:
    """A parameter by its path in the arm, its value and its standard error [SI], a window as one
    observation.
    """

    path: str
    value: float
    standard_error: float


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ArmFit(Reported):
    """An arm identified from the first episodes and judged on the last ones; `print` it.

    arm          the arm along measured pressures, with the identified parameters
    inspection   of the fitted episodes
    pairs        columns of pressures, from 1, that raise and lower each angle
    errors       (N, rows, J) [rad] of the free run on the episodes left out; `episode` (N,) their
                 numbers
    by_baseline  errors of the same windows by the name of the baseline
    band         (rows, J) half-width of the band of the free run that holds 95 % of these errors
                 [rad]
    estimates    parameters with their standard errors
    remarks      what the record does not separate, and what the fit left out
    fitted       number of the episodes, the first ones, of the fit
    regulators   of the muscles of `arm`, between command and pressure; empty where the episodes
                 have no commands
    commanded    errors as `errors`, of the free run from the commands alone, or None
    covariance   (P, P) of `estimates` [SI] along what the record separates; with others the arm
                 moves alike
    gain         errors of the physics alone and of the hybrid law, where one was asked for, or None
    columns      of the pressures, from 1, that the muscles of `arm` have; by default those of
                 `pairs` in turn
    gains        of these readings, by default 1, and their zeros [Pa]: p = gain (reading - zero)
    solved       the problems with the estimates, one for each search: covariance by windows,
                 profiles, bootstrap
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
    columns: tuple[int, ...] = ()
    gains: tuple[float, ...] = ()
    zeros: tuple[float, ...] = ()
    solved: tuple[SolvedProblem, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.arm.muscle)
        of_pairs = tuple(column for pair in self.pairs for column in pair)
        vars(self).update(
            columns=self.columns or of_pairs,
            gains=self.gains or (1.0,) * count,
            zeros=self.zeros or (0.0,) * count,
        )

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
        """1 - error/error of the best baseline (J,): 1 for a perfect prediction, 0 for none beyond
        the baseline.
        """
        return np.asarray(
            1.0 - self.rms / np.min([rms(errors) for errors in self.by_baseline.values()], axis=0)
        )

    @property
    def coverage(self) -> Array:
        """Share (J,) of errors on one half of the episodes left out inside a band from the other
        half.
        """
        return coverage(self.errors, self.episode)

    @property
    def horizon(self) -> Array:
        """Times [s] after the start of a window at which `band` and the errors stand."""
        return np.asarray(
            self.inspection.episodes.sample_time * np.arange(1, self.errors.shape[1] + 1)
        )

    def plant(self) -> Plant:
        """The arm with a proportional regulator for each muscle, whose time constant is the lag of
        its pressure.

        Supply, orifices and volumes of the muscles are chosen: the record does not contain them.
        """
        valve = Valve(3e-8, 0.3)
        regulators = tuple(
            ProportionalRegulator(
                Supply(SUPPLY),
                valve,
                valve,
                SecondOrderLag(1 / (2 * np.pi * lag), 1.0),
                2e4,
                SUPPLY,
            )
            for lag in self.arm.lags
        )
        return Plant(self.arm.muscle, regulators, self.arm.mechanism)

    def uncertainty(self) -> PlantUncertainty:
        """That of `plant()`, for randomisation: rms errors of its angles, and the covariance of its
        parameters, where a parameter at a bound of its range has no variance."""
        paths = []
        slopes = []
        bounds = {leaf.path: leaf.declared.bounds for leaf in tree.leaves(self.arm)}
        for estimate in self.estimates:
            lag = re.fullmatch(r"lags(\[\d+\])", estimate.path)
            paths.append((f"circuit{lag[1]}.lag.frequency" if lag else estimate.path,))
            slopes.append(
                -1 / (2 * np.pi * estimate.value**2)
                if lag
                else float(estimate.value not in bounds[estimate.path])
            )
        errors = {
            c.name: float(rms)
            for c, rms in zip(self.arm.mechanism.coordinates, self.rms, strict=True)
        }
        return PlantUncertainty(errors, tuple(paths), self.covariance * np.outer(slopes, slopes))

    def chapter(self) -> Chapter:
        """The description of the fit: errors beside those of the baselines, skill, band, muscles
        and parameters.
        """
        end = self.horizon[-1]
        count = len(np.unique(self.episode))
        skill = ", ".join(f"joint {j}: {value:.2f}" for j, value in enumerate(self.skill, start=1))
        band = (
            "the 95 % band of the model (shaded), which is the 95th percentile of the errors at"
            " each row."
            if count >= ENOUGH
            else f"the greatest errors of {count} episodes (shaded), which are no 95 % band."
        )
        caption = (
            f"Root mean square error against the horizon: the model, its baselines, and {band}"
        )
        summary = (
            "Angles are predicted from the state at the start of a window and from the pressures"
            f" alone: free run over {end:.3g} s on {count} episodes left out, {len(self.errors)}"
            f" windows. Skill, 1 - error/error of the best baseline: {skill}."
        )
        values = (
            NamedValue("horizon", float(end), "s", digits=3, brief=False),
            NamedValue("windows", len(self.errors), brief=False),
            NamedValue("delay in rows", self.inspection.delay, brief=False),
        )
        bands: dict[str, Any] = {"horizon": TableColumn(self.horizon, "s")}
        bands |= {
            f"joint {j}": TableColumn(half_width, "rad", "deg")
            for j, half_width in enumerate(self.band.T, start=1)
        }
        parameters = {
            "parameter": [estimate.path for estimate in self.estimates],
            "value [SI]": [estimate.value for estimate in self.estimates],
            "standard error [SI]": [estimate.standard_error for estimate in self.estimates],
        }
        tables = (
            self._error_table(),
            self._joint_table(),
            Table("joint-band", "Half width of the 95 % band", bands, shown=False),
            Table("joint-parameters", "Identified parameters", parameters, key="parameters"),
        )
        plots = (Plot("horizon", caption, self._horizon_figure),)
        notes = (*self._doubt(count), *self.remarks)
        return Chapter(
            "joint",
            "Identified arm",
            summary,
            values=values,
            tables=tables,
            plots=plots,
            notes=notes,
        )

    def _doubt(self, count: int) -> list[str]:
        """What a band of few episodes means, and joints whose baseline is better."""
        text = (
            f"the band comes from {count} episodes left out: it is no 95 % band. Their greatest"
            f" errors hold those of a further episode with {100 * count / (count + 1):.0f} %, n/(n"
            f" + 1), and {ENOUGH} episodes are needed; record more, or leave out a greater share"
        )
        worse = [
            f"joint {j}: {name} predicts better than the model, which is of no use there"
            for j, (name, skill) in enumerate(zip(self.best_baseline, self.skill, strict=True), 1)
            if skill < 0.0
        ]
        return [*([text] if count < ENOUGH else []), *worse]

    def _error_table(self) -> Table:
        predictions = {
            **self.by_baseline,
            "model": self.errors,
            "model, from commands": self.commanded,
        }
        if self.gain is not None:
            predictions |= {"physics alone": self.gain.physics, "hybrid law": self.gain.hybrid}
        rows = {name: rms(errors) for name, errors in predictions.items() if errors is not None}
        columns: dict[str, Any] = {"prediction by": list(rows)}
        for j in range(self.errors.shape[2]):
            columns[f"joint {j + 1}"] = TableColumn(
                [values[j] for values in rows.values()], "rad", "deg", 3
            )
        return Table(
            "joint-errors", "Root mean square error of the free run", columns, brief=len(rows)
        )

    def _joint_table(self) -> Table:
        known = 1.0 if len(np.unique(self.episode)) >= ENOUGH else np.nan
        columns: dict[str, Any] = {
            "joint": list(range(1, len(self.pairs) + 1)),
            "raised by muscle": [raising for raising, _ in self.pairs],
            "lowered by muscle": [lowering for _, lowering in self.pairs],
            "skill": TableColumn(self.skill, digits=3),
            "best baseline": TableColumn(list(self.best_baseline), brief=False),
            "95 % band at the horizon ±": TableColumn(self.band[-1], "rad", "deg", 3),
            "share inside the band": TableColumn(
                known * self.coverage, "1", "%", 3, short="inside"
            ),
        }
        return Table("joints", "Joints", columns, brief=len(self.pairs))

    def _horizon_figure(self) -> Any:
        """Error of every joint against the horizon, one panel each."""
        figure, panels = plotting.new_figure(1, self.errors.shape[2], squeeze=False)
        for j, axes in enumerate(panels[0]):
            for i, (name, errors) in enumerate([("model", self.errors), *self.by_baseline.items()]):
                axes.plot(
                    self.horizon,
                    np.degrees(rms(errors, axis=(0,))[:, j]),
                    color=plotting.LINES[i],
                    label=name,
                )
            band = np.degrees(self.band[:, j])
            axes.fill_between(
                self.horizon, 0.0, band, color=plotting.LINES[0], alpha=0.15, linewidth=0
            )
            axes.set(
                title=f"joint {j + 1}", xlabel="horizon [s]", ylabel="error [deg]" if j == 0 else ""
            )
        lines, names = panels[0][0].get_legend_handles_labels()
        figure.legend(lines, names, loc="outside upper center", ncols=len(names))
        return figure
