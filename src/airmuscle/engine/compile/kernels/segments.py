"""Parts of the kernels that integrate: inputs within a segment, and rows at output times.

numba copies them into the kernel, so that it remains one function, whose machine code can be stored.
"""

from __future__ import annotations

from typing import Any

from .parts import CONTRACTED_PART


@CONTRACTED_PART
def set_inputs(base: Any, elapsed: Any, w: Any, u: Any) -> None:
    """The inputs `u` so long after the start of a segment, where they were `base`; they move at `w`."""
    for i in range(u.shape[0]):
        u[i] = base[i] + elapsed * w[i]


@CONTRACTED_PART
def write_present(times: Any, row: Any, t: Any, y: Any, rows: Any) -> Any:
    """Write the present states at the output times up to `t`; the next row."""
    while row < times.shape[0] and times[row] <= t:
        for i in range(y.shape[0]):
            rows[row, i] = y[i]
        row += 1
    return row
