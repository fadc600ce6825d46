"""A sample of linear predictive control: observer, limits, and the quadratic program by a dual
active-set method.
"""

from math import sqrt

import numba

from ....core import Status
from .calls import CONTRACTED_PART, PART
from .matrices import solve_factor

DONE = Status.DONE.value
SINGULAR = Status.SINGULAR.value
NOT_CONVERGED = Status.NOT_CONVERGED.value
ITERATIONS = 10
FEASIBLE = 0
ACCURATE = 1
DEPENDENT = 2
POSITIVE = 3
"""Iterations for each row (chosen), and places of the tolerances: permitted violation of a limit of
a row of length 1; permitted error of an active limit before the refinement; square of the distance
of a row from the space of the active ones up to which it depends on them; what a slope of
multipliers must exceed."""


@CONTRACTED_PART
def add_product(row, x, count, value):
    """`value` + the product of the first `count` numbers of `row` and `x`."""
    total = value
    for k in range(count):
        total += row[k] * x[k]
    return total


@PART
def extend_factor(m, order, count, row, factor, tolerances):
    """Write row `count` of the Cholesky factor of the products of the active rows; whether `row` is
    independent.
    """
    square = add_product(m[row], m[row], m.shape[1], 0.0)
    for j in range(count):
        value = add_product(m[row], m[order[j]], m.shape[1], 0.0)
        for k in range(j):
            value -= factor[count, k] * factor[j, k]
        value /= factor[j, j]
        factor[count, j] = value
        square -= value * value
    independent = square > tolerances[DEPENDENT]
    factor[count, count] = sqrt(square) if independent else 1.0
    return independent


@PART
def release(order, count, place, factor, multipliers, active):
    """Remove the active row at a place, of `count`; rotations make its factor triangular again."""
    active[order[place]] = 0.0
    for k in range(place, count - 1):
        order[k] = order[k + 1]
        multipliers[k] = multipliers[k + 1]
        for j in range(k + 2):
            factor[k, j] = factor[k + 1, j]
    for k in range(place, count - 1):
        length = sqrt(factor[k, k] ** 2 + factor[k, k + 1] ** 2)
        along = factor[k, k] / length
        across = factor[k, k + 1] / length
        for i in range(k, count - 1):
            near = factor[i, k]
            far = factor[i, k + 1]
            factor[i, k] = along * near + across * far
            factor[i, k + 1] = along * far - across * near


@PART
def vector_of(m, order, count, multipliers, w):
    """w = -m^T multipliers of the active rows."""
    for j in range(w.shape[0]):
        w[j] = 0.0
    for k in range(count):
        for j in range(w.shape[0]):
            w[j] -= m[order[k], j] * multipliers[k]


@PART
def solve_active(m, lower, upper, active, order, count, factor, passes, wanted, rest, w):
    """The multipliers with which the active rows have their limits, in one or two passes; the error
    before the last.
    """
    error = 0.0
    for k in range(count):
        wanted[k] = 0.0
    for turn in range(passes):
        if turn > 0:
            vector_of(m, order, count, wanted, w)
        error = 0.0
        for k in range(count):
            limit = upper[order[k]] if active[order[k]] > 0.0 else lower[order[k]]
            rest[k] = add_product(m[order[k]], w, w.shape[0], -limit) if turn > 0 else -limit
            error = max(error, abs(rest[k]) / (1.0 + abs(limit)))
        solve_factor(factor, count, rest)
        for k in range(count):
            wanted[k] += rest[k]
    return error


@PART
def blocking_place(order, count, active, multipliers, change):
    """Where a multiplier would first change its sign, on the way to multipliers + change (-1:
    nowhere).
    """
    place = -1
    least = 1.0
    for k in range(count):
        side = active[order[k]]
        if side * (multipliers[k] + change[k]) < 0.0:
            share = multipliers[k] / -change[k]
            if place < 0 or share < least:
                place = k
                least = share
    return place


@PART
def worst_row(m, lower, upper, active, w, tolerances):
    """The row whose limit is violated most; -1 where none is."""
    worst = -1
    largest = tolerances[FEASIBLE]
    for i in range(m.shape[0]):
        if active[i] == 0.0:
            value = add_product(m[i], w, m.shape[1], 0.0)
            excess = max(value - upper[i], lower[i] - value) / (
                1.0 + min(abs(upper[i]), abs(lower[i]))
            )
            if excess > largest:
                worst = i
                largest = excess
    return worst


@PART
def exchange(m, row, order, count, active, factor, multipliers, change, tolerances):
    """Make a row active that depends on the active ones, in place of one of them; whether a point
    keeps the limits.
    """
    side = active[row]
    for k in range(count):
        change[k] = add_product(m[row], m[order[k]], m.shape[1], 0.0)
    solve_factor(factor, count, change)
    place = -1
    least = 0.0
    for k in range(count):
        slope = side * active[order[k]] * change[k]
        if slope > tolerances[POSITIVE]:
            share = abs(multipliers[k]) / slope
            if place < 0 or share < least:
                place = k
                least = share
    possible = place >= 0
    if possible:
        for k in range(count):
            multipliers[k] -= side * least * change[k]
        release(order, count, place, factor, multipliers, active)
        possible = extend_factor(m, order, count - 1, row, factor, tolerances)
        order[count - 1] = row
        multipliers[count - 1] = side * least
    return possible


@PART
def append_row(m, row, order, count, factor, multipliers, tolerances):
    """Make a row the last active one, without a multiplier, if it is independent; whether it is."""
    independent = False
    if count < m.shape[1]:
        independent = extend_factor(m, order, count, row, factor, tolerances)
    if independent:
        order[count] = row
        multipliers[count] = 0.0
    return independent


@PART
def begin_active(m, active, order, factor, multipliers, tolerances):
    """Take the rows that were active, without multipliers; how many are independent."""
    count = 0
    for i in range(m.shape[0]):
        if active[i] != 0.0:
            independent = append_row(m, i, order, count, factor, multipliers, tolerances)
            if independent:
                count += 1
            else:
                active[i] = 0.0
    return count


@PART
def shortest_vector(
    m, lower, upper, tolerances, active, order, factor, multipliers, change, rest, w
):
    """The shortest `w` (n,) with lower <= m w <= upper, for rows of `m` (r, n) of length 1; a
    status.

    tolerances  (4,) by FEASIBLE, ACCURATE, DEPENDENT, POSITIVE
    active   (r,): 1.0 at the upper limit, -1 at the lower, 0 at none: the first guess, and the
             result
    order, multipliers, change, rest (n,), factor (n, n): workspace

    Dual active-set method: w = -m^T multipliers fulfils the limits of the active rows; the row that
    is violated most becomes active, and one whose multiplier changes its sign is released. Every
    step lengthens w, so that no set of active rows returns. SINGULAR: there is no such w.
    Reference: Goldfarb and Idnani (1983).
    """
    count = begin_active(m, active, order, factor, multipliers, tolerances)
    status = NOT_CONVERGED
    passes = 1
    for _ in range(ITERATIONS * m.shape[0] + ITERATIONS):
        error = solve_active(m, lower, upper, active, order, count, factor, passes, change, rest, w)
        for k in range(count):
            change[k] -= multipliers[k]
        place = blocking_place(order, count, active, multipliers, change)
        share = 1.0 if place < 0 else min(1.0, multipliers[place] / -change[place])
        for k in range(count):
            multipliers[k] += share * change[k]
        if place >= 0:
            release(order, count, place, factor, multipliers, active)
            count -= 1
            continue
        vector_of(m, order, count, multipliers, w)
        row = worst_row(m, lower, upper, active, w, tolerances)
        if row < 0 and passes == 1:
            passes = 2
            continue
        if row < 0:
            status = DONE if error < tolerances[ACCURATE] else NOT_CONVERGED
            break
        value = add_product(m[row], w, m.shape[1], 0.0)
        active[row] = 1.0 if value > upper[row] else -1.0
        possible = append_row(m, row, order, count, factor, multipliers, tolerances)
        if possible:
            count += 1
        else:
            possible = exchange(
                m, row, order, count, active, factor, multipliers, change, tolerances
            )
        if not possible:
            status = SINGULAR
            break
    return status


@PART
def find_point(y, r, by_output, gain, predicted, inputs, innovation, point):
    """The point (N + q + m,): corrected states and disturbances, set points, inputs of the last
    sample.
    """
    states = predicted.shape[0]
    points = r.shape[0]
    for i in range(y.shape[0]):
        innovation[i] = y[i] - add_product(by_output[i], predicted, states, 0.0)
    for k in range(states):
        point[k] = add_product(gain[k], innovation, y.shape[0], predicted[k])
    for i in range(points):
        point[states + i] = r[i]
    for i in range(inputs.shape[0]):
        point[states + points + i] = inputs[i]


@PART
def find_limits(low, high, of_input, scale, fixed_low, fixed_high, by_point, point, lower, upper):
    """The limits of all rows for a point; those of rows of an input contain its range."""
    for i in range(lower.shape[0]):
        shift = add_product(by_point[i], point, point.shape[0], 0.0)
        lower[i] = fixed_low[i] + shift
        upper[i] = fixed_high[i] + shift
        if of_input[i] >= 0:
            lower[i] += scale[i] * low[of_input[i]]
            upper[i] += scale[i] * high[of_input[i]]


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def predictive_sample(
    y,
    r,
    low,
    high,
    by_output,
    gain,
    transition,
    by_input,
    rest,
    m,
    of_input,
    scale,
    fixed_low,
    fixed_high,
    by_point,
    plan_by_w,
    plan_by_point,
    tolerances,
    predicted,
    plan,
    inputs,
    active,
    counts,
    innovation,
    point,
    lower,
    upper,
    order,
    factor,
    multipliers,
    change,
    spare,
    w,
):
    """One sample: the inputs in `inputs` (m,), and the memory of the next sample in place; the
    status of the program.

    y, r              measured columns (p,) and set points (q,); low, high: limits of the inputs
                      (m,)
    by_output, gain, transition, by_input   (p, N), (N, p), (N, N), (N, m) of the observer
    rest              (m, N + q + m) the inputs of the target by the point
    m, of_input, scale, fixed_low, fixed_high, by_point   rows (r, n) of length 1, input or -1,
                                                          scale, limits
    plan_by_w, plan_by_point    (N_h m, n), (N_h m, N + q + m); tolerances those of
                                `shortest_vector`
    predicted, plan, active    (N,), (N_h m,), (r,); inputs (m,) those of the last sample
    counts            (2,): samples since the plan was found, -1 without one; failures so far
    Without a solution the next input of the last plan is applied, after its end that of the target.
    """
    find_point(y, r, by_output, gain, predicted, inputs, innovation, point)
    find_limits(low, high, of_input, scale, fixed_low, fixed_high, by_point, point, lower, upper)
    status = shortest_vector(
        m, lower, upper, tolerances, active, order, factor, multipliers, change, spare, w
    )
    number = inputs.shape[0]
    if status == DONE:
        counts[0] = 0
        for i in range(plan.shape[0]):
            steady = add_product(plan_by_point[i], point, point.shape[0], 0.0)
            plan[i] = add_product(plan_by_w[i], w, w.shape[0], steady)
    else:
        counts[1] += 1
        if counts[0] >= 0:
            counts[0] += 1
    first = counts[0] * number
    for i in range(number):
        wanted = add_product(rest[i], point, point.shape[0], 0.0)
        if counts[0] >= 0 and first < plan.shape[0]:
            wanted = plan[first + i]
        inputs[i] = min(max(wanted, low[i]), high[i])
    for k in range(predicted.shape[0]):
        free = add_product(transition[k], point, predicted.shape[0], 0.0)
        predicted[k] = add_product(by_input[k], inputs, number, free)
    return status
