"""Sliding variable of an error: s = e + T_s e', with a filtered backward difference."""

from __future__ import annotations

from collections.abc import Mapping

from ...core import ops
from ...core.ops import Value


def sliding_memory() -> dict[str, float]:
    """Whether it has started (0 or 1), the last error and its filtered derivative."""
    return {"started": 0.0, "error": 0.0, "error_rate": 0.0}


def sliding_variable(
    memory: Mapping[str, Value], error: Value, sliding_time: Value, filter_time: Value, dt: Value
) -> tuple[Value, dict[str, Value]]:
    """s = e + T_s e' and the memory for the next sample; e' is 0 at the first sample.

    The derivative is filtered by a first-order lag of time constant T_f [s], by backward differences.
    """
    change = (error - memory["error"] + filter_time * memory["error_rate"]) / (filter_time + dt)
    rate = ops.where(memory["started"] > 0, change, 0.0)
    return error + sliding_time * rate, {"started": 1.0, "error": error, "error_rate": rate}
