"""Muscles @class@ as an actuator group of Isaac Lab, on the joints of an articulation.

Muscle m has the length offsets[m] + sum over the joints j of gears[m][j] times their position; its tension T acts on
joint j with the effort -gears[m][j] T. By default each joint has one muscle, whose length is its position. The command
of the muscles is `command` (environments, muscles), to be written by an action term; with one muscle per joint the
effort of the action is added to it. `dt` is the time between two calls, that of a physics step. `max_delay` delays the
commands by so many calls, or by those of `muscles.delay`.
"""

import torch
from isaaclab.actuators import ActuatorBase, ActuatorBaseCfg
from isaaclab.utils import configclass

from @file@ import @class@


class @class@Actuator(ActuatorBase):
    """The muscles of a group; `state` is that of all environments, `output` the last output."""

    def __init__(self, cfg, joint_names, joint_ids, num_envs, device, *args, **kwargs):
        super().__init__(cfg, joint_names, joint_ids, num_envs, device, *args, **kwargs)
        gears = torch.eye(len(joint_names)) if cfg.gears is None else torch.tensor(cfg.gears)
        self.gears = gears.to(device=device, dtype=torch.float)
        offsets = cfg.offsets or (0.0,) * len(gears)
        self.offsets = torch.tensor(offsets, dtype=torch.float, device=device)
        shape = num_envs, len(gears)
        self.muscles, self.command = @class@(shape, max_delay=cfg.max_delay, device=device), torch.zeros(shape, device=device)
        self.state, self.output = self.muscles.start(cfg.initial_pressure), None
        self.fresh = torch.ones(num_envs, dtype=torch.bool, device=device)

    def reset(self, env_ids):
        self.fresh[env_ids] = True

    def compute(self, control_action, joint_pos, joint_vel):
        length, speed = self.offsets + joint_pos @ self.gears.T, joint_vel @ self.gears.T
        begun = self.muscles.start(self.cfg.initial_pressure, length)
        fresh, command, efforts = self.fresh[:, None], self.command, control_action.joint_efforts
        values = torch.where(fresh, begun.values, self.state.values)
        commands = torch.where(fresh, begun.commands, self.state.commands)
        self.fresh[:] = False
        if efforts is not None and efforts.shape == command.shape:
            command = command + efforts
        state = self.state._replace(values=values, commands=commands)
        self.output = self.muscles.compute(state, command, length, speed, self.cfg.dt)
        self.state = self.output.state
        self.computed_effort = -self.output.tension @ self.gears
        self.applied_effort = self._clip_effort(self.computed_effort)
        control_action.joint_efforts = self.applied_effort
        control_action.joint_positions = control_action.joint_velocities = None
        return control_action


@configclass
class @class@Cfg(ActuatorBaseCfg):
    """Transmission of the muscles, time between two calls [s], and gauge pressure [Pa] after a reset."""

    class_type: type = @class@Actuator
    dt: float = 0.005
    gears: tuple | None = None
    offsets: tuple | None = None
    initial_pressure: float = 0.0
    max_delay: int = 0
    stiffness: float = 0.0
    damping: float = 0.0
