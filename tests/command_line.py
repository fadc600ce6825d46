"""The command line in the process of a test."""

from __future__ import annotations

from typing import Any

from click.testing import Result
from typer.testing import CliRunner

from airmuscle.outlets.cli import app


def airmuscle(*arguments: object, width: int = 160, **options: Any) -> Result:
    """`airmuscle ARGUMENTS` in a terminal of this width; options are those of `CliRunner.invoke`, such as `input`."""
    environment = {"COLUMNS": str(width), **options.pop("env", {})}
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env=environment, **options)
