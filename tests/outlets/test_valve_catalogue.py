"""Real valves by name: their published flows come out of their law, every number has a source, bad
files are refused.

A valve of the catalogue stands in a scenario as `{ library = "matrix-821" }`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.core import cite
from airmuscle.errors import (
    AirmuscleWarning,
    FileError,
    ParameterError,
    UnitError,
    UnknownNameError,
)
from airmuscle.files import (
    Entry,
    PlantEntry,
    ValveEntry,
    list_laws,
    list_library,
    list_plants,
    list_products,
    list_valves,
    load,
    load_law,
    load_scenario,
    load_valve,
)
from airmuscle.files.library import PLANT_READER, Location
from airmuscle.papers.hosovsky_plant import MATRIX
from airmuscle.physics import CheckValve, Orifice, Valve, in_series

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
every_valve = pytest.mark.parametrize("name", list_valves())
GOOD = """
title = "A valve of ours"
provenance = "measured"
[valve]
model = "SubsonicIndexValve"
conductance = "2 dm3/(s bar)"
critical_ratio = 0.3
subsonic_index = 0.55
[exhaust]
model = "Valve"
conductance = "3 dm3/(s bar)"
critical_ratio = 0.25
[switching_times]
opening_delay = "4 ms"
closing_delay = "7 ms"
[[check]]
upstream = "7 bara"
downstream = "1 bara"
quantity = "flow"
equals = "840 l/min"
tolerance = "1 l/min"
source = "the bench"
[[reference]]
key = "ours"
authors = "We"
title = "Notes"
where = "here"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "valve.toml"
    path.write_text(text, encoding="utf-8")
    return path


@every_valve
def test_published_flows_come_out_of_the_law(name: str):
    entry = load_valve(name)
    for check in entry.checks:
        assert abs(entry.flow(**dict(check.conditions)) - check.equals) <= check.tolerance, (
            check.source
        )


def test_enough_of_the_catalogue_is_judged_by_a_published_flow():
    assert sum(bool(load_valve(name).checks) for name in list_valves()) >= 8


def test_a_check_fails_when_the_valve_changes():
    entry = load_valve("smc-sy5000")
    (check,) = entry.checks
    other = Valve(1.01 * entry.valve.conductance, entry.valve.critical_ratio)
    flow = other.mass_flow(*(p for _, p in check.conditions), 1.0, 293.15) / 1.185
    assert abs(flow - check.equals) > check.tolerance


@every_valve
def test_every_valve_says_where_it_is_from_and_what_was_converted(name: str):
    entry = load_valve(name)
    assert entry.references, "no source"
    assert entry.provenance in (
        "printed",
        "data sheet, secondary source",
        "secondary source, converted",
    )
    assert entry.note
    assert ("chosen" in entry.note) == ("converted" in entry.provenance)
    assert all(check.source for check in entry.checks)
    assert {r.key for r in cite(entry)} >= {r.key for r in entry.references}


def test_the_valve_of_the_third_paper():
    assert load_valve("matrix-821").valve == MATRIX
    assert load_valve("matrix").name == "matrix-821"


def test_the_paths_of_a_valve_may_differ():
    entry = load_valve("ckd-m4ga1-r")
    for path, conductance in (("valve", 0.99e-8), ("exhaust", 1.2e-8)):
        assert entry.orifice(path).conductance == pytest.approx(conductance, rel=1e-12)
        assert entry.orifice(path).critical_ratio == 0.20
    assert isinstance(load_valve("smc-ak2000-01").valve, CheckValve)


def test_a_file_of_the_user_is_read_in_si(tmp_path: Path):
    entry = load_valve(written(tmp_path, GOOD))
    assert entry.valve.conductance == pytest.approx(2e-8)
    assert (
        entry.switching_times.opening_delay,
        entry.switching_times.closing_delay,
    ) == pytest.approx((4e-3, 7e-3))
    (check,) = entry.checks
    assert entry.flow(**dict(check.conditions)) == pytest.approx(check.equals, rel=1e-9)
    assert dict(check.conditions) == {"upstream": 7e5, "downstream": 1e5}
    assert load(tmp_path / "valve.toml") == load(str(tmp_path / "valve.toml")) == entry


def test_the_page_on_valves_is_true(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    page = (Path(__file__).parents[2] / "docs" / "guides/valves.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    exec(compile(code, "guides/valves.md", "exec"), {})
    assert capsys.readouterr().out.count("Valve(") == 2
    _, own = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    entry = load_valve(written(tmp_path, own))
    (check,) = entry.checks
    assert abs(entry.flow(**dict(check.conditions)) - check.equals) <= check.tolerance


def test_a_limit_of_use_is_a_warning():
    with pytest.warns(AirmuscleWarning, match=r"smc-sx91: Maximum pressure 0\.2 MPa"):
        load_valve("smc-sx91")


def test_a_table_may_name_a_valve_of_the_catalogue_or_of_a_file_beside_it(tmp_path: Path):
    place = Location("scenario.toml", "plant.circuit.fill", written(tmp_path, GOOD).parent)
    assert PLANT_READER.build({"library": "matrix-821"}, place, kind=Orifice) == MATRIX
    exhaust = PLANT_READER.build({"library": "ckd-m4ga1-r", "path": "exhaust"}, place, kind=Orifice)
    assert exhaust == load_valve("ckd-m4ga1-r").exhaust
    of_file = PLANT_READER.build({"library": "valve.toml", "path": "exhaust"}, place, kind=Orifice)
    assert of_file.conductance == pytest.approx(3e-8)


SCENARIO = """
[plant]
muscle = "dmsp-20-300"
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { library = "matrix-821" }
discharge = { library = "ckd-m4ga1-r", path = "exhaust" }
[plant.mechanism]
model = "Isometric"
contraction = 0.0
[input]
fill = [["0 s", 1]]
[run]
duration = "0.2 s"
"""


def test_a_scenario_runs_with_valves_of_the_catalogue(tmp_path: Path):
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    scenario = load_scenario(path)
    assert scenario.plant.circuit.fill == MATRIX
    assert scenario.simulate()["pressure"][-1] > 1e5
    assert {"hosovsky"} & {r.key for r in load_valve("matrix-821").references}


@pytest.mark.parametrize(
    ("table", "error", "message"),
    [
        (
            {"library": "matrx-821"},
            UnknownNameError,
            r"\[fill\]: no valve 'matrx-821'; .* Did you mean 'matrix-821'\?",
        ),
        ({"library": "dmsp-20-300"}, UnknownNameError, "no valve 'dmsp-20-300'"),
        ({"library": "ckd"}, UnknownNameError, "'ckd' is ambiguous"),
        (
            {"library": "matrix-821", "path": "exhaust"},
            UnknownNameError,
            "matrix-821 has no path 'exhaust'; it has valve",
        ),
        (
            {"library": "matrix-821", "path": "exaust"},
            UnknownNameError,
            r"no path 'exaust'.* Did you mean 'exhaust'\?",
        ),
        (
            {"library": "matrix-821", "conductance": 1e-8},
            ParameterError,
            "unknown key 'conductance'",
        ),
        ({"library": 821}, ParameterError, "library is 821; it must be a text in quotes"),
        ({"library": "none.toml"}, FileError, r"none\.toml: there is no such file"),
    ],
)
def test_a_valve_that_is_not_there_is_refused(tmp_path: Path, table, error, message: str):
    with pytest.raises(error, match=message):
        PLANT_READER.build(table, Location("scenario.toml", "fill", tmp_path), kind=Orifice)


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ("[valve]", "[valv]", ParameterError, r"unknown key 'valv'.* Did you mean 'valve'\?"),
        ('title = "A valve of ours"', "", ParameterError, "'title' is missing"),
        (
            'model = "SubsonicIndexValve"',
            'model = "Supply"\npressure = 1e5',
            ParameterError,
            r"\[valve\]: Supply is not allowed here; an Orifice is required: .*Valve",
        ),
        (
            '"2 dm3/(s bar)"',
            '"2 dm3/s"',
            UnitError,
            r"\[valve\], conductance: unit 'dm3/s' cannot be converted to",
        ),
        (
            '"4 ms"',
            '"-4 ms"',
            ParameterError,
            r"\[switching_times\]: .*opening_delay .* allowed range: 0 to 1 s",
        ),
        (
            '"4 ms"',
            '"4 mm"',
            UnitError,
            r"\[switching_times\], opening_delay: unit 'mm' cannot be converted to 's'",
        ),
        (
            'closing_delay = "7 ms"',
            "",
            ParameterError,
            "'closing_delay' is missing: time from the command to close",
        ),
        (
            'upstream = "7 bara"',
            'upstream = "7 barg"',
            UnitError,
            r"\[check 1\], upstream: unit 'barg' is gauge",
        ),
        (
            'equals = "840 l/min"',
            "",
            ParameterError,
            r"\[check 1\]: 'equals' is missing: published value",
        ),
        (
            'equals = "840 l/min"',
            "equals = nan",
            ParameterError,
            r"\[check 1\]: equals is nan; it must be finite",
        ),
        ('source = "the bench"', "", ParameterError, r"\[check 1\]: 'source' is missing"),
        (
            "[[check]]",
            "[check]",
            ParameterError,
            r"'check' must be an array of tables; write \[\[check\]\]",
        ),
        ('key = "ours"', "key = 1", ParameterError, "key is 1; it must be a text in quotes"),
        ("[valve]", "valve = 3\n[other]", ParameterError, "unknown key 'other'"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_place(
    tmp_path: Path, old, new, error, message: str
):
    with pytest.raises(error, match=message):
        load_valve(written(tmp_path, GOOD.replace(old, new, 1)))


def test_a_file_without_a_valve_or_with_another_thing_is_refused(tmp_path: Path):
    with pytest.raises(ParameterError, match=r"the table \[valve\] is missing"):
        load_valve(written(tmp_path, 'title = "t"\nprovenance = "chosen"\n'))
    supply = '[valve]\nmodel = "Supply"\npressure = "6 bar"\n'
    with pytest.raises(ParameterError, match="Supply is not allowed here; an Orifice is required"):
        load_valve(written(tmp_path, f'title = "t"\nprovenance = "chosen"\n{supply}'))
    head = "switching_times = 3\n"
    with pytest.raises(ParameterError, match=r"\[switching_times\] is 3; it must be a table"):
        load_valve(written(tmp_path, head + GOOD.partition("[switching_times]")[0]))


def test_the_command_line_lists_shows_and_cites_valves():
    def run(*arguments: str):
        return airmuscle(*arguments)

    listed = {entry["name"]: entry for entry in json.loads(run("list", "--json").output)}
    assert listed["matrix-821"]["kind"] == "valve, Valve"
    shown = json.loads(run("show", "smc-sx91", "--json").stdout)["entry"]
    values = {p["parameter"]: p["value"] for p in shown["parameters"]}
    assert values["valve.conductance"] == pytest.approx(2.5e-9)
    assert values["switching_times.opening_delay"] == pytest.approx(0.01)
    assert shown["checks"][0]["checked_quantity"] == "flow"
    assert all(
        word in run("show", "matrix-821").output
        for word in ("critical pressure ratio", "0.433", "Hošovský")
    )
    assert "SM-P00077-A/3" in run("cite", "ckd-m4ga1").output
    assert "festo-mh2" in run("show", "festo").output + run("show", "festo").stderr


# One loader for muscles, laws and valves


def test_load_reads_every_entry_that_the_library_lists():
    assert set(list_library()) == {*list_laws(), *list_valves(), *list_plants(), *list_products()}
    kinds = {name: type(load(name)) for name in list_library()}
    assert {name for name, kind in kinds.items() if kind is ValveEntry} == set(list_valves())
    assert {name for name, kind in kinds.items() if kind is Entry} == set(list_laws())
    assert {name for name, kind in kinds.items() if kind is PlantEntry} == set(list_plants())
    assert am.load is load
    assert load("matrix-821") == load_valve("matrix-821")
    assert load("dmsp-20-300") == load_law("dmsp-20-300")


def test_loaded_entries_make_a_plant():
    valve, muscle = am.load("matrix-821"), am.load("dmsp-20-300").muscle
    plant = am.Plant(
        muscle, am.FillDischarge(am.Supply(5e5), valve.valve, valve.valve), am.Isometric(0.0)
    )
    assert plant.circuit.fill == MATRIX
    run = am.simulate(
        plant,
        am.Schedule({"fill": ((0.0, 1.0),)}),
        duration=0.05,
        initial_state=plant.state_at(pressure=0.0),
    )
    assert run["pressure"][-1] > 1e4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda muscle, valve: am.Plant(
                muscle.muscle,
                am.FillDischarge(am.Supply(5e5), valve, valve.valve),
                am.Isometric(0.0),
            ),
            (
                r"FillDischarge: fill must be an instance of Orifice; .* It contains one: write"
                r" \.valve after it"
            ),
        ),
        (
            lambda muscle, valve: am.Plant(
                muscle,
                am.FillDischarge(am.Supply(5e5), valve.valve, valve.valve),
                am.Isometric(0.0),
            ),
            r"Plant: its muscle must be a Muscle; .* give its \.muscle",
        ),
        (
            lambda muscle, valve: in_series(valve, valve.valve),
            r"argument 1 is ValveEntry; .* write \.valve after it",
        ),
    ],
)
def test_an_entry_in_place_of_its_part_is_refused_with_what_to_write(make, message: str):
    with pytest.raises(ParameterError, match=message):
        make(am.load("dmsp-20-300"), am.load("matrix-821"))


def test_both_paths_of_a_valve_are_named():
    entry = am.load("ckd-m4ga1-r")
    with pytest.raises(ParameterError, match=r"write \.valve or \.exhaust after it"):
        in_series(entry)


def test_a_valve_in_place_of_a_muscle_is_refused(tmp_path: Path):
    with pytest.raises(
        UnknownNameError,
        match=r"'matrix-821' is a valve; a muscle or a law is required: .*dmsp-20-300",
    ):
        load_law("matrix-821")
    with pytest.raises(
        ParameterError,
        match=r"valve\.toml: the file describes a valve; a muscle or a law is required",
    ):
        load_law(written(tmp_path, GOOD))
