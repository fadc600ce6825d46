"""Entry point of the command `airmuscle`: interruptions are handled before anything else is imported."""

from __future__ import annotations

import importlib
import sys

from .interruption import INTERRUPTED, check_interrupted, deferred_sigint


def main() -> None:
    """Run the command line and exit with its exit code; an interruption, also of an import, exits with 130."""
    try:
        with deferred_sigint():
            app = importlib.import_module(".app", __package__).app
            check_interrupted()
            app(prog_name="airmuscle")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
