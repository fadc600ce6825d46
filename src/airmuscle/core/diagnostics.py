"""Status: how a computation ended; diagnostic: remark on a result, with code, subject, rows and
hint.
"""

import dataclasses
import enum
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Self

from .arrays import Array
from .errors import Hint, HintedText


class Status(enum.IntEnum):
    """How a computation ended; `message` is the reason in words. `simulate` never returns PAUSED or
    NOT_STARTED.
    """

    message: str
    """The reason, as the end of a sentence that begins with "because"."""

    DONE = 0, "it is complete"
    PAUSED = 1, "it was paused"
    STEP_TOO_SMALL = 2, "the step became too small"
    NOT_FINITE = 3, "a rate or an output is not finite"
    TOO_MANY_STEPS = 4, "it took more steps than allowed"
    INTERRUPTED = 5, "it was interrupted"
    NOT_STARTED = 6, "no initial state was given"
    NEGATIVE_AIR_MASS = 7, "an air mass became negative"
    NON_FINITE_COMMAND = 8, "the controller gave a command that is not finite"
    NON_POSITIVE_VOLUME = 9, "a muscle volume became zero or negative"
    SINGULAR = 10, "the Jacobian is singular"
    NOT_CONVERGED = 11, "Newton's method did not converge"

    def __new__(
        cls, value: int, message: str = ""
    ) -> Self:  # without a message: the member of a value
        status = int.__new__(cls, value)
        status._value_ = value
        status.message = message
        return status


class DiagnosticCode(enum.StrEnum):
    """Kinds of diagnostics."""

    INTEGRATOR = "integrator"
    MODEL = "model"
    CONTROLLER = "controller"
    RATING = "rating"
    EXTRAPOLATION = "extrapolation"
    FRICTION_EXTRAPOLATION = "friction extrapolation"
    GEOMETRY_LIMIT = "geometry limit"
    COMPONENT = "component"
    INCOMPLETE = "incomplete"


@dataclasses.dataclass(frozen=True)
class Diagnostic:
    """One remark on a result.

    code     its kind
    subject  what it is about: a muscle, a component, the run
    text     the remark, a sentence without its full stop
    rows     how many rows of the recording it concerns; 0 where it concerns the result as a whole
    hint     what to do about it, a Hint if it is an argument of a function; empty where there is
             nothing to do
    """

    code: DiagnosticCode
    subject: str
    text: str
    rows: int = 0
    hint: str | Hint = ""

    @property
    def message(self) -> str:
        """The remark, and the hint as a sentence after it; a HintedText if the hint is a Hint."""
        if isinstance(self.hint, Hint):
            return HintedText(f"{self.text}.", self.hint)
        return f"{self.text}. {self.hint}" if self.hint else self.text

    def __str__(self) -> str:
        return str(self.message)


class ColumnLimit(NamedTuple):
    """Lower and upper limit of a column of a run; `subject` is the muscle or component that it
    belongs to.
    """

    subject: str
    code: DiagnosticCode
    column: str
    quantity: str
    bounds: tuple[float, float]


class Columns(Mapping[str, Array]):
    """Columns (N,) of a run by name, with the smallest and largest value of each.

    places, lower, upper   the smallest and largest values that are known, and by column where they
                           stand among them
    """

    def __init__(
        self,
        columns: Mapping[str, Array],
        places: Mapping[str, int] | None = None,
        lower: Sequence[float] = (),
        upper: Sequence[float] = (),
    ) -> None:
        self._columns = columns
        self._places = places or {}
        self._lower = lower
        self._upper = upper

    def __getitem__(self, name: str) -> Array:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def limits(self, name: str) -> tuple[float, float]:
        """The smallest and largest value of a column that has rows."""
        place = self._places.get(name)
        if place is not None:
            return self._lower[place], self._upper[place]
        values = self._columns[name]
        return float(values.min()), float(values.max())
