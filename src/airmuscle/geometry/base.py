"""The enclosed volume and the outline of a muscle, from its contraction."""

from __future__ import annotations

import abc
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..core import autodiff
from ..core.errors import GeometryLimitError
from ..core.ops import Value
from ..core.reference import Reference


class Geometry(abc.ABC):
    """Volume [m3] and outline of a muscle; contraction is (L0 - L)/L0.

    Every geometry declares `resting_length` L0 [m]: between the fittings, unpressurised and unloaded.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    traceable: ClassVar[bool] = True
    resting_length: float

    @property
    @abc.abstractmethod
    def contraction_range(self) -> tuple[float, float]:
        """The contractions [1] that this geometry can take."""

    @abc.abstractmethod
    def volume(self, contraction: Value) -> Value:
        """Enclosed volume [m3] at a contraction [1]; arrays give arrays."""

    @abc.abstractmethod
    def outline(self, contraction: float, points: int = 201) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Axial positions from the middle [m] and radii there [m], each of shape (points,).

        Raises OutOfReach where the geometry cannot take this contraction.
        """

    def volume_derivative(self, contraction: Value) -> Value:
        """dV/deps [m3], exact; virtual work makes p dV/deps / L0 the tension of an ideal muscle."""
        return autodiff.derivative(self, "volume", contraction)

    def check_contraction(self, contraction: Value) -> None:
        """Raise OutOfReach, naming the limits, for any contraction that this geometry cannot take."""
        low, high = self.contraction_range
        values = np.asarray(contraction, dtype=float)
        outside = ~((values >= low) & (values <= high))
        if outside.any():
            raise GeometryLimitError(
                f"{type(self).__name__} cannot take a contraction of {values[outside].flat[0]:.2%}; "
                f"it reaches from {low:.2%} to {high:.2%}."
            )
