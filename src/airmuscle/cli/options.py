"""Arguments and options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Name = Annotated[
    str,
    typer.Argument(metavar="NAME", help="A library entry, a unique prefix of its name, or a muscle file (TOML)."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in SI units instead of a table.")]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Output folder; created if it does not exist.")]
"""An output folder that the command always writes."""
OptionalFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Output folder for figures and data; default: none.")
]
Mapping = Annotated[
    Path | None,
    typer.Option("--mapping", metavar="FILE", help="Column mapping (TOML) for headers without quantity or unit."),
]
