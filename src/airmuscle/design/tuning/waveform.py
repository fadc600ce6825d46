"""Amplitude of a periodic waveform that rows with noise sample over several periods."""

from __future__ import annotations

import math

import numpy as np

from ...core.arrays import Array

MAX_HARMONICS, ROWS_PER_HARMONIC, SURE_HARMONICS = 15, 4, 5
"""Maximum number of harmonics of the waveform of an oscillation, rows of a period for each of them, and number of
harmonics for which two rows of a period are enough (chosen)."""
START_STEP = 0.02
"""Change of the phases of the extrema [periods] with which their search starts (chosen)."""
ARC_DEGREE, ROWS_PER_ARC, BETTER = 6, 25, 0.8
"""Degree of the polynomials from one extremum to the other, rows of half a period that they need, and largest ratio of
their residual variance to that of the series with which they replace it (chosen)."""


def waveform_amplitude(time: Array, values: Array, period: float, periods: int) -> float:
    """Half the range of the periodic waveform through the rows (N,), by least squares.

    The waveform is a Fourier series, or two polynomials of degree 6 in the phase between two extrema where these have a
    clearly smaller residual variance. The series rounds off the corners at the extrema of a relay oscillation of a
    first-order process, by 2.4 % of the amplitude with 15 harmonics; polynomials need 50 rows a period.
    """
    phase, wave, variance = _harmonic_wave(time, values, period, values.size // periods)
    amplitude = 0.5 * float(np.ptp(wave))
    if values.size < 2 * ROWS_PER_ARC * periods:
        return amplitude
    from scipy.optimize import minimize

    rows, start = time / period, np.array([phase[wave.argmin()], phase[wave.argmax()]])
    simplex = start + START_STEP * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 0.0, "maxiter": 80}
    found = minimize(lambda at: _two_arcs(rows, values, at)[0], start, method="Nelder-Mead", options=options).x
    residual, of_arcs = _two_arcs(rows, values, found)
    return of_arcs if residual / (values.size - 2 * (ARC_DEGREE + 2)) < BETTER * variance else amplitude


def _harmonic_wave(time: Array, values: Array, period: float, rows: int) -> tuple[Array, Array, float]:
    """Phases [periods] and values of the Fourier series through the rows, over one period, and residual variance."""
    count = max(1, min(MAX_HARMONICS, max(rows // ROWS_PER_HARMONIC, min(SURE_HARMONICS, (rows - 1) // 2))))
    order = np.arange(1, count + 1)
    phases = 2 * math.pi / period * np.outer(time, order)
    matrix = np.column_stack([np.ones(time.size), np.cos(phases), np.sin(phases)])
    coefficients = np.linalg.lstsq(matrix, values, rcond=None)[0]
    residual = float(np.sum((values - matrix @ coefficients) ** 2))
    phase = np.arange(32 * count) / (32 * count)
    fine = 2 * math.pi * np.outer(phase, order)
    wave = np.column_stack([np.cos(fine), np.sin(fine)]) @ coefficients[1:]
    return phase, np.asarray(wave), residual / max(values.size - 2 * count - 1, 1)


def _two_arcs(phase: Array, values: Array, extrema: Array) -> tuple[float, float]:
    """Residual sum of squares and half range of polynomials from minimum to maximum and back, by least squares.

    `phase` [periods] of the rows, `extrema` phases of the minimum and of the maximum. The ends of both polynomials
    need not meet; each extremum is the mean of the two ends.
    """
    residual, ends = 0.0, []
    for first, last in (extrema, extrema[::-1]):
        width = (last - first) % 1.0
        position = (phase - first) % 1.0
        on_arc = position <= width
        if np.count_nonzero(on_arc) <= ARC_DEGREE:
            return math.inf, math.nan
        x, y = 2.0 * position[on_arc] / width - 1.0, values[on_arc]
        basis = np.polynomial.chebyshev.chebvander(x, ARC_DEGREE)
        coefficients = np.linalg.lstsq(basis, y, rcond=None)[0]
        residual += float(np.sum((y - basis @ coefficients) ** 2))
        ends.append(np.polynomial.chebyshev.chebval([-1.0, 1.0], coefficients))
    (low, high), (back_high, back_low) = ends
    return residual, 0.25 * float(high + back_high - low - back_low)
