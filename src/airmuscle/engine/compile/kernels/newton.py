"""Newton's method on printed functions: g(x, p) = target of many unknowns, and of pairs of
functions.
"""

import numba

from ....core import Status
from .calls import PART, invoke, pointer

DONE = Status.DONE.value
SINGULAR = Status.SINGULAR.value
NOT_FINITE = Status.NOT_FINITE.value
NOT_CONVERGED = Status.NOT_CONVERGED.value
MAX_ITERATIONS = 50
MAX_STEP = 10.0
TOLERANCE = 1e-11
"""Iterations; the longest step and the step that ends the search, both in sizes of the unknowns."""


@PART
def scale_equations(by_x, values, target, sizes, a, b):
    """Write the linear equations a s = b of the step s in sizes, each divided by its largest
    coefficient.
    """
    n = b.shape[0]
    for i in range(n):
        largest = 0.0
        for k in range(n):
            a[i, k] = by_x[i, k] * sizes[k]
            largest = max(largest, abs(a[i, k]))
        scale = 1.0 / largest if largest > 0.0 else 1.0
        b[i] = (target[i] - values[i]) * scale
        for k in range(n):
            a[i, k] *= scale


@PART
def eliminate(a, b):
    """Reduce the equations to an upper triangle, with row pivoting; whether the matrix is
    regular.
    """
    n = b.shape[0]
    regular = True
    for column in range(n):
        pivot = column
        for i in range(column + 1, n):
            if abs(a[i, column]) > abs(a[pivot, column]):
                pivot = i
        if not abs(a[pivot, column]) > 1e-14:  # also where it is not a number
            regular = False
            break
        for k in range(n):
            a[column, k], a[pivot, k] = a[pivot, k], a[column, k]
        b[column], b[pivot] = b[pivot], b[column]
        for i in range(column + 1, n):
            share = a[i, column] / a[column, column]
            for k in range(column, n):
                a[i, k] -= share * a[column, k]
            b[i] -= share * b[column]
    return regular


@PART
def substitute_back(a, b):
    """Solve the upper triangle in place of `b`; the largest step in sizes."""
    n = b.shape[0]
    step = 0.0
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
        step = max(step, abs(b[i]))
    return step


@numba.njit(nogil=True, error_model="numpy")
def newton(function, p, target, sizes, x, values, by_x, by_p, a, b):
    """Move `x` (n,) to the root; `values` (n,), `by_x` (n, n) and `by_p` (n, m) hold the last
    results of the function.

    function(x, p, values, by_x, by_p)  its address
    a, b  (n, n), (n,): workspace
    Returns a status; b[0] is the last step in sizes.
    """
    n = x.shape[0]
    status = NOT_CONVERGED
    step = 0.0
    for _ in range(MAX_ITERATIONS):
        invoke(function, (pointer(x), pointer(p), pointer(values), pointer(by_x), pointer(by_p)))
        scale_equations(by_x, values, target, sizes, a, b)
        if not eliminate(a, b):
            return SINGULAR
        step = substitute_back(a, b)
        if not step < 1e300:
            return NOT_FINITE
        share = min(1.0, MAX_STEP / max(step, 1e-300))
        large = 1.0
        for i in range(n):
            x[i] += share * sizes[i] * b[i]
            large = max(large, abs(x[i] / sizes[i]))
        if step < TOLERANCE * large:
            status = DONE
            break
    b[0] = step
    return status


LANES = 8
ITERATIONS = 30
"""Points of one call of a function, as in `function.LANES`; iterations of Newton's method."""
RESIDUAL = 1e-11
MARGIN = 1e-12
WIDENED = 0.5
"""Relative residual of a solution; part of the range by which rounding may exceed it; widening of a
cell's range.
"""


@PART
def evaluate_boundaries(function, side, levels, t, x, values, ends):
    """Write q, k and s at both boundaries of each cell of one side to `ends`."""
    size = ends.shape[3]
    for g in range(levels.shape[0]):
        for lane in range(LANES):
            x[lane] = levels[g, lane]
        invoke(function, (pointer(t), pointer(x), pointer(values)))
        for lane in range(LANES):
            i = g * LANES + lane
            for kind in range(3):
                value = values[kind if kind < 2 else 4, lane]
                if i < size:
                    ends[side, kind, 0, i] = value
                if 0 < i <= size:
                    ends[side, kind, 1, i - 1] = value


@PART
def widen_ranges(side, ends):
    """Turn the values at the boundaries into widened ranges; empty ones where s is not positive."""
    for i in range(ends.shape[3]):
        possible = max(ends[side, 2, 0, i], ends[side, 2, 1, i]) > 0.0
        for kind in range(2):
            a = ends[side, kind, 0, i]
            b = ends[side, kind, 1, i]
            margin = WIDENED * abs(b - a)
            ends[side, kind, 0, i] = min(a, b) - margin if possible else 1e300
            ends[side, kind, 1, i] = max(a, b) + margin if possible else -1e300


@PART
def find_cells(q, k, ends, cells):
    """Write the pairs of cells in whose ranges a solution is possible; how many there are."""
    size = ends.shape[3]
    count = 0
    for i in range(size):
        q_low = q - ends[0, 0, 1, i]
        q_high = q - ends[0, 0, 0, i]
        k_low = k - ends[0, 1, 1, i]
        k_high = k - ends[0, 1, 0, i]
        for j in range(size):
            cells[count] = i * size + j
            count += (
                (ends[1, 0, 0, j] <= q_high)
                & (ends[1, 0, 1, j] >= q_low)
                & (ends[1, 1, 0, j] <= k_high)
                & (ends[1, 1, 1, j] >= k_low)
            )
    return count


@PART
def newton_steps(q, k, low, high, x, y, values, other_values):
    """One step of Newton's method of each lane, limited to a fifth of the range; the largest
    step.
    """
    largest = 0.0
    span = high - low
    for lane in range(LANES):
        residual = values[0, lane] + other_values[0, lane] - q
        other = values[1, lane] + other_values[1, lane] - k
        a = values[2, lane]
        c = values[3, lane]
        b = other_values[2, lane]
        d = other_values[3, lane]
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
    return largest


@PART
def is_solution(q, k, lane, values, other_values):
    """Whether both equations are fulfilled and both s are positive."""
    residual = abs(values[0, lane] + other_values[0, lane] - q)
    other = abs(values[1, lane] + other_values[1, lane] - k)
    scale = abs(values[0, lane]) + abs(other_values[0, lane]) + abs(q)
    rigid = abs(values[1, lane]) + abs(other_values[1, lane]) + abs(k)
    balanced = residual <= RESIDUAL * scale and other <= RESIDUAL * rigid
    return balanced and values[4, lane] > 0.0 and other_values[4, lane] > 0.0


@numba.njit(error_model="numpy", nogil=True)
def pair_solutions(
    first,
    second,
    low,
    high,
    point,
    wanted_q,
    wanted_k,
    levels,
    solutions,
    counts,
    arguments,
    values,
    other_values,
    ends,
    cells,
):
    """Write up to R solutions of every point (N,) into `solutions` (N, R, 2), and their numbers
    into `counts` (N,).

    first, second  addresses of functions in lanes, (t, x) -> (q, k, dq/dx, dk/dx, s); s > 0 at a
                   solution
    levels         (G, LANES): boundaries of the cells in x and in y, in ascending order; after the
                   last one repeated
    arguments (3, LANES), values and other_values (5, LANES): aligned workspace; ends (2, 3, 2, C),
    cells (C^2 + LANES,) A count above R says that there were more solutions; equal ones are not
    removed.
    """
    size = ends.shape[3]
    t = arguments[0]
    x = arguments[1]
    y = arguments[2]
    span = high - low
    for n in range(point.shape[0]):
        q = wanted_q[n]
        k = wanted_k[n]
        for lane in range(LANES):
            t[lane] = point[n]
        evaluate_boundaries(first, 0, levels, t, x, values, ends)
        evaluate_boundaries(second, 1, levels, t, x, other_values, ends)
        widen_ranges(0, ends)
        widen_ranges(1, ends)
        count = find_cells(q, k, ends, cells)
        stored = 0
        for start in range(0, count, LANES):
            used = min(LANES, count - start)
            for lane in range(LANES):
                cell = cells[start + min(lane, used - 1)]
                x[lane] = low + (cell // size + 0.5) * (span / size)
                y[lane] = low + (cell % size + 0.5) * (span / size)
            done = False
            for iteration in range(ITERATIONS + 1):
                invoke(first, (pointer(t), pointer(x), pointer(values)))
                invoke(second, (pointer(t), pointer(y), pointer(other_values)))
                if done or iteration == ITERATIONS:
                    break
                largest = newton_steps(q, k, low, high, x, y, values, other_values)
                done = largest <= 1e-15 * span or (iteration > 3 and largest <= 1e-13 * span)
            for lane in range(used):
                if is_solution(q, k, lane, values, other_values):
                    known = False
                    for each in range(min(stored, solutions.shape[1])):
                        near = max(
                            abs(solutions[n, each, 0] - x[lane]),
                            abs(solutions[n, each, 1] - y[lane]),
                        )
                        known = known or near <= 1e-7 * span
                    if not known:
                        if stored < solutions.shape[1]:
                            solutions[n, stored, 0] = x[lane]
                            solutions[n, stored, 1] = y[lane]
                        stored += 1
        counts[n] = stored
