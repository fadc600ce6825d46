"""Report chapter: the free run of an identified arm beside its baselines, its band, and its parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core import plotting
from ...report import Chapter, Plot, Table
from .free_run import rms
from .result import ArmFit


def joint_chapter(fit: ArmFit, title: str) -> Chapter:
    """Return the chapter of an arm that `fit_joint` has identified."""
    skill = ", ".join(f"joint {j}: {value:.2f}" for j, value in enumerate(fit.skill, start=1))
    remarks = "".join(f"\n\nRemark: {each}." for each in fit.remarks)
    summary = (
        f"Angles are predicted from the state at the start of a window and from the pressures alone, over "
        f"{fit.horizon[-1]:.3g} s, on {len(np.unique(fit.episode))} episodes left out. Skill, 1 - error/error of "
        f"the best baseline: {skill}.{remarks}"
    )
    caption = (
        "Root mean square error against the horizon: the model, its baselines, and the 95 % band of the model "
        "(shaded), which is the 95th percentile of the errors at each row."
    )
    return Chapter(
        paper="joint", title=title, summary=summary, tables=(_errors(fit), _parameters(fit)),
        plots=(Plot("horizon", caption, horizon_figure(fit)),),
    )  # fmt: skip


def horizon_figure(fit: ArmFit) -> Any:
    """Error of every joint against the horizon, one panel each."""
    count = fit.errors.shape[2]
    figure, panels = plotting.new_figure(1, count, squeeze=False)
    for j, axes in enumerate(panels[0]):
        for i, (name, errors) in enumerate([("model", fit.errors), *fit.by_baseline.items()]):
            axes.plot(fit.horizon, np.degrees(rms(errors, axis=(0,))[:, j]), color=plotting.LINES[i], label=name)
        axes.fill_between(
            fit.horizon, 0.0, np.degrees(fit.band[:, j]), color=plotting.LINES[0], alpha=0.15, linewidth=0
        )
        axes.set(title=f"joint {j + 1}", xlabel="horizon [s]", ylabel="error [deg]" if j == 0 else "")
    panels[0][0].legend()
    return figure


def _errors(fit: ArmFit) -> Table:
    rows = fit.table()
    columns: dict[str, list[Any]] = {"": [name for name, _ in rows]}
    columns |= {f"joint {j + 1}": [values[j] for _, values in rows] for j in range(fit.errors.shape[2])}
    return Table("joint-errors", "Error of the free run [deg], and skill", columns)


def _parameters(fit: ArmFit) -> Table:
    columns: dict[str, list[Any]] = {
        "parameter": [e.path for e in fit.estimates],
        "value [SI]": [e.value for e in fit.estimates],
        "standard error [SI]": [e.standard_error for e in fit.estimates],
    }
    return Table("joint-parameters", "Identified parameters", columns)
