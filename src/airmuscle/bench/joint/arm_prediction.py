"""ArmPrediction: later episodes predicted by an identified arm in free run, beside persistence and
the band of its fit.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Array, counted, plotting
from ...report import Chapter, NamedValue, Plot, Table, TableColumn
from ..prediction import PERSISTENCE
from ..reported import Reported
from .episodes import ENOUGH, HISTORY, Episodes, Windows, cut, long_enough, rms
from .free_run import from_commands, run_errors
from .identified import IdentifiedArm
from .later_episodes import UnfitEpisode, check_same_arm, remarks_on, unfit_episodes

LONGEST = 80
"""Rows up to which errors are stated against the horizon."""
STATED = (1, 2, 5, 10, 20, 40, 80)
"""Rows whose errors the brief view states."""
HOLDS = 0.8
"""Share of errors inside a 95 % band below which it does not hold (chosen)."""
NAMED = 10
"""Number of episodes that the brief view names (chosen)."""
COMMANDED = "from commands"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ArmPrediction(Reported):
    """Later episodes predicted by an identified arm; N windows of `rows` rows; `print` it.

    arm        that predicts
    episodes   that are long enough for a window
    windows    their windows, with the measured angles
    predicted  (N, rows, J) [rad] angles of the free run from the state at the start of a window and
               the pressures until its end
    further    (n, R, J) [rad] errors of the free run over R rows, up to 80, of the windows that
               hold them
    persisting (n, R, J) [rad] errors of persistence in the same windows
    commanded  (N, rows, J) [rad] errors of the free run from commands, or None
    unfit      episodes that do not fit
    remarks    what differs from the record of the fit, and what was left out
    """

    arm: IdentifiedArm
    episodes: Episodes
    windows: Windows
    predicted: Array
    further: Array
    persisting: Array
    commanded: Array | None
    unfit: tuple[UnfitEpisode, ...]
    remarks: tuple[str, ...]

    @property
    def measured(self) -> Array:
        """Measured angles (N, rows, J) [rad]."""
        return self.windows.angle[:, HISTORY + 1 :]

    @property
    def errors(self) -> Array:
        """Predicted minus measured angles (N, rows, J) [rad]."""
        return self.predicted - self.measured

    @property
    def rms(self) -> Array:
        """Root mean square error (J,) [rad] over all windows and rows."""
        return rms(self.errors)

    @property
    def persistence(self) -> Array:
        """Root mean square error (J,) [rad] of the angle at the start of a window."""
        return rms(self.measured - self.windows.angle[:, HISTORY : HISTORY + 1])

    @property
    def skill(self) -> Array:
        """1 - error/error of persistence (J,)."""
        return np.asarray(1.0 - self.rms / self.persistence)

    @property
    def half_width(self) -> Array:
        """Half-width (rows, J) [rad] of the band of the fit; NaN beyond its horizon."""
        rows = self.predicted.shape[1]
        stated = self.arm.band[:rows]
        return np.concatenate([stated, np.full((rows - len(stated), self.arm.joints), np.nan)])

    @property
    def coverage(self) -> Array:
        """Share (J,) of the errors inside the band of the fit, up to its horizon."""
        known = self.errors[:, : len(self.arm.band)]
        inside = np.abs(known) <= self.half_width[: known.shape[1]]
        return np.asarray(np.mean(inside, axis=(0, 1)))

    @property
    def horizon(self) -> Array:
        """Times [s] after the start of a window at which `further` stands."""
        return self.episodes.sample_time * np.arange(1, self.further.shape[1] + 1)

    def chapter(self) -> Chapter:
        """The description: errors, skill and band, then errors against the horizon, episodes that
        do not fit, and the angles.
        """
        rows = self.predicted.shape[1]
        degrees = ", ".join(f"{value:.3g}" for value in np.degrees(self.rms))
        inside = ", ".join(f"{100 * value:.3g}" for value in self.coverage)
        count = len(self.episodes)
        result = (
            f"Free run over {rows * self.episodes.sample_time:.3g} s on"
            f" {counted(count, 'later episode')}: {degrees} deg rms in"
            f" {_joints(self.arm.joints)}; {inside} % of the errors are inside the 95 % band of the"
            f" fit. {len(self.unfit)} of {count} episodes do not fit."
        )
        basis = (
            f"Each of {counted(len(self.windows), 'window')} begins with the measured angles and"
            " speeds; after that the arm sees the pressures alone. Skill is 1 - error/error of"
            f" {PERSISTENCE}."
        )
        return Chapter(
            "arm-prediction",
            "Prediction of later episodes",
            (result, basis),
            values=(
                NamedValue("windows", len(self.windows), brief=False),
                NamedValue("delay in rows", self.arm.delay, brief=False),
            ),
            tables=(
                self._joint_table(),
                self._horizon_table(STATED),
                self._horizon_table(range(1, LONGEST + 1)),
                self._unfit_table(),
                self._angle_table(),
            ),
            plots=(
                Plot("arm-horizon", "Root mean square error against the horizon.", self._figure),
            ),
            notes=(*self._doubts(), *self.episodes.notes, *self.remarks),
        )

    def _doubts(self) -> list[str]:
        """Joints whose band does not hold or whose model is worse than persistence."""
        texts = []
        if self.arm.judged < ENOUGH:
            texts.append(
                f"the band of the fit comes from {self.arm.judged} episodes, {ENOUGH} are needed:"
                " it is no 95 % band"
            )
        for joint, (share, skill, error, fitted) in enumerate(
            zip(self.coverage, self.skill, self.rms, self.arm.deviation, strict=True), start=1
        ):
            if skill < 0.0:
                texts.append(
                    f"joint {joint}: {PERSISTENCE} predicts better than the arm, which is of no use"
                    " there"
                )
            elif share < HOLDS:
                texts.append(
                    f"joint {joint}: the band of the fit does not hold, {100 * share:.3g} % of the"
                    f" errors are inside it and the error is {error / fitted:.3g} times that of the"
                    " fit: the arm has changed, or is loaded in another way; fit it anew with"
                    " these episodes"
                )
        return texts

    def _joint_table(self) -> Table:
        columns: dict[str, Any] = {
            "joint": list(range(1, self.arm.joints + 1)),
            "rms error": TableColumn(self.rms, "rad", "deg", 3),
            "in the fit": TableColumn(self.arm.deviation, "rad", "deg", 3),
            PERSISTENCE: TableColumn(self.persistence, "rad", "deg", 3),
            "skill": TableColumn(self.skill, digits=3),
            "share inside the band": TableColumn(self.coverage, "1", "%", 3, short="inside"),
        }
        if self.commanded is not None:
            columns[COMMANDED] = TableColumn(rms(self.commanded), "rad", "deg", 3)
        return Table(
            "arm-errors", "Errors of the free run by joint", columns, brief=self.arm.joints
        )

    def _horizon_table(self, rows: Sequence[int]) -> Table:
        """Errors after these rows, from 1, of the arm and of persistence; every row is a table of
        its own.
        """
        places = [row - 1 for row in rows if row <= self.further.shape[1]]
        is_whole = len(places) > len(STATED)
        errors = rms(self.further, axis=(0,))[places]
        persisting = rms(self.persisting, axis=(0,))[places]
        columns: dict[str, Any] = {
            "rows": [place + 1 for place in places],
            "horizon": TableColumn(self.horizon[places], "s", digits=3),
        }
        for joint in range(self.arm.joints):
            columns[f"joint {joint + 1}"] = TableColumn(errors[:, joint], "rad", "deg", 3)
            columns[f"joint {joint + 1}, {PERSISTENCE}"] = TableColumn(
                persisting[:, joint], "rad", "deg", 3, brief=False
            )
        return Table(
            "arm-every-horizon" if is_whole else "arm-horizon",
            "Root mean square error against the horizon",
            columns,
            note=f"{len(self.further)} windows hold {self.further.shape[1]} rows.",
            shown=not is_whole,
            brief=0 if is_whole else len(places),
        )

    def _unfit_table(self) -> Table:
        columns: dict[str, Any] = {
            "episode": [episode.name for episode in self.unfit],
            "joint": [episode.joint for episode in self.unfit],
            "rms error": TableColumn([episode.error for episode in self.unfit], "rad", "deg", 3),
            "likely cause": [episode.cause for episode in self.unfit],
        }
        return Table(
            "arm-unfit",
            "Episodes that do not fit",
            columns,
            note=(
                "Their rms error in a joint exceeds what 95 % of the errors of the fit stay below"
                " at the end of a free run."
            ),
            shown=bool(self.unfit),
            brief=min(NAMED, len(self.unfit)),
        )

    def _angle_table(self) -> Table:
        """Measured and predicted angles of every row of every window."""
        count, rows, joints = self.predicted.shape
        numbers = np.repeat(self.windows.episode, rows).astype(int).tolist()
        ahead = np.tile(np.arange(1, rows + 1), count)
        row = np.repeat(self.windows.first, rows) + ahead
        columns: dict[str, Any] = {
            "episode": [self.episodes.runs[number].name for number in numbers],
            "row": row.tolist(),
            "time": TableColumn(row * self.episodes.sample_time, "s"),
            "horizon": TableColumn(ahead * self.episodes.sample_time, "s"),
        }
        band = np.tile(self.half_width, (count, 1))
        for joint in range(joints):
            name = f"joint {joint + 1}"
            parts = {
                "measured": self.measured[..., joint].ravel(),
                "predicted": self.predicted[..., joint].ravel(),
                "half width": band[:, joint],
            }
            for part, values in parts.items():
                columns[f"{name} {part}"] = TableColumn(values, "rad", "deg", 6)
        return Table("angles", "Measured and predicted angles", columns, series=True)

    def _figure(self) -> Any:
        """Error of every joint against the horizon, one panel each."""
        figure, panels = plotting.new_figure(1, self.arm.joints, squeeze=False)
        curves = {
            "arm": rms(self.further, axis=(0,)),
            PERSISTENCE: rms(self.persisting, axis=(0,)),
        }
        for joint, axes in enumerate(panels[0]):
            for color, (name, errors) in zip(plotting.LINES, curves.items(), strict=False):
                axes.plot(self.horizon, np.degrees(errors[:, joint]), color=color, label=name)
            known = min(len(self.arm.band), len(self.horizon))
            band = np.degrees(self.arm.band[:known, joint])
            axes.fill_between(
                self.horizon[:known],
                0.0,
                band,
                color=plotting.LINES[0],
                alpha=0.15,
                linewidth=0,
                label="95 % band of the fit",
            )
            label = "error [deg]" if joint == 0 else ""
            axes.set(title=f"joint {joint + 1}", xlabel="horizon [s]", ylabel=label)
        lines, names = panels[0][0].get_legend_handles_labels()
        figure.legend(lines, names, loc="outside upper center", ncols=len(names))
        return figure


def _joints(count: int) -> str:
    return "joint 1" if count == 1 else f"joints 1 to {count}"


def predict_episodes(
    arm: IdentifiedArm, episodes: Episodes, rows: int | None = None
) -> ArmPrediction:
    """Predict later episodes by an identified arm, in free run over windows of `rows` rows, by
    default those of its band.

    A window begins at rows 10, 50, 90, ... of each episode while its rows follow. Nothing is
    fitted. Raises IdentificationError for episodes of another arm, with another sample time or
    scale, or that are all too short.
    """
    check_same_arm(arm, episodes)
    rows = len(arm.band) if rows is None else rows
    judged, short = long_enough(episodes, rows)
    acting = arm.acting(judged)
    windows = cut(acting, arm.delay, rows)
    errors = run_errors(arm.arm, windows)
    predicted = errors + windows.angle[:, HISTORY + 1 :]
    further = _further(arm, acting, rows)
    commanded = None
    unlike: list[str] = []
    if arm.regulators and all(run.command is not None for run in acting.runs):
        driven, unlike = from_commands(arm.regulators, acting, arm.delay, rows, arm.pairs)
        commanded = run_errors(arm.arm, driven)
    return ArmPrediction(
        arm,
        judged,
        windows,
        predicted,
        run_errors(arm.arm, further),
        further.angle[:, HISTORY : HISTORY + 1] - further.angle[:, HISTORY + 1 :],
        commanded,
        unfit_episodes(arm, judged, windows, predicted),
        (*short, *remarks_on(arm, judged), *unlike),
    )


def _further(arm: IdentifiedArm, episodes: Episodes, rows: int) -> Windows:
    """The windows of the longest horizon, of LONGEST rows where an episode holds them."""
    before = HISTORY + 2
    longest = max(len(run) for run in episodes.runs)
    further = min(max(rows, LONGEST), longest - before)
    needed = before + further
    long_runs = tuple(run for run in episodes.runs if len(run) >= needed)
    part = dataclasses.replace(episodes, runs=long_runs)
    return cut(part, arm.delay, further)
