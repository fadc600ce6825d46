@provenance@
"""@title@: a batched actuator for PyTorch, printed from a plant of airmuscle; it needs PyTorch alone.

    actuator = @class@((4096, 8))
    state = actuator.start(pressure=1e5, length=@length@)
    tension, pressure, valid, state = actuator.compute(state, command, length, speed, dt)

All arguments are tensors of the shape of the batch, or numbers: the command [@unit@] is @command@, limited to
COMMAND_RANGE; length [m] and speed [m/s] are those of the muscle. The tension [N], the gauge pressure [Pa] and whether
the point is within the validity range of the muscle belong to the beginning of the step, the state to its end: apply
the tension for the step. The command is held over the step, the length moves at its speed; the method is the classical
one of Runge and Kutta with steps of at most STEP. `torch.compile(actuator.compute)` makes one kernel of it.

Where a command, length or speed is not finite, `valid` is False, tension and pressure are NaN, and the state remains
as it is.
"""

import math
from typing import NamedTuple

import torch

STATES = @states@
PARAMETERS = @parameters@
DEFAULTS = @defaults@
LOWER, UPPER = @lower@, @upper@
COMMAND_RANGE = (@low@, @high@)
RESTING_LENGTH = @length@
STEP = @step@
# Identified parameters, and the root of their covariance: deviations are SPREAD times independent normal deviates.
IDENTIFIED = @identified@
SPREAD = @spread@
NO_COVARIANCE = (
    "the parameters of this actuator have no covariance from which to draw; export a muscle file with a table"
    " [uncertainty], as `airmuscle campaign` writes it, or give drawn values to set_parameters"
)


def stacked(values, like):
    """The elements of an array as one tensor, of the type of `like`."""
    kind = {"dtype": like.dtype, "device": like.device}
    return torch.stack(torch.broadcast_tensors(*(torch.as_tensor(value, **kind) for value in values or [0.0])))


@functions@
class State(NamedTuple):
    """States of the plant (n, *shape), and the last commands (max_delay, *shape), the newest first."""

    values: torch.Tensor
    commands: torch.Tensor


class Output(NamedTuple):
    """Tension [N], gauge pressure [Pa] and validity at the beginning of a step, and the state at its end."""

    tension: torch.Tensor
    pressure: torch.Tensor
    valid: torch.Tensor
    state: State


class @class@(torch.nn.Module):
    """Muscles of one kind with their circuits, one for each element of `shape`.

    max_delay  longest delay of a command in steps of `compute`; `delay` is the tensor of the delays
    """

    def __init__(self, shape=(1,), *, max_delay=0, dtype=torch.float32, device=None):
        super().__init__()
        self.shape, self.max_delay = torch.Size(shape), max_delay
        kind = {"dtype": dtype, "device": device}
        for name, values in (("defaults", DEFAULTS), ("lower", LOWER), ("upper", UPPER)):
            self.register_buffer(name, torch.tensor(values, **kind))
        self.register_buffer("spread", torch.tensor(SPREAD, **kind).reshape(len(IDENTIFIED), len(IDENTIFIED)))
        self.register_buffer("values", self.defaults.clone())
        self.register_buffer("prepared", prepare(self.values))
        self.register_buffer("delay", torch.full(self.shape, max_delay, dtype=torch.long, device=device))

    @parameter_methods@

    def _tensor(self, value):
        value = torch.as_tensor(value, dtype=self.defaults.dtype, device=self.defaults.device)
        return value.expand(self.shape)

    def start(self, pressure=0.0, length=RESTING_LENGTH, command=0.0):
        """The state at rest at a gauge pressure [Pa] and a length [m], after commands of this value."""
        values = start(torch.stack([self._tensor(pressure), self._tensor(length)]), self.prepared)
        values = values.expand(len(STATES), *self.shape).clone()
        return State(values, self._tensor(command).expand(self.max_delay, *self.shape).clone())

    def compute(self, state, command, length, speed, dt):
        """The output of a step of `dt` [s], and the state after it. Raises ValueError for a `dt` that is not positive."""
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt} s; it must be positive and finite")
        command, commands = self._tensor(command), state.commands
        if self.max_delay:
            known = torch.cat([command[None], commands])
            command, commands = known.gather(0, self.delay[None])[0], known[:-1]
        length, speed, values = self._tensor(length), self._tensor(speed), state.values
        tension, pressure, valid = observe(values, (command, length, speed), self.prepared)
        steps = max(1, math.ceil(dt / STEP - 1e-9))
        for k in range(steps):
            at = length + (k * dt / steps) * speed
            values = step(values, (command, at, speed), self.prepared, dt / steps)
        return Output(tension, pressure, valid > 0.5, State(values, commands))

    forward = compute
