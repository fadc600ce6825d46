"""`airmuscle schema`: JSON schema of scenario and muscle files."""

from pathlib import Path
from typing import Annotated

import typer

from ...core import atomic_folder
from ...files.scenario.schema import muscle_schema, scenario_schema
from ...report.data import as_json
from .terminal import echo, print_json


def schema(
    muscle: Annotated[
        bool, typer.Option("--muscle", help="The schema of muscle files; default: of scenario files.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Output file; default: print to stdout.")
    ] = None,
) -> None:
    """Print the JSON schema of scenario or muscle files.

    \b
    Editors use the schema to check and complete TOML files. It is generated from the models of this version, so it
    allows exactly what this version reads.
    The first line of a TOML file names its schema: #:schema scenario.schema.json

    \b
    Examples:
      airmuscle schema --out scenario.schema.json
      airmuscle schema --muscle --out muscle.schema.json
    """
    content = muscle_schema() if muscle else scenario_schema()
    if out is None:
        print_json(content)
        return
    if not out.name:
        raise typer.BadParameter("--out must be a file name, such as scenario.schema.json")
    with atomic_folder(out.parent) as folder:
        (folder / out.name).write_text(as_json(content), encoding="utf-8")
    echo(f"schema: {out}")
