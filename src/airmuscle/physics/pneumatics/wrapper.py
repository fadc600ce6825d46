"""CircuitWrapper: base class of wrappers of a circuit."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

from ...core.variables import Input
from .circuit import Circuit
from .gas import Ambient
from .supply import AirSource


class CircuitWrapper(Circuit, abc.ABC):
    """Wrapper between a circuit and its muscles; supply, ports and inputs are those of the inner circuit."""

    circuit: Circuit

    @property
    def supply(self) -> AirSource:  # type: ignore[override]  # forwarded, not stored
        return self.circuit.supply

    @property
    def port_count(self) -> int:
        return self.circuit.port_count

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        return self.circuit.validity_warnings(columns, ambient)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return self.circuit.inputs
