"""Report chapters of a campaign: an overview of records, stages and next experiments, then one part for each stage."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from ....report.chapter import Chapter, Plot, Table
from ..compare_chapter import compare_chapter
from ..dynamic.dynamic_chapter import dynamic_chapters
from ..hysteresis import loops_not_joined
from ..hysteresis.hysteresis_chapter import hysteresis_chapters
from ..hysteresis.joint_friction_chapter import joint_friction_chapter
from ..static_fit_chapter import MuscleDescription, fit_chapter
from . import Campaign, CreepStage, FillStage, FrictionStage, LeftOutStage, RecordKind, ReleaseStage, StaticStage
from .campaign_plots import characteristic_plot, creep_plot, fill_plot, prediction_plot, residual_plot
from .campaign_stages import USES, count_records, stage_result


@dataclasses.dataclass(frozen=True)
class UnreadFile:
    """A file of the folder that could not be read, with the reason."""

    name: str
    reason: str


@dataclasses.dataclass(frozen=True)
class ValidationRow:
    """A record that was kept aside, its error [N] and the share of its rows within the 95 % band."""

    record: str
    rmse: float
    half_width: float
    share: float
    rows: int


def campaign_chapters(
    campaign: Campaign,
    entry: MuscleDescription | None,
    *,
    unread: Sequence[UnreadFile] = (),
    scenarios: Sequence[tuple[str, str]] = (),
    validation: Sequence[ValidationRow] = (),
) -> list[Chapter]:
    """Return the chapters of a campaign; `scenarios` are pairs of a record and its scenario file or the reason."""
    chapters = [_overview(campaign, unread, dict(scenarios)), _predictions(campaign, validation), _next(campaign)]
    if isinstance(campaign.static, StaticStage) and entry is not None:
        chapters.append(compare_chapter(campaign.static.comparison))
        chapters.append(fit_chapter(campaign.static.fit, entry))
    if isinstance(campaign.hysteresis, FrictionStage):
        loops, joint = campaign.hysteresis.loops, campaign.hysteresis.joint
        chapters += [joint_friction_chapter(joint, loops_not_joined(loops))] if joint else hysteresis_chapters(loops)
    if isinstance(campaign.creep, CreepStage):
        chapters.append(_creep(campaign.creep))
    if isinstance(campaign.fills, FillStage):
        chapters += _prefixed(dynamic_chapters(campaign.fills.fit, "Fills and volume"), "fill")
    if isinstance(campaign.release, ReleaseStage):
        chapters += _prefixed(dynamic_chapters(campaign.release.fit, "Release"), "release")
    return chapters


def _overview(campaign: Campaign, unread: Sequence[UnreadFile], scenarios: dict[str, str]) -> Chapter:
    """Return the chapter of the stages and the records."""
    used = sum(record.kind is not RecordKind.UNUSED for record in campaign.records)
    sentences = [f"{used} of {len(campaign.records)} records are used."]
    if unread:
        sentences.append(f"{len(unread)} {'file' if len(unread) == 1 else 'files'} could not be read.")
    left_out = [name for name, stage in campaign.stages if isinstance(stage, LeftOutStage)]
    sentences.append(f"Not identified: {', '.join(left_out)}." if left_out else "All stages are identified.")
    if isinstance(campaign.static, StaticStage):
        sentences += [*(f"{band}" for band in campaign.static.all_bands), *campaign.static.data_notes]
    columns: dict[str, Any] = {
        "stage": [name for name, _ in campaign.stages],
        "records": [count_records(campaign, name) for name, _ in campaign.stages],
        "result": [stage_result(stage) for _, stage in campaign.stages],
    }
    tables = [
        Table("campaign-stages", "Stages", columns), _record_table(campaign, scenarios), _unread_table(unread)
    ]  # fmt: skip
    return Chapter(
        paper="campaign",
        title="Overview",
        summary=" ".join(sentences),
        tables=tuple(table for table in tables if table is not None),
    )


def _predictions(campaign: Campaign, validation: Sequence[ValidationRow]) -> Chapter:
    """Return the chapter of the muscle: characteristic, predicted loops and fills, residuals and bands."""
    plots: list[Plot | None] = [characteristic_plot(campaign), prediction_plot(campaign), residual_plot(campaign)]
    if isinstance(campaign.fills, FillStage):
        plots.append(fill_plot(campaign.fills))
    tables = [_band_table(campaign), _validation_table(validation)]
    return Chapter(
        paper="campaign-muscle",
        title="Muscle and prediction error",
        summary="The predicted force is that of the static law minus friction and creep along the recorded motion.",
        tables=tuple(table for table in tables if table is not None),
        plots=tuple(plot for plot in plots if plot is not None),
    )


def _next(campaign: Campaign) -> Chapter:
    """Return the chapter of the next experiments."""
    tables = [_next_table(campaign), _plan_table(campaign)]
    return Chapter(
        paper="campaign-next",
        title="What to measure next",
        summary="Missing stages first, then parameters that the records do not determine, then further static runs.",
        tables=tuple(table for table in tables if table is not None),
    )


def _band_table(campaign: Campaign) -> Table | None:
    if not isinstance(campaign.static, StaticStage):
        return None
    bands = campaign.static.all_bands
    columns: dict[str, Any] = {
        "prediction of": [band.purpose for band in bands],
        "half width of the 95 % band [N]": [band.half_width for band in bands],
        "rms error [N]": [band.rmse for band in bands],
        "groups left out": [band.groups for band in bands],
        "rows": [band.rows for band in bands],
    }
    return Table("campaign-bands", "Error of the predicted force", columns)


def _validation_table(rows: Sequence[ValidationRow]) -> Table | None:
    if not rows:
        return None
    columns: dict[str, Any] = {
        "record": [row.record for row in rows],
        "rms error [N]": [row.rmse for row in rows],
        "half width of the 95 % band [N]": [row.half_width for row in rows],
        "rows within the band [%]": [100.0 * row.share for row in rows],
        "rows": [row.rows for row in rows],
    }
    return Table("campaign-validation", "Records that were kept aside", columns)


def _record_table(campaign: Campaign, scenarios: dict[str, str]) -> Table:
    records = campaign.records
    columns: dict[str, Any] = {
        "record": [record.origin for record in records],
        "kind": [record.kind.value for record in records],
        "resting length [mm]": [None if r.resting_length is None else 1e3 * r.resting_length for r in records],
        "rows": [len(record.recording) for record in records],
        "reason": [record.reason for record in records],
        "used for": [USES[record.kind] for record in records],
        "scenario": [scenarios.get(record.origin, "") for record in records],
    }
    return Table("campaign-records", "Records and their use", columns)


def _unread_table(unread: Sequence[UnreadFile]) -> Table | None:
    if not unread:
        return None
    columns = {"file": [file.name for file in unread], "reason": [file.reason for file in unread]}
    return Table("campaign-unread", "Files that could not be read", columns)


def _next_table(campaign: Campaign) -> Table | None:
    if not campaign.next_experiments:
        return None
    columns = {
        "measure": [each.measure for each in campaign.next_experiments],
        "because of": [each.purpose for each in campaign.next_experiments],
    }
    return Table("campaign-next", "Experiments", columns)


def _plan_table(campaign: Campaign) -> Table | None:
    """Return the static runs to measure next."""
    plan = next((each.plan for each in campaign.next_experiments if each.plan is not None), None)
    if plan is None:
        return None
    units = {"pressure": (1e-3, "kPa"), "contraction": (100.0, "%")}

    def text(name: str, value: float) -> str:
        factor, unit = units[name]
        return f"{0.0 if abs(factor * value) < 5e-3 else factor * value:.4g} {unit}"

    columns: dict[str, Any] = {
        "constant": [f"{run.constant} {text(run.constant, run.level)}" for run in plan.runs],
        "swept": [f"{run.swept} {' to '.join(text(run.swept, end) for end in run.sweep_limits)}" for run in plan.runs],
        "points": [run.force.size for run in plan.runs],
        "expected force [N]": [f"{run.force.min():.4g} to {run.force.max():.4g}" for run in plan.runs],
    }
    return Table("campaign-plan", "D-optimal static runs to measure next", columns)


def _creep(stage: CreepStage) -> Chapter:
    holds = "\n\n".join(f"{origin}: {fit.verdict}" for origin, fit in stage.holds)
    count = len(stage.elements.stiffnesses)
    columns: dict[str, Any] = {
        "stiffness [N/m]": list(stage.elements.stiffnesses),
        "standard error [N/m]": stage.standard_errors[:count].tolist(),
        "relaxation time [s]": list(stage.elements.relaxation_times),
        "standard error [s]": stage.standard_errors[count:].tolist(),
    }
    return Chapter(
        paper="campaign-creep",
        title="Creep",
        summary=f"{stage.verdict}\n\n{holds}",
        tables=(Table("campaign-creep", "Maxwell elements", columns),),
        plots=(creep_plot(stage),),
    )


def _prefixed(chapters: Sequence[Chapter], prefix: str) -> list[Chapter]:
    """Return the chapters with a prefix of the names of their tables and figures, which must be unique in a report."""
    return [
        dataclasses.replace(
            chapter,
            paper=f"{prefix}-{chapter.paper}",
            tables=tuple(dataclasses.replace(table, name=f"{prefix}-{table.name}") for table in chapter.tables),
            plots=tuple(dataclasses.replace(plot, name=f"{prefix}-{plot.name}") for plot in chapter.plots),
        )
        for chapter in chapters
    ]
