"""Report chapters of several loops: an overview, the friction laws of all runs together, and each
loop.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

from ...report.chapter import Chapter, Table, TableColumn
from ...report.formatting import P_VALUE
from .joint import JointFit, loops_not_joined
from .loop_result import LoopFit, compared_laws, friction_tables
from .result import preferred_fit

SEPARATE_LOOPS = 2
"""Maximum number of loops of which the brief view has the laws of each; of more it has one row each
(chosen).
"""


def hysteresis_chapters(
    loop_fits: Sequence[LoopFit], joint: Sequence[JointFit] = ()
) -> list[Chapter]:
    """Return the overview of several loops, the chapter of the joint fits, if any, and one chapter
    for each loop.
    """
    chapters = [_overview(loop_fits)] if len(loop_fits) > 1 else []
    chapters += [joint_friction_chapter(joint, loops_not_joined(loop_fits))] if joint else []
    for i, loop_fit in enumerate(loop_fits, 1):
        chapter = loop_fit.chapter().among(suffix="" if len(loop_fits) == 1 else f"-{i}")
        chapters.append(dataclasses.replace(chapter, brief=len(loop_fits) <= SEPARATE_LOOPS))
    return chapters


def _overview(loop_fits: Sequence[LoopFit]) -> Chapter:
    """Return the chapter with one row for each loop: its preferred law, or that of the lowest
    AICc.
    """
    best = [loop_fit.recommended or next(iter(loop_fit.fits), None) for loop_fit in loop_fits]
    loops = [loop_fit.loop for loop_fit in loop_fits]
    columns: dict[str, Any] = {
        "run": [loop.recording.origin for loop in loops],
        "kind": [loop.description for loop in loops],
        "rows": [int(loop.fitted_rows.sum()) for loop in loops],
        "law": [fit and fit.name for fit in best],
        "rms error without friction": TableColumn(
            [fit and fit.rmse_without_friction for fit in best],
            "N",
            digits=3,
            short="without friction",
        ),
        "rms error": TableColumn([fit and fit.rmse for fit in best], "N", digits=3),
        "justified": [loop_fit.recommended is not None for loop_fit in loop_fits],
        "usable in a plant": TableColumn(
            [loop_fit.usable_in_plant for loop_fit in loop_fits], brief=False
        ),
    }
    # the chapters of a few loops name the failed laws themselves
    notes = tuple(_failed_laws(loop_fits)) if len(loop_fits) > SEPARATE_LOOPS else ()
    justified = sum(loop_fit.recommended is not None for loop_fit in loop_fits)
    summary = f"{len(loop_fits)} loops; the data justify a friction law for {justified} of them."
    tables = (Table("loops", "Best law of each loop", columns, brief=12),)
    return Chapter("loops", "Hysteresis loops", summary, tables=tables, notes=notes)


def _failed_laws(loop_fits: Sequence[LoopFit]) -> Iterator[str]:
    """A note on each law that was not fitted, with the run, or the number of runs."""
    failed: dict[tuple[str, str], list[str]] = {}
    for loop_fit in loop_fits:
        for law in loop_fit.failed.items():
            failed.setdefault(law, []).append(loop_fit.loop.recording.origin)
    for (name, reason), origins in failed.items():
        runs = origins[0] if len(origins) == 1 else f"{len(origins)} runs"
        yield f"{name} was not fitted to {runs}: {reason}"


def joint_friction_chapter(fits: Sequence[JointFit], not_joined: Sequence[str] = ()) -> Chapter:
    """Return the chapter of the joint fits of all laws, lowest AICc first, with the friction of
    each run by the best justified one; `not_joined` are sentences on the loops that the joint fit
    does not use."""
    shown = preferred_fit(fits) or fits[0]
    none = "The runs justify no friction law that holds for all of them, so none is written."
    none = "" if shown.justified else f"{none} {shown.name} is shown as the best one. "
    columns = {
        "depends on pressure": [fit.law is not fit.friction for fit in fits],
        "runs that disagree": [sum(run.disagrees for run in fit.agreement) for fit in fits],
    }
    laws = "Friction laws fitted to all runs together, best first"
    chapter = shown.chapter()
    runs = shown.agreement
    by_run: dict[str, Any] = {
        "run": [run.origin for run in runs],
        "level": [run.description for run in runs],
        "from this run": TableColumn([run.amplitude for run in runs], "N", digits=3),
        "standard error": TableColumn([run.amplitude_stderr for run in runs], "N", digits=2),
        "from all runs": TableColumn([run.joint_amplitude for run in runs], "N", digits=3),
        "rms deviation": TableColumn([run.deviation for run in runs], "1", "%"),
        P_VALUE: TableColumn([run.p_value for run in runs], brief=False),
        "agrees": TableColumn([not run.disagrees for run in runs], brief=False),
    }
    title = f"Friction of each run, {shown.name}: half the range of the force"
    of_runs = Table(
        "joint-runs", title, by_run, brief=[i for i, run in enumerate(runs) if run.disagrees]
    )
    tables = (compared_laws("joint-laws", laws, fits, columns), of_runs, *friction_tables(chapter))
    return dataclasses.replace(
        chapter,
        title="Friction of all runs",
        summary=(f"{none}{shown.verdict}",),
        tables=tables,
        notes=tuple(not_joined),
    )
