"""Report chapter of the friction of several runs: joint fits, agreement of the runs, and dependence on pressure."""

from __future__ import annotations

from collections.abc import Sequence

from ....core import leaves
from ....report.chapter import Chapter, Plot, Table
from ....report.formatting import P_VALUE
from . import JointFit, preferred_fit


def joint_friction_chapter(fits: Sequence[JointFit], not_joined: Sequence[str] = ()) -> Chapter:
    """Return the chapter of the joint fits of all laws, lowest AICc first; the best justified one is shown.

    `not_joined` are sentences on the loops that the joint fit does not use.
    """
    shown = preferred_fit(fits) or fits[0]
    summary = [shown.verdict]
    if not shown.justified:
        summary.insert(
            0,
            "The runs justify no friction law that holds for all of them, so none is written. "
            f"{shown.name} is shown as the best one.",
        )
    summary += not_joined
    return Chapter(
        paper="joint-friction",
        title="Friction of all runs",
        summary="\n\n".join(summary),
        tables=(_law_table(fits), _run_table(shown), _parameter_table(shown)),
        plots=(
            Plot(
                "joint-friction",
                f"Friction over pressure, {shown.name}: half the range of the friction force of each run, and joint "
                "fit.",
                shown.plot(),
            ),
        ),
        references=(*shown.friction.references, *(() if shown.law is shown.friction else shown.law.references)),
    )


def _law_table(fits: Sequence[JointFit]) -> Table:
    return Table(
        "joint-laws",
        "Friction laws fitted to all runs together, best first",
        {
            "law": [fit.name for fit in fits],
            "depends on pressure": ["no" if fit.law is fit.friction else "yes" for fit in fits],
            "rms error without friction [N]": [fit.rmse_without_friction for fit in fits],
            "rms error [N]": [fit.rmse for fit in fits],
            "reduction of AICc": [fit.aicc_reduction for fit in fits],
            P_VALUE: [fit.p_value for fit in fits],
            "runs that disagree": [sum(run.disagrees for run in fit.agreement) for fit in fits],
            "justified": ["yes" if fit.justified else "no" for fit in fits],
        },
    )


def _run_table(fit: JointFit) -> Table:
    """Return the friction of each run, from the run alone and from all runs."""
    runs = fit.agreement
    return Table(
        "joint-runs",
        f"Friction of each run, {fit.name}: half the range of the force",
        {
            "run": [run.origin for run in runs],
            "level": [run.description for run in runs],
            "from this run [N]": [run.amplitude for run in runs],
            "standard error [N]": [run.amplitude_stderr for run in runs],
            "from all runs [N]": [run.joint_amplitude for run in runs],
            "rms deviation [%]": [100.0 * run.deviation for run in runs],
            P_VALUE: [run.p_value for run in runs],
            "agrees": ["no" if run.disagrees else "yes" for run in runs],
        },
    )


def _parameter_table(fit: JointFit) -> Table:
    parameters = list(leaves(fit.friction))
    return Table(
        "joint-parameters",
        f"Parameters of {fit.name} from all runs",
        {
            "parameter": [leaf.path for leaf in parameters],
            "symbol": [leaf.declared.symbol for leaf in parameters],
            "value (SI)": [leaf.value for leaf in parameters],
            "unit": ["" if leaf.declared.unit == "1" else leaf.declared.unit for leaf in parameters],
            "meaning": [leaf.declared.meaning for leaf in parameters],
        },
    )
