"""Faults of the routes of a body, in words with numbers: stroke, sign, singular poses, contact with
the body, poses that gravity does not let them hold, jumps of wrapping.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .body import Body
from .clearance import Clearance
from .demand import TensionBalance
from .signs import main_joint, shown_arms, wrong_signs
from .sweep import RouteSweep

SMALL_ARM = 1e-3
"""Moment arm [m] below which a route hardly moves a joint (chosen)."""
SINGULAR = 0.05
"""Part of the greatest moment arm below which a pose is singular (chosen)."""
IMPORTANT = 0.25
"""Part of a joint in the changes of the length from which on its moment arm is judged (chosen)."""
INSIDE = 2e-3
"""Depth [m] by which a route must be inside a geom to be said to touch it (chosen)."""


class RouteFault(NamedTuple):
    """A fault of a route or joint: its kind, where it is, the number with its unit, the limit, and
    a sentence.
    """

    kind: str
    name: str
    value: float
    limit: float | None
    unit: str
    text: str


class CatalogueLimits(NamedTuple):
    """What the muscles of the catalogue can do: greatest contraction [1] and permitted force [N],
    each with the names of the muscles.
    """

    contraction: float
    contracting: str
    force: float
    pulling: str


def find_faults(
    body: Body,
    sweeps: Sequence[RouteSweep],
    clearances: Sequence[Clearance | None],
    balances: Sequence[TensionBalance],
    limits: CatalogueLimits,
    positive: Mapping[str, str],
) -> tuple[RouteFault, ...]:
    """All faults, the gravest kinds first."""
    faults = [fault for sweep in sweeps for fault in _stroke_faults(sweep, limits)]
    for wrong in wrong_signs(body, sweeps, positive):
        extreme = max(wrong.arms, key=abs)
        text = (
            f"{wrong.route}: {wrong.reason}; its moment arm is"
            f" {shown_arms(body, wrong.joint, wrong.arms)}."
        )
        faults.append(RouteFault("wrong sign", wrong.route, extreme, None, "m", text))
    for sweep in sweeps:
        faults += _arm_faults(body, sweep)
    for sweep, clearance in zip(sweeps, clearances, strict=True):
        faults += _contact_faults(body, sweep, clearance)
    for balance in balances:
        faults += _balance_faults(body, balance, limits)
    for sweep in sweeps:
        faults += _jump_faults(body, sweep)
    return tuple(faults)


def _stroke_faults(sweep: RouteSweep, limits: CatalogueLimits) -> Iterator[RouteFault]:
    """Routes whose stroke is more than a muscle of their greatest length can contract."""
    share = sweep.stroke_share
    if share is None or share <= limits.contraction:
        return
    longest = sweep.longest.length
    possible = limits.contraction * longest
    slack = float(np.mean(sweep.length < longest - possible))
    text = (
        f"{sweep.route.name}: no muscle serves its stroke of {1e3 * sweep.stroke:.4g} mm,"
        f" {100 * share:.4g} % of its greatest length; {limits.contracting} contracts by"
        f" {100 * limits.contraction:.4g} % at most, {1e3 * possible:.4g} mm even without fittings"
        f" and tendon. It exceeds this by {1e3 * (sweep.stroke - possible):.4g} mm, and would be"
        f" slack in {100 * slack:.3g} % of the poses. Reduce its lever to"
        f" {possible / sweep.stroke:.3g} of the present one, or lengthen the route."
    )
    yield RouteFault("stroke", sweep.route.name, share, limits.contraction, "1", text)


def _arm_faults(body: Body, sweep: RouteSweep) -> Iterator[RouteFault]:
    """Sign changes and singular poses of the joints that matter to a route."""
    main = main_joint(sweep)
    for joint, share in zip(sweep.route.joints, sweep.shares, strict=True):
        if joint != main and share < IMPORTANT:
            continue
        low, high = sweep.arm_range(joint)
        greatest = max(abs(low), abs(high))
        least = max(SMALL_ARM, SINGULAR * greatest)
        if greatest < SMALL_ARM:
            continue
        if low < -least and high > least:
            rows = [sweep.poses.described(body, sweep.row_of(joint, end)) for end in (False, True)]
            text = (
                f"{sweep.route.name}: its moment arm of {joint} changes its sign, from"
                f" {shown_arms(body, joint, (low, high))}: it pulls {joint} towards lesser"
                f" positions at {rows[0]}, towards greater ones at {rows[1]}."
            )
            yield RouteFault("sign change", sweep.route.name, low, None, "m", text)
            continue
        arms = np.abs(sweep.moment_arm[:, sweep.route.joints.index(joint)])
        row = int(arms.argmin())
        if arms[row] < least or low < 0.0 < high:
            text = (
                f"{sweep.route.name}: at {sweep.poses.described(body, row)} its moment arm of"
                f" {joint} is {1e3 * float(arms[row]):.3g} mm, of {1e3 * greatest:.4g} mm at most:"
                " a singular pose, in which it hardly turns it."
            )
            yield RouteFault("singular pose", sweep.route.name, float(arms[row]), least, "m", text)


def _contact_faults(
    body: Body, sweep: RouteSweep, clearance: Clearance | None
) -> Iterator[RouteFault]:
    if clearance is None or clearance.distance > -INSIDE:
        return
    pose = ", ".join(
        f"{name} {body.joints[name].shown(float(value))}"
        for name, value in zip(sweep.route.joints, clearance.positions, strict=True)
    )
    text = (
        f"{sweep.route.name}: it passes {-1e3 * clearance.distance:.3g} mm inside {clearance.geom}"
        f" at {pose}. Move a point of the route, or let it wrap around a geom."
    )
    yield RouteFault("contact", sweep.route.name, clearance.distance, -INSIDE, "m", text)


def _balance_faults(
    body: Body, balance: TensionBalance, limits: CatalogueLimits
) -> Iterator[RouteFault]:
    """Joints whose demand no tension of the routes gives, and routes that need more than a
    muscle's force.
    """
    demand = balance.demand
    unmet = balance.is_unmet
    for column, name in enumerate(demand.poses.joints):
        if not unmet[:, column].any():
            continue
        missing = np.where(unmet[:, column], np.abs(balance.missing[:, column]), 0.0)
        row = int(missing.argmax())
        torque = float(demand.torque[row, column])
        given = torque - float(balance.missing[row, column])
        unit = "N m" if body.joints[name].is_hinge else "N"
        arms = balance.moment_arm[row, column]
        way = "greater" if balance.missing[row, column] > 0.0 else "lesser"
        pulling = int(np.sum(np.sign(balance.missing[row, column]) * arms > SMALL_ARM))
        reason = (
            f"no route pulls it towards {way} positions there"
            if pulling == 0
            else f"the routes that pull it towards {way} positions there also turn other joints"
        )
        text = (
            f"{name}: its routes cannot hold {demand.name} in {100 * unmet[:, column].mean():.3g} %"
            f" of the poses: {torque:.4g} {unit} is demanded at"
            f" {demand.poses.described(body, row)}, and pulls give {given:.4g} {unit} at best;"
            f" {reason}."
        )
        yield RouteFault("not held", name, float(missing[row]), None, unit, text)
    for column, route in enumerate(body.routes):
        row = int(balance.tension[:, column].argmax())
        tension = float(balance.tension[row, column])
        if tension <= limits.force:
            continue
        text = (
            f"{route.name}: {demand.name} needs {tension:.4g} N at"
            f" {demand.poses.described(body, row)}; {limits.pulling} is permitted"
            f" {limits.force:.4g} N. Give it a longer lever, or several muscles."
        )
        yield RouteFault("force", route.name, tension, limits.force, "N", text)


def _jump_faults(body: Body, sweep: RouteSweep) -> Iterator[RouteFault]:
    for jump in sweep.jumps:
        pose = ", ".join(
            f"{name} {body.joints[name].shown(float(value))}"
            for name, value in zip(sweep.route.joints, jump.positions, strict=True)
        )
        text = (
            f"{sweep.route.place}: the length of the route jumps by {1e3 * jump.size:.3g} mm over"
            f" {jump.joint} at {pose}, where its path changes to the other side of a geom. Keep it"
            " on one side: by the place of the sidesite, of its points, or a smaller range."
        )
        yield RouteFault("wrapping", sweep.route.name, jump.size, None, "m", text)
