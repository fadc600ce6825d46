"""Report chapters of a campaign beside its overview: records at one level, muscle, and a part for
each stage.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, DASHES, LINES, RED, AirmuscleError, Array, legend_below, new_figure
from ...physics import CreepElements
from ...report import Chapter, Plot, Table, TableColumn, as_data
from ..comparison import compare_chapter
from ..diagnosis import level_tables, level_text
from ..dynamics import draw_residuals, dynamic_chapters, residual_panels, running_extreme
from ..hysteresis import hysteresis_chapters, joint_friction_chapter, loops_not_joined
from ..inspection import level_intervals
from ..prediction import thinned_rows
from ..statics import MuscleDescription, fit_chapter
from .creep_stage import CreepStage
from .fill_stage import FillStage
from .friction_and_release import FrictionStage, ReleaseStage
from .record import CampaignRecord, RecordKind
from .result import Campaign
from .static_stage import StaticStage
from .transient import LeftOutStage


def campaign_chapters(campaign: Campaign, entry: MuscleDescription | None) -> list[Chapter]:
    """Return the chapters that follow the overview, the `chapter()` of the campaign."""
    plots = (
        plot(campaign) for plot in (characteristic_plot, prediction_plot, residual_plot, fill_plot)
    )
    summary = (
        "The predicted force is that of the static law minus friction and creep along the recorded"
        " motion."
    )
    muscle = Chapter(
        "campaign-muscle", "Muscle and prediction error", summary, plots=tuple(filter(None, plots))
    )
    stages = sorted(
        (stage for _, stage in campaign.stages),
        key=lambda stage: not isinstance(stage, StaticStage),
    )
    chapters = [muscle, *(chapter for stage in stages for chapter in stage_chapters(stage, entry))]
    parts = [dataclasses.replace(chapter, brief=False) for chapter in chapters]
    tables = level_tables(
        [record.recording for record in campaign.records if record.kind.is_static]
    )
    text = "What the records show without a law."
    records = Chapter("level-records", "Isometric and isobaric records", text, tables=tables)
    is_brief = not isinstance(campaign.static, StaticStage)
    levels = [dataclasses.replace(records, brief=is_brief)] if tables else []
    return [*levels, *parts]


def stage_chapters(stage: object, entry: MuscleDescription | None = None) -> list[Chapter]:
    """Return the chapters of one stage; that of the static law has the chapter of the muscle if its
    entry is given.
    """
    if isinstance(stage, StaticStage):
        fitted = stage.fit.chapter() if entry is None else fit_chapter(stage.fit, entry)
        return [compare_chapter(stage.comparison), fitted]
    if isinstance(stage, FrictionStage):
        loops = stage.loops
        joint = stage.joint
        return (
            [joint_friction_chapter(joint, loops_not_joined(loops))]
            if joint
            else hysteresis_chapters(loops)
        )
    if isinstance(stage, CreepStage):
        holds = [f"{origin}: {fit.verdict}" for origin, fit in stage.holds]
        chapter = creep_chapter(stage.verdict, holds, stage.elements, stage.standard_errors)
        return [dataclasses.replace(chapter, plots=(creep_plot(stage),))]
    if isinstance(stage, FillStage | ReleaseStage):
        name, title = (
            ("fill-", "Fills and volume")
            if isinstance(stage, FillStage)
            else ("release-", "Release")
        )
        return [part.among(name) for part in dynamic_chapters(stage.fit, title)]
    return []


def stage_data(name: str, stage: object) -> dict[str, Any]:
    """Return a stage as plain data: name, verdict, whether it is identified, its chapters or the
    reason.
    """
    data: dict[str, Any] = {"stage": name, "verdict": getattr(stage, "verdict", "")}
    if isinstance(stage, LeftOutStage):
        return data | {"identified": False, "reason": stage.reason, "remedy": stage.remedy}
    if isinstance(stage, tuple):
        return data | {"count": len(stage)}
    return data | {"identified": True, **as_data(stage_chapters(stage))}


def creep_chapter(
    verdict: str, sentences: Sequence[str], elements: CreepElements, standard_errors: Array
) -> Chapter:
    """Return the chapter of creep: the verdict, a sentence on each hold, and the Maxwell elements
    with the standard errors of their stiffnesses [N/m], then of their relaxation times [s]."""
    count = len(elements.stiffnesses)
    columns: dict[str, Any] = {
        "stiffness": TableColumn(elements.stiffnesses, "N/m"),
        "standard error of the stiffness": TableColumn(standard_errors[:count], "N/m"),
        "relaxation time": TableColumn(elements.relaxation_times, "s"),
        "standard error of the time": TableColumn(standard_errors[count:], "s"),
    }
    table = Table("creep-elements", "Maxwell elements", columns, brief=count)
    return Chapter("creep", "Creep", (verdict, *sentences), tables=(table,) if count else ())


MAX_LOOPS = 6
MAX_PANELS = 6
"""Maximum number of loops in a figure, and of panels of fills (chosen)."""
CURVE_POINTS = 161
LEVEL_TOLERANCE = 0.03
"""Maximum relative difference of two pressures that have one curve (chosen)."""
POINT_TOLERANCE = 0.005
"""Maximum difference of the pressure of a point from that of its curve, relative to the maximum
(chosen).
"""


def characteristic_plot(campaign: Campaign) -> Plot | None:
    """Return the isobars of the muscle with the 95 % band and the measured points, freed of
    friction and creep.
    """
    stage, law = campaign.static, campaign.law()
    if not isinstance(stage, StaticStage) or law is None:
        return None
    length = campaign.resting_length
    figure, axes = new_figure(width=6.6, height=4.0)
    runs = [
        run
        for run in stage.points
        if length is None or run.constants.get("resting_length") in (length, None)
    ]
    isobaric = [
        r
        for r in campaign.records
        if r.kind is RecordKind.ISOBARIC and r.resting_length in (length, None)
    ]
    levels = sorted(record.level[1] for record in isobaric if record.level)
    band = LEVEL_TOLERANCE * max(levels, default=0.0)
    distinct = [levels[interval.start] for interval in level_intervals(np.array(levels), band)]
    evenly = np.linspace(*stage.fit.data_ranges["pressure"], 6)[1:].tolist()
    pressures = distinct[:: max(1, -(-len(distinct) // 7))] or evenly
    low, high = stage.fit.data_ranges["contraction"]
    eps = np.linspace(low, high, CURVE_POINTS)
    for i, pressure in enumerate(pressures):
        colour = LINES[i % len(LINES)]
        force = np.asarray(law.force(np.full(eps.size, pressure), eps), dtype=float)
        force = np.where(force > 0.0, force, np.nan)
        label = f"{pressure / 1e3:.3g} kPa"
        axes.plot(100 * eps, force, color=colour, linestyle=DASHES[i % 5], label=label, zorder=3)
        half = stage.band.half_width
        axes.fill_between(
            100 * eps,
            np.maximum(force - half, 0),
            force + half,
            color=colour,
            alpha=0.18,
            linewidth=0,
        )
        for run in runs:
            rows = np.abs(run["pressure"] - pressure) <= POINT_TOLERANCE * max(pressures)
            style = {
                "color": colour,
                "linestyle": "none",
                "marker": ".",
                "markersize": 2.5,
                "alpha": 0.7,
            }
            axes.plot(100 * run["contraction"][rows], run["force"][rows], **style)
    axes.set(xlabel="contraction [%]", ylabel="force [N]", ylim=(0.0, None))
    axes.legend(title="gauge pressure", loc="upper right", fontsize=8, title_fontsize=8)
    text = "" if length is None else f" of the muscle of {1e3 * length:.4g} mm"
    contents = "fitted law with its 95 % band, and measured points freed of friction and creep"
    return Plot("campaign-characteristic", f"Static characteristic{text}: {contents}.", figure)


def _length_and_level(record: CampaignRecord) -> tuple[float, float]:
    """Resting length and constant value of a record, which order the panels."""
    return record.resting_length or 0.0, record.level[1] if record.level else 0.0


def _draw_prediction(axes: Any, record: CampaignRecord, campaign: Campaign) -> None:
    """Draw the measured force of a record, the predicted force and its band."""
    recording = record.recording
    prediction = campaign.predict(recording)
    is_ramp = record.kind is RecordKind.ISOMETRIC
    x = 1e-3 * recording["pressure"] if is_ramp else 100.0 * recording["contraction"]
    dots = {"linestyle": "none", "marker": ".", "markersize": 2, "color": BLUE, "alpha": 0.6}
    axes.plot(x, recording["force"], label="measured", **dots)
    order = np.argsort(x, kind="stable")
    low = running_extreme(prediction.low[order], np.minimum)
    high = running_extreme(prediction.high[order], np.maximum)
    axes.fill_between(x[order], low, high, color=RED, alpha=0.15, linewidth=0, label="95 % band")
    axes.plot(x, prediction.force, color=RED, linewidth=0.9, label="predicted")
    axes.set_xlabel("pressure [kPa]" if is_ramp else "contraction [%]")
    length = "" if record.resting_length is None else f", {1e3 * record.resting_length:.4g} mm"
    title = "" if record.level is None else f"{level_text(*record.level)}{length}"
    axes.set_title(title, fontsize=8)


def prediction_plot(campaign: Campaign) -> Plot | None:
    """Return measured loops, the force predicted with friction and creep, and its 95 % band."""
    static = [record for record in campaign.records if record.kind.is_static]
    usable = [record for record in static if record.kind is RecordKind.ISOBARIC] or static
    if not usable or not isinstance(campaign.static, StaticStage):
        return None
    ordered = sorted(usable, key=_length_and_level)
    shown = [ordered[i] for i in thinned_rows(len(ordered), MAX_LOOPS)]
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure, panels = new_figure(rows, columns, width=7.4, height=2.3 * rows + 0.4, squeeze=False)
    for axes, record in zip(panels.ravel(), shown, strict=False):
        _draw_prediction(axes, record, campaign)
    for axes in panels.ravel()[len(shown) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("force [N]")
    legend_below(figure, panels[0, 0], columns=3)
    force = "static law minus friction and creep along the recorded motion"
    return Plot(
        "campaign-loops",
        f"Slow records with the predicted force: {force}. Shaded: 95 % band.",
        figure,
    )


def residual_plot(campaign: Campaign) -> Plot | None:
    """Return the residuals of all slow records over pressure, contraction and time in the
    record.
    """
    if not isinstance(campaign.static, StaticStage):
        return None
    figure, panels = new_figure(1, 3, width=7.4, height=2.7, sharey=True)
    half = campaign.static.band.half_width
    for record in campaign.records:
        if not record.kind.is_static:
            continue
        try:
            prediction = campaign.predict(record.recording)
        except AirmuscleError:
            continue
        recording = record.recording
        rows = recording["force"] > 0.0
        error = (prediction.force - recording["force"])[rows]
        share = np.linspace(0.0, 100.0, len(recording))[rows]
        columns = (
            1e-3 * recording["pressure"][rows],
            100.0 * recording["contraction"][rows],
            share,
        )
        for axes, x in zip(panels, columns, strict=True):
            axes.plot(
                x,
                error,
                linestyle="none",
                marker=".",
                markersize=1.0,
                color=BLUE,
                alpha=0.35,
                rasterized=True,
            )
    for axes, text in zip(
        panels, ("pressure [kPa]", "contraction [%]", "rows of the record [%]"), strict=True
    ):
        for limit, colour, dashes in ((0.0, BLACK, "-"), (-half, RED, "--"), (half, RED, "--")):
            axes.axhline(limit, color=colour, linewidth=0.8, linestyle=dashes)
        axes.set_xlabel(text)
    panels[0].set_ylabel("predicted - measured force [N]")
    caption = "Residuals of all slow records. Dashed: limits of the 95 % band for further runs."
    return Plot("campaign-residuals", caption, figure)


def fill_plot(campaign: Campaign) -> Plot | None:
    """Return the pressures of all fills with the joint fit, and the residuals below."""
    stage = campaign.fills
    if not isinstance(stage, FillStage):
        return None
    shown = min(len(stage.records), MAX_PANELS)
    figure, panels = residual_panels(
        shown, width=min(7.6, 2.6 + 1.9 * shown), height=3.9, sharey="row"
    )
    for i, column in enumerate(panels.T):
        recording = stage.experiments[i].recording
        sensor = stage.fit.problem.record_models[i].names[0]
        measured = 1e-3 * recording["pressure"]
        modelled = 1e-3 * stage.fit.modelled(i)[sensor]
        draw_residuals(column, recording["time"], measured, modelled, "joint fit")
        column[0].set_title(
            f"contraction {level_text('contraction', float(stage.contractions[i]))}", fontsize=8
        )
        column[1].set_xlabel("time [s]")
    panels[0, 0].set_ylabel("pressure [kPa]")
    panels[1, 0].set_ylabel("residual [kPa]")
    legend_below(figure, panels[0, 0])
    return Plot(
        "campaign-fills", "Fills and discharges with the joint fit of valves and volume.", figure
    )


def creep_plot(stage: CreepStage) -> Plot:
    """Return the change of the force in the holds with the Maxwell elements."""
    figure, axes = new_figure(width=6.3, height=3.0)
    rows = zip(stage.holds, stage.times, stage.measured, stage.modelled, strict=True)
    for i, ((origin, _), time, measured, modelled) in enumerate(rows):
        colour = LINES[i % len(LINES)]
        start = modelled[0]
        axes.plot(
            time,
            measured - start,
            linestyle="none",
            marker=".",
            markersize=2,
            color=colour,
            alpha=0.5,
        )
        axes.plot(time, modelled - start, color=colour, linestyle=DASHES[i % 5], label=origin)
    axes.set(xlabel="time after the motion [s]", ylabel="change of the force [N]")
    legend_below(figure, axes)
    return Plot(
        "campaign-creep",
        "Force after the motion of each hold, with the common Maxwell elements.",
        figure,
    )
