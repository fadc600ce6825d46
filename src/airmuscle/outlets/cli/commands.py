"""The command `airmuscle`: table of its commands, errors and exit codes.

Exit code 0: success. 1: failure, with one line on stderr that gives the reason. 2: wrong usage.
130: interrupted.
"""

import contextlib
import importlib
import sys
import warnings
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperGroup

from ...core import AirmuscleError, AirmuscleWarning, exclusive_folders, quotable, suggestion
from .interruption import INTERRUPTED, check_interrupted, deferred_sigint
from .options import install_completion_classes, print_completion_script
from .streams import encodable
from .terminal import RUN_CODE, echo, in_options, warned

SETTINGS: dict[str, Any] = {
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,
    "context_settings": {"help_option_names": ["-h", "--help"], "max_content_width": 110},
}


class CommandRow(NamedTuple):
    """A command: its module in this package and its function there, imported on use; its summary
    for --help.
    """

    name: str
    module: str
    function: str
    summary: str


COMMANDS = (
    CommandRow(
        "reproduce",
        "reproduce",
        "reproduce",
        "Reproduce three papers and test each of their claims.",
    ),
    CommandRow(
        "list",
        "library",
        "list_entries",
        "List muscles, laws, valves, plants, products and data sets.",
    ),
    CommandRow(
        "show", "library", "show", "Show parameters, sources and checks of a library entry."
    ),
    CommandRow("cite", "library", "cite", "Print the references of a library entry."),
    CommandRow(
        "evaluate",
        "library",
        "evaluate",
        "Evaluate a law for two of pressure, contraction and force.",
    ),
    CommandRow(
        "inspect",
        "measurements",
        "inspect",
        "Inspect measurement files: columns, runs, sampling, outliers.",
    ),
    CommandRow("fit", "fit", "fit", "Fit a characteristic to measured points, or compare several."),
    CommandRow("approximate", "fit", "approximate", "Approximate one characteristic by another."),
    CommandRow(
        "convert", "measurements", "convert", "Write measurement files as CSV, Parquet or HDF5."
    ),
    CommandRow(
        "hysteresis", "hysteresis", "hysteresis", "Fit friction models to hysteresis loops."
    ),
    CommandRow(
        "fit-dynamic",
        "fit_dynamic",
        "fit_dynamic",
        "Identify plant parameters from transient records.",
    ),
    CommandRow(
        "fit-regulator",
        "fit_dynamic",
        "fit_regulator_command",
        "Identify a pressure regulator from its response.",
    ),
    CommandRow(
        "fit-joint",
        "fit_joint",
        "fit_joint_command",
        "Identify a joint or an arm from its episodes.",
    ),
    CommandRow(
        "campaign", "campaign", "campaign", "Identify a muscle from all files of a test rig."
    ),
    CommandRow(
        "predict", "predict", "predict", "Predict further records by an identified muscle or plant."
    ),
    CommandRow(
        "fit-volume",
        "fit",
        "fit_volume_command",
        "Fit the volume of a muscle over its contraction.",
    ),
    CommandRow("plan", "plan", "plan", "Design the most informative experiments."),
    CommandRow(
        "fit-live", "fit_live", "fit_live", "Fit a surface while rows arrive; name the next point."
    ),
    CommandRow("size", "size", "size", "Size muscles of the catalogue for a lift or a joint."),
    CommandRow("simulate", "simulate", "simulate", "Simulate the plant of a scenario file."),
    CommandRow("study", "study", "study", "Run a parameter study of a scenario."),
    CommandRow("tune", "tune", "tune", "Tune the controller of a scenario for a family of plants."),
    CommandRow(
        "benchmark", "benchmark", "benchmark", "Benchmark controllers of a joint on common tasks."
    ),
    CommandRow(
        "export", "export", "export", "Export to C, MATLAB, FMU, MuJoCo, PyTorch and other targets."
    ),
    CommandRow("studio", "studio", "studio", "Show muscles and plants in the browser."),
    CommandRow(
        "schema", "simulate", "schema", "Print the JSON schema of scenario or muscle files."
    ),
)
"""All commands, in the order of use."""
_ROWS = {row.name: row for row in COMMANDS}
_UsageError: Any = typer.BadParameter.__base__


class LazyCommands(TyperGroup):
    """The commands of the table; a command's module is imported when the command is called."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(_ROWS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        row = _ROWS.get(cmd_name)
        if row is None:
            return None
        function = getattr(importlib.import_module(f".{row.module}", __package__), row.function)
        check_interrupted()
        command = typer.Typer(**SETTINGS)
        command.command(row.name)(function)
        built: Any = typer.main.get_command(command)
        for parameter in built.params:
            # a help text shows no Python type after the name of an argument
            if parameter.param_type_name == "argument":
                parameter.display_type_rich = lambda ctx: ""
        if row.name in RUN_CODE:
            built.params.append(_allow_code_option())
        return built

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args[0] not in _ROWS:
            ctx.fail(f"No such command '{args[0]}'.{suggestion(args[0], _ROWS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(row.name, row.summary) for row in COMMANDS])

    def make_context(self, *args: Any, **settings: Any) -> Any:
        with _printable_usage_errors():
            return super().make_context(*args, **settings)

    def invoke(self, ctx: Any) -> Any:
        def show(
            message: Warning | str, category: type[Warning], *location: Any, **options: Any
        ) -> None:
            if issubclass(
                category, AirmuscleWarning
            ):  # one line, the others with their location in the code
                text = message.args[0] if isinstance(message, Warning) else message
                warned.add(worded := in_options(text, ctx.invoked_subcommand))
                echo(f"warning: {worded}", err=True)
            else:
                show_other(message, category, *location, **options)

        with warnings.catch_warnings():
            show_other: Any = warnings.showwarning
            warnings.simplefilter("always", AirmuscleWarning)
            warnings.showwarning = show
            with (
                _exit_codes(ctx),
                _printable_usage_errors(),
                deferred_sigint(),
                exclusive_folders(),
            ):
                return super().invoke(ctx)


def _permit(ctx: typer.Context, value: bool) -> None:
    """Permit the code of users until a command ends."""
    if value:
        ctx.with_resource(importlib.import_module("...files", __package__).allow_code())


CODE_WORDS = (
    'Run classes that a file names as model = "module:Class"; only for files that you trust.'
)
AllowCode = Annotated[
    bool, typer.Option("--allow-code", help=CODE_WORDS, callback=_permit, is_eager=True)
]


def _allow_code_option() -> Any:
    """The flag with which a command reads `model = "module:Class"` in its files, taken from a
    command without name.
    """
    bearer = typer.Typer(**SETTINGS)

    @bearer.command()
    def bear(allow_code: AllowCode = False) -> None: ...

    (flag,) = (
        parameter
        for parameter in typer.main.get_command(bearer).params
        if parameter.name == "allow_code"
    )
    flag.expose_value = False
    return flag


@contextlib.contextmanager
def _exit_codes(ctx: Any) -> Iterator[None]:
    """Turn errors into one line on stderr and an exit code."""
    try:
        yield
    except AirmuscleError as error:
        echo(f"error: {in_options(error.message, ctx.invoked_subcommand)}", err=True)
        raise typer.Exit(1) from None
    except BrokenPipeError:
        raise
    except OSError as error:  # a full disk, a closed terminal
        echo(
            "error: " + quotable(f"{error.filename or 'output'}: {error.strerror or error}."),
            err=True,
        )
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        echo("interrupted", err=True)
        raise typer.Exit(INTERRUPTED) from None


@contextlib.contextmanager
def _printable_usage_errors() -> Iterator[None]:
    """Escape control characters of arguments that a usage error quotes, and replace those that
    stderr lacks; typer prints the error itself, in UTF-8 where ASCII is asked for.
    """
    try:
        yield
    except _UsageError as error:
        error.message = encodable(quotable(error.message), sys.stderr)
        raise


install_completion_classes()
app = typer.Typer(cls=LazyCommands, name="airmuscle", no_args_is_help=True, **SETTINGS)


def _print_version(requested: bool) -> None:
    if requested:
        from importlib import metadata

        echo(f"airmuscle {metadata.version('airmuscle')}")
        raise typer.Exit


VERSION = "Print the version and exit."
COMPLETION = "Print the completion script of bash, zsh or fish and exit."
Version = Annotated[
    bool, typer.Option("--version", callback=_print_version, is_eager=True, help=VERSION)
]
Shell = Annotated[
    str | None,
    typer.Option(metavar="SHELL", callback=print_completion_script, is_eager=True, help=COMPLETION),
]


@app.callback()
def airmuscle(version: Version = False, completion: Shell = None) -> None:
    """Models, identification and simulation of pneumatic artificial muscles.

    Pressures are gauge pressures unless the unit is an absolute one (bara, kPa(a), psia).
    An absolute pressure is converted with the ambient pressure of the plant or file; without one,
    101.325 kPa.

    \b
    Examples:
      airmuscle reproduce --out report
      airmuscle evaluate dmsp-20-300 --pressure "3 bar" --force "100 N" --out chart
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out
          fit
      airmuscle simulate scenario.toml --out run
    """
