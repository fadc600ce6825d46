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

import click
from click.shell_completion import CompletionItem

from ...core.errors import AirmuscleError, AirmuscleWarning, quotable, suggestion
from ...core.folder_locks import exclusive_folders
from .. import cli
from .interruption import INTERRUPTED, check_interrupted, deferred_sigint
from .options import PROGRAM, print_completion_script
from .parser import SETTINGS, CommandOption, command_of, parameter_of
from .streams import encodable
from .terminal import echo, warned


class CommandRow(NamedTuple):
    """A command: its summary for --help, its module in this package and its function there, both
    imported on use and named as the command where they are empty; whether it has --allow-code.
    """

    name: str
    summary: str
    module: str = ""
    function: str = ""
    runs_code: bool = False

    @property
    def own_name(self) -> str:
        """The name of the command as that of a module or a function."""
        return self.name.replace("-", "_")

    @property
    def module_name(self) -> str:
        """The module of the command in this package."""
        return self.module or self.own_name

    def load(self) -> Any:
        """The function of the command."""
        module = importlib.import_module(f".{self.module_name}", __package__)
        return getattr(module, self.function or self.own_name)


COMMANDS = (
    CommandRow("reproduce", "Reproduce three papers and test each of their claims."),
    CommandRow(
        "list",
        "List muscles, laws, valves, plants, products and data sets.",
        module="listing",
        function="list_entries",
    ),
    CommandRow(
        "show",
        "Show parameters, sources and checks of a library entry.",
        module="library",
        runs_code=True,
    ),
    CommandRow("diff", "Compare two muscles or laws: parameters and forces.", module="difference"),
    CommandRow("cite", "Print the references of a library entry.", module="library"),
    CommandRow(
        "evaluate", "Evaluate a law for two of pressure, contraction and force.", runs_code=True
    ),
    CommandRow("inspect", "Inspect measurement files: columns, runs, sampling, outliers."),
    CommandRow("check", "Check whether records are usable, right after a measurement."),
    CommandRow("audit", "Examine a muscle law, an orifice or constants of others.", runs_code=True),
    CommandRow("recipe", "Predict a muscle made by hand from tube, braid and length."),
    CommandRow(
        "fit", "Fit a characteristic to measured points, or compare several.", runs_code=True
    ),
    CommandRow("approximate", "Approximate one characteristic by another.", runs_code=True),
    CommandRow("convert", "Write measurement files as CSV, Parquet or HDF5."),
    CommandRow("hysteresis", "Fit friction models to hysteresis loops.", runs_code=True),
    CommandRow("fit-dynamic", "Identify plant parameters from transient records."),
    CommandRow(
        "fit-regulator",
        "Identify a pressure regulator from its response.",
        module="fit_dynamic",
        function="fit_regulator_command",
    ),
    CommandRow(
        "fit-joint", "Identify a joint or an arm from its episodes.", function="fit_joint_command"
    ),
    CommandRow("campaign", "Identify a muscle from all files of a test rig."),
    CommandRow(
        "predict", "Predict further records by an identified muscle, plant or arm.", runs_code=True
    ),
    CommandRow(
        "fit-volume",
        "Fit the volume of a muscle over its contraction.",
        function="fit_volume_command",
    ),
    CommandRow("plan", "Design the most informative experiments.", runs_code=True),
    CommandRow(
        "play", "Play planned signals on a test rig and record them.", function="play_signals"
    ),
    CommandRow("watch", "Read, check and fit the new files of a folder as they come."),
    CommandRow("fit-live", "Fit a surface while rows arrive; name the next point."),
    CommandRow("size", "Size muscles of the catalogue for a lift, a joint or a gripper."),
    CommandRow("body", "Study the routes of muscles on a robot's body."),
    CommandRow(
        "fit-out",
        "Choose the muscles of a robot's body for its routes.",
        function="fit_out_command",
    ),
    CommandRow("route", "Move points of routes so that they meet torques over angles."),
    CommandRow("cam", "Design a cam on which a muscle gives a torque over the angle."),
    CommandRow("simulate", "Simulate the plant of a scenario file.", runs_code=True),
    CommandRow("study", "Run a parameter study of a scenario.", runs_code=True),
    CommandRow("tune", "Tune the controller of a scenario for a family of plants.", runs_code=True),
    CommandRow("compare", "Compare the controllers of scenarios on one plant.", runs_code=True),
    CommandRow(
        "export", "Export to C, MATLAB, FMU, MuJoCo, PyTorch and other targets.", runs_code=True
    ),
    CommandRow("submit", "Prepare a muscle and its records for the library."),
    CommandRow("studio", "Show muscles and plants in the browser."),
    CommandRow("site", "Write a page with the whole library, without a server."),
    CommandRow(
        "schema",
        "Print the JSON schema of scenario or muscle files.",
        module="simulate",
        runs_code=True,
    ),
)
"""All commands, in the order of use."""
RUN_CODE = tuple(row.name for row in COMMANDS if row.runs_code)
"""Commands with --allow-code."""
_ROWS = {row.name: row for row in COMMANDS}
_UsageError: Any = click.BadParameter.__base__


class LazyCommands(click.Group):
    """The commands of the table; a command's module is imported when the command is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_ROWS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        row = _ROWS.get(cmd_name)
        if row is None:
            return None
        function = row.load()
        check_interrupted()
        command = command_of(function, row.name)
        if row.runs_code:
            command.params.append(parameter_of("allow_code", AllowCode, False))
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if args[0] not in _ROWS:
            ctx.fail(f"No such command '{args[0]}'.{suggestion(args[0], _ROWS)}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        commands = [
            CompletionItem(row.name, help=row.summary)
            for row in COMMANDS
            if row.name.startswith(incomplete)
        ]
        return commands + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(row.name, row.summary) for row in COMMANDS])

    def make_context(self, *args: Any, **settings: Any) -> click.Context:
        with _printable_usage_errors():
            return super().make_context(*args, **settings)

    def invoke(self, ctx: click.Context) -> Any:
        def show(
            message: Warning | str, category: type[Warning], *location: Any, **options: Any
        ) -> None:
            if issubclass(
                category, AirmuscleWarning
            ):  # one line, the others with their location in the code
                text = message.args[0] if isinstance(message, Warning) else message
                warned.add(worded := cli.in_options(text, ctx.invoked_subcommand))
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


def _permit(ctx: click.Context, value: bool) -> None:
    """Permit the code of users until a command ends."""
    if value:
        ctx.with_resource(importlib.import_module("...files", __package__).allow_code())


CODE_WORDS = (
    'Run classes that a file names as model = "module:Class"; only for files that you trust.'
)
AllowCode = Annotated[bool, CommandOption("--allow-code", CODE_WORDS, action=_permit)]


@contextlib.contextmanager
def _exit_codes(ctx: click.Context) -> Iterator[None]:
    """Turn errors into one line on stderr and an exit code."""
    try:
        yield
    except AirmuscleError as error:
        echo(f"error: {cli.in_options(error.message, ctx.invoked_subcommand)}", err=True)
        raise click.exceptions.Exit(1) from None
    except BrokenPipeError:
        raise
    except OSError as error:  # a full disk, a closed terminal
        echo(
            "error: " + quotable(f"{error.filename or 'output'}: {error.strerror or error}."),
            err=True,
        )
        raise click.exceptions.Exit(1) from None
    except KeyboardInterrupt:
        echo("interrupted", err=True)
        raise click.exceptions.Exit(INTERRUPTED) from None


RENAMED_OPTIONS: dict[tuple[str | None, str], str] = {
    ("tune", "--budget"): (
        "tune has no --budget, which is a time wherever it is an option. To limit the number of"
        " simulated loops: --simulations 4000"
    )
}
"""The error for an option of a command that had another name before."""


@contextlib.contextmanager
def _printable_usage_errors() -> Iterator[None]:
    """Escape control characters of arguments that a usage error quotes, and replace those that
    stderr lacks; the parser prints the error itself, in UTF-8 where ASCII is asked for.
    """
    try:
        yield
    except click.exceptions.NoArgsIsHelpError:
        raise
    except click.UsageError as error:
        command = error.ctx.info_name if error.ctx is not None else None
        option = getattr(error, "option_name", "")
        message = RENAMED_OPTIONS.get((command, option)) or error.format_message()
        text = encodable(quotable(message), sys.stderr)
        raise click.UsageError(text, error.ctx) from None


def _print_version(ctx: click.Context, requested: bool) -> None:
    if requested:
        from importlib import metadata

        echo(f"airmuscle {metadata.version('airmuscle')}")
        ctx.exit()


VERSION = "Print the version and exit."
COMPLETION = "Print the completion script of bash, zsh or fish and exit."
Version = Annotated[bool, CommandOption("--version", VERSION, action=_print_version)]
Shell = Annotated[
    str | None,
    CommandOption("--completion", COMPLETION, "SHELL", action=print_completion_script),
]


def airmuscle() -> None:
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


app = LazyCommands(
    PROGRAM,
    callback=airmuscle,
    help=airmuscle.__doc__,
    params=[parameter_of("version", Version, False), parameter_of("completion", Shell, None)],
    no_args_is_help=True,
    context_settings=SETTINGS,
)
"""The program with all its commands."""
