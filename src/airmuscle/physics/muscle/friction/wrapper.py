"""FrictionWrapper: base of the friction laws that modify or qualify another one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ....core.ops import Value
from ....core.variables import StateVariable
from .base import Friction, IdentifiedRange


class FrictionWrapper(Friction):
    """Wrapper that forwards everything to the inner friction law; subclasses override single properties."""

    inner: Friction

    @property
    def rate_independent(self) -> bool:  # type: ignore[override]
        """Whether the force depends on the path only, not on the speed."""
        return self.inner.rate_independent

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return self.inner.states

    @property
    def presliding_distance(self) -> float:
        return self.inner.presliding_distance

    @property
    def identified_range(self) -> IdentifiedRange | None:
        return self.inner.identified_range

    def pressure_factor(self, pressure: Value) -> Value:
        return self.inner.pressure_factor(pressure)

    def rates(self, bristles: Mapping[str, Value], speed: Value) -> dict[str, Value]:
        return self.inner.rates(bristles, speed)

    def force(self, bristles: Mapping[str, Value], speed: Value) -> Value:
        return self.inner.force(bristles, speed)

    def force_along(self, displacement: Any, time: Any = None) -> Any:
        return self.inner.force_along(displacement, time)
