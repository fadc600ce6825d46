"""A scenario file becomes the plant, the command and the run it describes, in every form that
docs/guides/scenario.md names.

What is wrong with it is said with file, table, key, value and what is allowed.
"""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scenario_files import writer_of

import airmuscle as am
from airmuscle.engine import (
    PWM,
    DormandPrince8,
    Periodic,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    WithDrivers,
)
from airmuscle.errors import (
    AirmuscleError,
    ColumnError,
    EquilibriumError,
    FileError,
    ParameterError,
    PhysicsError,
    UnitError,
    UnknownNameError,
)
from airmuscle.files import Entry, load, load_scenario, load_valve, save
from airmuscle.files.scenario.simulation_chapter import _input_plot
from airmuscle.physics import (
    Braid,
    ClosedChamber,
    HangingMass,
    Isometric,
    Isothermal,
    LinearDamper,
    Polytropic,
    WallHeatTransfer,
    WithLatch,
)

PAGE = (Path(__file__).parents[2] / "docs" / "guides/scenario.md").read_text(encoding="utf-8")
WHOLE, FITTED, FROM_LIBRARY, PAIR, DRIVEN, LINE = re.findall(
    r"```toml\n(.*?)```", PAGE, flags=re.DOTALL
)

MUSCLE = 'muscle = "chou-hannaford"'
MASS = 'model = "HangingMass"\nmass = "5 kg"'
FILL = 'fill = [["0.1 s", 1], ["0.2 s", 0]]'
DURATION = 'duration = "0.3 s"'
GOOD = f"""
title = "A small one"
[plant]
{MUSCLE}
[plant.circuit]
model = "FillDischarge"
supply = {{ model = "Supply", pressure = "5 bar" }}
fill = {{ model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }}
discharge = {{ model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }}
[plant.mechanism]
{MASS}
[input]
{FILL}
[run]
{DURATION}
initial_state = {{ pressure = "1 bar" }}
"""
written = writer_of(GOOD)


# Every form of docs/guides/scenario.md


def test_the_page_runs(tmp_path: Path):
    scenario = load_scenario(written(tmp_path, text=WHOLE))
    library = load("dmsp-20-300")
    assert scenario.title == "Fill and discharge"
    assert scenario.plant.muscle.contractile == library.characteristic
    assert scenario.plant.muscle.damper == LinearDamper(200.0)
    assert scenario.plant.gas == Isothermal()
    assert scenario.plant.circuit.supply.pressure == 650e3 - 101_325.0
    assert scenario.problem.input == Schedule(
        {"fill": ((5.0, 1.0), (15.0, 0.0)), "discharge": ((19.0, 1.0),)}
    )
    assert (
        scenario.problem.duration,
        scenario.problem.output_times,
        scenario.problem.integrator,
    ) == (
        25.0,
        0.01,
        Rodas4(rtol=1e-8),
    )
    assert scenario.columns == ("pressure", "position")
    run = scenario.simulate()
    assert run["pressure"].max() == pytest.approx(650e3 - 101_325.0, rel=1e-3), (
        "filled up to the supply"
    )
    assert run["pressure"][-1] == pytest.approx(0.0, abs=100.0), "and discharged"


def test_the_pair_of_the_page_runs(tmp_path: Path):
    run = load_scenario(written(tmp_path, text=PAIR)).simulate()
    assert np.ptp(run["left.air_mass"]) < 1e-18, "its chamber is closed"
    assert run["right.pressure"][-1] > run["left.pressure"][-1] + 1e5
    assert np.array_equal(run["left.contraction"], run["right.contraction"])


def test_a_list_holds_tables_or_names_of_its_kind(tmp_path: Path):
    i = PAIR.index("[[plant.circuit]]")
    j = PAIR.index("[plant.mechanism]")
    names = PAIR[:i] + PAIR[j:].replace('"right.fill" = [["0.1 s", 1]]', "")
    listed = ("[[plant.muscle]]", 'circuit = ["ClosedChamber", "ClosedChamber"]\n[[plant.muscle]]')
    text = f"[plant]\n{names}"
    assert load_scenario(written(tmp_path, listed, text=text)).plant.circuits == (
        ClosedChamber(),
        ClosedChamber(),
    )
    wrong = (listed[0], listed[1].replace('"ClosedChamber"]', "3]"))
    with pytest.raises(
        ParameterError,
        match=(
            r"\[plant.circuit\[1\]\] is 3; it must be a table. Write model = \"...\" of a Circuit"
        ),
    ):
        load_scenario(written(tmp_path, wrong, text=text))


def test_what_is_optional_has_the_defaults_of_the_page(tmp_path: Path):
    path = written(
        tmp_path,
        ('title = "A small one"\n', ""),
        ('initial_state = { pressure = "1 bar" }\n', ""),
        (FILL, ""),
    )
    path = written(tmp_path, (MUSCLE, 'muscle = "dmsp-20"'), text=path.read_text(encoding="utf-8"))
    path = written(tmp_path, ("[input]\n", ""), text=path.read_text(encoding="utf-8"))
    scenario = load_scenario(path)
    assert (scenario.title, scenario.problem.output_times, scenario.problem.integrator) == (
        "scenario",
        None,
        Rodas4(),
    )
    assert scenario.plant.gas == WallHeatTransfer()
    assert scenario.problem.input == Schedule({})
    assert scenario.plant.muscle_states(scenario.initial_state)[0].pressure == pytest.approx(
        0.0, abs=1e-6
    )


@pytest.mark.parametrize(
    ("was", "becomes", "part", "expected"),
    [
        (MASS, 'model = "Isometric"\ncontraction = "10 %"', "mechanism", Isometric(0.1)),
        (
            MASS,
            'model = "WithLatch"\ninner = { model = "HangingMass", mass = 5 }',
            "mechanism",
            WithLatch(HangingMass(5.0)),
        ),
        (MUSCLE, f'{MUSCLE}\ngas = "Polytropic"', "gas", Polytropic()),
        (
            MUSCLE,
            f'{MUSCLE}\ngas = {{ model = "Polytropic", exponent = 1.4 }}',
            "gas",
            Polytropic(1.4),
        ),
    ],
)
def test_components_are_tables_or_names(
    tmp_path: Path, was: str, becomes: str, part: str, expected: object
):
    assert getattr(load_scenario(written(tmp_path, (was, becomes))).plant, part) == expected


@pytest.mark.parametrize(
    ("text", "method"),
    [
        ('"Rodas4"', Rodas4()),
        ('{ model = "DormandPrince8", step = "0.1 ms" }', DormandPrince8(1e-4)),
        ('{ model = "RungeKutta4", step = 1e-4 }', RungeKutta4(1e-4)),
    ],
)
def test_every_method_of_the_page(tmp_path: Path, text: str, method: object):
    scenario = load_scenario(written(tmp_path, (DURATION, f"{DURATION}\nintegrator = {text}")))
    assert scenario.problem.integrator == method
    assert scenario.simulate()["time"][-1] == 0.3


def test_a_muscle_may_be_a_file_beside_the_scenario(tmp_path: Path):
    save(load("chou-hannaford"), tmp_path / "mine.toml")
    by_name = load_scenario(written(tmp_path)).plant.muscle
    assert (
        load_scenario(written(tmp_path, (MUSCLE, 'muscle = "mine.toml"'))).plant.muscle == by_name
    )
    replaced = (
        'muscle = { library = "mine.toml", damper = { model = "LinearDamper", damping = 7 }, name ='
        ' "mine" }'
    )
    muscle = load_scenario(written(tmp_path, (MUSCLE, replaced))).plant.muscle
    assert (muscle.damper, muscle.name, muscle.geometry) == (
        LinearDamper(7.0),
        "mine",
        by_name.geometry,
    )


def test_a_fitted_surface_becomes_a_muscle_by_the_geometry_of_the_page(tmp_path: Path):
    surface = load("dmsp-20-300").characteristic
    (tmp_path / "fit").mkdir()
    save(Entry("muscle", "fitted", "fitted", surface), tmp_path / "fit" / "muscle.toml")
    path = written(tmp_path, (f"[plant]\n{MUSCLE}", FITTED))
    muscle = load_scenario(path).plant.muscle
    assert muscle.contractile == surface
    assert muscle.geometry == Braid(0.01, math.radians(24), 0.3)


def test_a_plant_of_the_library_takes_the_replaced_part_of_the_page(tmp_path: Path):
    (tmp_path / "joint.toml").write_text(
        f'{FROM_LIBRARY}\n[input]\n"left.fill" = [["0.1 s", 1]]\n[run]\n{DURATION}\n'
    )
    plant = load_scenario(tmp_path / "joint.toml").plant
    original = load("joint-dmsp-20-matrix").plant
    assert plant == dataclasses.replace(original, gas=Isothermal())
    assert plant != original


def test_a_signal_is_linear_between_its_points(tmp_path: Path):
    scenario = load_scenario(
        written(
            tmp_path, (FILL, f'model = "SampledSignal"\n{FILL}'), (DURATION, 'duration = "200 ms"')
        )
    )
    assert scenario.problem.input == SampledSignal({"fill": ((0.1, 1.0), (0.2, 0.0))})
    run = scenario.simulate()
    assert run["fill"][run["time"] == 0.15] == pytest.approx(0.5)


OPENINGS = "time [ms],fill [%],valve\n0,0,0.5\n100,50,0.5\n300,0,0.25\n"


def driven(folder: Path, *changes: tuple[str, str]) -> Path:
    """The scenario with the command of the page, and its data file beside it."""
    (folder / "openings.csv").write_text(OPENINGS, encoding="utf-8")
    return written(folder, (f"[input]\n{FILL}", DRIVEN), *changes)


def test_the_command_of_the_page_runs(tmp_path: Path):
    scenario = load_scenario(driven(tmp_path))
    told = SampledSignal(
        {"fill": ((0, 0), (0.1, 0.5), (0.3, 0)), "discharge": ((0, 0.5), (0.1, 0.5), (0.3, 0.25))}
    )
    drivers = {
        "fill": SolenoidDriver(opening_delay=5e-3, closing_delay=2e-3),
        "discharge": (PWM(50.0, smallest_pulse=1e-3), SolenoidDriver(opening_delay=2e-3)),
    }
    assert scenario.problem.input == WithDrivers(Periodic(told, 0.4), drivers)
    run = scenario.simulate()
    assert np.count_nonzero(np.diff(run["discharge"]) > 0) == 15, (
        "a pulse in each period of the carrier"
    )


def test_an_input_that_columns_does_not_name_takes_the_column_of_its_name(tmp_path: Path):
    """It was 0 for the whole run, without a message."""
    named = load_scenario(driven(tmp_path)).problem.input
    partly = load_scenario(
        driven(tmp_path, ('fill = "fill", discharge', "discharge"))
    ).problem.input
    assert partly == named
    beside = (
        'columns = { fill = "fill", discharge = "valve" }',
        'columns = { discharge = "valve" }\nfill = [[0, 1]]',
    )
    assert load_scenario(driven(tmp_path, beside)).problem.input.inner.inner.points["fill"] == (
        (0.0, 1.0),
    )
    exchanged = (
        'columns = { fill = "fill", discharge = "valve" }',
        'columns = { discharge = "fill" }',
    )
    assert "fill" not in load_scenario(driven(tmp_path, exchanged)).problem.input.inner.inner.points


def test_a_recorded_command_may_be_held_and_rows_may_stand_beside_it(tmp_path: Path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "bench.csv").write_text(OPENINGS, encoding="utf-8")
    file = 'file = "data/bench.csv"\ndischarge = [["0.1 s", 1]]'
    fill = ((0.0, 0.0), (0.1, 0.5), (0.3, 0.0))
    for model, kind in (("", SampledSignal), ('model = "Schedule"\n', Schedule)):
        command = load_scenario(written(tmp_path, (FILL, f"{model}{file}"))).problem.input
        assert command == kind({"fill": fill, "discharge": ((0.1, 1.0),)})


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
def test_a_driver_may_have_the_delays_of_a_valve_of_the_catalogue(tmp_path: Path):
    response = load_valve("smc-sx91").switching_times
    command = load_scenario(
        written(tmp_path, (FILL, f'{FILL}\ndrivers = {{ fill = {{ library = "smc-sx91" }} }}'))
    ).problem.input
    assert command.drivers == {
        "fill": SolenoidDriver(response.opening_delay, response.closing_delay)
    }


def test_an_input_is_read_in_its_own_unit(tmp_path: Path):
    valve = '{ model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }'
    regulator = f"""model = "ProportionalRegulator"
supply = {{ model = "Supply", pressure = "6 bar" }}
fill = {valve}
discharge = {valve}
lag = {{ model = "SecondOrderLag", frequency = "20 Hz", damping_ratio = 0.7 }}
"""
    i = GOOD.index('model = "FillDischarge"')
    j = GOOD.index("[plant.mechanism]")
    text = (
        GOOD[:i]
        + regulator
        + GOOD[j:].replace(FILL, 'setpoint = [["0.1 s", "2 bar"], ["0.2 s", 1e5]]')
    )
    scenario = load_scenario(written(tmp_path, text=text))
    assert scenario.problem.input == Schedule({"setpoint": ((0.1, 2e5), (0.2, 1e5))})
    assert "setpoint\n[Pa]" in [
        axis.get_ylabel() for axis in _input_plot(scenario, scenario.simulate()).figure.axes
    ]
    with pytest.raises(
        UnitError, match=r"\[input\], setpoint: unit 'mm' cannot be converted to 'Pa'"
    ):
        load_scenario(written(tmp_path, ('"2 bar"', '"2 mm"'), text=text))


def test_a_column_of_no_known_quantity_has_the_unit_of_its_heading(tmp_path: Path):
    (tmp_path / "bench.csv").write_text(
        "time [s],valve [%],discharge,port [mm]\n0,50,1,1\n1,20,0,1\n", encoding="utf-8"
    )
    for column in ("valve", "valve [%]"):
        table = f'file = "bench.csv"\ncolumns = {{ fill = "{column}", discharge = "discharge" }}'
        command = load_scenario(written(tmp_path, (FILL, table))).problem.input
        assert command == SampledSignal(
            {"fill": ((0, 0.5), (1, 0.2)), "discharge": ((0, 1), (1, 0))}
        )
    with pytest.raises(
        UnitError, match=r"bench.csv, port \[mm\]: unit 'mm' cannot be converted to a ratio"
    ):
        load_scenario(written(tmp_path, (FILL, 'file = "bench.csv"\ncolumns = { fill = "port" }')))


def test_columns_called_like_inputs_are_taken_unasked(tmp_path: Path):
    (tmp_path / "bench.csv").write_text(
        "time [s],discharge [1],fill [1]\n0,1,0\n1,0.5,0.2\n", encoding="utf-8"
    )
    command = load_scenario(written(tmp_path, (FILL, 'file = "bench.csv"'))).problem.input
    assert command == SampledSignal({"fill": ((0, 0), (1, 0.2)), "discharge": ((0, 1), (1, 0.5))})


def test_the_file_of_a_run_holds_the_columns_that_are_asked_for(tmp_path: Path):
    path = written(tmp_path, ("[run]", '[output]\ncolumns = ["force", "fill"]\n[run]'))
    scenario = load_scenario(path)
    run = scenario.simulate()
    assert list(scenario.select_columns(run)) == ["time", "force", "fill"]
    everything = load_scenario(written(tmp_path))
    assert list(everything.select_columns(run)) == list(run)


def test_a_muscle_of_the_library_keeps_the_box_of_its_law(tmp_path: Path):
    entry = load("dmsp-20-300")
    named = 'muscle = { library = "dmsp-20", damper = { model = "LinearDamper", damping = 7 } }'
    assert (
        load_scenario(written(tmp_path, (MUSCLE, named))).plant.muscle.validity_range
        == entry.validity_range
    )
    law = (
        'contractile = { model = "ChouHannaford1996", geometry = { model = "Braid", radius = "10'
        ' mm", braid_angle = "25 deg", resting_length = "300 mm" } }'
    )
    other = f'muscle = {{ library = "dmsp-20", {law} }}'
    assert load_scenario(written(tmp_path, (MUSCLE, other))).plant.muscle.validity_range is None, (
        "another law was measured elsewhere"
    )


def test_the_start_is_rest_at_a_pressure_or_a_state(tmp_path: Path):
    at_rest = load_scenario(written(tmp_path))
    assert at_rest.plant.muscle_states(at_rest.initial_state)[0].tension == pytest.approx(
        5 * 9.80665
    )
    given = (
        'initial_state = { pressure = "1 bar" }',
        'initial_state = { pressure = "2 bar", position = "10 mm", speed = "5 cm/s" }',
    )
    state = load_scenario(written(tmp_path, given)).initial_state
    assert (state["position"], state["speed"]) == (0.01, 0.05)
    assert at_rest.plant.muscle_states(state)[0].pressure == pytest.approx(2e5)


def test_the_pressure_of_the_surroundings_is_absolute(tmp_path: Path):
    for text in ("98 kPa(a)", "0.98 bara", "98 kPa"):
        ambient = f'ambient = {{ model = "Ambient", pressure = "{text}" }}'
        assert (
            load_scenario(
                written(tmp_path, (MUSCLE, f"{MUSCLE}\n{ambient}"))
            ).plant.ambient.pressure
            == 98_000.0
        )


# What is wrong is said


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
@pytest.mark.parametrize(
    ("was", "becomes", "kind", "message"),
    [
        # tables and keys
        (
            "[input]",
            "[inputs]",
            ParameterError,
            r"toml: unknown key 'inputs'; .*Did you mean 'input'\?",
        ),
        ("[run]\n", "[input.fill2]\n", ParameterError, r"toml: the table \[run\] is missing"),
        (
            'title = "A small one"',
            "title = 3",
            ParameterError,
            r"toml: title is 3; it must be a text in quotes",
        ),
        (
            DURATION,
            "",
            ParameterError,
            r"\[run\]: 'duration' is missing: duration of the run, such as duration = \"25 s\"",
        ),
        (
            DURATION,
            "duratoin = 3",
            ParameterError,
            r"\[run\]: unknown key 'duratoin'; .*Did you mean 'duration'\?",
        ),
        # the plant
        (
            MUSCLE,
            "",
            ParameterError,
            r"\[plant\]: 'muscle' is missing; name a library entry or a muscle file, or write",
        ),
        (
            MUSCLE,
            "muscle = 3",
            ParameterError,
            r"\[plant.muscle\] is 3; name a library entry or a muscle file",
        ),
        (
            MUSCLE,
            "muscle = [3]",
            ParameterError,
            r"\[plant.muscle\[0\]\] is 3; name a library entry",
        ),
        (
            MUSCLE,
            'muscle = "chou-hanaford"',
            UnknownNameError,
            r"\[plant.muscle\]: no muscle or law .*mean 'chou-hannaford'\?",
        ),
        (
            MUSCLE,
            'muscle = "dmsp"',
            UnknownNameError,
            r"\[plant.muscle\]: 'dmsp' is ambiguous: dmsp-10-250",
        ),
        (
            MUSCLE,
            'muscle = "mine.toml"',
            FileError,
            r"\[plant.muscle\]: .*mine\.toml: there is no such file",
        ),
        (
            MUSCLE,
            'muscle = "sarosi-dmsp-10"',
            UnknownNameError,
            r"\[plant.muscle\]: sarosi-dmsp-10 .* lacks a \[geometry\]",
        ),
        (
            MUSCLE,
            'muscle = { library = "x" }',
            UnknownNameError,
            r"\[plant.muscle.library\]: no muscle or law 'x'",
        ),
        (
            MUSCLE,
            'muscle = { library = "saga2007" }',
            ParameterError,
            r"\[plant.muscle\]: saga2007 is Saga2007, which is not solved for",
        ),
        (
            MUSCLE,
            'muscle = { library = "sarosi-dmsp-10" }',
            ParameterError,
            r"\[plant.muscle\]: sarosi-dmsp-10 lacks a \[geometry\]",
        ),
        (
            MUSCLE,
            "muscle = {}",
            ParameterError,
            r"\[plant.muscle\]: the table \[contractile\] is missing; it must be a ForceLaw",
        ),
        (
            MUSCLE,
            f"{MUSCLE}\ngaz = 1",
            ParameterError,
            (
                r"\[plant\]: unknown key 'gaz'; there are muscle, circuit, mechanism, gas, ambient,"
                r" library\. Did you mean 'gas'\?"
            ),
        ),
        (
            MUSCLE,
            f'{MUSCLE}\ngas = "Rodas4"',
            ParameterError,
            r"\[plant.gas\]: Rodas4 is not allowed here; a Gas is required: .*Isothermal",
        ),
        (
            MUSCLE,
            f'{MUSCLE}\ngas = "Isotherm"',
            UnknownNameError,
            r"\[plant.gas\], model: .*Did you mean 'Isothermal'\?",
        ),
        (
            "3e-9, critical_ratio = 0.3",
            "3e-9",
            ParameterError,
            r"\[plant.circuit.fill\]: Valve needs 'critical_ratio'",
        ),
        (
            "= 0.3",
            "= 30",
            ParameterError,
            r"is 30; allowed range: 0 to 0.95. Is it in per cent\? As a ratio it is 0.3",
        ),
        (
            '"5 bar"',
            '"-2 bar"',
            ParameterError,
            r"\[plant.circuit.supply\]: .* is -200000 Pa; allowed range: -100000 to",
        ),
        (
            '"5 bar"',
            '"5,5 bar"',
            UnitError,
            r"supply\], pressure: '5,5 bar' contains a comma; .* a decimal point, '5.5 bar'",
        ),
        (
            '"5 kg"',
            '"5 N"',
            UnitError,
            r"\[plant.mechanism\], mass: unit 'N' cannot be converted to 'kg'",
        ),
        # the command
        (
            FILL,
            'fil = [["0 s", 1]]',
            ParameterError,
            r"\[input\]: .* no input 'fil'; .*Did you mean 'fill'\?",
        ),
        (
            FILL,
            "fill = 1",
            ParameterError,
            (
                r"\[input\], fill is 1; it must be a list of instants and values, such as \[\[\"5"
                r" s\", 1\]"
            ),
        ),
        (
            FILL,
            "fill = [1]",
            ParameterError,
            r"\[input\], fill contains 1; each item must be an instant and a value",
        ),
        (
            FILL,
            'fill = [["1 bar", 1]]',
            UnitError,
            r"\[input\], fill: unit 'bar' cannot be converted to 's'",
        ),
        (
            FILL,
            'fill = [["0.1", 1]]',
            UnitError,
            r"\[input\], fill: '0.1' has no unit; write it like '0.1 s'",
        ),
        (
            FILL,
            "fill = [[0.1, true]]",
            ParameterError,
            r"\[input\], fill is True; it must be a number",
        ),
        (FILL, "fill = [[0.1, nan]]", ParameterError, r"\[input\], fill is nan; it must be finite"),
        (
            FILL,
            "fill = [[0.2, 1], [0.1, 0]]",
            ParameterError,
            r"\[input\]: .*'fill' must list its instants in rising",
        ),
        (
            FILL,
            "fill = [[0.1, 7]]",
            ParameterError,
            r"\[input\]: the input 'fill' is 7 before 0.3 s; allowed range: 0",
        ),
        (FILL, "fill = [[0, -0.5]]", ParameterError, r"\[input\]: the input 'fill' is -0.5 before"),
        (
            FILL,
            'model = "SampledSignal"\nfill = [[0, 0], [0.3, 2]]',
            ParameterError,
            r"the input 'fill' is 2 before 0.3 s",
        ),
        (
            FILL,
            'model = "SampledSignal"\nfill = []',
            ParameterError,
            r"\[input\]: the sampled signal of 'fill' has no points",
        ),
        (
            FILL,
            'model = "Shedule"',
            UnknownNameError,
            (
                r"\[input\], model: no model 'Shedule'; there are SampledSignal, Schedule\. Did you"
                r" mean 'Schedule'\?"
            ),
        ),
        (
            FILL,
            'model = "Braid"',
            ParameterError,
            r"\[input\]: Braid is no input signal; there are Schedule, SampledSignal",
        ),
        (
            FILL,
            f'{FILL}\nperiod = "0 s"',
            ParameterError,
            r"\[input\]: Periodic.period is 0.0 s; it must be positive",
        ),
        (
            FILL,
            f"{FILL}\nperiod = nan",
            ParameterError,
            r"\[input\], period is nan; it must be finite",
        ),
        (
            FILL,
            f'{FILL}\nperiod = "1 bar"',
            UnitError,
            r"\[input\], period: unit 'bar' cannot be converted to 's'",
        ),
        (FILL, "file = 3", ParameterError, r"\[input\]: file is 3; it must be a text in quotes"),
        (FILL, 'file = "no.csv"', FileError, r"\[input\]: .*no\.csv"),
        (
            FILL,
            'columns = { fill = "x" }',
            ParameterError,
            r"\[input\]: columns is given without file; write file =",
        ),
        (
            FILL,
            "drivers = 3",
            ParameterError,
            r"\[input\], drivers is 3; it must be a table. Write fill = \{ model",
        ),
        (
            FILL,
            'drivers = { fil = "SolenoidDriver" }',
            ParameterError,
            r"\[input.drivers\]: .* no input 'fil'.*mean 'fill'\?",
        ),
        (
            FILL,
            'drivers = { fill = "SolenoidDrive" }',
            UnknownNameError,
            r"\[input.drivers.fill\], model: .*Did you mean 'SolenoidDriver'\?",
        ),
        (
            FILL,
            'drivers = { fill = "PWM" }',
            ParameterError,
            r"\[input.drivers.fill\]: PWM needs 'frequency' \[Hz\]",
        ),
        (
            FILL,
            'drivers = { fill = ["Rodas4"] }',
            ParameterError,
            r"\[input.drivers.fill\[0\]\]: Rodas4 is not allowed here; a Driver is required: .*PWM",
        ),
        (
            FILL,
            (
                f'{FILL}\ndrivers = {{ fill = {{ model = "SolenoidDriver", opening_delay = "-1 s"'
                " } }"
            ),
            ParameterError,
            (
                r"\[input.drivers.fill\]: SolenoidDriver.opening_delay .* is -1 s; allowed range: 0"
                r" to 10 s"
            ),
        ),
        (
            FILL,
            'fill = [[0, 2]]\ndrivers = { fill = "SolenoidDriver" }',
            ParameterError,
            r"\[input\]: the command of the driver of 'fill' is 2 before",
        ),
        (
            FILL,
            'drivers = { fill = { library = "ckd-m4ga1-r" } }',
            ParameterError,
            (
                r"\[input.drivers.fill\]: ckd-m4ga1-r: no switching times are published; write"
                r" model = "
            ),
        ),
        (
            FILL,
            'drivers = { fill = { library = "matrix-821", path = "valve" } }',
            ParameterError,
            r"\[input.drivers.fill\]: unknown key 'path'",
        ),
        # what is written
        (
            "[run]",
            "[output]\ncolumns = 3\n[run]",
            ParameterError,
            r'\[output\]: columns is 3; it must be a list of texts, such as \["pressure"',
        ),
        (
            "[run]",
            '[output]\ncolumns = ["presure"]\n[run]',
            ParameterError,
            (
                r"\[output\]: the run has no column 'presure'; there are time, air_mass, .*Did you"
                r" mean 'pressure'\?"
            ),
        ),
        (
            "[run]",
            '[output]\ncolumn = ["force"]\n[run]',
            ParameterError,
            r"\[output\]: unknown key 'column'; .*'columns'\?",
        ),
        (FILL, "model = 3", ParameterError, r"\[input\]: model is 3; it must be a text in quotes"),
        # the run
        (
            DURATION,
            "duration = 0",
            ParameterError,
            r"\[run\], duration is 0; it must be greater than zero",
        ),
        (
            DURATION,
            'duration = "-1 s"',
            ParameterError,
            r"\[run\], duration is '-1 s'; it must be greater than zero",
        ),
        (
            DURATION,
            "duration = inf",
            ParameterError,
            r"\[run\], duration is inf; it must be finite",
        ),
        (
            DURATION,
            "duration = [1]",
            ParameterError,
            r"\[run\], duration is \[1\]; it must be a number in s, or a text",
        ),
        (
            DURATION,
            'duration = "1 m"',
            UnitError,
            r"\[run\], duration: unit 'm' cannot be converted to 's'",
        ),
        (
            DURATION,
            f"{DURATION}\noutput_times = 0",
            ParameterError,
            r"\[run\], output_times is 0; it must be greater than zero",
        ),
        (
            DURATION,
            f"{DURATION}\nstart_time = nan",
            ParameterError,
            r"\[run\], start_time is nan; it must be finite",
        ),
        (
            DURATION,
            f'{DURATION}\nintegrator = "Rodas"',
            UnknownNameError,
            r"\[run.integrator\], .*Did you mean 'Rodas4'\?",
        ),
        (
            DURATION,
            f'{DURATION}\nintegrator = "Isothermal"',
            ParameterError,
            r"\[run.integrator\]: Isothermal is not allowed here; an Integrator is required",
        ),
        (
            DURATION,
            f"{DURATION}\nintegrator = 3",
            ParameterError,
            r"\[run.integrator\] is 3; it must be a table. Write model =",
        ),
        (
            '{ pressure = "1 bar" }',
            "3",
            ParameterError,
            (
                r"\[run\], initial_state is 3; it must be a table. Write initial_state = \{"
                r" pressure = \"0 bar\" \}"
            ),
        ),
        (
            "{ pressure =",
            "{ presure =",
            ParameterError,
            r"\[run.initial_state\]: unknown key 'presure'; .*Did you mean 'pressure'\?",
        ),
        (
            '"1 bar"',
            '"-2 bar"',
            ParameterError,
            r"\[run.initial_state\]: .*-200 kPa is not above absolute vacuum",
        ),
        (
            '"1 bar"',
            "inf",
            ParameterError,
            r"\[run.initial_state\], pressure is inf; it must be finite",
        ),
        (
            'pressure = "1 bar"',
            'position = "1 m"',
            PhysicsError,
            r"\[run.initial_state\]: Braid: a contraction of .* is outside its range",
        ),
    ],
)
def test_a_bad_scenario_is_told_what_is_wrong(
    tmp_path: Path, was: str, becomes: str, kind: type[AirmuscleError], message: str
):
    path = written(tmp_path, (was, becomes))
    with pytest.raises(kind, match=message) as raised:
        load_scenario(path)
    assert "scenario.toml" in str(raised.value)


@pytest.mark.parametrize(
    ("was", "becomes", "kind", "message"),
    [
        (
            'fill = "fill"',
            'fill = "fil"',
            ColumnError,
            r"\[input\]: openings.csv: no column 'fil'; .*Did you mean 'fill'\?",
        ),
        (
            "{ fill = ",
            "{ fil = ",
            ParameterError,
            r"\[input\]: the plant has no input 'fil'; .*Did you mean 'fill'\?",
        ),
        (
            'fill = "fill"',
            "fill = 3",
            ParameterError,
            r"\[input\], columns is .*; it must be a table such as \{ fill = \"valve\" \}",
        ),
        (
            "period",
            "fill = [[0, 1]]\nperiod",
            ParameterError,
            r"\[input\]: 'fill' is given both by the file and by rows; remove one",
        ),
    ],
)
def test_a_recorded_command_that_cannot_be_read_is_told(
    tmp_path: Path, was, becomes, kind, message
):
    with pytest.raises(kind, match=message):
        load_scenario(driven(tmp_path, (was, becomes)))


def test_a_recording_without_a_column_of_an_input_says_how_to_name_one(tmp_path: Path):
    path = driven(tmp_path, ('columns = { fill = "fill", discharge = "valve" }\n', ""))
    (tmp_path / "openings.csv").write_text("time [s],valve\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(
        ColumnError,
        match=(
            r"no column with the name of an input \(fill, discharge\); its columns are time, valve"
        ),
    ):
        load_scenario(path)


def test_a_plant_that_cannot_rest_names_muscle_and_forces(tmp_path: Path):
    heavy = written(
        tmp_path,
        ('"5 kg"', '"500 kg"'),
        (MUSCLE, 'muscle = { library = "chou-hannaford", name = "arm" }'),
    )
    with pytest.raises(
        EquilibriumError,
        match=r"scenario\.toml, \[run\.initial_state\]: HangingMass has no stable equilibrium",
    ) as raised:
        load_scenario(heavy)
    assert re.search(r"arm pulls \d+(\.\d+)? N at 100 kPa and a contraction of", str(raised.value))
    assert re.search(
        r"requires a tension of 4903 N\. Change the load, the pressure or the parallel",
        str(raised.value),
    )
    assert 'In [run], initial_state = { pressure = "2 bar" } is the equilibrium at another' in str(
        raised.value
    )
    assert "WithEndStops" in str(raised.value)


def test_an_unknown_input_is_named_before_a_missing_equilibrium(tmp_path: Path):
    with pytest.raises(ParameterError, match="the plant has no input 'fil'"):
        load_scenario(written(tmp_path, ('"5 kg"', '"500 kg"'), (FILL, "fil = [[0, 1]]")))


def test_a_command_that_is_no_table(tmp_path: Path):
    path = written(tmp_path, (f"[input]\n{FILL}", ""), ('title = "A small one"', "input = [1]"))
    with pytest.raises(ParameterError, match=r"scenario\.toml, input is \[1\]; it must be a table"):
        load_scenario(path)


def test_too_many_rows_are_refused_before_they_fill_the_memory(tmp_path: Path):
    path = written(tmp_path, (DURATION, f'{DURATION}\noutput_times = "1e-12 s"'))
    with pytest.raises(
        ParameterError,
        match=r"\[run\]: output_times of 1e-12 s gives 3e\+11 rows .* at most 2000000 are",
    ):
        load_scenario(path)


def test_a_scenario_is_loaded_run_and_reported_from_the_faces(tmp_path):
    scenario = am.files.load_scenario(
        Path(__file__).parents[2] / "examples" / "fill_discharge.toml"
    )
    page = am.report.write_report(
        [am.files.run_chapter(scenario, scenario.simulate())], tmp_path / "run"
    )
    assert scenario.title in page.read_text(encoding="utf-8")
    again = am.files.load_scenario(am.files.save_scenario(scenario, tmp_path / "again.toml"))
    assert again.problem.system == scenario.problem.system
