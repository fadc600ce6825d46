"""`airmuscle schema`: what an editor needs to check and complete the files that people write."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    muscle: Annotated[
        bool, typer.Option("--muscle", help="The schema of a muscle file instead of a scenario's.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write; it is printed without it.")
    ] = None,
) -> None:
    """Print the JSON schema of a scenario file, for editors that check and complete TOML.

    \b
    It is made from the program's own models: what it allows is what this version reads.
    An editor is told by the first line of the file: #:schema scenario.schema.json

    \b
    Examples:
      airmuscle schema --out scenario.schema.json
      airmuscle schema --muscle --out muscle.schema.json
    """
    from ..report.output_folder import atomic_folder
    from ..report.write import as_json
    from ..scenario.schema import muscle_schema, scenario_schema

    text = as_json(muscle_schema() if muscle else scenario_schema())
    if out is None:
        typer.echo(text, nl=False)
        return
    if not out.name:
        raise typer.BadParameter("--out wants the name of a file, like scenario.schema.json")
    with atomic_folder(out.parent) as place:
        (place / out.name).write_text(text, encoding="utf-8")
    typer.echo(f"schema: {out}")
