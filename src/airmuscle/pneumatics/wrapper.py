"""What stands between a circuit and its muscles is a circuit too, with the same supply, muscles and inputs."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

from ..core.variables import Input
from .circuit import Circuit
from .gas import Ambient
from .supply import AirSource


class CircuitWrapper(Circuit, abc.ABC):
    """A circuit around another one."""

    circuit: Circuit

    @property
    def supply(self) -> AirSource:  # type: ignore[override]  # the circuit's own
        return self.circuit.supply

    @property
    def port_count(self) -> int:
        return self.circuit.port_count

    def validity_warnings(self, columns: Mapping[str, Any], ambient: Ambient) -> dict[str, str]:
        return self.circuit.validity_warnings(columns, ambient)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return self.circuit.inputs
