"""Types of the arguments of a static fit."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.annotation import one_line
from ...core.errors import ParameterError
from ...physics.muscle.characteristic.base import Characteristic
from ...recording import Recording


def check_arguments(characteristic: object, recording: object) -> None:
    """Raise ParameterError for a characteristic or a recording of another type."""
    if not isinstance(characteristic, Characteristic):
        raise ParameterError(
            f"fit: {_describe_argument(characteristic)} is not a characteristic. Give one, for example "
            f"{_initial_law(characteristic)}."
        )
    runs = recording if isinstance(recording, Sequence) and not isinstance(recording, str) else [recording]
    for run in runs:
        if not isinstance(run, Recording):
            raise ParameterError(
                f"fit: {one_line(run)} is not a Recording. Give one, as returned by read, read_csv or simulate."
            )


def _describe_argument(argument: object) -> str:
    return f"the class {argument.__name__}" if isinstance(argument, type) else one_line(argument)


def _initial_law(argument: object) -> str:
    """A characteristic to fit as an expression, of the class of the argument if that is a class of characteristics."""
    if isinstance(argument, type) and issubclass(argument, Characteristic):
        values = ".blank(degree=5)" if hasattr(argument, "blank") else "(...) with initial values"
        return f"an object of the class, {argument.__name__}{values}"
    return "load(...).characteristic"
