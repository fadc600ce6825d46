"""Entry of the muscle that a campaign identified, with the uncertainty of its parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...bench.identify.campaign import Campaign, CreepStage, ReleaseStage, StaticStage
from ...bench.identify.specimen_errors import ranked_specimen_errors, resting_lengths_of
from ...core.errors import IdentificationError
from ...physics.muscle.friction import NoFriction
from ...physics.muscle.muscle import LENGTH_TOLERANCE
from .entry import Entry
from .fitted_entry import band_of_others, band_range
from .stated_band import StatedBand
from .uncertainty import ParameterUncertainty


def campaign_entry(campaign: Campaign, title: str, resting_length: float | None = None) -> Entry:
    """The muscle of a resting length [m] with all identified parts, by default that of the fills.

    Raises IdentificationError without a static characteristic.
    """
    stage, length = campaign.static, resting_length or campaign.resting_length
    law = campaign.law(length)
    if not isinstance(stage, StaticStage) or law is None:
        reason = "the recommended law is not solved for the force" if law is None else ""
        cause = reason if isinstance(stage, StaticStage) else stage.reason
        raise IdentificationError(f"no muscle can be written, because there is no static law for the force: {cause}.")
    friction, creep = campaign.friction, campaign.creep_elements
    return Entry(
        name="muscle",
        title=title,
        provenance="fitted",
        characteristic=law,
        geometry=campaign.geometry(length),
        damper=campaign.release.damper if isinstance(campaign.release, ReleaseStage) else None,
        friction=None if isinstance(friction, NoFriction) else friction,
        creep=creep if creep.stiffnesses else None,
        note=_note(campaign, stage),
        validity_range=stage.fit.validity_range,
        uncertainty=_uncertainty(campaign, stage),
        error_band=_stated_band(campaign, stage, length),
    )


def _note(campaign: Campaign, stage: StaticStage) -> str:
    used = sum(record.kind.value != "unused" for record in campaign.records)
    left_out = [name for name, result in campaign.stages if hasattr(result, "remedy")]
    text = f"Identified from {used} of {len(campaign.records)} records. {stage.band}"
    return f"{text} Not identified: {', '.join(left_out)}." if left_out else text


def _stated_band(campaign: Campaign, stage: StaticStage, length: float | None) -> StatedBand:
    """The bands of the muscle of a resting length [m], whose specimens are those of this length."""
    held, runs = stage.held_band, [record.recording for record in campaign.records if record.kind.is_static]
    band = band_range(StatedBand("force", stage.band.half_width, str(stage.band)), runs)
    if held is not None and held.half_width != stage.band.half_width:
        band = dataclasses.replace(band, source=f"{stage.band} {held}", held_half_width=held.half_width)
    if length is not None:
        lengths = resting_lengths_of(runs)
        own = tuple(n for n in band.specimens if abs(lengths.get(n, length) - length) <= LENGTH_TOLERANCE)
        band = dataclasses.replace(band, specimens=own)
    errors = ranked_specimen_errors(stage.comparison.recommended, [stage.comparison], stage.points)
    return band_of_others(band, errors)


def _uncertainty(campaign: Campaign, stage: StaticStage) -> ParameterUncertainty | None:
    """Standard errors and correlations of the static law, then those of damper and creep, fitted separately."""
    fit = stage.fit
    known = [i for i, estimate in enumerate(fit.estimates) if np.isfinite(estimate.stderr)]
    names = [f"characteristic.{fit.estimates[i].name}" for i in known]
    errors = [fit.estimates[i].stderr for i in known]
    blocks = [fit.correlations[np.ix_(known, known)]]
    if isinstance(campaign.release, ReleaseStage):
        damping = campaign.release.fit["muscle.damper.damping"]
        if np.isfinite(damping.stderr):
            names.append("damper.damping")
            errors.append(damping.stderr)
            blocks.append(np.eye(1))
    if isinstance(campaign.creep, CreepStage):
        count = len(campaign.creep.elements.stiffnesses)
        paths = [f"creep.{field}[{i}]" for field in ("stiffnesses", "relaxation_times") for i in range(count)]
        names += paths
        errors += campaign.creep.standard_errors.tolist()
        blocks += [np.eye(1)] * len(paths)
    return None if not names else ParameterUncertainty(tuple(names), tuple(errors), _block_diagonal(blocks))


def _block_diagonal(blocks: Sequence[np.ndarray]) -> tuple[tuple[float, ...], ...]:
    size = sum(len(block) for block in blocks)
    matrix, start = np.zeros((size, size)), 0
    for block in blocks:
        end = start + len(block)
        matrix[start:end, start:end] = block
        start = end
    np.fill_diagonal(matrix, 1.0)
    return tuple(tuple(float(value) for value in row) for row in matrix)
