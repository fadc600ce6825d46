"""Options of a command that declared requests state."""

import functools
import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import click

from ..requests.declaration import Option, RequestError, build, options_of
from .parser import CommandOption

Command = TypeVar("Command", bound=Callable[..., None])
_METAVARS: dict[type[Any], str] = {int: "N", float: "NUMBER", str: "NAME", Path: "FILE"}


def with_requests(command: Command) -> Command:
    """A command each of whose parameters that is a request is replaced by the options that the
    request declares.

    A request that is not possible ends the command with a message on its usage.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters = list[inspect.Parameter]()
    classes = dict[str, type[Any]]()
    for parameter in inspect.signature(command).parameters.values():
        hint = hints[parameter.name]
        if isinstance(hint, type) and "__dataclass_fields__" in hint.__dict__ and options_of(hint):
            classes[parameter.name] = hint
            parameters += map(_parameter, options_of(hint))
        else:
            parameters.append(
                parameter.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY)
            )

    @functools.wraps(command)
    def expanded(**values: Any) -> None:
        try:
            for name, cls in classes.items():
                flags = {option.name: flag_of(option) for option in options_of(cls)}
                values[name] = build(
                    cls, {field: values.pop(field) for field in flags}, flags.__getitem__
                )
            command(**values)
        except RequestError as error:
            raise click.BadParameter(str(error)) from None

    setattr(expanded, "__signature__", inspect.Signature(parameters))  # noqa: B010
    expanded.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return expanded  # type: ignore[return-value]


def flag_of(declared: Option) -> str:
    """The name of a field on the command line."""
    return declared.flag or f"--{declared.name.replace('_', '-')}"


def _parameter(declared: Option) -> inspect.Parameter:
    """The parameter of a command for a field, which is given as text where the field has a unit."""
    as_text = bool(declared.unit or declared.read or declared.choices)
    kind: Any = str if as_text else declared.kind
    if declared.repeated:
        kind = list[kind]
    low, high = (int(bound) if math.isfinite(bound) else None for bound in declared.bounds)
    parsed = CommandOption(
        flag_of(declared),
        declared.meaning,
        declared.metavar or ("QUANTITY" if declared.unit else _METAVARS.get(declared.kind)),
        (low, high) if declared.kind is int else (None, None),
        declared.complete,
    )
    default = inspect.Parameter.empty if declared.needed else declared.default
    taken: Any = kind if default is not None else kind | None
    return inspect.Parameter(
        declared.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[taken, parsed],
    )
