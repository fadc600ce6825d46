"""Request of the identification of an arm from episodes, and its computation: the chapter and the
scenarios.
"""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...bench.joint import (
    ArmFit,
    ArmPrediction,
    EpisodeMapping,
    fit_joint,
    fit_known_joint,
    identified_arm,
    predict_episodes,
    read_episode_mapping,
    read_episodes,
)
from ...bench.joint.episode_formats import propose_mapping
from ...bench.joint.episode_inspection import EpisodeInspection, inspect_episodes
from ...bench.joint.episodes import join
from ...control.laws import PID, Cascade, CoContraction, Decentralised
from ...core import ColumnError
from ...engine.processes import Workers
from ...files.library import list_plants
from ...files.library.write import entry_of, model_table, scenario_toml, to_toml
from ...files.scenario import EPISODES, arm_record, load_arm, load_scenario
from ...files.scenario.plant_uncertainty import uncertainty_table
from ...physics import PressureDriven
from ...report.chapter import Chapter
from .declaration import RequestError, Where, many, option, optional, request

FIRST_LAG = 0.02
"""Lag [s] of the pressures from which the search of a known joint starts (chosen)."""
DURATION = 2.0
STEP = 0.15
"""Duration [s] of the scenarios, and step of the controlled one relative to the range of the angle
(chosen).
"""


@request
class JointFitRequest:
    """What the identification of a joint is asked for."""

    mapping: Path | None = optional(
        "Mapping file (TOML): which column is what. Without it one is proposed, and nothing is"
        " fitted."
    )
    inspect: bool = option("State what the record contains; fit nothing.", default=False)
    left_out: float | None = optional(
        "Share of the episodes, the last ones, that judges the fit; default: a tenth, or 19"
        " episodes if that is more, but a third at most.",
        metavar="SHARE",
        bounds=(0.01, 0.9),
        label="Share of the episodes that judges the fit",
        hint="empty: at least 19 of them, a third at most",
        example="0.1",
    )
    horizon: int = option(
        "Rows of the free run.",
        default=40,
        bounds=(5, 1000),
        metavar="ROWS",
        label="Rows of the free run",
        example="40",
        filled="40",
    )
    residual: bool = option(
        "Fit a hybrid law to what physics leaves, used for joints that gain by it on episodes held"
        " back.",
        default=False,
        label="A hybrid law for what physics leaves (takes longer)",
    )
    seed: int = option("Seed of the order of the windows.", default=0)
    known: str | None = optional(
        "A joint of known muscles and geometry, a scenario or a plant of the library: the numbers"
        " of --free are estimated.",
        metavar="SCENARIO",
        complete=lambda incomplete: [name for name in list_plants() if name.startswith(incomplete)],
        label="Joint of known muscles and geometry",
        hint="a plant of the library, or the text of a scenario",
        example="joint-dmsp-20-matrix",
    )
    free: tuple[str, ...] = many(
        "With --known: path of a parameter that is estimated, zeros, gains or lags. Repeatable; by"
        " default inertia, damping, offset, weight and friction of the mechanism, lags and zeros.",
        metavar="PATH",
        label="Parameters of a known joint that are estimated",
        hint="empty: mechanism, lags and zeros",
        example="mechanism.inertia, zeros",
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for paths without a known joint, and for a residual of one."""
        if self.known is None and self.free:
            raise RequestError(
                f"{where('free')} requires {where('known')}, the scenario of the joint.", "free"
            )
        if self.known is not None and self.residual:
            raise RequestError(
                f"{where('residual')} and {where('known')} exclude each other.", "residual"
            )


def inspect_requested(source: Path, request: JointFitRequest) -> EpisodeInspection:
    """What the record contains. Raises RequestError without a mapping file, with a proposal."""
    rules = _mapping(source, request)
    return inspect_episodes(read_episodes(source, rules), rules.pairs, request.horizon)


def _mapping(source: Path, request: JointFitRequest) -> EpisodeMapping:
    if request.mapping is None:
        raise RequestError(
            "a mapping file is needed, which states what the columns are. Proposal for"
            f" {source.name}, to be corrected and given as --mapping"
            f" arm.toml:\n\n{propose_mapping(source)}",
            "mapping",
        )
    return read_episode_mapping(request.mapping)


def fit_requested_arm(
    source: Path,
    request: JointFitRequest,
    progress: Callable[[str], None],
    workers: Workers = 1,
) -> tuple[Chapter, dict[str, str]]:
    """The chapter of the fit, and scenarios and muscles by file. Raises RequestError without a
    mapping file.
    """
    rules = _mapping(source, request)
    title = f"Arm identified from {source.name}"
    episodes = read_episodes(source, rules)
    common: dict[str, Any] = {
        "pairs": rules.pairs,
        "left_out": request.left_out,
        "rows": request.horizon,
        "progress": progress,
    }
    if request.known is None:
        fit = fit_joint(
            episodes,
            axes=rules.axes,
            residual=request.residual,
            seed=request.seed,
            workers=workers,
            **common,
        )
        names = [muscle.name for muscle in fit.arm.muscle]
        note = "supply, orifices and volumes are chosen"
        warning = SCALED
    else:
        plant = load_scenario(request.known).plant
        arm = PressureDriven(plant.muscles, plant.mechanism, (FIRST_LAG,) * len(plant.muscles))
        fit = fit_known_joint(arm, episodes, request.free, **common)
        names = [fit.arm.muscle[number - 1].name for pair in fit.pairs for number in pair]
        note = IN_PLACE
        warning = ""
    muscles = {
        f"muscles/{muscle.name}.toml": to_toml(
            dataclasses.replace(
                entry_of(muscle),
                title=f"{muscle.name}: {title}",
                provenance="fitted",
                warning=warning,
            )
        )
        for number, muscle in enumerate(fit.arm.muscle)
        if any(
            estimate.path.startswith(f"muscle[{number}].") for estimate in fit.estimates
        )  # identified parameters
    }
    return (
        dataclasses.replace(fit.chapter(), title=title),
        _scenarios(fit, rules, names, title, note) | muscles,
    )


def predict_later(
    arm_path: Path, sources: Sequence[Path], mapping: Path | None, horizon: int | None
) -> ArmPrediction:
    """The prediction of later episodes by the arm of a scenario; they are read as its record was,
    or by a mapping file. Raises RequestError where neither says how.
    """
    arm = load_arm(arm_path)
    rules = arm.mapping if mapping is None else read_episode_mapping(mapping)
    if rules is None:
        raise RequestError(
            f"{arm_path}: does not state how its record was read; give --mapping arm.toml, the"
            " mapping file of fit-joint."
        )
    try:
        parts = [read_episodes(source, rules) for source in sources]
    except ColumnError as error:
        if mapping is not None:
            raise
        raise ColumnError(
            f"{error} Columns are looked for as in the record of the fit; a mapping file"
            " (--mapping) may name others."
        ) from None
    return predict_episodes(arm, join(parts), horizon)


IN_PLACE = (
    "supply and orifices are chosen; pressure regulators stand in place of the circuits of the"
    " known joint"
)
SCALED = "the scale of its forces is chosen: the record contains pressures and angles alone"


def _scenarios(
    fit: ArmFit, mapping: EpisodeMapping, names: Sequence[str], title: str, note: str
) -> dict[str, str]:
    """The arm at constant set points, and with a PID controller of each angle to be tuned, both
    with their record; `names` as in the pairs.
    """
    episodes = fit.inspection.episodes
    middle = np.median(episodes.rows("pressure"), axis=0)
    levels = [max(float(middle[muscle - 1]), 0.0) for pair in fit.pairs for muscle in pair]
    schedule = {
        f"{name}.setpoint": [[0.0, level]] for name, level in zip(names, levels, strict=True)
    }
    run = {"duration": DURATION, "initial_state": {"pressure": float(np.mean(levels))}}
    # without the extreme hundredths of the angles, which may be outliers
    limits = np.quantile(episodes.rows("angle"), (0.01, 0.99), axis=0)
    ranges = np.ptp(limits, axis=0).tolist()
    laws = []
    wanted = {}
    for j, (c, range_) in enumerate(zip(fit.arm.mechanism.coordinates, ranges, strict=True)):
        mean = float(np.mean(levels[2 * j : 2 * j + 2]))
        setpoints = (f"{names[2 * j]}.setpoint", f"{names[2 * j + 1]}.setpoint")
        pair = CoContraction(setpoints, mean)
        pid = PID(c.name, "difference", mean / range_, 0.5)
        laws.append(Cascade(pid, pair, (-mean,), (mean,)))
        wanted[c.name] = [[0.0, 0.0], [0.1, STEP * range_]]
    law = laws[0] if len(laws) == 1 else Decentralised(tuple(laws))
    controller = {**model_table(law), "sample_time": 0.01, "setpoint": wanted}
    tuned = f"{note}, and so are the gains: airmuscle tune finds better ones"
    fitted = {
        "uncertainty": uncertainty_table(fit.uncertainty()),
        EPISODES: arm_record(identified_arm(fit, mapping)),
    }
    return {
        "scenario.toml": scenario_toml(title, fit.plant(), schedule, run, note, fitted),
        "controlled.toml": scenario_toml(
            f"{title}, controlled", fit.plant(), {"controller": controller}, run, tuned, fitted
        ),
    }
