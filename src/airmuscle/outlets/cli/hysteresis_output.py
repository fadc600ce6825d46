"""Output of `airmuscle hysteresis`: text and JSON."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from ...bench.identify.campaign import HeldCreep
from ...bench.identify.hysteresis import HysteresisFit, JointFit, LoopFit, preferred_fit
from ...bench.identify.hysteresis.hysteresis_chapter import describe_row_counts
from ...core import leaves
from .terminal import echo, print_table

MAX_TABLES = 2
"""Maximum number of loops with a table of all laws; of more loops there is one line each (chosen)."""


def print_loops(fits: Sequence[LoopFit]) -> None:
    """Print the friction laws of each loop, or of many loops the best law of each; the report contains all."""
    if len(fits) > MAX_TABLES:
        _print_many(fits)
        return
    for fit in fits:
        echo(f"{fit.loop.recording.origin}: {fit.loop.description}. {describe_row_counts(fit.loop)}")
        rows = [
            (type(f.friction).__name__, f"{f.rmse_without_friction:.3g} to {f.rmse:.3g} N", _second_run_errors(f),
             f"{0.0 - f.aicc_reduction:.4g}", _p_value(f.p_value), "yes" if f.justified else "no")
            for f in fit.fits
        ]  # fmt: skip
        headers = ("model", "rms error", "on second run", "difference in AICc", "p-value (F test)", "justified")
        print_table(headers, rows, right=headers[3:5])
        best = fit.recommended
        echo(str(best) if best is not None else "The data justify no friction model for this loop.")
        if best is not None and not fit.usable_in_plant:
            echo("note: friction driven by pressure describes isometric loops only; a plant cannot use it.")
        for name, reason in fit.failed.items():
            echo(f"note: {name} was not fitted: {reason}")
        echo()


def _print_many(fits: Sequence[LoopFit]) -> None:
    rows = []
    for fit in fits:
        best = fit.recommended or min(fit.fits, key=lambda each: -each.aicc_reduction)
        errors = f"{best.rmse_without_friction:.3g} to {best.rmse:.3g} N"
        place = (fit.loop.recording.origin, fit.loop.description, str(int(fit.loop.fitted_rows.sum())))
        rows.append((*place, type(best.friction).__name__, errors, "yes" if fit.recommended else "no"))
    print_table(("run", "kind", "rows", "best law", "rms error", "justified"), rows, right=("rows",))
    reasons: dict[str, list[str]] = {}
    for fit in fits:
        for name, reason in fit.failed.items():
            reasons.setdefault(f"{name} was not fitted to {{}}: {reason}", []).append(fit.loop.recording.origin)
    for text, origins in reasons.items():
        echo(f"note: {text.format(origins[0] if len(origins) == 1 else f'{len(origins)} runs')}")
    echo()


def print_creep(creep: HeldCreep | None) -> None:
    """Print the creep of each recording and the elements of the muscle."""
    if creep is None:
        return
    for text in creep.sentences:
        echo(f"creep: {text}")
    echo(f"creep of the muscle: {creep.verdict}")


def print_joint(joint: Sequence[JointFit], not_joined: Sequence[str]) -> None:
    """Print the friction laws of all runs together."""
    if not joint:
        return
    echo("All runs together, each with its own static curve:")
    rows = [
        (fit.name, "no" if fit.law is fit.friction else "yes", f"{fit.rmse_without_friction:.3g} to {fit.rmse:.3g} N",
         f"{0.0 - fit.aicc_reduction:.4g}", str(sum(run.disagrees for run in fit.agreement)),
         "yes" if fit.justified else "no")
        for fit in joint
    ]  # fmt: skip
    headers = ("model", "depends on pressure", "rms error", "difference in AICc", "runs that disagree", "justified")
    print_table(headers, rows, right=headers[3:5])
    best = preferred_fit(joint) or joint[0]
    shown = [run for run in best.agreement if run.disagrees or len(best.agreement) <= MAX_TABLES]
    for sentence in (*map(str, shown), *not_joined, str(best)):
        echo(sentence)
    echo()


def _p_value(probability: float) -> str:
    return "< 0.001" if probability < 0.001 else f"{probability:.2g}"


def _second_run_errors(fit: HysteresisFit) -> str:
    """The rms errors on the second run, without and with friction; empty without a second run."""
    return (
        f"{fit.repeat_rmse_without_friction:.3g} to {fit.repeat_rmse:.3g} N" if math.isfinite(fit.repeat_rmse) else ""
    )


def loop_to_dict(fit: LoopFit) -> dict[str, Any]:
    """A loop with its fits as plain data, all numbers SI."""
    return {
        "origin": fit.loop.recording.origin,
        "run": fit.loop.run.kind.name,
        "first_row": fit.loop.run.interval.start + 1,
        "last_row": fit.loop.run.interval.stop,
        "constant": fit.loop.run.constant_column,
        "value": fit.loop.run.constant_value,
        "recommended": type(fit.recommended.friction).__name__ if fit.recommended else None,
        "usable_in_plant": fit.usable_in_plant,
        "models": [
            {
                "model": type(f.friction).__name__, "parameters": {p.path: p.value for p in leaves(f.friction)},
                "rmse": f.rmse, "rmse_without": f.rmse_without_friction, "gap": f.residual_gap, "gap_without": f.gap,
                "repeat_rmse": f.repeat_rmse, "repeat_rmse_without": f.repeat_rmse_without_friction,
                "repeatability": f.repeatability, "aicc_difference": 0.0 - f.aicc_reduction, "p_value": f.p_value,
                "justified": f.justified, "undetermined": list(f.undetermined),
            }
            for f in fit.fits
        ],
        "failed": dict(fit.failed),
    }  # fmt: skip


def joint_to_dict(fit: JointFit) -> dict[str, Any]:
    """A joint fit as plain data, all numbers SI."""
    return {
        "model": fit.name, "parameters": {p.path: p.value for p in leaves(fit.friction)}, "rmse": fit.rmse,
        "rmse_without": fit.rmse_without_friction, "aicc_difference": 0.0 - fit.aicc_reduction, "p_value": fit.p_value,
        "pressure_p_value": fit.scale_p_value, "repeat_rmse": fit.repeat_rmse,
        "repeat_rmse_without": fit.repeat_rmse_without_friction, "justified": fit.justified,
        "undetermined": list(fit.undetermined), "reservations": list(fit.reservations),
        "runs": [{**dataclasses.asdict(run), "disagrees": run.disagrees} for run in fit.agreement],
    }  # fmt: skip


def creep_to_dict(creep: HeldCreep | None) -> dict[str, Any]:
    """The creep of the holds as plain data, all numbers SI."""
    if creep is None:
        return {"creep": [], "creep_elements": None}
    elements = dataclasses.asdict(creep.elements) | {"standard_errors": creep.standard_errors}
    return {"creep": list(creep.sentences), "creep_elements": elements | {"verdict": creep.verdict}}
