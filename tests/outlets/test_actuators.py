"""Batched actuators in learning stacks: in PyTorch, Warp and ONNX a muscle gives the tensions of
the library.

With the steps of `simulate(..., RungeKutta4(step))` they agree to 1e-12 of the tension in double
and to 1e-5 in single precision. Derivatives of PyTorch are those of the printed expressions. The
adapters run in the released package of Newton; those of mjlab and Isaac Lab, which need another
MuJoCo or Isaac Sim, against their interfaces as recorded here.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
import types
from dataclasses import replace

import numpy as np
import plants
import pytest
from typer.testing import CliRunner
from widths import widened

from airmuscle.engine import (
    Double,
    RungeKutta4,
    SampledSignal,
    Single,
    WithSensitivities,
    sensitivity,
    simulate,
)
from airmuscle.errors import AirmuscleError, ParameterError
from airmuscle.files import ParameterUncertainty, list_laws, load_law, load_scenario
from airmuscle.outlets import OnnxStack, TorchStack, WarpStack, regulated_plant, write_actuator
from airmuscle.outlets.cli import app
from airmuscle.physics import open_plant

pytestmark = pytest.mark.tool
LIFT = load_scenario("lift-dmsp-20").plant
STEPS = 40


def muscles_of_the_library():
    """Plants with every muscle of the library that has a closed form, behind the pressure
    regulator.
    """
    found = {}
    for name in list_laws():
        entry = load_law(name)
        try:
            muscle = entry.muscle
        except AirmuscleError:
            continue
        if entry.characteristic.traceable:
            found[name] = regulated_plant(muscle)
    return found


KINDS = (
    "LuGre",
    "Maxwell slip",
    "pressure damper, creep",
    "heat",
    "real gas",
    "underlap",
    "regulator, leak",
    "held and let go",
)
PLANTS = {
    **muscles_of_the_library(),
    **{name: plants.EXAMPLES[name] for name in KINDS},
    "lift": LIFT,
}
USUAL = ("dmsp-20-300", "LuGre", "lift")
CASES = widened(list(PLANTS), lambda name: name in USUAL)


def module_of(path):
    """A written module, imported."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def motion(plant):
    """Command, first length and speed of a shortening muscle that is filled."""
    length = 0.97 * plant.resting_lengths[0]
    return 5e5 if "setpoint" in open_plant(plant).inputs else 0.8, length, -0.1 * length


def expected(plant, step, pressure=2e5):
    """Tension and pressure (STEPS,) at the beginning of each step, by the library."""
    command, length, speed = motion(plant)
    rest = plant.resting_lengths[0]
    end = STEPS * step
    part = open_plant(plant, (rest - length,))
    signals = {
        "shortening": ((0.0, rest - length), (end, rest - length - speed * end)),
        "shortening_speed": ((0.0, -speed),),
    }
    signals[next(name for name in part.inputs if "shortening" not in name)] = ((0.0, command),)
    run = simulate(
        part,
        SampledSignal(signals),
        duration=end,
        initial_state=part.state_at(pressure=pressure),
        output_times=step,
        integrator=RungeKutta4(step),
    )
    return np.stack([run["force"][:STEPS], run["pressure"][:STEPS]])


def check(rows, plant, step, tolerance):
    right = expected(plant, step)
    scale = np.abs(right).max(axis=1, keepdims=True)
    assert scale[0] > 10.0, "the muscle pulls"
    assert np.ptp(right[1]) > 1e2, "the pressure moves"
    assert (np.abs(np.array(rows).T - right) <= tolerance * scale).all()


def torch_rows(torch, module, dtype, plant, max_delay=0):
    actuator = getattr(module, class_of(module))((2, 3), dtype=dtype, max_delay=max_delay)
    command, length, speed = motion(plant)
    h = module.STEP
    state = actuator.start(2e5, length, command)
    rows = []
    for k in range(STEPS):
        output = actuator.compute(state, command, length + k * h * speed, speed, h)
        state = output.state
        rows.append([float(output.tension[1, 2]), float(output.pressure[1, 2])])
    return rows


def class_of(module):
    return next(name for name in vars(module) if name.lower() == module.__name__.split("_")[0])


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch", reason="needs the package torch")


@pytest.fixture(scope="module")
def warp():
    module = pytest.importorskip("warp", reason="needs the package warp-lang")
    module.config.quiet = True
    return module


@pytest.mark.parametrize("name", CASES)
def test_in_torch_a_muscle_pulls_as_in_the_library(name, torch, tmp_path):
    write_actuator(PLANTS[name], tmp_path, name="muscle")
    module = module_of(tmp_path / "muscle.py")
    plant = PLANTS[name]
    check(torch_rows(torch, module, torch.float64, plant), plant, module.STEP, 1e-12)
    check(torch_rows(torch, module, torch.float32, plant), plant, module.STEP, 1e-5)


@pytest.mark.parametrize("name", CASES)
def test_in_onnx_a_muscle_pulls_as_in_the_library(name, tmp_path):
    runtime = pytest.importorskip("onnxruntime", reason="needs the package onnxruntime")
    pytest.importorskip("onnx", reason="needs the package onnx")
    runtime.set_default_logger_severity(3)
    plant = PLANTS[name]
    h = 2.5e-4
    command, length, speed = motion(plant)
    for precision, kind, tolerance in ((Double(), np.float64, 1e-12), (Single(), np.float32, 1e-5)):
        write_actuator(PLANTS[name], tmp_path / kind.__name__, OnnxStack(precision), name="muscle")
        start, step = (
            runtime.InferenceSession(
                str(tmp_path / kind.__name__ / f"{file}.onnx"), providers=["CPUExecutionProvider"]
            )
            for file in ("muscle_start", "muscle")
        )
        (state,) = start.run(
            ["state"], {"pressure": np.full(3, 2e5, kind), "length": np.full(3, length, kind)}
        )
        rows = []
        for k in range(STEPS):
            given = {"command": command, "length": length + k * h * speed, "speed": speed}
            arrays = {key: np.full(3, value, kind) for key, value in given.items()} | {
                "dt": np.array(h, kind)
            }
            names = ["tension", "pressure", "valid", "next_state"]
            tension, pressure, valid, state = step.run(names, {"state": state, **arrays})
            assert valid.dtype == bool
            rows.append([tension[1], pressure[1]])
        check(rows, plant, h, tolerance)


@pytest.mark.parametrize(
    "name", widened(["lift", "LuGre", "dmsp-20-300"], lambda name: name == "lift")
)
@pytest.mark.parametrize(("precision", "tolerance"), [(Double(), 1e-12), (Single(), 1e-5)], ids=str)
def test_in_warp_a_muscle_pulls_as_in_the_library(precision, tolerance, name, warp, tmp_path):
    write_actuator(PLANTS[name], tmp_path, WarpStack(precision), name="muscle")
    module = module_of(tmp_path / "muscle_warp.py")
    plant = PLANTS[name]
    command, length, speed = motion(plant)
    h = module.STEP
    actuator = module.Muscle(5, device="cpu")
    rows = []
    actuator.start(2e5, length)
    for k in range(STEPS):
        given = (command, length + k * h * speed, speed)
        actuator.compute(
            *(warp.full(5, value, dtype=module.real, device="cpu") for value in given), h
        )
        rows.append([actuator.tension.numpy()[4], actuator.pressure.numpy()[4]])
    assert actuator.valid.numpy().tolist() == [1.0] * 5
    check(rows, plant, h, tolerance)


def test_substeps_meet_the_step_of_the_simulator(torch, tmp_path):
    """A step of four integrator steps is the same as four steps, with a length that moves at its
    speed.
    """
    write_actuator(LIFT, tmp_path, name="muscle")
    module, (command, length, speed) = module_of(tmp_path / "muscle.py"), motion(LIFT)
    actuator = module.Muscle((1,), dtype=torch.float64)
    h = module.STEP
    state = actuator.start(2e5, length)
    whole = actuator.compute(state, command, length, speed, 4 * h).state.values
    for k in range(4):
        state = actuator.compute(state, command, length + k * h * speed, speed, h).state
    torch.testing.assert_close(whole, state.values, rtol=1e-13, atol=0.0)


def test_derivatives_in_torch_are_the_sensitivities_of_the_library(torch, tmp_path):
    """Tension and next states by the states and by parameters, to 1e-9: one step of RK4 with its
    exact derivatives.
    """
    plant = PLANTS["LuGre"]
    write_actuator(plant, tmp_path, name="muscle")
    module = module_of(tmp_path / "muscle.py")
    rest = plant.resting_lengths[0]
    part = open_plant(plant, (0.02,))
    names = list(module.STATES)
    paths = [path for path in module.PARAMETERS if "friction" in path or "damp" in path]
    system = WithSensitivities(
        part, ((),) * len(names) + tuple((p,) for p in paths), (1.0,) * (len(names) + len(paths))
    )
    state = {n: 1.02 * v + 1e-6 for n, v in part.state_at(pressure=2.5e5).items()}
    start = dict.fromkeys((s.name for s in system.states), 0.0) | state
    start |= {sensitivity(name, k): 1.0 for k, name in enumerate(names)}
    h = module.STEP
    speed = 0.05
    moving = {
        "shortening": ((0.0, 0.02), (h, 0.02 + h * speed)),
        "shortening_speed": ((0.0, speed),),
    }
    given = SampledSignal({"fill": ((0.0, 0.6),), **moving})
    run = simulate(
        system,
        given,
        duration=module.STEP,
        initial_state=start,
        output_times=module.STEP,
        integrator=RungeKutta4(module.STEP),
    )
    columns = range(len(names) + len(paths))
    right = [[run[sensitivity("force", k)][0] for k in columns]]
    right += [[run[sensitivity(name, k)][-1] for k in columns] for name in names]
    values = torch.tensor(module.DEFAULTS, dtype=torch.float64)
    at = [module.PARAMETERS.index(path) for path in paths]
    point = torch.tensor([0.6, rest - 0.02, -speed], dtype=torch.float64)

    def both(states, chosen):
        c = module.prepare(values.index_copy(0, torch.tensor(at), chosen))
        return torch.cat(
            [module.observe(states, point, c)[:1], module.step(states, point, c, module.STEP)]
        )

    arguments = torch.tensor([state[name] for name in names], dtype=torch.float64), values[at]
    found = torch.cat(torch.autograd.functional.jacobian(both, arguments), dim=1).numpy()
    sizes = np.abs(right).max(axis=1, keepdims=True)
    assert (np.abs(right) > 0).sum() > 8
    assert (np.abs(found - right) <= 1e-9 * np.maximum(np.abs(right), 1e-6 * sizes)).all()


def test_the_flag_says_where_the_validity_range_is_left(torch, tmp_path):
    write_actuator(LIFT, tmp_path, name="muscle")
    module = module_of(tmp_path / "muscle.py")
    rest = LIFT.resting_lengths[0]
    limits = {limit.column: limit.bounds for limit in open_plant(LIFT).column_limits}
    actuator = module.Muscle((4,), dtype=torch.float64)
    _, high = limits["contraction"]
    inside = min(high, 0.2)
    contraction = torch.tensor(
        [0.5 * inside, high + 0.01, 0.5 * inside, 0.5 * inside], dtype=torch.float64
    )
    pressure = torch.tensor([2e5, 2e5, limits["pressure"][1] + 1e4, 3e5], dtype=torch.float64)
    length = (1.0 - contraction) * rest
    output = actuator.compute(actuator.start(pressure, length), 0.0, length, 0.0, 1e-3)
    assert output.valid.tolist() == [True, False, False, True]
    torch.testing.assert_close(output.pressure, pressure, rtol=1e-12, atol=0.0)


def test_a_delayed_command_acts_so_many_steps_later(torch, warp, tmp_path):
    write_actuator(LIFT, tmp_path, name="muscle")
    write_actuator(LIFT, tmp_path / "warp", WarpStack(Double()), name="muscle")
    module, kernels = (
        module_of(tmp_path / "muscle.py"),
        module_of(tmp_path / "warp" / "muscle_warp.py"),
    )
    length = 0.29
    delays = [0, 2, 3]
    actuator = module.Muscle((3,), max_delay=3, dtype=torch.float64)
    other = kernels.Muscle(3, max_delay=3, device="cpu")
    actuator.delay[:] = torch.tensor(delays)
    other.delay.assign(delays)
    other.start(1e5, length)
    state = actuator.start(1e5, length)
    pressures = []
    for k in range(8):
        command = 0.5 + 0.05 * k
        output = actuator.compute(state, command, length, 0.0, 1e-3)
        state = output.state
        pressures.append(output.pressure.tolist())
        other.compute(
            *(warp.full(3, v, dtype=kernels.real, device="cpu") for v in (command, length, 0.0)),
            1e-3,
        )
        np.testing.assert_allclose(other.pressure.numpy(), pressures[-1], rtol=1e-12)
    for column, delay in zip(np.array(pressures).T, delays, strict=True):
        np.testing.assert_array_equal(column[: delay + 1], column[0])
        np.testing.assert_allclose(column[delay:], np.array(pressures)[: 8 - delay, 0], rtol=1e-12)


UNCERTAINTY = ParameterUncertainty(
    ("characteristic.c0", "damper.damping"), (1e5, 20.0), ((1.0, 0.8), (0.8, 1.0))
)


def test_parameters_are_drawn_from_the_identified_covariance(torch, tmp_path):
    write_actuator(LIFT, tmp_path, name="muscle", uncertainty=UNCERTAINTY)
    module = module_of(tmp_path / "muscle.py")
    actuator = module.Muscle((200, 50), dtype=torch.float64)
    actuator.randomise(generator=torch.Generator().manual_seed(1))
    paths = ["muscle.contractile.c0", "muscle.damper.damping"]
    drawn = np.array(
        [actuator.values[module.PARAMETERS.index(path)].numpy().ravel() for path in paths]
    )
    means = [module.DEFAULTS[module.PARAMETERS.index(path)] for path in paths]
    assert (
        np.abs(drawn.mean(axis=1) - means) < 4 * np.array(UNCERTAINTY.standard_errors) / 100
    ).all()
    np.testing.assert_allclose(np.cov(drawn), UNCERTAINTY.covariance, rtol=0.05)
    length = torch.full((200, 50), 0.28, dtype=torch.float64)
    tension = actuator.compute(actuator.start(3e5, length), 0.0, length, 0.0, 1e-3).tension
    assert tension.unique().numel() == 10_000
    actuator.randomise(1e9, torch.Generator().manual_seed(2))
    i = module.PARAMETERS.index("muscle.damper.damping")
    assert actuator.values[i].min() == module.LOWER[i], "draws stay within the bounds"


def test_a_parameter_of_each_muscle_is_set_by_its_path(torch, tmp_path):
    write_actuator(LIFT, tmp_path, name="muscle")
    module = module_of(tmp_path / "muscle.py")
    actuator = module.Muscle((2,), dtype=torch.float64)
    actuator.set_parameters({"muscle.damper.damping": torch.tensor([100.0, 300.0])})
    output = actuator.compute(actuator.start(3e5, 0.29), 0.0, 0.29, -0.1, 1e-3)
    assert output.tension[0] - output.tension[1] == pytest.approx(200.0 * 0.1, rel=1e-9)
    with pytest.raises(KeyError, match=r"there is no parameter 'mass'; there are muscle\."):
        actuator.set_parameters({"mass": 1.0})


# Adapters


GEARS = ((0.03,), (-0.03,))
OFFSETS = (0.97 * LIFT.resting_lengths[0],) * 2
"""Gears [m/rad] and offsets [m] of two muscles on a joint."""


def joint_torques(torch, folder, angles, speed, commands, dt):
    """Torques of two muscles of the library's actuator on a joint, computed muscle by muscle."""
    module = module_of(folder / "muscle.py")
    torques = np.zeros(len(angles))
    for (gear,), offset, command in zip(GEARS, OFFSETS, commands, strict=True):
        actuator = module.Muscle((1,))
        state = actuator.start(1e5, offset + gear * angles[0])
        for k, angle in enumerate(angles):
            output = actuator.compute(state, command, offset + gear * angle, gear * speed, dt)
            state = output.state
            torques[k] = torques[k] - gear * float(output.tension)
    return torques


ANGLES = np.linspace(0.0, 0.1, 21)
COMMANDS = (0.6, -0.2)


def test_the_drive_of_newton_gives_the_efforts_of_the_muscles(warp, torch, tmp_path, monkeypatch):
    newton = pytest.importorskip("newton.actuators", reason="needs the package newton")
    monkeypatch.syspath_prepend(str(tmp_path))
    write_actuator(LIFT, tmp_path, WarpStack(), name="muscle")
    write_actuator(LIFT, tmp_path, name="muscle")
    adapter = module_of(tmp_path / "muscle_newton.py")
    drive = adapter.MuscleDrive([g for (g,) in GEARS], OFFSETS, initial_pressure=1e5)
    actuator = newton.Actuator(warp.array([0, 0], dtype=warp.uint32, device="cpu"), drive)
    states, controls, efforts = [actuator.state(), actuator.state()], actuator.sim_control(), []
    for angle in ANGLES:
        points = actuator.sim_state()
        points.joint_q, points.joint_qd = (
            warp.array([v], dtype=float, device="cpu") for v in (angle, 1.0)
        )
        for name in ("joint_target_q", "joint_target_qd", "joint_f"):
            setattr(controls, name, warp.zeros(1, dtype=float, device="cpu"))
        controls.muscle_command = warp.array(COMMANDS, dtype=float, device="cpu")
        actuator.step(points, controls, *states, dt=1e-3)
        states.reverse()
        efforts.append(controls.joint_f.numpy()[0])
    np.testing.assert_allclose(
        efforts, joint_torques(torch, tmp_path, ANGLES, 1.0, COMMANDS, 1e-3), rtol=1e-4, atol=1e-3
    )
    before = states[0].drive_state.values.numpy()
    states[0].reset(warp.array([True, False], dtype=warp.bool, device="cpu"))
    assert states[0].drive_state.fresh.numpy().tolist() == [1, 0]
    assert (states[0].drive_state.values.numpy() == before).all(), (
        "a muscle starts at its length in the next step"
    )


class RecordedActuator:
    """Interface of `mjlab.actuator.Actuator` 1.6 and of `isaaclab.actuators.ActuatorBase` 2.3, as
    far as it is used.
    """

    def __init__(self, cfg, *arguments, **_):
        self.cfg, self._mjs_actuators, self.effort_limit = cfg, [], float("inf")
        self.target_names = arguments[-1] if isinstance(arguments[-1], list) else arguments[0]

    def initialize(self, mj_model, model, data, device):
        pass

    def reset(self, env_ids=None):
        pass


def record(monkeypatch, names):
    """Modules of an interface in place of a package that is not there."""
    for name, content in names.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)


@dataclasses.dataclass(kw_only=True)
class RecordedCfg:
    """Fields that all configurations have."""

    target_names_expr: tuple = ()
    joint_names_expr: tuple = ()
    armature: float | None = None
    frictionloss: float | None = None
    viscous_damping: float | None = None
    transmission_type: str = "joint"
    delay_max_lag: int = 0


def test_the_actuator_of_mjlab_gives_the_efforts_of_the_muscles(torch, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    motors = []
    base = {"Actuator": RecordedActuator, "ActuatorCfg": RecordedCfg}
    spec = {
        "create_motor_actuator": (
            lambda spec, name, **options: motors.append((name, options)) or name
        )
    }
    record(
        monkeypatch,
        {"mjlab": {}, "mjlab.actuator": base, "mjlab.utils": {}, "mjlab.utils.spec": spec},
    )
    write_actuator(LIFT, tmp_path, name="muscle")
    adapter = module_of(tmp_path / "muscle_mjlab.py")
    cfg = adapter.MuscleCfg(
        target_names_expr=("elbow",), gears=GEARS, offsets=OFFSETS, initial_pressure=1e5
    )
    actuator = cfg.build(None, [0], ["elbow"])
    actuator.edit_spec(None, ["elbow"])
    assert motors[0][0] == "elbow"
    timed = types.SimpleNamespace(opt=types.SimpleNamespace(timestep=1e-3))
    actuator.initialize(timed, None, types.SimpleNamespace(nworld=3), "cpu")
    actuator.command[:] = torch.tensor(COMMANDS)
    efforts = []
    for angle in ANGLES:
        pos = torch.full((3, 1), angle)
        vel = torch.ones((3, 1))
        command = types.SimpleNamespace(pos=pos.float(), vel=vel, effort_target=torch.zeros((3, 1)))
        efforts.append(actuator.compute(command)[2, 0].item())
    np.testing.assert_allclose(
        efforts, joint_torques(torch, tmp_path, ANGLES, 1.0, COMMANDS, 1e-3), rtol=1e-5, atol=1e-4
    )
    actuator.reset(torch.tensor([1]))
    actuator.compute(command)
    assert actuator.output.pressure[1] == pytest.approx(torch.tensor([1e5, 1e5]), rel=1e-6)
    assert actuator.output.pressure[2, 0] > 1.1e5


def test_the_actuator_of_isaac_lab_gives_the_efforts_of_the_muscles(torch, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    base = {"ActuatorBase": RecordedActuator, "ActuatorBaseCfg": RecordedCfg}
    utils = {"configclass": dataclasses.dataclass}
    record(monkeypatch, {"isaaclab": {}, "isaaclab.actuators": base, "isaaclab.utils": utils})
    write_actuator(LIFT, tmp_path, name="muscle")
    adapter = module_of(tmp_path / "muscle_isaaclab.py")
    cfg = adapter.MuscleCfg(dt=1e-3, gears=GEARS, offsets=OFFSETS, initial_pressure=1e5)
    actuator = cfg.class_type(cfg, ["elbow"], slice(None), 3, "cpu")
    actuator.command[:] = torch.tensor(COMMANDS)
    efforts = []
    for angle in ANGLES:
        action = types.SimpleNamespace(joint_efforts=None, joint_positions=1, joint_velocities=1)
        action = actuator.compute(action, torch.full((3, 1), angle).float(), torch.ones((3, 1)))
        efforts.append(action.joint_efforts[2, 0].item())
    assert action.joint_positions is None
    np.testing.assert_allclose(
        efforts, joint_torques(torch, tmp_path, ANGLES, 1.0, COMMANDS, 1e-3), rtol=1e-5, atol=1e-4
    )
    actuator.reset([1])
    actuator.compute(action, torch.zeros((3, 1)), torch.zeros((3, 1)))
    assert actuator.output.pressure[1] == pytest.approx(torch.tensor([1e5, 1e5]), rel=1e-6)


# What cannot be exported, and the command


@pytest.mark.parametrize(
    ("plant", "options", "message"),
    [
        (LIFT, {"step": 0.0}, r"actuator: step is 0\.0 s; allowed range: above 0 to 1 s"),
        (
            plants.EXAMPLES["joint with stops"],
            {},
            "choose one of the muscles|cannot be separate actuators",
        ),
        (
            replace(LIFT, muscle=plants.EXAMPLES["hardening series spring"].muscles[0]),
            {},
            "has a series spring",
        ),
        (
            LIFT,
            {
                "uncertainty": replace(
                    UNCERTAINTY, parameters=("characteristic.k", "damper.damping")
                )
            },
            r"the plant has no parameter 'muscle\.contractile\.k' of the uncertainty",
        ),
    ],
)
def test_what_cannot_be_an_actuator_is_refused(plant, options, message, tmp_path):
    with pytest.raises(ParameterError, match=message):
        write_actuator(plant, tmp_path, TorchStack(), **options)


def test_onnx_needs_its_package(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(
        AirmuscleError, match=r"needs the package 'onnx'; pip install airmuscle\[learning\]"
    ):
        write_actuator(LIFT, tmp_path, OnnxStack())


@pytest.mark.parametrize(
    ("source", "file"),
    [("dmsp-20-300", "dmsp_20_300.py"), ("joint-dmsp-20-itv2050", "joint_dmsp_20_itv2050.py")],
)
def test_the_command_writes_an_actuator(source, file, tmp_path):
    options = [] if source.startswith("dmsp") else ["--muscle", "left"]
    result = CliRunner().invoke(
        app, ["export", source, "--to", "torch", "--out", str(tmp_path), *options]
    )
    assert result.exit_code == 0, result.output
    text = (tmp_path / file).read_text()
    assert "SHA-256 of the model" in text
    assert "COMMAND_RANGE = (0.0, " in text
