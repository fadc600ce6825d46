"""Creep elements of a muscle from the creep of a hold: conversion of relaxation and of retardation to Maxwell elements.

A hold at constant length relaxes: F(t) = F_inf + Sum k_i z_0 exp(-t/tau_i) after a change of length z_0, so that the
amplitudes give the stiffnesses directly. A hold under constant load retards: the operational compliance is
D(s) = J_0 + Sum J_i/(1 + s lambda_i), and the operational stiffness of the muscle with its Maxwell elements is its
reciprocal, K + Sum k_i s tau_i/(1 + s tau_i); the relaxation times belong to the zeros of D.
Reference: Tschoegl, N. W., The Phenomenological Theory of Linear Viscoelastic Behavior, Springer, 1989.
"""

from __future__ import annotations

import numpy as np

from ....core.errors import IdentificationError, ParameterError
from ....physics.muscle import CreepElements
from .creep import CreepFit


def creep_elements(
    fit: CreepFit, *, step: float, stiffness: float | None = None, resting_length: float | None = None
) -> CreepElements:
    """The creep elements of a muscle that creeps as the hold of `fit`; none if the data justify no creep.

    step            shortening of the muscle [m] by the fast change before the hold, negative for an elongation
    stiffness       static stiffness K [N/m] of the relaxed muscle at constant pressure; needed for a hold under a load
    resting_length  [m]; needed for a hold under a load, whose creep is a contraction

    The fast change must be quick compared with the time constants, and the muscle taut. Raises ParameterError for a
    missing or invalid value, IdentificationError for creep in the wrong direction, which passive elements do not have.
    """
    if not np.isfinite(step) or step == 0.0:
        raise ParameterError(f"creep_elements: the step is {step:g} m; it must be finite and not zero.")
    amplitudes = np.array(fit.creep.amplitudes)
    times = np.array(fit.creep.time_constants)
    if not amplitudes.size:
        return CreepElements()
    if fit.unit:
        return _relaxation(amplitudes, times, step)
    if stiffness is None or resting_length is None:
        raise ParameterError(
            "creep_elements: a hold under a load needs the static stiffness and the resting length of the muscle. Give "
            "stiffness=... [N/m], such as that of its law, and resting_length=... [m]."
        )
    if not stiffness > 0.0 or not resting_length > 0.0:
        raise ParameterError(
            f"creep_elements: the stiffness is {stiffness:g} N/m and the resting length {resting_length:g} m; both "
            "must be greater than zero."
        )
    return _retardation(amplitudes * resting_length, times, step, stiffness)


def _relaxation(amplitudes: np.ndarray, times: np.ndarray, step: float) -> CreepElements:
    """From the change of the force [N] after a shortening by `step` [m], which lowers the force at first."""
    stiffnesses = amplitudes / step
    _check_passive(stiffnesses)
    return CreepElements(tuple(map(float, stiffnesses)), tuple(map(float, times)))


def _retardation(creep: np.ndarray, times: np.ndarray, step: float, stiffness: float) -> CreepElements:
    """From the further shortening [m] under a constant load after a shortening by `step` [m]."""
    _check_passive(creep / step)
    load = stiffness * (step + creep.sum())
    instantaneous, compliances = step / load, creep / load
    # D(s) prod(1 + s lambda_i) as a polynomial in s; its zeros are -1/tau_i
    factors = [np.poly1d([constant, 1.0]) for constant in times]
    numerator = _product(factors) * instantaneous
    for i, compliance in enumerate(compliances):
        numerator = numerator + _product([f for j, f in enumerate(factors) if j != i]) * compliance
    zeros = np.sort(np.real(numerator.roots))
    slopes = [-float(np.sum(compliances * times / (1.0 + zero * times) ** 2)) for zero in zeros]
    stiffnesses = [1.0 / (slope * zero) for slope, zero in zip(slopes, zeros, strict=True)]
    return CreepElements(tuple(map(float, stiffnesses)), tuple(float(-1.0 / zero) for zero in zeros))


def _product(factors: list[np.poly1d]) -> np.poly1d:
    result = np.poly1d([1.0])
    for factor in factors:
        result = result * factor
    return result


def _check_passive(ratios: np.ndarray) -> None:
    if (ratios <= 0.0).any():
        raise IdentificationError(
            "the creep has the opposite direction of that of passive elements: after a shortening the force recovers "
            "at constant length, and the muscle shortens further under a constant load. Check the sign of the step and "
            "that the pressure was constant; creep of the pressure is no creep of the muscle."
        )
