"""Parsers of commands: arguments and options of a function, which its annotations declare."""

import inspect
from collections.abc import Callable
from pathlib import Path
from types import NoneType
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import click

SETTINGS: dict[str, Any] = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
"""Settings of the parser of every command."""
Completion = Callable[[str], list[str]]
"""The names that complete the beginning of one."""


class Argument(NamedTuple):
    """An argument of a command: its placeholder, its help text, and the completion of its names."""

    metavar: str
    meaning: str
    complete: Completion | None = None


class CommandOption(NamedTuple):
    """An option of a command: its name, its help text, the placeholder of its value, the range of
    an integer, and the completion of names.

    The value of an option with an `action` is passed to it, before all others are read, and not to
    the command.
    """

    flag: str
    meaning: str
    metavar: str | None = None
    bounds: tuple[int | None, int | None] = (None, None)
    complete: Completion | None = None
    action: Callable[[click.Context, Any], None] | None = None


class DescribedArgument(click.Argument):
    """An argument with a help text, of which `word` is the heading."""

    def __init__(self, name: str, word: str, meaning: str, **settings: Any) -> None:
        repeated = settings["nargs"] == -1
        shown = word if settings.get("required", False) else f"[{word}]"
        super().__init__([name], metavar=shown + "..." * repeated, **settings)
        self.word = word
        self.meaning = meaning


class DescribedCommand(click.Command):
    """A command whose help describes its arguments, too."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        rows = [
            (argument.word, argument.meaning + "  [required]" * argument.required)
            for argument in self.get_params(ctx)
            if isinstance(argument, DescribedArgument)
        ]
        if rows:
            with formatter.section("Arguments"):
                formatter.write_dl(rows)
        super().format_options(ctx, formatter)


def command_of(function: Callable[..., Any], name: str) -> click.Command:
    """The command of a function, each of whose parameters is annotated with an Argument or a
    CommandOption.
    """
    hints = get_type_hints(function, include_extras=True)
    parameters = inspect.signature(function).parameters.values()
    return DescribedCommand(
        name,
        callback=function,
        help=function.__doc__,
        params=[parameter_of(p.name, hints[p.name], p.default) for p in parameters],
        context_settings=SETTINGS,
    )


def parameter_of(name: str, hint: Any, default: Any) -> click.Parameter:
    """The parameter of a parser for an annotation with an Argument or a CommandOption."""
    taken, declared = get_args(hint)
    kinds = [kind for kind in get_args(taken) or (taken,) if kind is not NoneType]
    repeated = get_origin(taken) is list or get_origin(kinds[0]) is list
    (kind,) = get_args(kinds[0]) or kinds
    settings: dict[str, Any] = {"type": _type_of(kind, declared)}
    if default is inspect.Parameter.empty:
        settings["required"] = True
    elif not repeated:
        settings["default"] = default
    if declared.complete is not None:
        complete = declared.complete
        settings["shell_complete"] = lambda ctx, param, incomplete: complete(incomplete)
    if isinstance(declared, Argument):
        return DescribedArgument(
            name, declared.metavar, declared.meaning, nargs=-1 if repeated else 1, **settings
        )
    if declared.action is not None:
        action = declared.action
        settings |= {
            "callback": lambda ctx, param, value: action(ctx, value),
            "is_eager": True,
            "expose_value": False,
        }
    if kind is bool:
        settings = {key: value for key, value in settings.items() if key != "type"}
        settings["is_flag"] = True
    return click.Option(
        [name, declared.flag],
        help=declared.meaning,
        metavar=declared.metavar,
        multiple=repeated,
        show_default=settings.get("default") != "",
        **settings,
    )


def _type_of(kind: type[Any], declared: Argument | CommandOption) -> Any:
    """The type of a parser for a type of Python."""
    if kind is Path:
        return click.Path(path_type=Path)
    if kind is int and isinstance(declared, CommandOption) and declared.bounds != (None, None):
        return click.IntRange(*declared.bounds)
    return kind
