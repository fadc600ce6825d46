"""Options of the command line from declared requests."""

import contextlib
import functools
import inspect
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

from ..requests.declaration import Option, RequestError, build, options_of

Command = TypeVar("Command", bound=Callable[..., None])
_METAVARS: dict[type[Any], str] = {int: "N", float: "NUMBER", str: "NAME", Path: "FILE"}


def with_requests(command: Command) -> Command:
    """A command each of whose parameters that is a request is replaced by the options that the request declares.

    A request that is not possible ends the command with a message on its usage.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters, classes = list[inspect.Parameter](), dict[str, type[Any]]()
    for parameter in inspect.signature(command).parameters.values():
        hint = hints[parameter.name]
        if isinstance(hint, type) and options_of_request(hint):
            classes[parameter.name] = hint
            parameters += map(_parameter, options_of(hint))
        else:
            parameters.append(parameter.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY))

    @functools.wraps(command)
    def expanded(**values: Any) -> None:
        for name, cls in classes.items():
            flags = {each.name: flag_of(each) for each in options_of(cls)}
            given = {each: values.pop(each) for each in flags}
            with _usage_errors():
                values[name] = build(cls, given, flags.__getitem__)
        with _usage_errors():
            command(**values)

    setattr(expanded, "__signature__", inspect.Signature(parameters))  # noqa: B010
    expanded.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return expanded  # type: ignore[return-value]


@contextlib.contextmanager
def _usage_errors() -> Iterator[None]:
    """Turn an impossible request into an error of usage."""
    try:
        yield
    except RequestError as error:
        raise typer.BadParameter(str(error)) from None


def options_of_request(cls: Any) -> bool:
    """Whether a class is a request."""
    return "__dataclass_fields__" in cls.__dict__ and bool(options_of(cls))


def flag_of(declared: Option) -> str:
    """The name of a field on the command line."""
    return declared.flag or f"--{declared.name.replace('_', '-')}"


def _parameter(declared: Option) -> inspect.Parameter:
    """The parameter of a command for a field, which is given as text where the field has a unit."""
    as_text = bool(declared.unit or declared.read or declared.choices)
    kind: Any = str if as_text else declared.kind
    if declared.repeated:
        kind = list[kind]
    settings: dict[str, Any] = {
        "metavar": declared.metavar or ("QUANTITY" if declared.unit else _METAVARS.get(declared.kind)),
        "help": declared.meaning,
    }
    if declared.complete is not None:
        settings["autocompletion"] = declared.complete
    if declared.kind is int:
        low, high = (int(bound) if math.isfinite(bound) else None for bound in declared.bounds)
        settings |= {"min": low, "max": high}
    default = inspect.Parameter.empty if declared.needed else declared.default
    taken: Any = kind if default is not None else kind | None
    annotation = Annotated[taken, typer.Option(flag_of(declared), **settings)]
    return inspect.Parameter(declared.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
