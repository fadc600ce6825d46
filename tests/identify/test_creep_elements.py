"""A hold that a muscle with creep elements shows gives back these elements, under a load and at a
held length.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from airmuscle.bench import Creep, creep_elements, find_holds, fit_creep
from airmuscle.bench.campaign import HeldRows
from airmuscle.bench.hysteresis import CreepFit
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import CreepElements
from airmuscle.recording import Recording

K = 20e3
L0 = 0.2
ELEMENTS = CreepElements((8e3, 4e3), (0.5, 6.0))


def simulated_shortening(elements: CreepElements, load: float, time: np.ndarray) -> np.ndarray:
    """Shortening [m] under a step of the force of the contractile part, integrated with short
    steps.
    """
    k = np.array(elements.stiffnesses)
    tau = np.array(elements.relaxation_times)
    x = load / (K + k.sum())
    z = np.full(k.size, x)
    path = [x]
    for step in np.diff(time):
        for _ in range(20):
            rate = float(np.sum(k * z / tau)) / (
                K + k.sum()
            )  # K x' + sum k z' = 0 with z' = x' - z/tau
            z = z + step / 20 * (rate - z / tau)
            x = x + step / 20 * rate
        path.append(x)
    return np.array(path)


@pytest.mark.parametrize("elements", [CreepElements((8e3,), (2.0,)), ELEMENTS])
def test_a_hold_under_a_load_gives_the_elements(elements: CreepElements):
    time = np.linspace(0.0, 40.0, 2001)
    shortening = simulated_shortening(elements, 200.0, time)
    rng = np.random.default_rng(0)
    hold = Recording(
        {"time": time, "contraction": shortening / L0 + 1e-6 * rng.standard_normal(2001)}, "hold"
    )
    found = creep_elements(
        fit_creep(hold, "contraction"), step=float(shortening[0]), stiffness=K, resting_length=L0
    )
    assert sorted(found.relaxation_times) == pytest.approx(
        sorted(elements.relaxation_times), rel=0.03
    )
    assert sorted(found.stiffnesses) == pytest.approx(sorted(elements.stiffnesses), rel=0.03)


def test_a_hold_at_a_length_gives_the_elements():
    time = np.linspace(0.0, 40.0, 2001)
    pairs = zip(ELEMENTS.stiffnesses, ELEMENTS.relaxation_times, strict=True)
    force = 300.0 - 0.005 * sum(
        k * np.exp(-time / tau) for k, tau in pairs
    )  # after a shortening by 5 mm
    noise = 0.02 * np.random.default_rng(1).standard_normal(2001)
    found = creep_elements(
        fit_creep(Recording({"time": time, "force": force + noise}, "hold"), "force"), step=0.005
    )
    assert found.stiffnesses == pytest.approx(ELEMENTS.stiffnesses, rel=0.03)
    assert found.relaxation_times == pytest.approx(ELEMENTS.relaxation_times, rel=0.03)


def made(amplitudes: tuple[float, ...], times: tuple[float, ...], unit: str = "") -> CreepFit:
    return CreepFit(
        Creep(0.1, amplitudes, times), 1e-6, (1e-3, 1e-6, 1e-6), (1e-9, 1e-9), 40.0, unit
    )


def test_the_stiffnesses_of_a_relaxation_are_its_amplitudes_by_the_step():
    found = creep_elements(made((30.0, 12.0), (0.5, 6.0), "N"), step=0.004)
    assert found.stiffnesses == pytest.approx((7500.0, 3000.0), rel=1e-12)
    assert found.relaxation_times == (0.5, 6.0)


def test_no_creep_gives_no_elements():
    assert creep_elements(made((), ()), step=0.01) == CreepElements()


def test_creep_that_passive_elements_do_not_have_and_missing_values_are_refused():
    with pytest.raises(IdentificationError, match="opposite direction of that of passive elements"):
        creep_elements(made((-3.0,), (2.0,), "N"), step=0.005)
    with pytest.raises(ParameterError, match="needs the static stiffness and the resting length"):
        creep_elements(made((0.01,), (2.0,)), step=0.005)
    with pytest.raises(ParameterError, match="the step is 0 m"):
        creep_elements(made((0.01,), (2.0,)), step=0.0)


def test_a_held_length_whose_force_relaxes_by_less_than_the_band_of_a_constant_load_is_a_hold_at_a_length():
    """5 N of 500 N, a hundred times the noise, are a relaxation; the noise of the held length is no
    creep.
    """
    random = np.random.default_rng(0)
    time = np.arange(0.0, 61.3, 0.1)
    elapsed = np.maximum(time - 1.3, 0.0)
    held = 0.04 * np.clip((time - 1.0) / 0.3, 0.0, 1.0)
    force = 500.0 - 4000.0 * held - 4.8 * np.exp(-elapsed / 8.0) * (time >= 1.3)
    columns = {
        "time": time,
        "pressure": np.full(time.size, 3e5),
        "contraction": held + 1e-6 * random.standard_normal(time.size),
        "force": force + 0.05 * random.standard_normal(time.size),
    }
    (hold,) = find_holds(Recording(columns, "bench"))
    assert hold.quantity == "force"
    creep = fit_creep(Recording(columns, "bench").rows(hold.interval.rows), "force").creep
    assert creep.amplitudes == pytest.approx((4.8,), rel=0.05)
    assert creep.time_constants == pytest.approx((8.0,), rel=0.05)
    load = {
        **columns,
        "contraction": 0.1 + (500.0 - force) / 1e4,
        "force": 340.0 + columns["force"] - force,
    }
    assert [each.quantity for each in find_holds(Recording(load, "bench"))] == ["contraction"]


def test_a_hold_that_ends_within_the_dead_time_is_no_fit_of_the_motion():
    time = np.arange(0.0, 0.3, 0.001)
    held = 0.04 * np.clip((time - 0.02) / 0.1, 0.0, 1.0)
    columns = {
        "time": time,
        "pressure": np.full(time.size, 3e5),
        "contraction": held,
        "force": 500.0 - 4000.0 * held,
    }
    record = Recording(columns, "bench", constants={"resting_length": 0.3})
    with pytest.raises(IdentificationError, match=r"the hold ends 0\.18 s after"):
        HeldRows.after(record, 0.12)
    assert HeldRows.after(record, 0.05).recording["force"] == pytest.approx(340.0)


@pytest.mark.parametrize("step", [0.01, -0.02])
def test_compliance_and_stiffness_of_the_conversion_are_reciprocal(step):
    """D(s) (K + Sum k_i s tau_i/(1 + s tau_i)) = 1 at every s, exactly: the conversion is
    algebra.
    """
    stiffness = 2.5e4
    length = 0.3
    creep = np.array([0.003, 0.002]) * np.sign(step)
    times = np.array([0.8, 12.0])
    fit = SimpleNamespace(
        unit="", creep=SimpleNamespace(amplitudes=tuple(creep), time_constants=tuple(times))
    )
    found = creep_elements(fit, step=step, stiffness=stiffness, resting_length=length)
    load = stiffness * (step + length * creep.sum())
    relaxation = np.array(found.relaxation_times)
    for s in (0.0, 1e-3, 0.1, 1.0, 30.0, 1e6):
        compliance = (step + length * np.sum(creep / (1 + s * times))) / load
        dynamic = stiffness + np.sum(
            np.array(found.stiffnesses) * s * relaxation / (1 + s * relaxation)
        )
        assert compliance * dynamic == pytest.approx(1.0, abs=1e-9)
