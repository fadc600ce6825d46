"""Geometry (interface): enclosed volume and outline of a muscle as functions of contraction."""

import abc
from typing import ClassVar

import numpy as np

from ....core import (
    Array,
    GeometryLimitError,
    ParameterError,
    Reference,
    Value,
    abridged,
    autodiff,
    ops,
)
from ..quantity_arguments import QuantityMethods, Units

LENGTH_TOLERANCE = 1e-6
"""Difference of two resting lengths [m] up to which they are the same (chosen)."""


def check_contraction_range(
    contraction: Value, limits: tuple[float, float], owner: str, remark: str = ""
) -> None:
    """Raise GeometryLimitError if a contraction [1] is outside `limits`; symbols and JAX arrays are
    not checked.

    `owner` names the model and `remark` extends the message.
    """
    if ops.is_traced(contraction):
        return
    values = np.asarray(contraction, dtype=float)
    outside = ~((values >= limits[0]) & (values <= limits[1]))
    if outside.any():
        raise GeometryLimitError(
            f"{owner}: a contraction of {100 * values[outside].flat[0]:.4g} % is outside its range,"
            f" {100 * limits[0]:.4g} to {100 * limits[1]:.4g} %{remark}."
        )


def check_not_straight(contraction: Value, owner: str) -> None:
    """Raise GeometryLimitError at a contraction [1] of 0, where straight fibres pull infinitely;
    symbols and JAX arrays are not checked."""
    if ops.is_traced(contraction):
        return
    if np.any(np.asarray(contraction, dtype=float) == 0.0):
        raise GeometryLimitError(
            f"{owner}: at a contraction of 0 % the fibres are straight and the force is infinite."
            " Give a contraction greater than 0, such as 0.01 %."
        )


RESTING_LENGTH = ("m", "L_0", "length between the fittings, unpressurised and unloaded")
"""Unit, symbol and meaning of the parameter of a resting length."""
LENGTHS = (1e-3, 20.0)
"""Bounds of a resting length [m]."""
Profile = tuple[Array, Array]
"""Axial positions [m] and radii [m]."""


def check_degree(owner: str, degree: object, least: int = 0) -> None:
    """Raise ParameterError unless the degree of a polynomial is an integer of at least `least`."""
    if isinstance(degree, bool) or not isinstance(degree, int) or degree < least:
        raise ParameterError(
            f"{owner}: degree is {abridged(degree)}; it must be an integer, {least} or more."
        )


class Geometry(QuantityMethods, abc.ABC):
    """Volume [m3] and outline of a muscle; contraction is (L_0 - L)/L_0.

    Every geometry declares `resting_length` L_0 [m]: the length between the fittings, unpressurised
    and unloaded.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    traceable: ClassVar[bool] = True
    argument_units: ClassVar[Units] = {"volume": ("1",), "volume_derivative": ("1",)}
    resting_length: float

    @property
    @abc.abstractmethod
    def contraction_range(self) -> tuple[float, float]:
        """Minimum and maximum contraction [1] of this geometry."""

    @abc.abstractmethod
    def volume(self, contraction: Value) -> Value:
        """Enclosed volume [m3] at a contraction [1], a scalar or an array; the result has the same
        shape.
        """

    def radius_at(self, contraction: Value) -> Value:
        """Radius [m] of the cylinder of this volume at a contraction [1]."""
        return np.sqrt(
            self.volume(contraction) / (np.pi * (self.resting_length * (1.0 - contraction)))
        )

    def outline(self, contraction: float, points: int = 201) -> Profile:
        """Axial positions from the middle [m] and radii [m] at a contraction [1], each of shape
        (points,).

        They are those of a cylinder unless the geometry has another shape. Raises
        GeometryLimitError if the contraction is outside `contraction_range`.
        """
        self.check_contraction(contraction)
        half = self.resting_length * (1.0 - contraction) / 2
        return np.linspace(-half, half, points), np.full(points, float(self.radius_at(contraction)))

    def volume_derivative(self, contraction: Value) -> Value:
        """Exact derivative dV/deps [m3]; by virtual work, p (dV/deps)/L_0 is the tension of an
        ideal muscle.
        """
        return autodiff.derivative(self, "volume", contraction)

    def check_contraction(self, contraction: Value) -> None:
        """Raise GeometryLimitError if a contraction [1] is outside `contraction_range`."""
        check_contraction_range(contraction, self.contraction_range, type(self).__name__)
