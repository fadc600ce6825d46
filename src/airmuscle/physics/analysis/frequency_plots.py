"""Figures of frequency responses: gain and phase (Bode), and the open loop in the complex plane (Nyquist)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import ParameterError
from ...core.plotting import BLACK, DASHES, LINES, RED, legend_below, new_figure

MAX_CURVES = 7
"""Curves of one figure that can be told apart."""
NYQUIST_LIMIT = 3.0
"""Greatest magnitude that a Nyquist plot shows: around -1, margins are read off (chosen)."""


def bode_figure(model: Any, frequencies: Array) -> Any:
    """A Matplotlib figure of gain and phase of every output to every input of a model at frequencies (F,) [Hz].

    The model is a LinearModel or a SampledModel. Raises ParameterError for more than MAX_CURVES pairs.
    """
    pairs = [(i, j) for i in range(len(model.outputs)) for j in range(len(model.inputs))]
    if not pairs or len(pairs) > MAX_CURVES:
        raise ParameterError(
            f"bode: {len(pairs)} pairs of an input and an output; allowed range: 1 to {MAX_CURVES}. Choose them with "
            "model.select(inputs=[...], outputs=[...])."
        )
    response = model.frequency_response(frequencies)
    figure, (gain, phase) = new_figure(2, 1, height=4.6, sharex=True)
    for (i, j), colour, dashes in zip(pairs, LINES, DASHES, strict=False):
        values, label = response[:, i, j], f"{model.outputs[i]} / {model.inputs[j]}"
        gain.plot(frequencies, np.abs(values), color=colour, linestyle=dashes, label=label)
        phase.plot(frequencies, np.degrees(np.unwrap(np.angle(values))), color=colour, linestyle=dashes)
    gain.set(xscale="log", yscale="log", ylabel="gain")
    phase.set(xscale="log", xlabel="frequency [Hz]", ylabel="phase [deg]")
    legend_below(figure, gain, columns=2)
    return figure


def nyquist_figure(response: npt.NDArray[np.complex128], sensitivity_peak: float) -> Any:
    """A Matplotlib figure of an open loop (F,) near -1, with the circle that its sensitivity peak [1] touches."""
    figure, axes = new_figure(height=4.2, width=4.6)
    inside = np.abs(response) <= NYQUIST_LIMIT
    shown = np.where(inside, response, np.nan)
    axes.plot(shown.real, shown.imag, color=LINES[0], label="open loop")
    axes.plot(shown.real, -shown.imag, color=LINES[0], linestyle=":", linewidth=1.0, label="negative frequencies")
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
    axes.plot(turn.real, turn.imag, color=BLACK, linestyle="--", linewidth=0.8, label="gain 1")
    circle = -1.0 + turn / sensitivity_peak
    axes.plot(circle.real, circle.imag, color=RED, linewidth=0.9, label=f"sensitivity {sensitivity_peak:.3g}")
    axes.plot([-1.0], [0.0], "+", color=RED, markersize=9)
    axes.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
    legend_below(figure, axes, columns=2)
    return figure
