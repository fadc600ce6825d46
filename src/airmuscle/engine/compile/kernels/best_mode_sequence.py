"""Best sequence of the modes of a plant, such as the states of on-off inputs: the one with the
least predicted cost.

By enumeration with bounds, the search of predictive control with a finite control set.
"""

import numba

from ....core import Status
from .calls import invoke, pointer
from .matrices import exponential_step

DONE = Status.DONE.value
NOT_FINITE = Status.NOT_FINITE.value


@numba.njit(error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def choose_mode(
    rates,
    measured,
    c,
    sizes,
    h,
    modes,
    changes,
    wanted,
    weights,
    states,
    costs,
    sequence,
    best,
    count,
    f,
    a,
    work,
    y,
    slopes,
):
    """The sequence of modes with the least sum of weights (y - wanted)^2 and of the costs of
    changes of mode.

    rates, measured  addresses of the functions of AugmentedRates
    modes            (M, m) inputs; changes (M, M) cost of the change from one mode to another
    states           (K + 1, N): the first row is the state now; costs (K + 1,)
    sequence         (K + 1,): the first is the mode before now; best (K + 1,): the cost in [0], the
                     modes after it
    count            (2,): steps that were computed, and sequences that were complete
    y, slopes        (p,), (p, N); f, a, work as in `predict_extended`: workspace

    A sequence whose cost exceeds the best one so far is not continued. Of equal sequences the first
    one is kept.
    """
    n = f.shape[0]
    total = states.shape[1]
    horizon = costs.shape[0] - 1
    e = work[3]
    best[0] = 1e300
    count[0] = count[1] = 0
    costs[0] = 0.0
    depth = 0
    sequence[1] = -1
    while depth >= 0:
        mode = sequence[depth + 1] + 1
        if mode == modes.shape[0]:
            depth -= 1
            continue
        sequence[depth + 1] = mode
        cost = costs[depth] + changes[sequence[depth], mode]
        if not cost < best[0]:
            continue
        x = states[depth]
        later = states[depth + 1]
        u = modes[mode]
        count[0] += 1
        if (
            exponential_step(rates, c, sizes, x, u, h, f, a, work[0], work[1], work[2], e, work[4])
            != DONE
        ):
            return NOT_FINITE
        for i in range(total):
            later[i] = x[i] + sizes[i] * e[i, total] if i < n else x[i]
        invoke(measured, (pointer(later), pointer(u), pointer(c), pointer(y), pointer(slopes)))
        error = 0.0
        for i in range(y.shape[0]):
            error += weights[i] * (y[i] - wanted[i]) ** 2
        cost += error
        if not cost < best[0]:
            continue
        depth += 1
        costs[depth] = cost
        if depth == horizon:
            count[1] += 1
            best[0] = cost
            for k in range(1, best.shape[0]):
                best[k] = sequence[k]
            depth -= 1
        else:
            sequence[depth + 1] = -1
    return DONE if best[0] < 1e300 else NOT_FINITE
