"""Entries before and after a fit: initial law, fitted law, and muscle of a campaign, each with its
uncertainty.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...bench.campaign import Campaign, CreepStage, ReleaseStage, StaticStage
from ...bench.comparison import RankedModel
from ...bench.comparison.specimen_errors import (
    SpecimenErrors,
    ranked_specimen_errors,
    resting_lengths_of,
    specimens_of,
)
from ...bench.diagnosis.misfit import misfit_warning
from ...bench.estimation import LEVEL
from ...bench.inspection import maximum_rate
from ...bench.statics import Fit, standard_candidates
from ...core import (
    HintedText,
    IdentificationError,
    ParameterError,
    UnknownNameError,
    cite,
    printable,
    suggestion,
)
from ...physics import Characteristic, ContractileSurface, Geometry, NoFriction
from ...physics.muscle.muscle import LENGTH_TOLERANCE
from ...recording import Recording
from ...report.shown import value_text
from . import ParameterUncertainty, StatedBand, is_path, load_law, model_class, model_names
from .entry import MEASURED, MISSING_GEOMETRY, Entry
from .scaling import entry_at_length

MAX_NAMES = 3
MAX_NAME = 60
"""Maximum number of file names in a title, and of characters of each (chosen)."""


def find_initial_law(
    name: str, recordings: Sequence[Recording], degree: int, option: str = "--characteristic"
) -> tuple[Entry, tuple[str, ...]]:
    """The library entry or muscle file of that name, or the named model with initial values
    estimated from the data; and the parameters to keep fixed because they only scale other
    parameters.

    Law and geometry of an entry are scaled to the resting length of the data. Raises ParameterError
    for a model whose initial values cannot be estimated, and for an entry that cannot be scaled. A
    law of a user, `module:Class`, has the initial values of its `guess`.
    """
    is_code = ":" in name and not is_path(name)
    if not is_code and name not in model_names():
        try:
            entry = load_law(name)
            lengths = resting_lengths(recordings)
        except UnknownNameError as error:  # the message also lists the laws
            if is_path(name):
                raise
            laws = model_names(Characteristic)
            text = f" Or name a law: {', '.join(laws)}.{suggestion(name, laws)}"
            raise UnknownNameError(HintedText(error.message, text)) from None
        return (
            entry_at_length(entry, *lengths, f"{option} {name}") if len(lengths) == 1 else entry
        ), ()
    cls = model_class(name, option)
    if not issubclass(cls, Characteristic):
        known = ", ".join(model_names(Characteristic))
        raise ParameterError(f"{option}: {name} is not a characteristic; there are {known}.")
    if is_code:
        return Entry(cls.__name__, cls.__name__, "chosen", cls.guess(recordings)), cls.redundant
    if issubclass(cls, ContractileSurface):
        return Entry(name, name, "chosen", cls.guess(recordings, degree)), ()
    for candidate in standard_candidates(recordings):
        if type(candidate.law) is cls:
            return Entry(name, name, "chosen", candidate.law), candidate.fixed
    has_length = all("resting_length" in run.constants for run in recordings)
    length = (
        ""
        if has_length
        else " Or give the resting length, which allows more models to be initialised from data."
    )
    raise ParameterError(
        f"{option}: {name} needs initial values, which cannot be estimated from these data. Give a"
        " library entry of this model (see airmuscle list) or a muscle file with initial"
        f" values.{length}"
    )


def resting_lengths(recordings: Sequence[Recording]) -> tuple[float, ...]:
    """The different resting lengths [m] that the recordings state, in ascending order."""
    stated = (recording.constants.get("resting_length") for recording in recordings)
    return tuple(sorted({float(length) for length in stated if length is not None}))


def fitted_entry(
    result: Fit,
    initial: Entry,
    files: Sequence[Path],
    error_ratio: float = 1.0,
    recordings: Sequence[Recording] = (),
    errors: SpecimenErrors | None = None,
) -> Entry:
    """The initial entry with the fitted characteristic, a new provenance and its 95 % bands,
    without its checks.

    error_ratio  rms error of rows left out of the fit over that of its own rows, by which the band
                 is widened
    recordings   of the fit, whose specimens, resting lengths and rates the band holds for
    errors       of specimens left out of the fit, for the band of a specimen that was not measured
    """
    texts = {quantity.name: value_text(quantity) for quantity in result.goodness()}
    names = list_files([f.name for f in files])
    note = (
        f"Fitted to {names}: rms error {texts['rms error']}, maximum error"
        f" {texts['maximum error']}."
    )
    geometry = initial.geometry
    inside = getattr(result.model, "geometry", None)
    if isinstance(inside, Geometry) and (geometry is None or type(geometry) is type(inside)):
        geometry = inside  # the law was fitted with it
    title = f"{type(result.model).__name__} fitted to {list_files([f.stem for f in files])}"
    residuals = np.abs(result.residuals[result.censoring == 0])
    band = None
    size = residuals.size
    half = (
        error_ratio * float(np.quantile(residuals, min(np.ceil((size + 1) * LEVEL) / size, 1.0)))
        if size
        else 0.0
    )
    if np.isfinite(half) and half > 0.0:
        source = f"95 % quantile of the residuals of {size} rows of the fit"
        if error_ratio != 1.0:
            source += (
                f", times {error_ratio:.3g}, the ratio of the rms errors of rows left out and of"
                " all rows"
            )
        band = _complete_band(
            StatedBand(result.fitted_quantity.name, half, source), recordings, errors
        )
    entry = dataclasses.replace(
        initial,
        name="muscle",
        title=title,
        provenance="fitted",
        evidence=MEASURED,
        note=note,
        warning=misfit_warning(result.misfit),
        characteristic=result.model,
        geometry=geometry,
        validity_range=result.validity_range,
        checks=(),
        uncertainty=None,
        error_band=band,
        references=tuple(cite((initial.references, result.recording.references))),
    )
    return dataclasses.replace(entry, note=" ".join([note, *missing_geometry(entry)]))


def left_out_ratio(best: RankedModel) -> float:
    """Rms error of the rows left out over that of all rows; 1 where it is unknown or smaller."""
    if not (best.in_sample_rmse > 0.0 and np.isfinite(best.cross_validated_rmse)):
        return 1.0
    return max(best.cross_validated_rmse / best.in_sample_rmse, 1.0)


def _complete_band(
    band: StatedBand, recordings: Sequence[Recording], errors: SpecimenErrors | None
) -> StatedBand:
    """The band with the specimens, resting lengths and maximum rates of the records that it holds
    for, and, of a force, with that of specimens that were not measured, if their errors are
    known."""
    timed = [run for run in recordings if "time" in run]
    if errors is not None and band.quantity == "force":
        band = dataclasses.replace(
            band, new_specimen_half_width=errors.half_width, new_specimen_source=str(errors)
        )
    return dataclasses.replace(
        band,
        specimens=specimens_of(recordings),
        resting_lengths=tuple(resting_lengths_of(recordings).values()),
        max_contraction_rate=maximum_rate(timed, "contraction") if timed else None,
        max_pressure_rate=maximum_rate(timed, "pressure") if timed else None,
    )


def list_files(names: Sequence[str]) -> str:
    """The names of files for a title: up to three of them, else their number with the first and the
    last.
    """
    shown = map(printable, names)
    short = [
        name if len(name) <= MAX_NAME else f"{name[: MAX_NAME // 2]}…{name[-MAX_NAME // 2 :]}"
        for name in shown
    ]
    if len(short) <= MAX_NAMES:
        return ", ".join(short)
    return f"{len(short)} files, {short[0]} to {short[-1]}"


def missing_geometry(entry: Entry) -> list[str]:
    """The remark that the muscle has no geometry, how it is given and how it is measured; empty if
    it has one.
    """
    return [] if entry.geometry is not None else [f"The muscle lacks {MISSING_GEOMETRY}."]


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
    band = _complete_band(StatedBand("force", stage.band.half_width, str(stage.band)), runs, errors)
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
