"""The command line in the process of a test."""

from __future__ import annotations

import json
import re
from typing import Any

from click.testing import CliRunner, Result
from json_keys import undocumented

from airmuscle.outlets.cli import app


def command_names() -> list[str]:
    """All commands, in the order of the help text."""
    listed = airmuscle("--help").output.partition("Commands:")[2]
    return re.findall(r"^  ([\w-]+)  +.*$", listed, re.MULTILINE)


def airmuscle(*arguments: object, width: int = 160, **options: Any) -> Result:
    """`airmuscle ARGUMENTS` in a terminal of this width; options are those of `CliRunner.invoke`,
    such as `input`.

    The keys of an answer in JSON are those that the documentation lists; `fit-live` prints a line
    for each step.
    """
    environment = {"COLUMNS": str(width), **options.pop("env", {})}
    result = CliRunner().invoke(
        app, [str(argument) for argument in arguments], env=environment, **options
    )
    chapters = (
        "--json" in arguments and arguments[0] != "fit-live" and result.stdout.startswith("{")
    )
    if chapters and result.exit_code == 0:
        missing = undocumented(json.loads(result.stdout))
        assert not missing, f"docs/reference/json-keys.md lacks {missing}"
    return result
