"""Recordings: measured and simulated runs in one type."""

from .columns import QUANTITIES, Quantity
from .recording import Recording

__all__ = [
    "QUANTITIES",
    "Quantity",
    "Recording",
]
