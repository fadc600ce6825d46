"""Pairs (x, y) with q_1(t, x) + q_2(t, y) = Q and k_1(t, x) + k_2(t, y) = K: a search in cells and Newton's method."""

from __future__ import annotations

from typing import Any

import numba

from .calls import invoke, pointer

LANES, ITERATIONS = 8, 30
"""Points of one call of a function, as in `lanes_function`; iterations of Newton's method."""
RESIDUAL, MARGIN, WIDENED = 1e-11, 1e-12, 0.5
"""Relative residual of a solution; part of the range by which rounding may exceed it; widening of a cell's range."""


@numba.njit(error_model="numpy", nogil=True)
def pair_solutions(
    first: Any, second: Any, low: Any, high: Any, point: Any, wanted_q: Any, wanted_k: Any, levels: Any, found: Any,
    counts: Any, arguments: Any, values: Any, other_values: Any, ends: Any, cells: Any,
) -> None:  # fmt: skip
    """Write up to R solutions of every point (N,) into `found` (N, R, 2), and their numbers into `counts` (N,).

    first, second  addresses of functions in lanes, (t, x) -> (q, k, dq/dx, dk/dx, s); s > 0 at a solution
    levels         (G, LANES): boundaries of the cells in x and in y, in ascending order; after the last one repeated
    arguments (3, LANES), values and other_values (5, LANES): aligned workspace; ends (2, 3, 2, C), cells (C^2 + LANES,)
    A count above R says that there were more solutions; equal ones are not removed.
    """
    size = ends.shape[3]
    t, x, y, span = arguments[0], arguments[1], arguments[2], high - low
    for n in range(point.shape[0]):
        for lane in range(LANES):
            t[lane] = point[n]
        for side in range(2):
            function = first if side == 0 else second
            target = values if side == 0 else other_values
            for g in range(levels.shape[0]):
                for lane in range(LANES):
                    x[lane] = levels[g, lane]
                invoke(function, (pointer(t), pointer(x), pointer(target)))
                for lane in range(LANES):
                    i = g * LANES + lane
                    for kind in range(3):
                        value = target[kind if kind < 2 else 4, lane]
                        if i < size:
                            ends[side, kind, 0, i] = value
                        if 0 < i <= size:
                            ends[side, kind, 1, i - 1] = value
            for i in range(size):
                if max(ends[side, 2, 0, i], ends[side, 2, 1, i]) > 0.0:
                    for kind in range(2):
                        a, b = ends[side, kind, 0, i], ends[side, kind, 1, i]
                        margin = WIDENED * abs(b - a)
                        ends[side, kind, 0, i] = min(a, b) - margin
                        ends[side, kind, 1, i] = max(a, b) + margin
                else:
                    for kind in range(2):
                        ends[side, kind, 0, i], ends[side, kind, 1, i] = 1e300, -1e300
        count = 0
        for i in range(size):
            q_low, q_high = wanted_q[n] - ends[0, 0, 1, i], wanted_q[n] - ends[0, 0, 0, i]
            k_low, k_high = wanted_k[n] - ends[0, 1, 1, i], wanted_k[n] - ends[0, 1, 0, i]
            for j in range(size):
                cells[count] = i * size + j
                count += (
                    (ends[1, 0, 0, j] <= q_high)
                    & (ends[1, 0, 1, j] >= q_low)
                    & (ends[1, 1, 0, j] <= k_high)
                    & (ends[1, 1, 1, j] >= k_low)
                )
        stored = 0
        width = span / size
        for start in range(0, count, LANES):
            used = min(LANES, count - start)
            for lane in range(LANES):
                cell = cells[start + min(lane, used - 1)]
                x[lane] = low + (cell // size + 0.5) * width
                y[lane] = low + (cell % size + 0.5) * width
            done = False
            for iteration in range(ITERATIONS + 1):
                invoke(first, (pointer(t), pointer(x), pointer(values)))
                invoke(second, (pointer(t), pointer(y), pointer(other_values)))
                if done or iteration == ITERATIONS:
                    break
                largest = 0.0
                for lane in range(LANES):
                    residual = values[0, lane] + other_values[0, lane] - wanted_q[n]
                    other = values[1, lane] + other_values[1, lane] - wanted_k[n]
                    a, c = values[2, lane], values[3, lane]
                    b, d = other_values[2, lane], other_values[3, lane]
                    determinant = a * d - b * c
                    step = (b * other - d * residual) / determinant
                    y_step = (c * residual - a * other) / determinant
                    if not (abs(step) < 1e300 and abs(y_step) < 1e300):
                        step = y_step = 0.0
                    largest = max(largest, abs(step), abs(y_step))
                    step = min(max(step, -0.2 * span), 0.2 * span)
                    y_step = min(max(y_step, -0.2 * span), 0.2 * span)
                    x[lane] = min(max(x[lane] + step, low), high)
                    y[lane] = min(max(y[lane] + y_step, low), high)
                done = largest <= 1e-15 * span or (iteration > 3 and largest <= 1e-13 * span)
            for lane in range(used):
                residual = abs(values[0, lane] + other_values[0, lane] - wanted_q[n])
                other = abs(values[1, lane] + other_values[1, lane] - wanted_k[n])
                scale = abs(values[0, lane]) + abs(other_values[0, lane]) + abs(wanted_q[n])
                rigid = abs(values[1, lane]) + abs(other_values[1, lane]) + abs(wanted_k[n])
                balanced = residual <= RESIDUAL * scale and other <= RESIDUAL * rigid
                if balanced and values[4, lane] > 0.0 and other_values[4, lane] > 0.0:
                    known = False
                    for k in range(min(stored, found.shape[1])):
                        distance = max(abs(found[n, k, 0] - x[lane]), abs(found[n, k, 1] - y[lane]))
                        known = known or distance <= 1e-7 * span
                    if not known:
                        if stored < found.shape[1]:
                            found[n, stored, 0] = x[lane]
                            found[n, stored, 1] = y[lane]
                        stored += 1
        counts[n] = stored
