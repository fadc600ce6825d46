"""Solenoid valve with pulse-width modulation: command, coil current and opening; mean opening over
the duty ratio.

python examples/valve_pulses.py        writes report/examples/drivers.png
"""

import numpy as np

import airmuscle as am
from airmuscle.core import plotting
from airmuscle.engine import PWM, SolenoidDriver, WithDrivers
from airmuscle.units import ms

VALVE = SolenoidDriver(
    opening_delay=5 * ms, closing_delay=2 * ms, opening_ramp=10 * ms, closing_ramp=4 * ms
)  # chosen


def sample_input(command, duration, rows=4000):
    """Sample times [s] and values of the input `fill`."""
    times = np.linspace(0.0, duration, rows, endpoint=False)
    return times, command.segments(("fill",), 0.0, duration).inputs_at(times, 0.0)[:, 0]


def mean_opening(duty, pwm):
    """Mean opening over the last of 20 periods."""
    command = WithDrivers(am.Schedule({"fill": ((0, duty),)}), {"fill": (pwm, VALVE)})
    memory = command.init(0.0)
    period = 1 / pwm.frequency
    _, memory = command.step(memory, ("fill",), 0.0, 19 * period)
    last, _ = command.step(memory, ("fill",), 19 * period, period)
    lengths = np.diff(last.ends, prepend=19 * period)
    return float(lengths @ (last.values[:, 0] + last.slopes[:, 0] * lengths / 2)) / period


figure, (left, right) = plotting.new_figure(1, 2, width=9.0, height=3.4, width_ratios=(1.5, 1))
signal = am.SampledSignal({"fill": ((0.0, 0.05), (0.4, 0.6))})
pwm = PWM(frequency=25.0, smallest_pulse=3 * ms)
for command, style in (
    (signal, {"color": plotting.BLACK, "linestyle": "--", "label": "command"}),
    (
        WithDrivers(signal, {"fill": pwm}),
        {"color": plotting.LINES[4], "linewidth": 0.9, "label": "coil current"},
    ),
    (WithDrivers(signal, {"fill": (pwm, VALVE)}), {"color": plotting.LINES[0], "label": "opening"}),
):
    times, values = sample_input(command, 0.4)
    left.plot(times / ms, values, **style)
left.set(
    xlabel="time [ms]", ylabel="command, current, opening", title="PWM at 25 Hz, minimum pulse 3 ms"
)
left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3)

duties = np.linspace(0.0, 1.0, 201)
for i, frequency in enumerate((5.0, 25.0, 50.0, 100.0)):
    right.plot(
        duties,
        [mean_opening(d, PWM(frequency)) for d in duties],
        color=plotting.LINES[i],
        label=f"{frequency:g} Hz",
    )
right.plot((0, 1), (0, 1), color=plotting.BLACK, linewidth=0.6)
right.set(xlabel="duty ratio", ylabel="mean opening", title="mean opening over duty ratio")
plotting.legend_outside(right, title="PWM frequency")
plotting.save(figure, "report/examples/drivers.png")
print("wrote report/examples/drivers.png")
