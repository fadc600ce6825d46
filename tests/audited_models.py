"""Muscle laws and orifices as somebody writes them: right ones, and ones with a fault.

Each law takes a gauge pressure [Pa] and a contraction, and returns a tension [N]; each orifice takes
two absolute pressures [Pa], and returns a mass flow [kg/s].
"""

import math
import time

RADIUS = 0.01
ANGLE = math.radians(25.0)
A = 3.0 / math.tan(ANGLE) ** 2
B = 1.0 / math.sin(ANGLE) ** 2
AREA = math.pi * RADIUS**2


def braid(pressure, contraction):
    return pressure * AREA * (A * (1.0 - contraction) ** 2 - B)


# right laws


def ideal(pressure, contraction):
    return max(braid(pressure, contraction), 0.0)


def end_correction(pressure, contraction):
    return max(braid(pressure, 1.2 * contraction), 0.0)


def with_wall(pressure, contraction):
    return max(braid(pressure, contraction) - 400.0 * contraction, 0.0)


def linear(pressure, contraction):
    return max(2e-3 * pressure * (1.0 - contraction / 0.25), 0.0)


def slack_smoothly(pressure, contraction):
    force = braid(pressure, contraction)
    return 0.5 * (force + math.hypot(force, 1.0))


def exponential(pressure, contraction):
    return max(pressure * 1.5e-3 * math.exp(-6.0 * contraction) - 150.0 * contraction, 0.0)


def surface(pressure, contraction):
    p = pressure / 1e5
    return max(220.0 * p - 1000.0 * p * contraction + 400.0 * p * contraction**2 - 30.0, 0.0)


def refuses_what_is_longer(pressure, contraction):
    if contraction < 0.0:
        raise ValueError("longer than at rest")
    return ideal(pressure, contraction)


def stretched_sleeve(pressure, contraction):
    if contraction < 0.0:
        return ideal(pressure, 0.0) - 3000.0 * contraction
    return ideal(pressure, contraction)


# laws with a fault


def explodes(pressure, contraction):
    return pressure * 8e-4 * math.exp(-45.0 * contraction)


def pushes(pressure, contraction):
    return braid(pressure, 2.0 * contraction)


def grows(pressure, contraction):
    return 2e-3 * pressure * (0.3 + 2.0 * contraction)


def inverted(pressure, contraction):
    return (7e5 - pressure) * 2e-3 * (1.0 - contraction / 0.3)


def jumps(pressure, contraction):
    return (
        ideal(pressure, contraction) if contraction < 0.11 else 0.4 * ideal(pressure, contraction)
    )


def in_bar(pressure, contraction):
    return ideal(1e5 * pressure, contraction)


def in_per_cent(pressure, contraction):
    return ideal(pressure, contraction / 100.0)


def absolute(pressure, contraction):
    return braid(pressure - 101_325.0, contraction)


def not_real(pressure, contraction):
    return ideal(pressure, contraction) + (contraction - 0.1) ** 0.5


LAST = [0.0]


def remembers(pressure, contraction):
    force = ideal(pressure, contraction) + 20.0 * math.copysign(1.0, contraction - LAST[0])
    LAST[0] = contraction
    return force


def hangs(pressure, contraction):
    while True:
        time.sleep(0.1)


def raises(pressure, contraction):
    raise RuntimeError("no licence")


def volume(contraction, unused):
    """Volume of the ideal braid of 0.2 m."""
    stretch = 1.0 - contraction
    sine = 1.0 - (stretch * math.cos(ANGLE)) ** 2
    return AREA * 0.2 * stretch * sine / math.sin(ANGLE) ** 2


def volume_of_a_cylinder(contraction, unused):
    return AREA * 0.2 * (1.0 + 0.5 * contraction)


# orifices


def iso(upstream, downstream, critical=0.3):
    ratio = downstream / upstream
    flow = 1.185 * 1e-8 * upstream
    if ratio <= critical:
        return flow
    if ratio >= 1.0:
        return 0.0
    return flow * math.sqrt(1.0 - ((ratio - critical) / (1.0 - critical)) ** 2)


def never_chokes(upstream, downstream):
    return 1e-8 * math.sqrt(max(upstream * (upstream - downstream), 0.0))


def of_gauge_pressures(upstream, downstream):
    return iso(upstream + 101_325.0, downstream + 101_325.0)


def uphill(upstream, downstream):
    high, low = max(upstream, downstream), min(upstream, downstream)
    return iso(high, low)
