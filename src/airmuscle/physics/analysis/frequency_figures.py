"""Figures of frequency responses: Bode plot, open loop with its margins, Nyquist plot."""

import math
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ...core import (
    BLACK,
    DASHES,
    LINES,
    RED,
    Array,
    ParameterError,
    legend_below,
    new_figure,
)

MAX_CURVES = 7
"""Curves of one figure that can be told apart."""
NYQUIST_LIMIT = 3.0
"""Greatest magnitude that a Nyquist plot shows: around -1, margins are read off (chosen)."""
CRITICAL_PHASE = -180.0
"""Phase [deg] of the critical point -1."""
PHASE_STEPS = (5.0, 15.0, 45.0, 90.0, 180.0, 360.0, 720.0)
"""Steps of an axis of phase [deg]: fractions and multiples of a quarter turn."""
MAX_STEPS = 8
"""Steps of an axis of phase that can be read (chosen)."""


class GainAndPhaseMargin(Protocol):
    """The margins that a Bode plot shows."""

    @property
    def gain(self) -> float:
        """Factor by which the gain may rise; infinite: any."""
        ...

    @property
    def gain_frequency(self) -> float:
        """Frequency of the gain margin [Hz]; NaN where there is none."""
        ...

    @property
    def phase(self) -> float:
        """Phase margin [rad]."""
        ...

    @property
    def phase_frequency(self) -> float:
        """Frequency of the phase margin [Hz]; NaN where there is none."""
        ...


def bode_figure(model: Any, frequencies: Array) -> Any:
    """A Matplotlib figure of gain [dB] and phase [deg] of every output to every input of a model at
    frequencies (F,) [Hz].

    The model is a LinearModel or a SampledModel, and 0 dB is a gain of 1 in SI units. Lines stand
    at 0 dB and -180 degrees where the curves are there. Raises ParameterError for more than
    MAX_CURVES pairs.
    """
    figure, gain, phase = _gain_and_phase(model, frequencies)
    gain.set_ylabel("gain in SI units [dB]")
    for axes, level in ((gain, 0.0), (phase, CRITICAL_PHASE)):
        low, high = axes.get_ylim()
        if low <= level <= high:
            _draw_level(axes, level)
    legend_below(figure, gain, columns=2)
    return figure


def open_loop_figure(
    opened: Any, frequencies: Array, margins: GainAndPhaseMargin | None = None
) -> Any:
    """A Matplotlib figure of gain [dB] and phase [deg] of an open loop with one input and one
    output at frequencies (F,) [Hz], with the lines of 0 dB and -180 degrees.

    margins  those of the loop, drawn where their frequencies are shown; None without
    """
    figure, gain, phase = _gain_and_phase(opened, frequencies)
    gain.set_ylabel("gain [dB]")
    for axes, level in ((gain, 0.0), (phase, CRITICAL_PHASE)):
        _draw_level(axes, level)
    if margins is not None:
        shown = float(np.min(frequencies)), float(np.max(frequencies))
        _draw_gain_margin((gain, phase), margins, shown)
        _draw_phase_margin((gain, phase), margins, shown)
    legend_below(figure, gain, columns=2)
    return figure


def _gain_and_phase(model: Any, frequencies: Array) -> tuple[Any, Any, Any]:
    """The figure, its upper axes with the gains [dB], its lower axes with the phases [deg]."""
    from matplotlib.ticker import MultipleLocator

    pairs = [(i, j) for i in range(len(model.outputs)) for j in range(len(model.inputs))]
    if not pairs or len(pairs) > MAX_CURVES:
        raise ParameterError(
            f"bode: {len(pairs)} pairs of an input and an output; allowed range: 1 to {MAX_CURVES}."
            " Choose them with model.select(inputs=[...], outputs=[...])."
        )
    response = model.frequency_response(frequencies)
    figure, (gain, phase) = new_figure(2, 1, height=4.6, sharex=True)
    for (i, j), colour, dashes in zip(pairs, LINES, DASHES, strict=False):
        values = response[:, i, j]
        label = f"{model.outputs[i]} / {model.inputs[j]}"
        gain.plot(frequencies, decibels(values), color=colour, linestyle=dashes, label=label)
        phase.plot(frequencies, _phases(values), color=colour, linestyle=dashes)
    gain.set(xscale="log")
    phase.set(xscale="log", xlabel="frequency [Hz]", ylabel="phase [deg]")
    low, high = phase.get_ylim()
    step = next((step for step in PHASE_STEPS if high - low <= MAX_STEPS * step), None)
    if step is not None:
        phase.yaxis.set_major_locator(MultipleLocator(step))
    return figure, gain, phase


def decibels(response: npt.NDArray[np.complex128]) -> Array:
    """20 log10 of the magnitude of responses (F,); NaN where a response is 0."""
    magnitude = np.abs(response)
    return 20.0 * np.log10(np.where(magnitude > 0.0, magnitude, np.nan))


def _phases(response: npt.NDArray[np.complex128]) -> Array:
    """Continuous phases (F,) [deg], of which the first is above -360 and not above 0."""
    phases = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(phases - 360.0 * np.ceil(phases[0] / 360.0))


def _draw_level(axes: Any, level: float) -> None:
    axes.axhline(level, color=BLACK, linestyle="--", linewidth=0.8)


def _draw_gain_margin(
    panels: tuple[Any, Any], margins: GainAndPhaseMargin, shown: tuple[float, float]
) -> None:
    """The distance of the gain from 0 dB where the phase is -180 degrees."""
    f = margins.gain_frequency
    if not shown[0] <= f <= shown[1]:
        return
    margin = 20.0 * math.log10(margins.gain)
    label = f"gain margin {margin:.3g} dB at {f:.3g} Hz"
    _draw_margin(panels, 0, f, (0.0, -margin), label)


def _draw_phase_margin(
    panels: tuple[Any, Any], margins: GainAndPhaseMargin, shown: tuple[float, float]
) -> None:
    """The distance of the phase from -180 degrees, or a whole turn from there, where the gain is
    0 dB."""
    f = margins.phase_frequency
    if not shown[0] <= f <= shown[1]:
        return
    frequencies, phases = panels[1].lines[0].get_data()
    there = float(np.interp(math.log(f), np.log(frequencies), phases))
    critical = CRITICAL_PHASE + 360.0 * round((there - CRITICAL_PHASE) / 360.0)
    margin = math.degrees(margins.phase)
    end = critical + math.copysign(margin, there - critical)
    label = f"phase margin {margin:.3g} deg at {f:.3g} Hz"
    _draw_margin(panels, 1, f, (critical, end), label)


def _draw_margin(
    panels: tuple[Any, Any], place: int, frequency: float, ends: tuple[float, float], label: str
) -> None:
    """A margin between two values in the panel `place`, and its frequency in both panels."""
    style: Any = {"color": RED, "marker": ("s", "o")[place], "markersize": 4, "linewidth": 1.8}
    panels[place].plot([frequency, frequency], ends, zorder=3, **style)
    for axes in panels:
        axes.axvline(frequency, color=RED, linestyle=":", linewidth=0.8)
    # a legend belongs to one panel, that of the gain
    panels[0].plot([], [], label=label, **style)


def nyquist_figure(response: npt.NDArray[np.complex128], sensitivity_peak: float) -> Any:
    """A Matplotlib figure of an open loop (F,) near -1, with the circle that its sensitivity peak
    [1] touches.
    """
    figure, axes = new_figure(height=4.2, width=4.6)
    inside = np.abs(response) <= NYQUIST_LIMIT
    shown = np.where(inside, response, np.nan)
    axes.plot(shown.real, shown.imag, color=LINES[0], label="open loop")
    axes.plot(
        shown.real,
        -shown.imag,
        color=LINES[0],
        linestyle=":",
        linewidth=1.0,
        label="negative frequencies",
    )
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
    axes.plot(turn.real, turn.imag, color=BLACK, linestyle="--", linewidth=0.8, label="gain 1")
    circle = -1.0 + turn / sensitivity_peak
    axes.plot(
        circle.real,
        circle.imag,
        color=RED,
        linewidth=0.9,
        label=f"sensitivity {sensitivity_peak:.3g}",
    )
    axes.plot([-1.0], [0.0], "+", color=RED, markersize=9)
    axes.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
    legend_below(figure, axes, columns=2)
    return figure
