"""Output of the fit commands: files, tables and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..identify.result import Fit
    from ..library.entry import Entry
    from ..recording import Recording
    from ..report.chapter import Chapter

from pathlib import Path
from typing import Any

import typer

from .remedies import in_options


def echo(lines: Sequence[str], out: Path) -> None:
    """What was found, and where it stands."""
    for line in lines:
        typer.echo(in_options(line))
    typer.echo(f"muscle: {out / 'muscle.toml'}")
    typer.echo(f"report: {out / 'report.html'}")


def fitted(result: Fit, start: Entry, files: list[Path]) -> Entry:
    """The fitted muscle with the parts of the one it started from; its checks and trust were of other numbers."""
    import dataclasses

    summary = dict(result.summary())
    names = ", ".join(f.name for f in files)
    note = f"Fitted to {names}: rms error {summary['rms error']}, maximum {summary['maximum error']}."
    title = f"{type(result.model).__name__} fitted to {', '.join(f.stem for f in files)}"
    return dataclasses.replace(
        start, name="muscle", title=title, provenance="fitted", note=note, warning="", characteristic=result.model,
        validity_range=result.validity_range, checks=(),
    )  # fmt: skip


def as_data(result: Fit) -> dict[str, Any]:
    """A fit as plain data, all numbers SI."""
    import dataclasses

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
        "notes": list(result.notes),
    }


def write(result: Fit, entry: Entry, recordings: list[Recording], out: Path, chapters: Sequence[Chapter] = ()) -> None:
    """Muscle and report in one folder, whole or not at all; `chapters` stand before the fit's own."""
    import dataclasses

    from ..library.write import save
    from ..report.fit_chapter import fit_chapter
    from ..report.output_folder import atomic_folder
    from ..report.write import write_into

    with atomic_folder(out) as place:
        save(entry, place / "muscle.toml")
        notes = tuple(dict.fromkeys(note for run in recordings for note in run.notes))
        worded = dataclasses.replace(result, notes=tuple(in_options(note) for note in result.notes))
        write_into(place, [*chapters, fit_chapter(worded, entry, notes)], title="Fit")
