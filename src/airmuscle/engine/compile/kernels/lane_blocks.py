"""Equal steps of a printed one-step method for many blocks of systems, one system a lane, and their outputs."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer


@numba.njit(error_model="numpy", nogil=True)
def lane_blocks(
    step: Any, outputs: Any, x: Any, u: Any, c: Any, w: Any, h: Any, other: Any, o: Any, span: Any, steps: Any
) -> Any:
    """Advance the blocks span[0] .. span[1] - 1 by steps[0] steps, then compute their outputs; returns 0.

    step(x, u, c, w, h, y), outputs(x, u, c, o)  addresses of the printed functions, W lanes each
    x, u, c, o  (B, n, W), (B, m, W), (B, C, W), (B, k, W): states, inputs, what `prepare` left, outputs of each block
    w, h, other  (m, W), (1, W), (n, W): zeros, the length of a step, and workspace
    """
    at_w, at_h, at_other = pointer(w), pointer(h), pointer(other)
    for block in range(span[0], span[1]):
        at_x, at_u, at_c = pointer(x[block]), pointer(u[block]), pointer(c[block])
        at, beside = at_x, at_other
        for _ in range(steps[0]):
            invoke(step, (at, at_u, at_c, at_w, at_h, beside))
            at, beside = beside, at
        if at != at_x:
            for i in range(x.shape[1]):
                for lane in range(x.shape[2]):
                    x[block, i, lane] = other[i, lane]
        invoke(outputs, (at_x, at_u, at_c, pointer(o[block])))
    return 0
