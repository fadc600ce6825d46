"""Output of `airmuscle fit`: text, JSON, muscle file and report."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...bench.identify import Fit
from ...core.atomic_output import atomic_folder
from ...files.library.entry import Entry
from ...files.library.write import write_fit
from ...recording import Recording
from ...report.chapter import Chapter
from .option_hints import in_options
from .terminal import echo


def print_results(lines: Sequence[str], out: Path) -> None:
    """Print the results and the paths of the files that were written."""
    for line in lines:
        echo(line)
    echo(f"muscle: {out / 'muscle.toml'}")
    echo(f"report: {out / 'report.html'}")


def with_option_names(result: Fit) -> Fit:
    """The fit whose notes name options of `airmuscle fit` instead of Python arguments."""
    return result.with_notes(in_options(note, "fit") for note in result.notes)


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
        "standard_errors": result.error_basis,
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
        write_fit(folder, with_option_names(result), entry, recordings, chapters)
