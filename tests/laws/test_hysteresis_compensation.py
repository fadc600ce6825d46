"""The inverse of the modified Prandtl-Ishlinskii operator by Kuhnen's formulas: the composed
operator is the identity to 1e-12; a fit finds the weights again; the compensation of a muscle with
friction reduces the tracking error.
"""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from called_controller import Called
from plants import chosen_muscle

import airmuscle as am
from airmuscle.control import HysteresisCompensation, HysteresisOperator, SetpointCommand
from airmuscle.engine import ControlLoop
from airmuscle.errors import ParameterError
from airmuscle.physics import MaxwellSlip, Valve

OPERATORS = {
    "plays": HysteresisOperator((0.0, 0.1, 0.3, 0.7), (0.8, 0.3, 0.2, 0.4)),
    "negative weight": HysteresisOperator((0.0, 0.2, 0.5), (1.0, -0.4, 0.1)),
    "dead zones": HysteresisOperator(
        (0.0, 0.1, 0.4), (1.0, 0.5, 0.2), (0.6, -0.3, 1.1, -0.9), (0.5, -0.4, -0.8, 0.7)
    ),
    "memoryless": HysteresisOperator((0.0,), (2.0,), (0.5,), (1.0,)),
}
PATH = np.cumsum(np.random.default_rng(7).normal(scale=0.3, size=2000))


@pytest.mark.parametrize("operator", OPERATORS.values(), ids=OPERATORS)
def test_the_operator_after_its_inverse_is_the_identity(operator):
    assert (
        np.abs(operator.output(operator.inverse.output(PATH)) - PATH).max()
        <= 1e-12 * np.abs(PATH).max()
    )


@pytest.mark.parametrize("operator", OPERATORS.values(), ids=OPERATORS)
def test_the_inverse_after_the_operator_is_the_identity(operator):
    assert (
        np.abs(operator.inverse.output(operator.output(PATH)) - PATH).max()
        <= 1e-12 * np.abs(PATH).max()
    )


def test_a_play_follows_its_input_within_its_threshold():
    play = HysteresisOperator((0.0, 1.0), (1e-9, 1.0))
    assert play.output([0.5, 2.0, 1.5, 0.5, -0.5]) == pytest.approx(
        [0.0, 1.0, 1.0, 1.0, 0.5], abs=1e-8
    )


def test_a_fit_finds_the_weights_again():
    truth = OPERATORS["plays"]
    found = HysteresisOperator.fitted(PATH, truth.output(PATH), truth.thresholds)
    assert found.weights == pytest.approx(truth.weights, abs=1e-9)


MUSCLE = replace(
    chosen_muscle(), friction=MaxwellSlip(stiffnesses=(2e4, 1e4, 5e3), limits=(2e-4, 1e-3, 3e-3))
)
VALVE = Valve(2e-8, 0.4)
CIRCUIT = replace(
    am.load("joint-dmsp-20-regulators").plant.circuits[0],
    fill=VALVE,
    discharge=VALVE,
    max_setpoint=5.5e5,
)
PLANT = am.Plant(MUSCLE, CIRCUIT, am.HangingMass(5.0))
START = am.find_equilibrium(PLANT, pressure=2e5)
H = 0.02
DURATION = 16.0
TIME = H * np.arange(round(DURATION / H) + 1)


def driven(pressures, law=SetpointCommand(("setpoint",), ("pressure",))):
    """A recording at the samples with these set pressures (N,)."""
    wanted = am.SampledSignal(
        {"pressure": tuple(zip(TIME.tolist(), pressures.tolist(), strict=True))}
    )
    run = am.simulate(
        PLANT, ControlLoop(law, H, wanted), duration=DURATION, initial_state=START, output_times=H
    )
    _, rows = np.unique(np.round(run["time"] / H), return_index=True)
    return {name: run[name][rows] for name in run}


def swings(amplitude, frequency, phase=0.0):
    return 2e5 + amplitude * np.sin(2 * np.pi * frequency * TIME + phase) * np.minimum(
        TIME / 2.0, 1.0
    )


def test_a_compensated_muscle_with_friction_tracks_better():
    """Fitted to one slow swing with decreasing amplitude, judged on another: at least half of the
    error is gone.
    """
    taught = driven(2e5 + 1.2e5 * np.sin(2 * np.pi * 0.25 * TIME) * (1.0 - 0.9 * TIME / DURATION))
    anhysteretic = np.polyfit(taught["position"], taught["pressure"], 3)
    centred = taught["pressure"] - 2e5
    operator = HysteresisOperator.fitted(
        centred, np.polyval(anhysteretic, taught["position"]) - 2e5, (0.0, *(1e4 * np.arange(1, 8)))
    )
    wanted = swings(0.8e5, 0.17) + 0.3e5 * np.sin(2 * np.pi * 0.4 * TIME)
    compensated = 2e5 + operator.inverse.output(wanted - 2e5)
    late = TIME > 3.0

    def error(record):
        return float(
            np.sqrt(np.mean((np.polyval(anhysteretic, record["position"]) - wanted)[late] ** 2))
        )

    plain = error(driven(wanted))
    better = error(driven(compensated))
    assert better < 0.5 * plain


def test_a_compiled_compensation_is_that_of_the_operator():
    """The command of the law through the operator is the set point, to 1e-12; compiled as
    called.
    """
    operator = HysteresisOperator((0.0, 1e4, 3e4), (0.9, 0.2, 0.1))
    law = HysteresisCompensation(
        SetpointCommand(("setpoint",), ("pressure",)), "setpoint", operator.inverse
    )
    wanted = swings(1e5, 0.5)
    for controller in (law, Called(law)):
        command = driven(wanted, controller)["command.setpoint"]
        assert operator.output(command)[:-1] == pytest.approx(wanted[:-1], rel=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (((0.0, 1.0), (1.0,)), "2 thresholds and 1 weights"),
        (((), ()), "give as many, one or more"),
        (((0.1,), (1.0,)), "must begin with 0 and increase"),
        (((0.0, 1.0), (1.0, -1.0)), "Otherwise there is no inverse"),
        (((0.0,), (1.0,), (1.0,), (-1.0,)), "Otherwise there is no inverse"),
        (((0.0,), (1.0,), (0.0,), (1.0,)), "one threshold, other than 0"),
        (((0.0,), (float("nan"),)), "weights"),
    ],
)
def test_an_operator_without_inverse_is_refused(given, message):
    with pytest.raises(ParameterError, match=message):
        HysteresisOperator(*given)


def test_an_input_that_the_law_does_not_command_is_refused():
    with pytest.raises(
        ParameterError, match=r"does not command 'fil'; it commands fill.*Did you mean 'fill'"
    ):
        HysteresisCompensation(
            SetpointCommand(("fill",), ("x",)), "fil", OPERATORS["plays"].inverse
        )


def test_paths_of_different_lengths_are_refused():
    with pytest.raises(ParameterError, match="must be finite arrays"):
        HysteresisOperator.fitted([0.0, 1.0], [0.0], (0.0,))


EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "noisy_hysteresis.py"))


def test_elements_keep_their_direction_where_a_switch_by_the_rate_flips():
    """The numbers of docs/guides/hysteresis.md; without noise both turn at the three ends of the
    triangles.
    """
    rng = np.random.default_rng(0)
    clean, noisy = (EXAMPLE["comparison"](noise, rng) for noise in (0.0, 1.0))
    assert clean == [pytest.approx(0.0375, abs=0.001), 0.0, pytest.approx(0.025, abs=0.02), 0.0]
    assert noisy == [
        pytest.approx(66, abs=2),
        pytest.approx(133, abs=3),
        pytest.approx(0.35, abs=0.2),
        pytest.approx(7, abs=1),
    ]
    switched, slipping = EXAMPLE["held_flips"](rng)
    assert switched == pytest.approx(24, abs=4)
    assert slipping == 0.0


def test_the_first_loop_is_wider_if_the_elements_begin_relaxed():
    np.testing.assert_allclose(EXAMPLE["loop_widths"](), [80.0, 53.0, 53.0], atol=0.1)
    np.testing.assert_allclose(EXAMPLE["loop_widths"](settled=True), [53.0, 53.0, 53.0], atol=0.1)
