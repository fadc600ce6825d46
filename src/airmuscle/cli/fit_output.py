"""Output of `airmuscle fit`: text, JSON, muscle file and report."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..identify import Fit
from ..library.entry import Entry
from ..library.write import save
from ..recording import Recording
from ..report.chapter import Chapter
from ..report.fit_chapter import fit_chapter
from ..report.output_folder import atomic_folder
from ..report.write import write_into
from .fit_geometry import fitted_geometry, missing_geometry
from .option_hints import in_options
from .terminal import echo

MAX_NAMES, MAX_NAME = 3, 60
"""Maximum number of file names in a title, and of characters of each (chosen)."""


def print_results(lines: Sequence[str], out: Path) -> None:
    """Print the results and the paths of the files that were written."""
    for line in lines:
        echo(line)
    echo(f"muscle: {out / 'muscle.toml'}")
    echo(f"report: {out / 'report.html'}")


def fitted_entry(result: Fit, initial: Entry, files: list[Path]) -> Entry:
    """The initial entry with the fitted characteristic and a new provenance, without its checks."""
    summary = dict(result.summary())
    names = list_files([f.name for f in files])
    note = f"Fitted to {names}: rms error {summary['rms error']}, maximum error {summary['maximum error']}."
    geometry = fitted_geometry(initial, result.model)
    title = f"{type(result.model).__name__} fitted to {list_files([f.stem for f in files])}"
    entry = dataclasses.replace(
        initial, name="muscle", title=title, provenance="fitted", note=note, warning="", characteristic=result.model,
        geometry=geometry, validity_range=result.validity_range, checks=(),
    )  # fmt: skip
    return dataclasses.replace(entry, note=" ".join([note, *missing_geometry(entry)]))


def with_option_names(result: Fit) -> Fit:
    """The fit whose notes name options of `airmuscle fit` instead of Python arguments."""
    return dataclasses.replace(result, notes=tuple(in_options(note, "fit") for note in result.notes))


def list_files(names: Sequence[str]) -> str:
    """The names of files for a title: up to three of them, else their number with the first and the last."""
    short = [name if len(name) <= MAX_NAME else f"{name[: MAX_NAME // 2]}…{name[-MAX_NAME // 2 :]}" for name in names]
    if len(short) <= MAX_NAMES:
        return ", ".join(short)
    return f"{len(short)} files, {short[0]} to {short[-1]}"


def fit_to_dict(result: Fit) -> dict[str, Any]:
    """A fit as plain data, all numbers SI."""
    return {
        "model": type(result.model).__name__,
        "quantity": result.fitted_quantity.name,
        "unit": result.fitted_quantity.unit,
        "parameters": [dataclasses.asdict(estimate) for estimate in result.estimates],
        "rmse": result.rmse,
        "max_error": dataclasses.asdict(result.max_error),
        "sigma": result.sigma,
        "r2": result.r2,
        "correlation_index": result.ik,
        "rank": result.rank,
        "condition": result.condition,
        "rows_used": result.rows_used,
        "rows_censored": result.rows_censored,
        "rows_dropped": result.rows_dropped,
        "valid_for": result.data_ranges,
        "notes": list(with_option_names(result).notes),
    }


def write_results(
    result: Fit, entry: Entry, recordings: list[Recording], out: Path, chapters: Sequence[Chapter] = ()
) -> None:
    """Write muscle file and report into one folder, completely or not at all; `chapters` precede that of the fit."""
    with atomic_folder(out) as folder:
        save(entry, folder / "muscle.toml")
        notes = tuple(dict.fromkeys(note for recording in recordings for note in recording.notes))
        write_into(folder, [*chapters, fit_chapter(with_option_names(result), entry, notes)], title="Fit")
