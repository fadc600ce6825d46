"""Episodes of an arm that the program itself makes: the plant, its inputs and its noise are
known.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airmuscle.bench import Episode, Episodes
from airmuscle.engine import RungeKutta4, SampledSignal, simulate_batch
from airmuscle.physics import (
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

STEP = 0.01
ROWS = 95
BRAID = Braid(0.01, 0.43, 0.3)


def known_arm(joints=1):
    """Joints with a pair of unequal muscles each, dry friction and gravity; numbers are chosen."""
    muscles = []
    routes = []
    links = []
    elements = []
    for j in range(joints):
        for k, sign in enumerate((1.0, -1.0)):
            law = LinearInPressure((6e-4 + 1e-4 * k, -8e-4, 0.0), (-12.0, 40.0), 4.0)
            muscles.append(Muscle(law, BRAID, name=f"m{2 * j + k}"))
            routes.append(MuscleRoute((j + 1,), (sign * 0.03,)))
        axis, mass = ((0, 0, 1), 0.0) if j % 2 else ((0, 1, 0), 0.6)
        links.append(SpatialLink(axis, (0.0, 0.0, 0.0), mass, (0.05, 0.0, -0.1), 0.0, 0.08, 0.4))
        loads = [0.0] * (2 * joints)
        loads[2 * j : 2 * j + 2] = 3e-3, 4e-3
        elements.append(StickSlip(0.3, tuple(loads), 0.0, 1.0, 0.005))
    mechanism = WithStickSlip(SerialArm(tuple(links), tuple(routes)), tuple(elements))
    return PressureDriven(tuple(muscles), mechanism, (0.03,) * (2 * joints))


def made_episodes(count=40, joints=1, seed=0, noise=5e-4, delay=0, rows=ROWS, arm=None):
    """Episodes under pressures that wander between 0 and 3 bar, with a noise of the angles
    [rad].
    """
    rng = np.random.default_rng(seed)
    arm = arm or known_arm(joints)
    knots = np.linspace(0.0, STEP * (rows + delay), 12)
    levels = rng.uniform(0.2e5, 3e5, (count, 2 * joints, len(knots)))
    names = [f"m{i}.measured_pressure" for i in range(2 * joints)]
    signals = [
        SampledSignal(
            {
                n: tuple(zip(knots.tolist(), p.tolist(), strict=True))
                for n, p in zip(names, each, strict=True)
            }
        )
        for each in levels
    ]
    start = {s.name: np.zeros(count) for s in arm.states}
    start |= {f"m{i}.pressure": levels[:, i, 0] for i in range(2 * joints)}
    start |= {f"joint{j + 1}.angle": rng.uniform(-0.3, 0.3, count) for j in range(joints)}
    times = STEP * np.arange(rows + delay)
    keep = [
        f"joint{j + 1}.{what}" for what in ("angle", "angular_speed") for j in range(joints)
    ] + names
    run = simulate_batch(
        arm,
        {},
        signals,
        duration=float(times[-1]),
        initial_states=start,
        output_times=times,
        integrator=RungeKutta4(STEP / 5),
        keep=keep,
    )
    columns = np.stack([run[name] for name in keep], axis=-1)
    angle, speed, pressure = np.split(columns, [joints, 2 * joints], axis=-1)
    angle = angle + noise * rng.standard_normal(angle.shape)
    runs = [
        Episode(a[delay:], v[delay:], p[: len(p) - delay], p[: len(p) - delay], f"episode {i + 1}")
        for i, (a, v, p) in enumerate(zip(angle, speed, pressure, strict=True))
    ]
    return Episodes(tuple(runs), STEP)


def changed(episodes, **columns):
    """The episodes with some columns changed by functions of their rows."""
    runs = [
        replace(run, **{n: change(getattr(run, n).copy()) for n, change in columns.items()})
        for run in episodes.runs
    ]
    return replace(episodes, runs=tuple(runs))
