"""Drivers of an input inside a kernel: pulse width modulation, and a switch with delays and ramps.

`PWM` and `SolenoidDriver` of `engine.loop` call them as plain Python, and exported programs print
them. A signal is an array (3, capacity): end, value at the start, and slope of each segment;
`count` of them are used.
"""

import numpy as np

from .calls import PART

INFINITY = np.inf
THRESHOLD = 0.5
"""The coil of a solenoid carries current while its command is at least this (chosen)."""
ARRIVED = 1e-12
"""An opening this close to its target has reached it: rounding makes no segment of its own."""


@PART
def end_of_pulse(time, duty, period, smallest):
    """The end of the pulse of a period that begins at `time`: -infinity without a pulse, infinity
    without a gap.
    """
    width = period * min(max(duty, 0.0), 1.0)
    end = time + width
    if period - width < smallest:
        end = INFINITY
    if width < smallest:
        end = -INFINITY
    return end


@PART
def hold_levels(result, levels, end):
    """Turn instants at which levels begin into ends of segments without slope."""
    for i in range(levels):
        result[0, i] = result[0, i + 1] if i + 1 < levels else end
        result[2, i] = 0.0


@PART
def pulse_width_modulation(settings, state, later, signal, count, start, ulp, result):
    """Modulate a signal from `start`; the number of segments of the result.

    settings  frequency, smallest pulse
    state     origin of the carrier, periods begun, end of the last pulse; `later` receives it at
              the end of the signal
    ulp       distance from the end of the signal to the next floating-point number
    """
    end = signal[0, count - 1]
    frequency = settings[0]
    period = 1.0 / frequency
    smallest = max(settings[1], 1e-9 * period, 4.0 * ulp)
    origin = state[0]
    begun = state[1]
    pulse_end = state[2]
    on = pulse_end > start  # pulses so far: instants in row 0 of the result, levels in row 1
    result[0, 0] = start
    result[1, 0] = 1.0 if on else 0.0
    levels = 1
    if on and pulse_end < end:
        result[0, 1] = pulse_end
        result[1, 1] = 0.0
        levels = 2
    last = end - 4.0 * ulp
    total = int(np.ceil((end - origin) * frequency - begun)) + 1
    k = 0
    begin = start
    periods = 0
    for i in range(total):
        time = origin + (begun + i) / frequency
        if time < last:
            time = max(time, start)
            while k < count - 1 and signal[0, k] <= time:
                begin = signal[0, k]
                k += 1
            pulse_end = end_of_pulse(
                time, signal[1, k] + (time - begin) * signal[2, k], period, smallest
            )
            if periods == 0 and time == start:
                levels = 0
            on = pulse_end > time
            level = 1.0 if on else 0.0
            if levels == 0 or level != result[1, levels - 1]:
                result[0, levels] = time
                result[1, levels] = level
                levels += 1
            if on and pulse_end < end:
                result[0, levels] = pulse_end
                result[1, levels] = 0.0
                levels += 1
            periods += 1
    hold_levels(result, levels, end)
    later[0] = origin
    later[1] = begun + periods
    later[2] = pulse_end
    return levels


@PART
def find_switchings(signal, count, start, coil, events):
    """Write the instants at which a signal passes the threshold, and the new coil states; how many
    there are.
    """
    switchings = 0
    present = coil
    begin = start
    for k in range(count):
        value = signal[1, k]
        slope = signal[2, k]
        first = value >= THRESHOLD
        last = value + slope * (signal[0, k] - begin) >= THRESHOLD
        if first != (present > 0.0):
            present = 1.0 if first else 0.0
            events[0, switchings] = begin
            events[1, switchings] = present
            switchings += 1
        if last != first:
            present = 1.0 if last else 0.0
            events[0, switchings] = min(begin + (THRESHOLD - value) / slope, signal[0, k])
            events[1, switchings] = present
            switchings += 1
        begin = signal[0, k]
    return switchings


@PART
def move_towards(target, opening, edge, stop, settings, result, segments):
    """Write the motion of the opening from `edge` to `stop`, and the rest after it; the opening,
    and the segments.
    """
    after = target
    arrival = edge
    if target != opening:
        ramp = settings[2] if target > opening else settings[3]
        distance = abs(target - opening)
        travel = (stop - edge) / ramp if ramp > 0.0 else INFINITY
        left = distance - travel
        if left > ARRIVED:
            after = target + left if opening - target >= 0.0 else target - left
        arrival = edge + ramp * distance if after == target else stop
        arrival = min(arrival, stop)
    if arrival > edge:
        result[0, segments] = arrival
        result[1, segments] = opening
        result[2, segments] = (after - opening) / (arrival - edge)
        segments += 1
    if stop > arrival:
        result[0, segments] = stop
        result[1, segments] = after
        result[2, segments] = 0.0
        segments += 1
    return after, segments


@PART
def delayed_switch(settings, state, later, signal, count, start, events, result):
    """Opening of a switch that follows a signal from `start`; the number of segments of the result.

    settings  opening delay, closing delay, opening ramp, closing ramp
    state     coil, pending instant, target, opening; `later` receives it at the end of the signal
    events    (3, capacity): workspace
    """
    end = signal[0, count - 1]
    coil = state[0]
    pending = state[1]
    target = state[2]
    opening = state[3]
    switchings = find_switchings(signal, count, start, coil, events)
    edge = start
    segments = 0
    for k in range(switchings + 1):
        instant = events[0, k] if k < switchings else INFINITY
        if coil != target and pending < instant and pending < end:
            if pending > edge:
                opening, segments = move_towards(
                    target, opening, edge, pending, settings, result, segments
                )
            edge = pending
            target = coil
        if k < switchings:
            coil = events[1, k]
            delay = settings[0] if coil > 0.0 else settings[1]
            pending = instant + delay
    if end > edge:
        opening, segments = move_towards(target, opening, edge, end, settings, result, segments)
    later[0] = coil
    later[1] = pending if pending >= end else INFINITY
    later[2] = target
    later[3] = opening
    return segments
