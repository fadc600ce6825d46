"""Hysteresis from a noisy pressure: a friction switched by the rate of the pressure, and elements
that slip.

python examples/noisy_hysteresis.py    prints both on the same noisy pressure, and a first loop
                                           that is wider

The switch is that of a published simulator (porcaro_2026, common/actions/torque.py), the widths of
80 and 53 kPa are those of its joint (docs/hysteresis_play). Force, slip and gain are chosen.
Expected: with 1 kPa of noise the switch flips at 66 % of the samples, the element at 0.4 %; loops
of 80, 53, 53 kPa.
"""

import numpy as np

from airmuscle.physics import MaxwellSlip

# N, kPa, samples a second
FORCE = 5.0
SLIP = 20.0
RATE = 200.0
TRAVEL = 1e-6  # m of the threads for each kPa


def triangle(low, high, period, laps):
    """A path up and down, with RATE samples a second."""
    time = np.arange(round(RATE * period * laps) + 1) / RATE
    return low + (high - low) * (1.0 - np.abs(1.0 - 2.0 * (time / period % 1.0)))


def switched(pressure):
    """Friction [N] by the sign of the rate of the pressure [kPa], held below 2.5 kPa/s."""
    rate = np.clip(np.diff(pressure, prepend=pressure[0]) * RATE / 10.0, -1.0, 1.0)
    direction = np.tanh(rate / 0.1)
    last = np.maximum.accumulate(np.where(np.abs(rate) > 0.25, np.arange(len(rate)), 0))
    return FORCE * direction[last]


def slipping(pressure):
    """Friction [N] of one element that slips when the pressure [kPa] has turned by twice SLIP."""
    law = MaxwellSlip((FORCE / (SLIP * TRAVEL),), (SLIP * TRAVEL,))
    return law.force_along(TRAVEL * pressure)


def flips(force):
    """Percentage of the samples at which a force changes its sign."""
    return 100.0 * np.mean(np.sign(force[1:]) * np.sign(force[:-1]) < 0)


def comparison(noise, rng):
    """Flips [%] and rms error [% of the friction] of both laws with noise [kPa] on triangles of 40
    kPa/s.
    """
    clean = triangle(100.0, 500.0, 20.0, 2)
    noisy = clean + rng.normal(0.0, noise, clean.size)
    return [
        value
        for law in (switched, slipping)
        for value in (
            flips(law(noisy)),
            100.0 / FORCE * np.sqrt(np.mean((law(noisy) - law(clean)) ** 2)),
        )
    ]


def held_flips(rng, rate=2.5):
    """Flips [%] of both laws while a pressure is held after a rise, with a noise of its rate
    [kPa/s].
    """
    hold = np.full(2000, 300.0) + rng.normal(0.0, rate / RATE / np.sqrt(2.0), 2000)
    path = np.concatenate([np.linspace(100.0, 300.0, 1000), hold])
    return [flips(law(path)[1000:]) for law in (switched, slipping)]


def loop_widths(laps=3, settled=False):
    """Width [kPa] of each loop at half the way.

    The wide element, longer than half the way, slips in the first lap only, and not at all if it is
    `settled` at the deflection in which every further lap begins.
    """
    # m, m, N/kPa
    way = 0.02
    wide = 0.016
    gain = 1.0
    law = MaxwellSlip((1e5, 27.0 / (way - wide)), (26.5e0 / 1e5, wide))
    path = triangle(0.0, way, 10.0, laps)
    before = np.linspace(way, 0.0, 100) if settled else np.zeros(1)
    force = law.force_along(np.concatenate([np.zeros(1), before, path]))[before.size + 1 :]
    each = round(10.0 * RATE)
    quarter = round(2.5 * RATE)
    return [(force[k * each + quarter] - force[k * each + 3 * quarter]) / gain for k in range(laps)]


if __name__ == "__main__":
    generator = np.random.default_rng(0)
    for level in (0.0, 0.01, 0.1, 1.0, 3.0):
        by_rate, rate_error, by_slip, slip_error = comparison(level, generator)
        print(
            f"noise {level:4} kPa: switched flips at {by_rate:6.3f} % of the samples, rms error"
            f" {rate_error:5.1f} %; slipping {by_slip:5.3f} %, {slip_error:4.1f} %"
        )
    print(
        "held, noise of 2.5 kPa/s: switched flips at {:.1f} %, slipping at {:.1f} %".format(
            *held_flips(generator)
        )
    )
    for text, widths in (("relaxed", loop_widths()), ("settled", loop_widths(settled=True))):
        print(
            f"elements {text} at the start: loops of "
            + ", ".join(f"{width:.1f}" for width in widths)
            + " kPa"
        )
