"""State feedback with observer and integral action, against the same equations in matrices.

x_k = x^-_k + K (y_k - y_0 - C x^-_k),   u_k = u_0 - L x_k - L_I w_k limited to the ranges of the inputs,
x^-_(k+1) = A x_k + B (u_k - u_0),   w_(k+1) = w_k + h (z_k - r_k), unchanged while an input is limited
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.control import StateFeedback
from airmuscle.engine import Measurement

H, RANDOM = 0.02, np.random.default_rng(4)
A, B, C = (0.4 * RANDOM.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3)))
K, GAIN, INTEGRAL_GAIN = (0.4 * RANDOM.normal(size=shape) for shape in ((3, 2), (2, 3), (2, 1)))
Y0, U0 = np.array([0.4, -2.0]), np.array([1.5, 0.3])


def law() -> StateFeedback:
    flat = [tuple(matrix.ravel().tolist()) for matrix in (A, B, C, K, GAIN, INTEGRAL_GAIN)]
    return StateFeedback(("y", "z"), ("z",), ("u", "v"), ("a", "b", "c"), *flat, tuple(Y0), tuple(U0))


@pytest.mark.parametrize(("low", "high"), [(-1e9, 1e9), (1.2, 1.7)], ids=["free", "limited"])
def test_each_sample_is_that_of_the_matrices(low, high):
    feedback, memory = law(), dict(law().initial_memory)
    predicted, integral, random = np.zeros(3), np.zeros(1), np.random.default_rng(5)
    for _ in range(8):
        measured, setpoint = random.normal(size=2), random.normal()
        ranges = {"u": (low, high), "v": (-1e9, 1e9)}
        commands, memory = feedback.step(
            memory, Measurement(dict(zip("yz", measured, strict=True)), {"z": setpoint}, ranges), H
        )
        state = predicted + K @ (measured - Y0 - C @ predicted)
        wanted = U0 - GAIN @ state - INTEGRAL_GAIN @ integral
        applied = np.array([np.clip(wanted[0], low, high), wanted[1]])
        assert [commands["u"], commands["v"]] == pytest.approx(applied)
        predicted = A @ state + B @ (applied - U0)
        integral = integral + (H * (measured[1] - setpoint) if np.array_equal(applied, wanted) else 0.0)
        assert [memory[f"state.{name}"] for name in "abc"] == pytest.approx(predicted)
        assert memory["integral.z"] == pytest.approx(integral[0])


def test_at_the_operating_point_the_inputs_remain():
    columns = dict(zip("yz", Y0, strict=True))
    ranges = dict.fromkeys("uv", (-10.0, 10.0))
    commands, memory = law().step(dict(law().initial_memory), Measurement(columns, {"z": Y0[1]}, ranges), H)
    assert (commands["u"], commands["v"]) == pytest.approx(U0)
    assert set(memory.values()) == {0.0}
