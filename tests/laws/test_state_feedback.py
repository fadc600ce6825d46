"""State feedback with observer and integral action, against the same equations in matrices.

x_k = x^-_k + K (y_k - y_0 - C x^-_k),   u_k = u_0 + N (r_k - z_0) - L x_k - L_I w_k limited to the
                                         ranges of the inputs,
x^-_(k+1) = A x_k + B (u_k - u_0),   w_(k+1) = w_k + h (z_k - r_k), unchanged while an input is
                                     limited
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from airmuscle.control import StateFeedback, design_adrc
from airmuscle.engine import Measurement
from airmuscle.errors import ParameterError

H = 0.02
RANDOM = np.random.default_rng(4)
A, B, C = (0.4 * RANDOM.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3)))
K, GAIN, INTEGRAL_GAIN = (0.4 * RANDOM.normal(size=shape) for shape in ((3, 2), (2, 3), (2, 1)))
Y0 = np.array([0.4, -2.0])
U0 = np.array([1.5, 0.3])


def law() -> StateFeedback:
    flat = [tuple(matrix.ravel().tolist()) for matrix in (A, B, C, K, GAIN, INTEGRAL_GAIN)]
    return StateFeedback(
        ("y", "z"), ("z",), ("u", "v"), ("a", "b", "c"), *flat, tuple(Y0), tuple(U0)
    )


@pytest.mark.parametrize(("low", "high"), [(-1e9, 1e9), (1.2, 1.7)], ids=["free", "limited"])
def test_each_sample_is_that_of_the_matrices(low, high):
    feedback = law()
    memory = dict(law().initial_memory)
    predicted = np.zeros(3)
    integral = np.zeros(1)
    random = np.random.default_rng(5)
    for _ in range(8):
        measured = random.normal(size=2)
        setpoint = random.normal()
        ranges = {"u": (low, high), "v": (-1e9, 1e9)}
        commands, memory = feedback.step(
            memory, Measurement(dict(zip("yz", measured, strict=True)), {"z": setpoint}, ranges), H
        )
        state = predicted + K @ (measured - Y0 - C @ predicted)
        wanted = U0 - GAIN @ state - INTEGRAL_GAIN @ integral
        applied = np.array([np.clip(wanted[0], low, high), wanted[1]])
        assert [commands["u"], commands["v"]] == pytest.approx(applied)
        predicted = A @ state + B @ (applied - U0)
        integral = integral + (
            H * (measured[1] - setpoint) if np.array_equal(applied, wanted) else 0.0
        )
        assert [memory[f"state.{name}"] for name in "abc"] == pytest.approx(predicted)
        assert memory["integral.z"] == pytest.approx(integral[0])


def test_at_the_operating_point_the_inputs_remain():
    columns = dict(zip("yz", Y0, strict=True))
    ranges = dict.fromkeys("uv", (-10.0, 10.0))
    commands, memory = law().step(
        dict(law().initial_memory), Measurement(columns, {"z": Y0[1]}, ranges), H
    )
    assert (commands["u"], commands["v"]) == pytest.approx(U0)
    assert set(memory.values()) == {0.0}


def test_a_set_point_has_a_gain_and_integral_action_can_be_absent():
    flat = [tuple(matrix.ravel().tolist()) for matrix in (A, B, C, K, GAIN)]
    aimed = StateFeedback(
        ("y", "z"),
        ("z",),
        ("u", "v"),
        ("a", "b", "c"),
        *flat,
        (),
        tuple(Y0),
        tuple(U0),
        (2.0, -3.0),
    )
    assert set(aimed.initial_memory) == {"state.a", "state.b", "state.c"}
    columns = dict(zip("yz", Y0, strict=True))
    ranges = dict.fromkeys("uv", (-10.0, 10.0))
    commands, _ = aimed.step(
        dict(aimed.initial_memory), Measurement(columns, {"z": Y0[1] + 0.5}, ranges), H
    )
    assert (commands["u"], commands["v"]) == pytest.approx((U0[0] + 1.0, U0[1] - 1.5))
    with pytest.raises(ParameterError, match=r"setpoint_gain has 1 numbers; .* it must have 2"):
        replace(aimed, setpoint_gain=(1.0,))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_active_disturbance_rejection_has_the_poles_of_its_bandwidths(order):
    """Controller: (s + omega_c)^n on the chain of integrators; observer: all poles at exp(-omega_o
    h).
    """
    wc = 7.0
    wo = 40.0
    b0 = 3.0
    law = design_adrc("y", "u", H, order=order, gain=b0, bandwidth=wc, observer_bandwidth=wo)
    n = order + 1
    a, b, c, k = (
        np.reshape(m, s)
        for m, s in (
            (law.transition, (n, n)),
            (law.input_matrix, (n, 1)),
            (law.output_matrix, (1, n)),
            (law.observer_gain, (n, 1)),
        )
    )
    assert np.poly((np.eye(n) - k @ c) @ a) == pytest.approx(
        np.poly([np.exp(-wo * H)] * n), abs=1e-9
    )
    chain = np.diag(np.ones(order - 1), 1)
    chain[-1] = -b0 * np.array(law.feedback_gain[:order])
    assert np.poly(chain) == pytest.approx(np.poly([-wc] * order), rel=1e-9)
    assert law.feedback_gain[order] == pytest.approx(1 / b0)
    assert law.setpoint_gain == pytest.approx((wc**order / b0,))
    assert a[:, :order] @ np.eye(n)[:order, :order] == pytest.approx(
        np.eye(n)[:, :order]
        + np.array(
            [
                [H ** (j - i) / math.factorial(j - i) if j > i else 0.0 for j in range(order)]
                for i in range(n)
            ]
        )
    )
    assert b[0, 0] == pytest.approx(b0 * H**order / math.factorial(order))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"order": 5}, "order is 5; allowed range: 1 to 4"),
        ({"gain": 0.0}, "gain is 0.0; it must be finite, and not 0"),
        ({"bandwidth": -1.0}, "bandwidth is -1.0"),
        ({"observer_bandwidth": float("nan")}, "observer_bandwidth is nan"),
    ],
)
def test_an_impossible_rejection_is_refused(change, message):
    with pytest.raises(ParameterError, match=f"design_adrc: {message}"):
        design_adrc(
            "y",
            "u",
            H,
            **{"order": 2, "gain": 1.0, "bandwidth": 5.0, "observer_bandwidth": 20.0, **change},
        )
