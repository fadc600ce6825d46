"""Muscles @class@ as an actuator group of mjlab, on the joints or tendons of an entity.

Muscle m has the length offsets[m] + sum over the targets j of gears[m][j] times their position; its tension T acts on
target j with the force -gears[m][j] T. By default each target has one muscle, whose length is its position. The command
of the muscles is `command` (environments, muscles), to be written by an action term; with one muscle per target the
effort target is added to it. The sum is delayed by mjlab (`delay_min_lag`, `delay_max_lag` and the further fields).
"""

from dataclasses import dataclass, replace

import torch
from mjlab.actuator import Actuator, ActuatorCfg
from mjlab.utils.spec import create_motor_actuator

from @file@ import @class@


@dataclass(kw_only=True)
class @class@Cfg(ActuatorCfg):
    """Transmission of the muscles, and their gauge pressure [Pa] after a reset."""

    gears: tuple[tuple[float, ...], ...] | None = None
    offsets: tuple[float, ...] | None = None
    initial_pressure: float = 0.0

    def build(self, entity, target_ids, target_names):
        return @class@Actuator(self, entity, target_ids, target_names)


class @class@Actuator(Actuator):
    """The muscles of a group; `state` is that of all environments, `output` the last output."""

    def edit_spec(self, spec, target_names):
        for name in target_names:
            motor = create_motor_actuator(
                spec, name, effort_limit=float("inf"), armature=self.cfg.armature, frictionloss=self.cfg.frictionloss,
                viscous_damping=self.cfg.viscous_damping, transmission_type=self.cfg.transmission_type,
            )
            self._mjs_actuators.append(motor)

    def initialize(self, mj_model, model, data, device):
        super().initialize(mj_model, model, data, device)
        targets = len(self.target_names)
        gears = torch.eye(targets) if self.cfg.gears is None else torch.tensor(self.cfg.gears)
        self.gears = gears.to(device=device, dtype=torch.float)
        offsets = self.cfg.offsets or (0.0,) * len(gears)
        self.offsets = torch.tensor(offsets, dtype=torch.float, device=device)
        shape = data.nworld, len(gears)
        self.dt, self.muscles = float(mj_model.opt.timestep), @class@(shape, device=device)
        self.command = torch.zeros(shape, device=device)
        self.state, self.output = self.muscles.start(self.cfg.initial_pressure), None
        self.fresh = torch.ones(data.nworld, dtype=torch.bool, device=device)

    def reset(self, env_ids=None):
        super().reset(env_ids)
        self.fresh[slice(None) if env_ids is None else env_ids] = True

    def get_command(self, data):
        """The commands of the muscles in place of the targets, so that mjlab delays them."""
        cmd = super().get_command(data)
        command = self.command.clone()
        if cmd.effort_target.shape == command.shape:
            command = command + cmd.effort_target
        unused = torch.zeros_like(command)
        return replace(cmd, position_target=unused, velocity_target=unused, effort_target=command)

    def compute(self, cmd):
        length, speed = self.offsets + cmd.pos @ self.gears.T, cmd.vel @ self.gears.T
        begun = self.muscles.start(self.cfg.initial_pressure, length).values
        values = torch.where(self.fresh[:, None], begun, self.state.values)
        self.fresh[:] = False
        state = self.state._replace(values=values)
        self.output = self.muscles.compute(state, cmd.effort_target, length, speed, self.dt)
        self.state = self.output.state
        return -self.output.tension @ self.gears
