"""Reduced arm of unknown size from which a fit starts: muscles linear in pressure on links with stick-slip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core import tree
from ...core.arrays import Array
from ...physics import (
    Braid,
    LinearInPressure,
    Muscle,
    MuscleRoute,
    PressureDriven,
    SerialArm,
    SpatialLink,
    StickSlip,
    WithStickSlip,
)

RADIUS, LENGTH, INERTIA, AREA = 0.03, 0.3, 0.1, 6.7e-4
"""Moment arm [m], resting length [m], inertia [kg m^2] and area [m2] of every joint, chosen: a record of pressures and
angles contains none of the first three, and each multiplies coefficients that are fitted."""
GEOMETRY = Braid(0.01, 0.43, LENGTH)


def reduced_arm(middle: Array, axes: Sequence[tuple[int, int, int]] = (), link_length: float = 0.3) -> PressureDriven:
    """Arm of J joints with a pair of muscles each, from which a fit starts.

    middle       middle of the range of each joint [rad], about which forces are polynomials
    axes         axes of the joints, if the coupling of the links is to be found; without them every joint has an
                 inertia of its own
    link_length  distance of the joints of coupled links [m]
    """
    count = len(middle)
    routes = tuple(MuscleRoute((j + 1,), (sign * RADIUS,)) for j in range(count) for sign in (1.0, -1.0))
    muscles = tuple(
        _muscle(f"m{2 * j + k}", sign * RADIUS * float(middle[j]) / LENGTH)
        for j in range(count)
        for k, sign in enumerate((1.0, -1.0))
    )
    links = tuple(_link(j, axes[j] if axes else (0, 0, 1), link_length if axes and j else 0.0) for j in range(count))
    loads = np.zeros((count, 2 * count))
    for j in range(count):
        loads[j, 2 * j : 2 * j + 2] = 0.1 * RADIUS
    elements = tuple(StickSlip(0.5, tuple(row.tolist()), presliding_angle=4e-3) for row in loads)
    return PressureDriven(muscles, WithStickSlip(SerialArm(links, routes), elements), (0.02,) * (2 * count))


def _muscle(name: str, reference: float) -> Muscle:
    full = 3e5 * AREA
    law = LinearInPressure((AREA, 0.0, 0.0), (-0.05 * full, 0.0, 0.0), 0.3 * full, reference)
    return Muscle(law, GEOMETRY, name=name)


def _link(number: int, axis: tuple[int, int, int], distance: float) -> SpatialLink:
    if not distance:
        return SpatialLink(axis, rotor_inertia=INERTIA, damping=0.5)
    position = (distance, 0.0, 0.0) if number > 1 else (0.0, 0.0, 0.0)
    return SpatialLink(axis, position, 1.0, (0.0, 0.0, 0.0), 0.0, INERTIA, 0.5)


def stronger(arm: PressureDriven, joint: int, factor: float) -> PressureDriven:
    """The arm with forces, dry friction and damping of one joint multiplied: another initial guess of its inertia."""
    fields = ("area", "passive_force", "slack_width", "coulomb_torque", "damping")
    own = {path for path in own_parameters(joint) if path.rsplit(".")[-1].startswith(fields)}
    values = [float(leaf.value) * (factor if leaf.path in own else 1.0) for leaf in tree.leaves(arm)]
    changed: PressureDriven = tree.unflatten(arm, values)
    return changed


def own_parameters(joint: int) -> list[str]:
    """Paths of what a fit changes for one joint and its pair of muscles, in a `PressureDriven` of `reduced_arm`."""
    pair = (2 * joint, 2 * joint + 1)
    laws = [f"muscle[{m}].contractile." for m in pair]
    paths = [f"{law}{name}[{k}]" for law in laws for name in ("area", "passive_force") for k in range(3)]
    paths += [f"{law}slack_width" for law in laws] + [f"lags[{m}]" for m in pair]
    element, link = f"mechanism.elements[{joint}].", f"mechanism.inner.links[{joint}]."
    paths += [f"{element}{name}" for name in ("coulomb_torque", "presliding_angle")]
    paths += [f"{element}load_arms[{m}]" for m in pair]
    return [*paths, f"{element}static_excess", f"{element}stribeck_speed", f"{link}damping"]


def shared_parameters(axes: Sequence[tuple[int, int, int]]) -> list[str]:
    """Paths of what couples the joints of an arm whose axes are known.

    The place of a mass along the axis of its joint has no effect on that joint, and is not among them.
    """
    links = [f"mechanism.inner.links[{j}]." for j in range(len(axes))]
    paths = [f"{links[1]}zero_angle", *(f"{link}rotor_inertia" for link in links[1:])]
    for link, axis in zip(links[1:], axes[1:], strict=True):
        across = (k for k in range(3) if not axis[k])
        paths += [f"{link}mass", f"{link}inertia", *(f"{link}centre[{k}]" for k in across)]
    return paths
