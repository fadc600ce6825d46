"""`airmuscle fit-joint`: a joint or an arm identified from episodes of its pressures and angles."""

import dataclasses
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ...bench.joint import ArmFit, fit_joint, inspect_episodes, read_episode_mapping, read_episodes
from ...control.laws import PID, Cascade, CoContraction, Decentralised
from ...core.atomic_output import check_writable
from ...files.library.write import model_table, scenario_toml
from ...files.scenario.plant_uncertainty import uncertainty_table
from ..requests.declaration import option, request
from .delivery import deliver
from .options import Folder, Json
from .request_options import with_requests
from .terminal import echo

DURATION, STEP = 2.0, 0.15
"""Duration [s] of the scenarios, and step of the controlled one relative to the range of the angle (chosen)."""


@request
class JointFitRequest:
    """What the identification of a joint is asked for."""

    mapping: Path = option("Mapping file (TOML): which column is what.")
    inspect: bool = option("State what the record contains; fit nothing.", default=False)
    left_out: float = option("Share of the episodes that judges the fit.", default=0.1, metavar="SHARE")
    horizon: int = option("Rows of the free run.", default=40, bounds=(5, 1000), metavar="ROWS")
    seed: int = option("Seed of the order of the windows.", default=0)


@with_requests
def fit_joint_command(
    source: Annotated[Path, typer.Argument(metavar="EPISODES", help="A folder of episodes, or one file with all.")],
    request: JointFitRequest,
    out: Folder = Path("joint"),
    json: Json = False,
) -> None:
    """Identify a joint or an arm from its episodes.

    \b
    Episodes are short records with angles of the joints and pressures of their muscles: CSV, NPZ, JSON, HDF5 or
    Parquet, one file each or one for all. The mapping file says which column is what, in which unit, and may state
    the muscles of each joint and the axes of the joints. The free run is judged on the last episodes, beside
    persistence and a linear ARX model. Writes DIR/report.html, DIR/scenario.toml, the arm with a pressure
    regulator for each muscle, and DIR/controlled.toml, the same with a controller of each angle to be tuned.

    \b
    Examples:
      airmuscle fit-joint episodes/ --mapping arm.toml --inspect
      airmuscle fit-joint episodes.npz --mapping arm.toml --out arm
    """
    check_writable(out)
    rules = read_episode_mapping(request.mapping)
    episodes = read_episodes(source, rules)
    if request.inspect:
        echo(str(inspect_episodes(episodes, rules.pairs)))
        return
    fit = fit_joint(
        episodes, pairs=rules.pairs, axes=rules.axes, left_out=request.left_out, rows=request.horizon,
        seed=request.seed, progress=lambda text: None if json else echo(text),
    )  # fmt: skip
    title = f"Arm identified from {source.name}"
    chapter = dataclasses.replace(fit.chapter(), title=title)
    deliver("fit-joint", [chapter], json=json, out=out, title="Identified arm", files=_scenarios(fit, title))


def _scenarios(fit: ArmFit, title: str) -> dict[str, str]:
    """The arm with a pressure regulator for each muscle: at constant set points, and with a PID controller of
    each angle to be tuned, which commands half the difference of the pressures of its pair."""
    names = [muscle.name for muscle in fit.arm.muscle]
    middle = np.median(fit.inspection.episodes.rows("pressure"), axis=0)
    levels = [max(float(middle[muscle - 1]), 0.0) for pair in fit.pairs for muscle in pair]
    held = {f"{name}.setpoint": [[0.0, level]] for name, level in zip(names, levels, strict=True)}
    run = {"duration": DURATION, "initial_state": {"pressure": float(np.mean(levels))}}
    ranges = np.ptp(np.quantile(fit.inspection.episodes.rows("angle"), (0.01, 0.99), axis=0), axis=0).tolist()
    laws, wanted = [], {}
    for j, (c, range_) in enumerate(zip(fit.arm.mechanism.coordinates, ranges, strict=True)):
        mean = float(np.mean(levels[2 * j : 2 * j + 2]))
        pair = CoContraction((f"{names[2 * j]}.setpoint", f"{names[2 * j + 1]}.setpoint"), mean)
        laws.append(Cascade(PID(c.name, "difference", mean / range_, 0.5), pair, (-mean,), (mean,)))
        wanted[c.name] = [[0.0, 0.0], [0.1, STEP * range_]]
    controller = {**model_table(Decentralised(tuple(laws))), "sample_time": 0.01, "setpoint": wanted}
    note = "supply, orifices and volumes are chosen"
    tuned = f"{note}, and so are the gains: airmuscle tune finds better ones"
    return {
        "scenario.toml": scenario_toml(
            title, fit.plant(), held, run, note, {"uncertainty": uncertainty_table(fit.uncertainty())}
        ),
        "controlled.toml": scenario_toml(f"{title}, controlled", fit.plant(), {"controller": controller}, run, tuned),
    }
