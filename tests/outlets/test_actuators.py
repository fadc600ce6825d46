"""Batched actuators in learning stacks: in PyTorch, Warp and ONNX a muscle gives the tensions of
the library.

With the steps of `simulate(..., RungeKutta4(step))` they agree to 1e-12 of the tension in double
and to 1e-5 in single precision. Derivatives of PyTorch are those of the printed expressions. The
adapters of robot learning frameworks run in test_frameworks.py.
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import plants
import pytest
from click.testing import CliRunner
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


DAMPING = "muscle.damper.damping"


@pytest.fixture(scope="module")
def modules(torch, warp, tmp_path_factory):
    """Written modules of PyTorch and Warp with an uncertainty, and those without."""
    folder = tmp_path_factory.mktemp("modules")
    written = []
    for name, uncertainty in (("muscle", UNCERTAINTY), ("plain", None)):
        for stack, end in ((TorchStack(), ""), (WarpStack(Double()), "_warp")):
            write_actuator(LIFT, folder, stack, name=name, uncertainty=uncertainty)
            written.append(module_of(folder / f"{name}{end}.py"))
    return written


def actuators(torch, modules):
    """Four muscles of PyTorch and of Warp."""
    in_torch, in_warp = modules
    return [
        getattr(in_torch, class_of(in_torch))((4,), dtype=torch.float64),
        getattr(in_warp, class_of(in_warp))(4, device="cpu"),
    ]


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (-5.0, "-5"),
        (float("nan"), "nan"),
        (float("inf"), "inf"),
        ([100.0, 200.0, -1.0, 300.0], "-1"),
    ],
)
def test_a_parameter_beyond_its_bounds_is_refused_and_changes_nothing(value, shown, torch, modules):
    for actuator, prepared in zip(
        actuators(torch, modules[:2]), ("prepared", "prepared"), strict=True
    ):
        before = np.array(getattr(actuator, prepared).numpy())
        with pytest.raises(ValueError, match=rf"{DAMPING} is {shown}; allowed are 0 to "):
            actuator.set_parameters({DAMPING: value})
        np.testing.assert_array_equal(getattr(actuator, prepared).numpy(), before)
        with pytest.raises(KeyError, match="there is no parameter 'mass'"):
            actuator.set_parameters({"mass": 1.0})


def test_parameters_of_each_muscle_are_set_in_warp_as_in_torch(torch, warp, modules):
    dampings = [0.0, 100.0, 200.0, 400.0]
    in_torch, in_warp = actuators(torch, modules[:2])
    for actuator in (in_torch, in_warp):
        actuator.set_parameters({DAMPING: dampings})
    output = in_torch.compute(in_torch.start(3e5, 0.28), 0.0, 0.28, -0.1, 1e-3)
    in_warp.start(3e5, 0.28)
    in_warp.compute(
        *(warp.full(4, v, dtype=modules[1].real, device="cpu") for v in (0.0, 0.28, -0.1)), 1e-3
    )
    np.testing.assert_allclose(in_warp.tension.numpy(), output.tension.numpy(), rtol=1e-12)
    assert np.ptp(output.tension.numpy()) == pytest.approx(40.0)


@pytest.mark.parametrize("change", ["tensor", "number", "randomise", "none"])
@pytest.mark.parametrize("before", ["randomise", "none"])
def test_a_stored_actuator_is_restored_whatever_its_parameters_are(change, before, torch, modules):
    """Into a new module, and into one with drawn parameters; alone and within a policy."""

    def changed(actuator, change, seed):
        if change == "randomise":
            actuator.randomise(generator=torch.Generator().manual_seed(seed))
        elif change != "none":
            value = 150.0 if change == "number" else torch.tensor([10.0, 20.0, 30.0, 40.0])
            actuator.set_parameters({DAMPING: value})
        return torch.nn.Sequential(actuator)

    first = changed(actuators(torch, modules[:2])[0], change, 1)
    second = changed(actuators(torch, modules[:2])[0], before, 2)
    second.load_state_dict(first.state_dict())
    tensions = []
    for policy in (first, second):
        actuator = policy[0]
        state = actuator.start(3e5, 0.28)
        tensions.append(actuator.compute(state, 0.0, 0.28, -0.1, 1e-3).tension.numpy())
        np.testing.assert_array_equal(actuator.values.numpy(), first[0].values.numpy())
    np.testing.assert_array_equal(*tensions)


def test_an_actuator_of_another_shape_or_kind_is_not_restored(torch, modules):
    muscle = modules[0].Muscle
    stored = muscle((4,))
    stored.set_parameters({DAMPING: torch.full((4,), 10.0)})
    with pytest.raises(RuntimeError, match="size mismatch for values"):
        muscle((3,)).load_state_dict(stored.state_dict())


def test_without_a_covariance_nothing_can_be_drawn(torch, modules):
    """The remedy works: values that were drawn elsewhere are given to set_parameters."""
    remedy = r"have no covariance .* table \[uncertainty\].* drawn values to set_parameters"
    drawn = np.random.default_rng(1).uniform(50.0, 100.0, 4)
    for actuator in actuators(torch, modules[2:]):
        with pytest.raises(ValueError, match=remedy):
            actuator.randomise()
        actuator.set_parameters({DAMPING: drawn})


@pytest.mark.parametrize("dt", [0.0, -1e-3, float("nan"), float("inf")])
def test_a_step_that_is_not_positive_is_refused(dt, torch, warp, modules):
    in_torch, in_warp = actuators(torch, modules[:2])
    with pytest.raises(ValueError, match=r"dt is .* s; it must be positive and finite"):
        in_torch.compute(in_torch.start(), 0.0, 0.28, 0.0, dt)
    rows = [warp.zeros(4, dtype=modules[1].real, device="cpu") for _ in range(3)]
    with pytest.raises(ValueError, match=r"dt is .* s; it must be positive and finite"):
        in_warp.compute(*rows, dt)


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
        AirmuscleError, match=r"needs the package 'onnx'; pip install .airmuscle\[learning\]"
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
