"""Controllers: what closes a loop around a plant, each a frozen model with a memory that is a value."""

from .pid import PID
from .split import Split
from .two_point import TwoPoint

__all__ = [
    "PID",
    "Split",
    "TwoPoint",
]
