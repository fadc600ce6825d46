"""The command `airmuscle`: its commands, and how each of them ends.

Exit code 0 is well, 1 the work failed (one line on stderr says why), 2 wrong usage, 130 interrupted.
"""

from __future__ import annotations

import functools
import warnings
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from ..core.errors import AirmuscleError, AirmuscleWarning
from .cite import cite
from .convert import convert
from .fit import fit
from .fit_dynamic import fit_dynamic
from .hysteresis import hysteresis
from .inspect import inspect
from .interruption import deferred_sigint
from .list import list_entries
from .plan import plan
from .remedies import in_options
from .reproduce import reproduce
from .schema import schema
from .show import show
from .simulate import simulate
from .solve import solve
from .sweep import sweep


class Commands(TyperGroup):
    """Lists the commands in the order of use, and turns errors and warnings into one line each."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(self.commands)

    def invoke(self, ctx: Any) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("always", AirmuscleWarning)
            warnings.showwarning = functools.partial(_show_warning, warnings.showwarning)
            try:
                with deferred_sigint():
                    return super().invoke(ctx)
            except AirmuscleError as error:
                typer.echo(f"error: {in_options(str(error))}", err=True)
                raise typer.Exit(1) from None
            except BrokenPipeError:
                raise
            except OSError as error:  # a full disk, a terminal that went away
                typer.echo(f"error: {error.filename or 'output'}: {error.strerror or error}.", err=True)
                raise typer.Exit(1) from None
            except KeyboardInterrupt:
                typer.echo("interrupted", err=True)
                raise typer.Exit(130) from None


def _show_warning(others: Any, message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """One line for a warning of ours; those of others say where they come from."""
    if issubclass(category, AirmuscleWarning):
        typer.echo(f"warning: {in_options(str(message))}", err=True)
    else:
        others(message, category, *place, **more)


app = typer.Typer(
    cls=Commands,
    name="airmuscle",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
app.command("reproduce", short_help="Reproduce the papers, and judge each of their claims.")(reproduce)
app.command("list")(list_entries)
app.command("show", short_help="Show parameters, sources and checks of an entry.")(show)
app.command("cite")(cite)
app.command("solve", short_help="From two of pressure, contraction and force get the third.")(solve)
app.command("inspect", short_help="Show what was understood of bench files.")(inspect)
app.command("fit")(fit)
app.command("convert", short_help="Bring one model as near to another as it comes.")(convert)
app.command("hysteresis", short_help="Fit friction to loops, and say whether the data justify it.")(hysteresis)
app.command("fit-dynamic", short_help="Find a plant's numbers from records of its motion.")(fit_dynamic)
app.command("plan", short_help="Say which runs tell most about a muscle on your bench.")(plan)
app.command("simulate", short_help="Simulate a plant that a scenario file describes.")(simulate)
app.command("sweep", short_help="Run a scenario many times, with numbers that vary.")(sweep)
app.command("schema", short_help="Print what editors need to check scenario and muscle files.")(schema)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib import metadata

        typer.echo(f"airmuscle {metadata.version('airmuscle')}")
        raise typer.Exit


@app.callback()
def airmuscle(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Models, identification and simulation of pneumatic artificial muscles.

    Pressures are gauge unless their unit says absolute (bara, kPa(a), psia).

    \b
    Examples:
      airmuscle reproduce --out report
      airmuscle solve dmsp-20-300 --pressure "3 bar" --force "100 N" --out chart
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out fit
      airmuscle simulate scenario.toml --out run
    """


def main() -> None:
    """Run the command line and leave with its exit code."""
    app(prog_name="airmuscle")
