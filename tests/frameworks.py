"""Runs of the written adapters in the released packages of mjlab, Newton and Isaac Lab, for
test_frameworks.py: `python frameworks.py NAME FOLDER` prints a JSON object of what it measures.

Executed by the Python of the environment that `./run test-tools` makes for these packages. All runs
have two muscles on one joint that stands at the position 0, the commands COMMANDS from the step
BEGIN on, and the physics step DT.
"""

import dataclasses
import importlib.abc
import importlib.machinery
import json
import sys
import warnings
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np

DT = 1e-3
STEPS, BEGIN, LATER = 16, 4, 10
"""Number of steps, and those from which on a command and another one act."""
COMMANDS = (0.6, -0.2), (-0.4, 0.5)
GEARS, OFFSETS = ((0.03,), (-0.03,)), (0.29, 0.29)
PRESSURE = 1e5
DELAYS = (0, 1, 4)
ANGLES, SPEED = np.linspace(0.0, 0.1, STEPS).tolist(), 1.0
"""Positions [rad] and speed [rad/s] of a joint that is moved."""
LOST = 7
"""The step whose command is not a number."""
MODEL = """<mujoco><worldbody><body name="link"><joint name="elbow" type="hinge" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="1"/></body></worldbody></mujoco>"""


def command_of(step, lost=False):
    """Commands of both muscles in a step."""
    if lost and step == LOST:
        return (float("nan"), float("nan"))
    if step < BEGIN:
        return (0.0, 0.0)
    return COMMANDS[int(step >= LATER)]


def single_command_of(step):
    """The command of one muscle, which is given as the effort of its joint."""
    return command_of(step)[0]


class Mjlab:
    """Entity, scene and simulation of mjlab, with three environments."""

    def __init__(self):
        import torch
        import warp

        warp.config.quiet = True
        torch.set_num_threads(1)
        from muscle_mjlab import MuscleCfg

        self.cfg, self.torch = MuscleCfg, torch

    def scene(self, delay, muscles):
        import mujoco
        from mjlab.entity import EntityArticulationInfoCfg, EntityCfg
        from mjlab.scene import Scene, SceneCfg
        from mjlab.sim import MujocoCfg, Simulation, SimulationCfg

        cfg = self.cfg(
            target_names_expr=("elbow",),
            gears=GEARS[:muscles],
            offsets=OFFSETS[:muscles],
            initial_pressure=PRESSURE,
            delay_min_lag=delay,
            delay_max_lag=delay,
        )
        entity = EntityCfg(
            spec_fn=lambda: mujoco.MjSpec.from_string(MODEL),
            articulation=EntityArticulationInfoCfg(actuators=(cfg,)),
        )
        scene = Scene(SceneCfg(num_envs=3, entities={"robot": entity}), device="cpu")
        simulation = Simulation(
            num_envs=3,
            cfg=SimulationCfg(mujoco=MujocoCfg(timestep=DT)),
            model=scene.compile(),
            device="cpu",
        )
        scene.initialize(simulation.mj_model, simulation.model, simulation.data)
        scene.reset()
        return scene, scene["robot"], scene["robot"].actuators[0]

    def pressures(self, delay, lost=False):
        """Pressures (STEPS, 2) under commands to `actuator.command`, and validity (STEPS,)."""
        scene, _, actuator = self.scene(delay, 2)
        rows, valid = [], []
        for step in range(STEPS):
            actuator.command[:] = self.torch.tensor(command_of(step, lost))
            scene.write_data_to_sim()
            rows.append(actuator.output.pressure[1].tolist())
            valid.append(bool(actuator.output.valid[1].all()))
        return rows, valid

    def pressures_by_target(self, delay):
        """Pressures (STEPS, 1) of one muscle whose command is the effort target of the joint."""
        scene, entity, actuator = self.scene(delay, 1)
        rows = []
        for step in range(STEPS):
            entity.data.joint_effort_target[:] = single_command_of(step)
            scene.write_data_to_sim()
            rows.append(actuator.output.pressure[1].tolist())
        return rows

    def efforts(self):
        """Position, velocity and effort (STEPS, 3) of a joint that is moved, and the pressures (2, 2)
        after a reset of the first of two environments.
        """
        scene, entity, actuator = self.scene(0, 2)
        rows = []
        for position in ANGLES:
            actuator.command[:] = self.torch.tensor(COMMANDS[0])
            entity.write_joint_position_to_sim(self.torch.full((3, 1), position))
            entity.write_joint_velocity_to_sim(self.torch.full((3, 1), SPEED))
            scene.write_data_to_sim()
            rows.append([position, SPEED, entity.data.data.ctrl[1, 0].item()])
        actuator.reset(self.torch.tensor([1]))
        scene.write_data_to_sim()
        return rows, actuator.output.pressure[1:].tolist()

    def messages(self):
        """None."""
        return []


class Newton:
    """A drive that `ModelBuilder.add_actuator` adds."""

    def __init__(self):
        import warp

        warp.config.quiet = True
        from muscle_newton import MuscleDrive

        self.drive, self.warp = MuscleDrive, warp

    def model(self, muscles=2, **options):
        import newton

        builder = newton.ModelBuilder()
        link = builder.add_link(mass=1.0)
        joint = builder.add_joint_revolute(-1, link, axis=(0, 1, 0))
        builder.add_articulation([joint])
        for (gear,), offset in list(zip(GEARS, OFFSETS, strict=True))[:muscles]:
            builder.add_actuator(
                self.drive, index=builder.joint_qd_start[joint], gear=gear, offset=offset, **options
            )
        return builder.finalize(device="cpu")

    def array(self, values):
        return self.warp.array(values, dtype=float, device="cpu")

    def run(self, model, give):
        """Pressures (STEPS, muscles) and validity (STEPS,) under the controls that `give` sets."""
        control, actuator, state = model.control(), model.actuators[0], model.state()
        states = [actuator.state(), actuator.state()]
        pressures, valid = [], []
        for step in range(STEPS):
            give(control, step)
            control.joint_f = self.array([0.0])
            actuator.step(state, control, *states, dt=DT)
            states.reverse()
            pressures.append(actuator.drive.muscles.pressure.numpy().tolist())
            valid.append(bool(actuator.drive.muscles.valid.numpy().all()))
        return pressures, valid

    def own(self, lost=False):
        def give(control, step):
            control.muscle_command = self.array(command_of(step, lost))

        return give

    def by_feedforward(self, control, step):
        control.muscle_command = None
        control.joint_act = self.array([single_command_of(step)])

    def pressures(self, delay, lost=False):
        model = self.model(initial_pressure=PRESSURE, max_delay=delay)
        return self.run(model, self.own(lost))

    def pressures_by_target(self, delay):
        options = {"delay_steps": delay} if delay else {}
        return self.run(self.model(1, initial_pressure=PRESSURE, **options), self.by_feedforward)[0]

    def efforts(self):
        """Position, velocity and effort (STEPS, 3) of a joint that is moved, and the pressures (2, 1)
        after a reset of the first of two muscles.
        """
        model = self.model(initial_pressure=PRESSURE)
        control, actuator, state = model.control(), model.actuators[0], model.state()
        states, rows = [actuator.state(), actuator.state()], []
        control.muscle_command = self.array(COMMANDS[0])
        for angle in (*ANGLES, ANGLES[-1]):
            if len(rows) == STEPS:
                states[0].reset(self.warp.array([True, False], dtype=bool, device="cpu"))
            state.joint_q, state.joint_qd = self.array([angle]), self.array([SPEED])
            control.joint_f = self.array([0.0])
            actuator.step(state, control, *states, dt=DT)
            states.reverse()
            rows.append([angle, SPEED, float(control.joint_f.numpy()[0])])
        return rows[:STEPS], [[one] for one in actuator.drive.muscles.pressure.numpy().tolist()]

    def messages(self):
        """Warnings of `add_actuator`, and errors of a delay that would not act and of a control with
        one element for two muscles.
        """
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            self.model(initial_pressure=PRESSURE, max_delay=2)
        heard = [str(one.message) for one in caught if "ignoring" in str(one.message)]
        for options, give in (({"delay_steps": 3}, self.own()), ({}, lambda control, step: None)):
            try:
                self.run(self.model(**options), give)
                heard.append("accepted")
            except ValueError as error:
                heard.append(str(error))
        return heard


class StandIns(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Modules of Isaac Sim, which Isaac Lab imports and its actuators do not use."""

    NAMES = frozenset({"omni", "pxr", "carb", "isaacsim", "usdrt"})

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in self.NAMES:
            return importlib.machinery.ModuleSpec(name, self, is_package=True)
        return None

    def create_module(self, spec):
        module = MagicMock(name=spec.name)
        module.__name__, module.__path__, module.__spec__ = spec.name, [], spec
        return module

    def exec_module(self, module):
        pass


class Isaaclab:
    """`ActuatorBase` of Isaac Lab without Isaac Sim."""

    def __init__(self):
        import torch

        torch.set_num_threads(1)
        sys.meta_path.insert(0, StandIns())
        package = Path(importlib.machinery.PathFinder.find_spec("isaaclab").origin).parent
        nested = package / "source" / "isaaclab"
        if nested.is_dir():  # the wheel of Isaac Lab 2
            sys.path.insert(0, str(nested))
        from muscle_isaaclab import MuscleCfg

        self.cfg, self.torch = MuscleCfg, torch

    def actuator(self, muscles=2, **options):
        cfg = self.cfg(
            joint_names_expr=["elbow"],
            dt=DT,
            gears=GEARS[:muscles],
            offsets=OFFSETS[:muscles],
            initial_pressure=PRESSURE,
            **options,
        )
        return cfg.class_type(cfg, ["elbow"], slice(None), 3, "cpu")

    def step(self, actuator, position=0.0, speed=0.0, effort=None):
        from isaaclab.utils.types import ArticulationActions

        given = None if effort is None else self.torch.full((3, 1), effort)
        action = ArticulationActions(joint_efforts=given)
        point = self.torch.full((3, 1), position), self.torch.full((3, 1), speed)
        done = actuator.compute(action, *point)
        return done.joint_efforts[1, 0].item()

    def pressures(self, delay, lost=False):
        actuator, rows, valid = self.actuator(max_delay=delay), [], []
        for step in range(STEPS):
            actuator.command[:] = self.torch.tensor(command_of(step, lost))
            self.step(actuator)
            rows.append(actuator.output.pressure[1].tolist())
            valid.append(bool(actuator.output.valid[1].all()))
        return rows, valid

    def pressures_by_target(self, delay):
        actuator, rows = self.actuator(1, max_delay=delay), []
        for step in range(STEPS):
            self.step(actuator, effort=single_command_of(step))
            rows.append(actuator.output.pressure[1].tolist())
        return rows

    def efforts(self):
        """Position, velocity and effort (STEPS, 3) of a joint that is moved, and the pressures (2, 2)
        after a reset of the first of two environments.
        """
        actuator, rows = self.actuator(), []
        for position in ANGLES:
            actuator.command[:] = self.torch.tensor(COMMANDS[0])
            rows.append([position, SPEED, self.step(actuator, position, SPEED)])
        actuator.reset([1])
        self.step(actuator)
        return rows, actuator.output.pressure[1:].tolist()

    def messages(self):
        """The greatest effort under a limit of 0.5 N m, and warnings of deprecated names."""
        names = {field.name for field in dataclasses.fields(self.cfg)}
        name = "actuator_effort_limit"  # of Isaac Lab 3
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            limited = self.actuator(**{name if name in names else "effort_limit": 0.5})
            greatest = 0.0
            for _ in range(STEPS):
                limited.command[:] = self.torch.tensor(COMMANDS[0])
                greatest = max(greatest, abs(self.step(limited)))
        return [greatest, *(str(one.message) for one in caught if "effort" in str(one.message))]


def main(name, folder):
    sys.path.insert(0, folder)
    framework = {"mjlab": Mjlab, "newton": Newton, "isaaclab": Isaaclab}[name]()
    rows, after_reset = framework.efforts()
    result = {
        "own": {delay: framework.pressures(delay)[0] for delay in DELAYS},
        "target": {delay: framework.pressures_by_target(delay) for delay in DELAYS},
        "lost": framework.pressures(0, lost=True),
        "efforts": rows,
        "after_reset": after_reset,
        "messages": framework.messages(),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
