"""Record that separates two parameters of a dynamic fit, for `airmuscle plan STUDY.toml`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import typer

from ...bench.identify.dynamic import RecordRanking, rank_records
from ...core.atomic_output import atomic_folder, check_writable
from ...files.scenario.identification import load_dynamic_fit
from ...report.chapter import Chapter, Table
from ...report.write import save_table, write_into
from .terminal import echo, print_json, print_table


def describes_study(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a file describe a study of fit-dynamic."""
    return "fit" in tables and "record" in tables


def plan_records(study: Path, separate: Sequence[str], out: Path | None, json: bool) -> None:
    """Fit a study, rank the candidate records, and print and write the ranking.

    Raises BadParameter unless none or two parameters are to be separated.
    """
    if len(separate) not in (0, 2):
        raise typer.BadParameter(f"--separate names {len(separate)} parameters; give two, or none")
    if out is not None:
        check_writable(out)
    loaded = load_dynamic_fit(study)
    pair = (separate[0], separate[1]) if separate else None
    ranking = rank_records(loaded.fit(), pair)
    if out is not None:
        _write(ranking, loaded.title, out)
    if json:
        print_json(dataclasses.asdict(ranking) | {"verdict": ranking.verdict})
        return
    echo(ranking.verdict)
    columns = _columns(ranking)
    rows = [tuple(map(_text, row)) for row in zip(*columns.values(), strict=True)]
    print_table(tuple(columns), rows, right=tuple(columns)[1:])
    for reason in ranking.failed:
        echo(f"note: left out: {reason}")
    if out is not None:
        echo(f"plan: {out / 'plan.csv'}")
        echo(f"report: {out / 'report.html'}")


def _write(ranking: RecordRanking, title: str, out: Path) -> None:
    table = Table("ranking", "Expected precision with one further record", _columns(ranking))
    chapter = Chapter("plan", f"Next record: {title}", ranking.verdict, tables=(table,))
    with atomic_folder(out) as folder:
        save_table(table, folder / "plan.csv")
        write_into(folder, [chapter], title="Next record")


def _text(cell: Any) -> str:
    return cell if isinstance(cell, str) else f"{cell:.3g}"


def _columns(ranking: RecordRanking) -> dict[str, list[Any]]:
    """The candidate records with gain, correlation and relative standard errors of the pair; first without one."""
    precisions = [ranking.now, *(each.precision for each in ranking.ranking)]
    columns: dict[str, list[Any]] = {
        "record in addition": ["none", *(each.description for each in ranking.ranking)],
        "gain": [1.0, *(each.gain for each in ranking.ranking)],
        "correlation": [each.correlation for each in precisions],
    }
    for i, name in enumerate(ranking.pair):
        columns[f"stderr of {name} [%]"] = [100.0 * each.standard_errors[i] for each in precisions]
    return columns
