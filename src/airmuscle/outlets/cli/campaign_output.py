"""Output of `airmuscle campaign`: text and JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...bench.identify.campaign import (
    Campaign,
    CampaignRecord,
    CreepStage,
    FillStage,
    FrictionStage,
    LeftOutStage,
    ReleaseStage,
    StaticStage,
)
from ...bench.identify.campaign.campaign_chapters import UnreadFile, ValidationRow
from ...bench.identify.campaign.campaign_stages import USES, stage_result
from ...core import leaves
from ...files.scenario.campaign import RecordScenario
from ...physics.muscle.friction import NoFriction
from .fit_output import fit_to_dict
from .terminal import echo, print_table


def print_campaign(
    campaign: Campaign, unread: Sequence[UnreadFile], scenarios: Sequence[RecordScenario],
    validation: Sequence[ValidationRow], out: Path,
) -> None:  # fmt: skip
    """Print records, stages, next experiments and the paths of the files."""
    rows = [(record.origin, record.kind.value, record.reason, USES[record.kind]) for record in campaign.records]
    print_table(("record", "kind", "reason", "used for"), rows)
    for file in unread:
        echo(f"warning: left out: {file.reason}", err=True)
    echo()
    for name, stage in campaign.stages:
        echo(f"{name}: {stage_result(stage)}")
    if isinstance(campaign.static, StaticStage):
        for band in campaign.static.all_bands:
            echo(str(band))
        for note in campaign.static.data_notes:
            echo(f"note: {note}")
    for row in validation:
        echo(
            f"kept aside: {row.record}: rms error {row.rmse:.4g} N, {100 * row.share:.3g} % of {row.rows} rows within "
            f"±{row.half_width:.3g} N"
        )
    for each in campaign.next_experiments:
        echo(f"measure next: {each.measure} ({each.purpose})")
    written = sum(bool(scenario.text) for scenario in scenarios)
    if (out / "muscle.toml").exists():
        echo(f"muscle: {out / 'muscle.toml'}")
    elif isinstance(campaign.static, LeftOutStage):
        stage = campaign.static
        echo(f"muscle: not written, because it needs a static law: {stage.reason}; {stage.remedy}")
    if scenarios and not written:
        reasons = dict.fromkeys(scenario.reason for scenario in scenarios)
        echo(f"scenarios: not written: {'; '.join(reasons)}")
    if written:
        echo(f"scenarios: {out / 'scenarios'} ({written} of {len(scenarios)} records)")
    echo(f"report: {out / 'report.html'}")


def campaign_to_dict(
    campaign: Campaign, unread: Sequence[UnreadFile], scenarios: Sequence[RecordScenario],
    validation: Sequence[ValidationRow],
) -> dict[str, Any]:  # fmt: skip
    """A campaign as plain data, all numbers SI."""
    return {
        "records": [_record_to_dict(record) for record in campaign.records],
        "unread": [dataclasses.asdict(file) for file in unread],
        "stages": [stage_to_dict(name, stage) for name, stage in campaign.stages],
        "validation": [dataclasses.asdict(row) for row in validation],
        "next": [{"measure": each.measure, "purpose": each.purpose} for each in campaign.next_experiments],
        "scenarios": {s.record: s.name if s.text else None for s in scenarios},
    }


def stage_to_dict(name: str, result: object) -> dict[str, Any]:
    """The result of a stage as plain data, all numbers SI."""
    data: dict[str, Any] = {"stage": name, "verdict": getattr(result, "verdict", "")}
    if isinstance(result, LeftOutStage):
        return data | {"identified": False, "reason": result.reason, "remedy": result.remedy}
    if isinstance(result, tuple):
        records = [_record_to_dict(record) for record in result if isinstance(record, CampaignRecord)]
        return data | ({"records": records} if records else {"count": len(result)})
    return data | {"identified": True} | _values(result)


def _values(result: object) -> dict[str, Any]:
    if isinstance(result, CreepStage):
        return {"elements": dataclasses.asdict(result.elements), "standard_errors": result.standard_errors}
    if isinstance(result, FrictionStage):
        friction = result.friction
        parameters = {} if isinstance(friction, NoFriction) else {leaf.path: leaf.value for leaf in leaves(friction)}
        return {"model": result.selected.name if result.selected else None, "parameters": parameters}
    if isinstance(result, StaticStage):
        bands = [dataclasses.asdict(band) for band in result.all_bands]
        return {"bands": bands, "notes": list(result.data_notes), "fit": fit_to_dict(result.fit)}
    if isinstance(result, FillStage):
        estimate = None if result.estimate is None else dataclasses.asdict(result.estimate)
        values = [dataclasses.asdict(each) for each in result.fit.estimates]
        return {"parameters": values, "volume": estimate, "cross_rms": result.cross_rms}
    if isinstance(result, ReleaseStage):
        return {"parameters": [dataclasses.asdict(each) for each in result.fit.estimates], "masses": result.masses}
    return {}


def _record_to_dict(record: CampaignRecord) -> dict[str, Any]:
    return {
        "origin": record.origin,
        "kind": record.kind.value,
        "reason": record.reason,
        "rows": len(record.recording),
        "resting_length": record.resting_length,
    }
