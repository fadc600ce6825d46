"""Bounds of the parameters that an exported program can change, as the languages state them."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...core import Array, Leaf
from .identifiers import c_values, filled


@dataclasses.dataclass(frozen=True, eq=False)
class ParameterBounds:
    """Least and greatest values (P,) of parameters, limits included; those of Python."""

    lowest: Array
    highest: Array

    @classmethod
    def of(cls, parameters: Sequence[Leaf]) -> "ParameterBounds":
        """The declared bounds of parameters."""
        bounds = [leaf.declared.bounds for leaf in parameters]
        table = np.array(bounds, dtype=float).reshape(-1, 2)
        return cls(table[:, 0], table[:, 1])

    @property
    def data(self) -> dict[str, Array]:
        """The bounds by the names of a program."""
        return {"parameter_minimum": self.lowest, "parameter_maximum": self.highest}

    def c_places(self, name: str, number: str = "double") -> dict[str, str]:
        """The places of a C source: the bounds, and the function that compares with them."""
        rows = {key: c_values(values, 1, number) for key, values in self.data.items()}
        check = filled("check_parameters.c", {"number": number}, name)
        return {**rows, "check_parameters": check}
