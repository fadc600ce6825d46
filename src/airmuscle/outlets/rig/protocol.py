"""Rig: the three functions through which signals are played on a test rig."""

from collections.abc import Mapping
from typing import Protocol


class Rig(Protocol):
    """A test rig with pressure regulators; each function may raise RigError.

    A rig vents when it is switched on, on `stop`, and by itself when commands stay out: no program
    can vent after it was killed.
    """

    def write(self, commands: Mapping[str, float]) -> None:
        """Set the gauge pressures [Pa] by command, `setpoint` or `left.setpoint`."""

    def read(self) -> Mapping[str, float]:
        """The readings [SI] by name, such as `pressure`, `left.pressure` or `angle`."""

    def stop(self) -> None:
        """Vent all muscles; return once this is confirmed. May be called at any time, also
        again.
        """
