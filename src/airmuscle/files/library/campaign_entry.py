"""The muscle of a campaign, with its uncertainty."""

import dataclasses

import numpy as np

from ...bench.campaign import Campaign, CreepStage, ReleaseStage, StaticStage
from ...bench.comparison.specimen_errors import ranked_specimen_errors
from ...bench.diagnosis.misfit import misfit_warning
from ...bench.estimation import resting_lengths_of
from ...core import IdentificationError
from ...physics import NoFriction
from ...physics.muscle.geometry.base import LENGTH_TOLERANCE
from . import ParameterUncertainty, StatedBand
from .entry import MEASURED, Entry
from .fitted_entry import complete_band


def campaign_entry(campaign: Campaign, title: str, resting_length: float | None = None) -> Entry:
    """The muscle of a resting length [m], by default of the fills. Raises IdentificationError
    without a static law.
    """
    stage = campaign.static
    length = resting_length or campaign.resting_length
    law = campaign.law(length)
    if not isinstance(stage, StaticStage) or law is None:
        reason = "the recommended law is not solved for the force" if law is None else ""
        cause = reason if isinstance(stage, StaticStage) else stage.reason
        raise IdentificationError(
            f"no muscle can be written, because there is no static law for the force: {cause}."
        )
    friction = campaign.friction
    creep = campaign.creep_elements
    used = sum(record.kind.value != "unused" for record in campaign.records)
    note = f"Identified from {used} of {len(campaign.records)} records. {stage.band}"
    left_out = [name for name, result in campaign.stages if hasattr(result, "remedy")]
    return Entry(
        name="muscle",
        title=title,
        provenance="fitted",
        evidence=MEASURED,
        characteristic=law,
        geometry=campaign.geometry(length),
        damper=campaign.release.damper if isinstance(campaign.release, ReleaseStage) else None,
        friction=None if isinstance(friction, NoFriction) else friction,
        creep=creep if creep.stiffnesses else None,
        note=f"{note} Not identified: {', '.join(left_out)}." if left_out else note,
        warning=misfit_warning(stage.fit.misfit),
        validity_range=stage.fit.validity_range,
        uncertainty=_uncertainty(campaign, stage),
        error_band=_stated_band(campaign, stage, length),
    )


def _stated_band(campaign: Campaign, stage: StaticStage, length: float | None) -> StatedBand:
    """The bands of the muscle of a resting length [m], whose specimens are those of this length."""
    held_band = stage.held_band
    runs = [record.recording for record in campaign.records if record.kind.is_static]
    errors = ranked_specimen_errors(stage.comparison.recommended, [stage.comparison], stage.points)
    band = complete_band(StatedBand("force", stage.band.half_width, str(stage.band)), runs, errors)
    if held_band is not None and held_band.half_width != stage.band.half_width:
        band = dataclasses.replace(
            band, source=f"{stage.band} {held_band}", held_half_width=held_band.half_width
        )
    if length is not None:
        lengths = resting_lengths_of(runs)
        specimens = tuple(
            n for n in band.specimens if abs(lengths.get(n, length) - length) <= LENGTH_TOLERANCE
        )
        band = dataclasses.replace(band, specimens=specimens)
    return band


def _uncertainty(campaign: Campaign, stage: StaticStage) -> ParameterUncertainty | None:
    """Standard errors and correlations of the static law, then those of damper and creep, fitted
    separately.
    """
    from scipy.linalg import block_diag

    fit = stage.fit
    known = [i for i, estimate in enumerate(fit.estimates) if np.isfinite(estimate.stderr)]
    names = [f"characteristic.{fit.estimates[i].name}" for i in known]
    errors = [fit.estimates[i].stderr for i in known]
    if isinstance(campaign.release, ReleaseStage):
        damping = campaign.release.fit["muscle.damper.damping"]
        if np.isfinite(damping.stderr):
            names.append("damper.damping")
            errors.append(damping.stderr)
    if isinstance(campaign.creep, CreepStage):
        count = len(campaign.creep.elements.stiffnesses)
        names += [
            f"creep.{field}[{i}]"
            for field in ("stiffnesses", "relaxation_times")
            for i in range(count)
        ]
        errors += campaign.creep.standard_errors.tolist()
    if not names:
        return None
    correlations = block_diag(
        fit.correlations[np.ix_(known, known)], np.eye(len(names) - len(known))
    )
    np.fill_diagonal(correlations, 1.0)
    return ParameterUncertainty(
        tuple(names), tuple(errors), tuple(map(tuple, correlations.tolist()))
    )
