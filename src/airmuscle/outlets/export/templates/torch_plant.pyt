@provenance@
"""@title@: a batched joint or arm with its muscles for PyTorch, printed from a plant of airmuscle; it needs PyTorch alone.

    arm = @class@((4096,))
    state = arm.start(pressure=1e5, angle=0.0)
    output = arm.compute(state, command, dt)
    state = output.state

A command is a tensor (@inputs_count@, *shape), or a number for all: @commands@, each limited to its
COMMAND_RANGES. Coordinates and speeds (J, *shape), gauge pressures [Pa] and tensions [N] (M, *shape) and whether the point
is within the validity range of the muscles belong to the beginning of the step, the state to its end. The commands are held
over the step; the method is the classical one of Runge and Kutta with steps of at most STEP.

Where a command is not finite, `valid` is False, the other outputs are NaN, and the state remains as it is.
"""

import math
from typing import NamedTuple

import torch

STATES = @states@
COMMANDS = @names@
COMMAND_RANGES = @ranges@
COORDINATES = @coordinates@
MUSCLES = @muscles@
PARAMETERS = @parameters@
DEFAULTS = @defaults@
LOWER, UPPER = @lower@, @upper@
STEP = @step@
# Identified parameters, and the root of their covariance: deviations are SPREAD times independent normal deviates.
IDENTIFIED = @identified@
SPREAD = @spread@
NO_COVARIANCE = (
    "the parameters of this plant have no covariance from which to draw; export a scenario with a table [uncertainty], as"
    " `airmuscle fit-joint` writes it, or give drawn values to set_parameters"
)


def stacked(values, like):
    """The elements of an array as one tensor, of the type of `like`."""
    kind = {"dtype": like.dtype, "device": like.device}
    return torch.stack(torch.broadcast_tensors(*(torch.as_tensor(value, **kind) for value in values or [0.0])))


@functions@
class Output(NamedTuple):
    """Coordinates, their speeds, gauge pressures [Pa], tensions [N] and validity at the beginning of a step, and the state
    (n, *shape) at its end.
    """

    angle: torch.Tensor
    speed: torch.Tensor
    pressure: torch.Tensor
    tension: torch.Tensor
    valid: torch.Tensor
    state: torch.Tensor


class @class@(torch.nn.Module):
    """Plants of one kind, one for each element of `shape`."""

    def __init__(self, shape=(1,), *, dtype=torch.float32, device=None):
        super().__init__()
        self.shape = torch.Size(shape)
        kind = {"dtype": dtype, "device": device}
        for name, values in (("defaults", DEFAULTS), ("lower", LOWER), ("upper", UPPER)):
            self.register_buffer(name, torch.tensor(values, **kind))
        columns = len(SPREAD[0]) if SPREAD else 0
        self.register_buffer("spread", torch.tensor(SPREAD, **kind).reshape(len(IDENTIFIED), columns))
        self.register_buffer("values", self.defaults.clone())
        self.register_buffer("prepared", prepare(self.values))

    @parameter_methods@

    def _rows(self, value, count):
        """A number, a sequence of `count`, or a tensor (count, *shape) as a tensor (count, *shape)."""
        value = torch.as_tensor(value, dtype=self.defaults.dtype, device=self.defaults.device)
        if value.ndim == 1 and value.shape[0] == count:
            value = value.reshape(count, *(1 for _ in self.shape))
        return value.expand(count, *self.shape)

    def start(self, pressure=0.0, angle=0.0):
        """The state (n, *shape) at rest at gauge pressures [Pa] of the muscles and at coordinates."""
        begun = torch.cat([self._rows(pressure, len(MUSCLES)), self._rows(angle, len(COORDINATES))])
        return start(begun, self.prepared).expand(len(STATES), *self.shape).clone()

    def compute(self, state, command, dt):
        """The output of a step of `dt` [s], with the state after it. Raises ValueError for a `dt` that is not positive."""
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt} s; it must be positive and finite")
        u, c = self._rows(command, len(COMMANDS)), self.prepared
        observed = observe(state, u, c)
        count, h = max(1, math.ceil(dt / STEP - 1e-9)), dt / max(1, math.ceil(dt / STEP - 1e-9))
        for _ in range(count):
            first = rates(state, u, c)
            second = rates(state + 0.5 * h * first, u, c)
            third = rates(state + 0.5 * h * second, u, c)
            fourth = rates(state + h * third, u, c)
            state = state + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        sizes = [len(COORDINATES)] * 2 + [len(MUSCLES)] * 2 + [1]
        angle, speed, pressure, tension, valid = observed.split(sizes)
        return Output(angle, speed, pressure, tension, valid[0] > 0.5, state)

    forward = compute
