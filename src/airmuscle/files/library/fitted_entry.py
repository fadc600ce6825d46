"""Entries before and after a fit: initial law, and fitted law with its uncertainty."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...bench import comparison, inspection, statics
from ...bench.diagnosis.misfit import misfit_warning
from ...bench.estimation import LEVEL, resting_lengths_of, specimens_of
from ...bench.statics import Fit
from ...core import (
    HintedText,
    ParameterError,
    UnknownNameError,
    cite,
    printable,
    suggestion,
)
from ...physics import Characteristic, ContractileSurface, Geometry
from ...recording import Recording
from ...report.shown import value_text
from . import StatedBand, is_path, load_law, model_class, model_names
from .entry import MEASURED, MISSING_GEOMETRY, Entry
from .fields import is_model_name
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
    if not is_code and not is_model_name(name):
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
    for candidate in statics.standard_candidates(recordings):
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
    errors: "comparison.SpecimenErrors | None" = None,
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
        band = complete_band(
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


def left_out_ratio(best: "comparison.RankedModel") -> float:
    """Rms error of the rows left out over that of all rows; 1 where it is unknown or smaller."""
    if not (best.in_sample_rmse > 0.0 and np.isfinite(best.cross_validated_rmse)):
        return 1.0
    return max(best.cross_validated_rmse / best.in_sample_rmse, 1.0)


def complete_band(
    band: StatedBand, recordings: Sequence[Recording], errors: "comparison.SpecimenErrors | None"
) -> StatedBand:
    """The band with the specimens, resting lengths and maximum rates of the records that it holds
    for, and, of a force, with that of specimens that were not measured, if their errors are
    known."""
    timed = [run for run in recordings if "time" in run]
    if errors is not None and band.quantity == "force":
        band = dataclasses.replace(
            band,
            new_specimen_half_width=errors.half_width,
            new_specimen_source=str(errors),
            new_specimen_slack_force=errors.slack_force,
        )
    return dataclasses.replace(
        band,
        specimens=specimens_of(recordings),
        resting_lengths=tuple(resting_lengths_of(recordings).values()),
        max_contraction_rate=inspection.maximum_rate(timed, "contraction") if timed else None,
        max_pressure_rate=inspection.maximum_rate(timed, "pressure") if timed else None,
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
