"""Whole joints and arms in learning stacks: in PyTorch, Warp and ONNX a plant with its muscles moves
as in the library.

With the steps of `simulate(..., RungeKutta4(step))` angles, pressures and tensions agree to 1e-12 of
the greatest in double and to 1e-4 in single precision. Each plant is driven by unequal commands.
"""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest
from arm_episodes import known_arm
from command_line import airmuscle
from widths import widened

import airmuscle as am
from airmuscle.bench import PlantUncertainty
from airmuscle.engine import Double, RungeKutta4, Single, simulate
from airmuscle.errors import ParameterError
from airmuscle.files import load_scenario
from airmuscle.outlets import OnnxStack, TorchStack, WarpStack, write_plant_module
from airmuscle.physics import Plant, ProportionalRegulator, SecondOrderLag, Supply, Valve

H = 5e-4
STEPS = 60
PRESSURE = 2.5e5
ANGLE = 0.1


def identified(joints):
    """An arm as `fit-joint` writes it: stick-slip, a pressure regulator for each muscle."""
    arm = known_arm(joints)
    valve = Valve(3e-8, 0.3)
    regulator = ProportionalRegulator(Supply(6e5), valve, valve, SecondOrderLag(8.0, 1.0), 2e4, 6e5)
    return Plant(arm.muscle, (regulator,) * len(arm.muscle), arm.mechanism)


PLANTS = {
    "joint": identified(1),
    "arm": identified(2),
    "regulators": load_scenario("joint-dmsp-20-regulators").plant,
    "planar arm": load_scenario("arm-lilly-quesada").plant,
}
CASES = widened(list(PLANTS), lambda name: name == "joint")


def commands(plant):
    """Constant commands (inputs,), different for neighbours, within their ranges."""
    return np.array(
        [
            known.minimum + (0.4 if number % 2 else 0.2) * (min(known.maximum, 6e5) - known.minimum)
            for number, known in enumerate(plant.input_variables)
        ]
    )


def expected(plant):
    """Angles, pressures and tensions (columns, STEPS) at the beginning of each step."""
    pose = dict.fromkeys((c.name for c in plant.mechanism.coordinates), ANGLE)
    schedule = {
        name: ((0.0, value),)
        for name, value in zip(plant.inputs, commands(plant).tolist(), strict=True)
    }
    run = simulate(
        plant,
        am.Schedule(schedule),
        duration=STEPS * H,
        initial_state=plant.state_at(pressure=PRESSURE, **pose),
        output_times=H,
        integrator=RungeKutta4(H),
    )
    names = [*pose]
    for column in ("pressure", "force"):
        names += [f"{prefix}{column}" for prefix in plant.prefixes]
    return np.array([run[name][:STEPS] for name in names])


def check(rows, plant, tolerance):
    right = expected(plant)
    scale = np.abs(right).max(axis=1, keepdims=True)
    assert np.ptp(right[0]) > 1e-4, "the joint moves"
    assert (np.abs(np.array(rows).T - right) <= tolerance * scale).all()


def module_of(path):
    """A written module, imported."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch", reason="needs the package torch")


@pytest.mark.tool
@pytest.mark.parametrize("name", CASES)
def test_in_torch_a_plant_moves_as_in_the_library(name, torch, tmp_path):
    plant = PLANTS[name]
    write_plant_module(plant, tmp_path, name="arm", step=H)
    module = module_of(tmp_path / "arm.py")
    for dtype, tolerance in ((torch.float64, 1e-12), (torch.float32, 1e-4)):
        arm = module.Arm((2, 3), dtype=dtype)
        state = arm.start(PRESSURE, ANGLE)
        rows = []
        for _ in range(STEPS):
            output = arm.compute(state, torch.tensor(commands(plant)), H)
            state = output.state
            parts = (output.angle, output.pressure, output.tension)
            rows.append([float(value) for part in parts for value in part[:, 1, 2]])
        check(rows, plant, tolerance)


@pytest.mark.tool
@pytest.mark.parametrize("name", CASES)
def test_in_onnx_a_plant_moves_as_in_the_library(name, tmp_path):
    runtime = pytest.importorskip("onnxruntime", reason="needs the package onnxruntime")
    pytest.importorskip("onnx", reason="needs the package onnx")
    runtime.set_default_logger_severity(3)
    plant = PLANTS[name]
    write_plant_module(plant, tmp_path, OnnxStack(Double()), name="arm", step=H)
    start, step = (
        runtime.InferenceSession(str(tmp_path / f"{file}.onnx"), providers=["CPUExecutionProvider"])
        for file in ("arm_start", "arm")
    )
    shape = (len(plant.muscles), 3), (len(plant.mechanism.coordinates), 3)
    begun = {"pressure": np.full(shape[0], PRESSURE), "angle": np.full(shape[1], ANGLE)}
    (state,) = start.run(["state"], begun)
    command = np.repeat(commands(plant)[:, None], 3, axis=1)
    rows = []
    for _ in range(STEPS):
        driven = {"state": state, "command": command, "dt": np.array(H)}
        names = ["angle", "pressure", "tension", "valid", "next_state"]
        *parts, valid, state = step.run(names, driven)
        assert valid.dtype == bool
        rows.append(np.concatenate(parts)[:, 1])
    check(rows, plant, 1e-12)


@pytest.mark.tool
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("precision", "tolerance"), [(Double(), 1e-12), (Single(), 1e-4)], ids=str)
def test_in_warp_a_plant_moves_as_in_the_library(precision, tolerance, name, tmp_path):
    warp = pytest.importorskip("warp", reason="needs the package warp-lang")
    warp.config.quiet = True
    plant = PLANTS[name]
    write_plant_module(plant, tmp_path, WarpStack(precision), name="arm", step=H)
    module = module_of(tmp_path / "arm_warp.py")
    arm = module.Arm(3, device="cpu")
    arm.start(PRESSURE, ANGLE)
    command = np.repeat(commands(plant)[:, None], 3, axis=1)
    driven = warp.array(command, dtype=module.real, device="cpu")
    rows = []
    for _ in range(STEPS):
        arm.compute(driven, H)
        parts = [array.numpy() for array in (arm.angle, arm.pressure, arm.tension)]
        rows.append(np.concatenate(parts)[:, 1])
    check(rows, plant, tolerance)


@pytest.mark.tool
def test_a_command_that_is_not_finite_changes_no_state_and_is_not_valid(torch, tmp_path):
    plant = PLANTS["joint"]
    write_plant_module(plant, tmp_path, name="arm", step=H)
    arm = module_of(tmp_path / "arm.py").Arm((3,), dtype=torch.float64)
    state = arm.start(PRESSURE)
    command = torch.tensor(commands(plant))[:, None].repeat(1, 3)
    command[1, 2] = float("nan")
    output = arm.compute(state, command, H)
    assert output.valid.tolist() == [True, True, False]
    assert torch.isnan(output.angle[0]).tolist() == [False, False, True]
    assert torch.equal(output.state[:, 2], state[:, 2])
    assert not torch.equal(output.state[:, 0], state[:, 0])


@pytest.mark.tool
def test_plants_are_drawn_from_the_covariance_of_the_fit(torch, tmp_path):
    """Deviations and correlation of two parameters; two paths of one parameter are equal."""
    damping = "mechanism.inner.links[0].damping"
    areas = ("muscle[0].contractile.area[0]", "muscle[1].contractile.area[0]")
    covariance = np.array([[1e-4, 4e-9], [4e-9, 1e-12]])
    uncertainty = PlantUncertainty({"joint1.angle": 0.01}, ((damping,), areas), covariance)
    write_plant_module(PLANTS["joint"], tmp_path, name="arm", step=H, uncertainty=uncertainty)
    module = module_of(tmp_path / "arm.py")
    arm = module.Arm((20_000,), dtype=torch.float64)
    arm.randomise(generator=torch.Generator().manual_seed(0))
    drawn = arm.values[[module.PARAMETERS.index(path) for path in (damping, *areas)]].numpy()
    assert drawn[0].std() == pytest.approx(1e-2, rel=0.03)
    assert drawn[1].std() == pytest.approx(1e-6, rel=0.03)
    np.testing.assert_allclose(np.diff(drawn[1]), np.diff(drawn[2]), atol=1e-18)
    assert np.corrcoef(drawn[:2])[0, 1] == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize("stack", [TorchStack(), WarpStack()], ids=lambda s: type(s).__name__)
def test_the_source_states_commands_ranges_and_parameters(stack, tmp_path):
    (path,) = write_plant_module(PLANTS["joint"], tmp_path, stack, name="arm", step=H)
    text = path.read_text(encoding="utf-8")
    compile(text, path.name, "exec")
    assert "COMMANDS = ('m0.setpoint', 'm1.setpoint')" in text
    assert "COMMAND_RANGES = ((0.0, 600000.0), (0.0, 600000.0))" in text
    assert "COORDINATES = ('joint1.angle',)" in text
    assert "'mechanism.inner.links[0].damping'" in text


def test_what_has_no_module_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="allowed range: above 0 to 1 s"):
        write_plant_module(PLANTS["joint"], tmp_path, step=0.0)
    wrong = PlantUncertainty({}, (("gas.colour",),), np.eye(1))
    with pytest.raises(ParameterError, match=r"no parameter 'gas\.colour' of the uncertainty"):
        write_plant_module(PLANTS["joint"], tmp_path, step=H, uncertainty=wrong)


def test_the_command_writes_a_plant_of_several_muscles_as_a_whole_or_one_of_them(tmp_path):
    source = "joint-dmsp-20-regulators"
    done = airmuscle("export", source, "--to", "torch", "--out", tmp_path / "whole")
    assert done.exit_code == 0, done.output
    (path,) = (tmp_path / "whole").glob("*.py")
    assert "MUSCLES = ('left', 'right')" in path.read_text(encoding="utf-8")
    done = airmuscle(
        "export", source, "--to", "torch", "--muscle", "left", "--out", tmp_path / "one"
    )
    assert done.exit_code == 0, done.output
    said = airmuscle(
        "export", source, "--to", "torch", "--muscle", "middle", "--out", tmp_path / "none"
    )
    assert said.exit_code == 1
    assert "--muscle left" in " ".join(said.output.split())
