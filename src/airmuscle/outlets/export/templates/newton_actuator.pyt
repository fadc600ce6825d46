"""Muscles @class@ as the drive of an actuator of Newton (`newton.actuators.Actuator`).

Actuator i has one muscle of the length offset[i] + gear[i] q, with the position q of its degree of freedom; its tension
T gives the effort -gear[i] T. Its command is `muscle_command[i]` of the controls, or the feed-forward of its degree of
freedom where `muscle_command` is None. A muscle starts at rest at `initial_pressure` [Pa] with its length at that
instant. `max_delay` delays commands by so many steps, or by those of `muscles.delay`; `delay_steps` of Newton delays the
feed-forward alone, and is refused with `muscle_command`.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from newton.actuators import DriveBase

from @file@_warp import @class@, real, start


@wp.kernel(enable_backward=False)
def pull(
    positions: wp.array(dtype=float), velocities: wp.array(dtype=float), at_position: wp.array(dtype=wp.uint32),
    at_velocity: wp.array(dtype=wp.uint32), gear: wp.array(dtype=real), offset: wp.array(dtype=real), pressure: real,
    length: wp.array(dtype=real), speed: wp.array(dtype=real), q: wp.array2d(dtype=real),
):
    i = wp.tid()
    length[i] = offset[i] + gear[i] * real(positions[at_position[i]])
    speed[i] = gear[i] * real(velocities[at_velocity[i]])
    q[0, i] = pressure
    q[1, i] = length[i]


@wp.kernel(enable_backward=False)
def take_command(given: wp.array(dtype=float), index: wp.array(dtype=wp.uint32), own: int, command: wp.array(dtype=real)):
    i = wp.tid()
    if given:
        command[i] = real(given[i]) if own == 1 else real(given[index[i]])


@wp.kernel(enable_backward=False)
def begin(fresh: wp.array(dtype=wp.int32), begun: wp.array2d(dtype=real), states: wp.array2d(dtype=real)):
    i = wp.tid()
    if fresh[i] == 1:
        for k in range(states.shape[0]):
            states[k, i] = begun[k, i]


@wp.kernel(enable_backward=False)
def put_effort(tension: wp.array(dtype=real), gear: wp.array(dtype=real), forces: wp.array(dtype=float)):
    i = wp.tid()
    forces[i] = -float(gear[i] * tension[i])


@wp.kernel(enable_backward=False)
def refresh(mask: wp.array(dtype=wp.bool), fresh: wp.array(dtype=wp.int32)):
    i = wp.tid()
    if mask[i]:
        fresh[i] = 1


class @class@Drive(DriveBase):
    """One muscle for each actuator; `muscles` has the parameters and the last outputs.

    gear, offset  arrays (N,) of the length [m] per position and at the position 0
    """

    custom_inputs = ("muscle_command",)
    SHARED_PARAMS = frozenset({"initial_pressure", "max_delay"})

    @dataclass
    class State(DriveBase.State):
        """States (n, N) and commands of the muscles; `fresh` (N,) is 1 for those that start in the next step."""

        values: wp.array
        commands: wp.array
        fresh: wp.array

        def reset(self, mask=None):
            if mask is None:
                self.fresh.fill_(1)
            else:
                wp.launch(refresh, dim=len(self.fresh), inputs=[mask, self.fresh], device=self.fresh.device)

    @classmethod
    def resolve_arguments(cls, args):
        usual = {"gear": 1.0, "offset": 0.0, "initial_pressure": 0.0, "max_delay": 0}
        return {name: args.get(name, value) for name, value in usual.items()}

    def __init__(self, gear, offset, initial_pressure=0.0, max_delay=0):
        self.gear, self.offset = gear, offset
        self.initial_pressure, self.max_delay, self.muscles = initial_pressure, max_delay, None

    def finalize(self, device, num_actuators):
        self.muscles = @class@(num_actuators, max_delay=self.max_delay, device=device)
        self._length, self._speed, self._command = (wp.zeros(num_actuators, dtype=real, device=device) for _ in range(3))
        self._q = wp.zeros((2, num_actuators), dtype=real, device=device)
        self._begun = wp.zeros_like(self.muscles.states)
        self.gear, self.offset = (
            wp.array(np.broadcast_to(each.numpy() if hasattr(each, "numpy") else each, num_actuators), dtype=real, device=device)
            for each in (self.gear, self.offset)
        )

    def is_stateful(self):
        return True

    def is_graphable(self):
        return True

    def state(self, num_actuators, device):
        fresh = wp.full(num_actuators, 1, dtype=wp.int32, device=device)
        return self.State(wp.zeros_like(self.muscles.states), wp.zeros_like(self.muscles.commands), fresh)

    def compute(
        self, positions, velocities, target_pos, target_vel, feedforward, pos_indices, vel_indices, target_pos_indices,
        target_vel_indices, forces, state, dt, device=None, *, custom_inputs=None,
    ):
        muscles, own = self.muscles, (custom_inputs or {}).get("muscle_command")
        if own is not None:
            self._check_command(own, is_delayed=target_vel_indices is not vel_indices)
        launch = {"dim": muscles.count, "device": muscles.device}
        pressure = real(self.initial_pressure)
        points = [positions, velocities, pos_indices, vel_indices, self.gear, self.offset, pressure]
        wp.launch(pull, inputs=[*points, self._length, self._speed, self._q], **launch)
        given = feedforward if own is None else own
        wp.launch(take_command, inputs=[given, target_vel_indices, int(own is not None), self._command], **launch)
        wp.copy(muscles.states, state.values)
        wp.copy(muscles.commands, state.commands)
        wp.launch(start, inputs=[self._q, muscles.prepared, self._begun], **launch)
        wp.launch(begin, inputs=[state.fresh, self._begun, muscles.states], **launch)
        muscles.compute(self._command, self._length, self._speed, dt)
        wp.launch(put_effort, inputs=[muscles.tension, self.gear, forces], **launch)

    def _check_command(self, own, is_delayed):
        if len(own) != self.muscles.count:
            raise ValueError(
                f"muscle_command has {len(own)} elements; assign an array of {self.muscles.count}, one for each actuator of"
                " this group, or None for the feed-forward of the degrees of freedom"
            )
        if is_delayed:
            raise ValueError(
                "delay_steps does not delay muscle_command; give the drive max_delay in its place, or set muscle_command to"
                " None for the feed-forward of the degrees of freedom"
            )

    def update_state(self, current_state, next_state):
        wp.copy(next_state.values, self.muscles.states)
        wp.copy(next_state.commands, self.muscles.commands)
        next_state.fresh.zero_()
