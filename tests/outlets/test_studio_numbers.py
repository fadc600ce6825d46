"""Numbers of the studio: what its scripts compute in the page is what the library computes."""

from __future__ import annotations

import base64
import dataclasses
import importlib
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from scenario_files import LIFT
from studio_pages import BEGINNING, WEB, run_script, scripts

import airmuscle as am
from airmuscle.control import linearise_loop
from airmuscle.core import flatten, leaves, with_parameters
from airmuscle.errors import FileError, ParameterError, PhysicsError, TraceError
from airmuscle.files import list_laws, load_scenario, to_toml
from airmuscle.files.library import Location
from airmuscle.files.library.build import build
from airmuscle.files.scenario import build_scenario
from airmuscle.outlets import export_page
from airmuscle.outlets.studio import library_list, sheet_of_any, sheet_of_scenario_text
from airmuscle.outlets.studio.law_sheet import law_sheet
from airmuscle.physics import Braid, PleatedTube, StraightFibre
from airmuscle.physics.muscle.characteristic import calls

WITHOUT_CLOSED_FORM = (
    "festo-tool-dmsp-10",
    "festo-tool-dmsp-20",
    "festo-tool-dmsp-40",
    "saga2007-exact",
)
pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
LAWS = [name for name in list_laws() if name not in WITHOUT_CLOSED_FORM]
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
TOLERANCE = 1e-12


def fill_template(template: list[str | int], values: list[float]) -> str:
    """The text with these values, as the page fills it in."""
    return "".join(repr(values[item]) if isinstance(item, int) else item for item in template)


EVALUATE = """
console.log(JSON.stringify(DATA.map(([sheet, values, points]) => {
  const law = new airmuscle.Law(sheet);
  law.values.set(values); law.prepare();
  return points.map(([p, c, f]) => [law.force(p, c), law.contraction(p, f), law.pressure(c, f), law.stiffness(p, c)].map(String));
})));
"""


def or_nan(function, *arguments):
    try:
        return float(function(*arguments))
    except PhysicsError:
        return float("nan")


def points_of(law, limits):
    """Pressures, contractions and forces (N, 3) over the validity range, some of them without a
    solution, and beyond it: stretched, slack, above the pressures.
    """
    rng = np.random.default_rng(0)
    low = [0.0, 0.0]
    high = [min(law.pressure_range[1], 6e5), 0.25]
    if limits is not None:
        low = [limits.min_pressure, limits.min_contraction]
        high = [limits.max_pressure, limits.max_contraction]
    points = rng.uniform([*low, 0.0], [*high, 500.0], (6, 3))
    if law.refuses_beyond:
        return points
    further = rng.uniform([0.0, -0.1, 0.0], [1.5 * high[0], 1.5 * high[1], 2500.0], (8, 3))
    return np.concatenate([points, further])


def changed(law):
    """The law with every parameter one per cent greater, where that is allowed."""
    for factor in (1.01, 0.99):
        try:
            return with_parameters(law, flatten(law) * factor)
        except ParameterError:
            continue
    return law


def library_values(law, points):
    return np.array(
        [
            [
                or_nan(law.force, p, c),
                or_nan(law.contraction, p, f),
                or_nan(law.pressure, c, f),
                or_nan(law.stiffness, p, c),
            ]
            for p, c, f in points
        ]
    )


def test_every_law_of_the_page_gives_the_numbers_of_the_library(tmp_path):
    """Also with changed parameters; a point without a solution has none in the page."""
    text = scripts(*BEGINNING)
    data = []
    expected = {}
    for name in LAWS:
        entry = am.load(name)
        limits = entry.validity_range
        sheet = law_sheet(entry)
        text += sheet.pop("script")
        points = points_of(entry.characteristic, entry.validity_range)
        ratings = entry.ratings
        known = calls.with_stated_range(
            changed(entry.characteristic), limits, None if ratings is None else ratings.max_force
        )
        for kind, law in (("", entry.characteristic), (" changed", known)):
            values = flatten(law).tolist() + sheet["values"][sum(1 for _ in leaves(law)) :]
            data.append((sheet, values, points.tolist()))
            expected[name + kind] = library_values(law, points)
    found = run_script(text + EVALUATE, data, tmp_path)
    wrong = {}
    for (name, wanted), rows in zip(expected.items(), found, strict=True):
        values = np.array(rows).astype(float)
        assert (np.isnan(values) == np.isnan(wanted)).all(), name
        both = np.isfinite(values) & np.isfinite(wanted)
        scale = np.abs(np.where(both, wanted, 0.0)).max(axis=0)
        worst = np.where(both, np.abs(values - wanted), 0.0).max(axis=0)
        if not (worst <= TOLERANCE * scale).all():
            wrong[name] = worst / scale
    assert wrong == {}


SAY = """
console.log(JSON.stringify(DATA[1].map(([p, c]) => {
  const law = new airmuscle.Law(DATA[0]);
  law.values.set(DATA[0].values); law.prepare();
  return airmuscle.textBeyond(law, { contraction: c, force: law.force(p, c) });
})));
"""


def test_the_page_says_what_a_law_is_beyond_its_range_in_the_words_of_the_contract(tmp_path):
    sheet = law_sheet(am.load("dmsp-20-300"))
    script = sheet.pop("script")
    points = [(3e5, -0.02), (3e5, 0.6), (9e5, 0.1)]
    said = run_script(scripts(*BEGINNING) + script + SAY, [sheet, points], tmp_path)
    contract = (EXAMPLES.parent / "docs" / "reference" / "conventions.md").read_text("utf-8")
    for text, words in zip(said, ("sleeve", "slack", "1.5 times the rated force"), strict=True):
        assert words in text
        assert words in contract
    assert "extrapolation" not in " ".join(scripts(*BEGINNING).split())


def test_a_law_without_a_closed_form_is_approximated_and_the_error_is_stated():
    sheet = law_sheet(am.load("festo-tool-dmsp-20"))
    assert 0.0 < sheet["approximation"]["rms_error"] < sheet["approximation"]["max_error"] < 25.0
    assert sheet["parameters"] == []
    with pytest.raises(
        TraceError, match=r"saga2007-exact: ExactMeridian has no closed form and no validity range"
    ):
        law_sheet(am.load("saga2007-exact"))


OUTLINE = """
console.log(JSON.stringify(DATA.map(([sheet, contractions]) => {
  const law = new airmuscle.Law(sheet);
  return contractions.map((c) => { const o = law.outline(c, 40); return [o.axial, o.radius]; });
})));
"""


def test_the_outline_of_the_page_is_that_of_the_geometry(tmp_path):
    """A closed form exactly, any other geometry by linear interpolation."""
    entry = am.load("saga2007-circle")
    braid = Braid(0.01, 0.4, 0.3)
    shapes = [StraightFibre(0.2, 0.02, rings=2), braid, PleatedTube(0.2, 0.02)]
    text = scripts(*BEGINNING)
    data = []
    for shape in shapes:
        from_file = am.load("sarosi-dmsp-10") if not isinstance(shape, StraightFibre) else entry
        law = from_file.characteristic
        if isinstance(shape, StraightFibre):
            law = build(
                {
                    "model": "VirtualWork",
                    "geometry": {
                        "model": "Braid",
                        "radius": 0.01,
                        "braid_angle": 0.4,
                        "resting_length": 0.2,
                    },
                },
                Location("", "", Path()),
            )
        sheet = law_sheet(dataclasses.replace(from_file, characteristic=law, geometry=shape))
        text += sheet.pop("script")
        data.append((sheet, [0.0, 0.1, 0.2]))
    found = run_script(text + OUTLINE, data, tmp_path)
    for shape, outlines in zip(shapes, found, strict=True):
        for contraction, (axial, radius) in zip((0.0, 0.1, 0.2), outlines, strict=True):
            x, r = shape.outline(contraction, 6001)
            tolerance = 1e-9 if not isinstance(shape, PleatedTube) else 2e-4
            np.testing.assert_allclose(
                np.interp(axial, x, r), radius, atol=max(tolerance, 2e-5 * r.max())
            )
            assert max(axial) == pytest.approx(x.max(), abs=1e-12)


NUMBERS = (
    0.0,
    -0.0,
    1.0,
    5.0,
    0.1,
    1e-4,
    9.999e-5,
    1e-7,
    123456.789,
    1e15,
    1e16,
    1.5e22,
    5e-324,
    1.7976931348623157e308,
    -2.5e-9,
    2.6167e-09,
    4096.0,
)


def test_the_page_writes_numbers_as_python_does(tmp_path):
    text = scripts("numbers") + "console.log(JSON.stringify(DATA.map(airmuscle.pythonFloat)));"
    assert run_script(text, NUMBERS, tmp_path) == [repr(x) for x in NUMBERS]


def test_the_page_reads_what_users_type(tmp_path):
    text = (
        scripts("numbers")
        + "console.log(JSON.stringify(DATA.map((t) => String(airmuscle.readNumber(t)))));"
    )
    given = [
        "1",
        " 2.5 ",
        "2,5",
        "−3",
        "1e3",
        ".5",
        "",
        "abc",
        "1 2",
        "1,000,000",
        "0x10",
        "Infinity",
        "--1",
    ]
    wanted = ["1", "2.5", "2.5", "-3", "1000", "0.5", *["NaN"] * 7]
    assert run_script(text, given, tmp_path) == wanted


@pytest.mark.parametrize("name", LAWS)
def test_a_muscle_file_of_the_page_is_that_of_the_library(name, tmp_path):
    entry = am.load(name)
    sheet = law_sheet(entry)
    assert sheet["toml"]["unchanged"] == to_toml(entry)
    text = fill_template(sheet["toml"]["changed"], [v * 1.01 for v in sheet["values"]])
    file = tmp_path / "own.toml"
    file.write_text(text)
    again = am.load(file)
    law = again.characteristic
    np.testing.assert_array_equal(flatten(law), flatten(entry.characteristic) * 1.01)
    assert again.provenance == "chosen"
    assert again.uncertainty is None
    assert name in again.note


RUN = """
const run = new airmuscle.PlantRun(DATA);
const r = run.scheduled(run.program.run.segments, 0.01);
console.log(JSON.stringify([r.status, r.steps, r.columns]));
"""


@pytest.mark.parametrize(
    "name",
    [
        "lift-dmsp-20",
        "joint-dmsp-20-proportional",
        pytest.param("joint-dmsp-20-matrix", marks=pytest.mark.slow),
    ],
)
def test_a_run_of_the_page_is_that_of_the_library(name, tmp_path):
    sheet = sheet_of_any(name)
    text = scripts("numbers") + sheet.pop("script") + scripts("plant-start", "plant-run") + RUN
    status, _, columns = run_script(text, sheet, tmp_path)
    assert status == 0
    scenario = scenario_of(name)
    times = np.array(columns["time"])
    recording = am.simulate(
        scenario.plant,
        scenario.problem.input,
        duration=scenario.problem.duration,
        initial_state=dict(scenario.initial_state),
        output_times=times,
        integrator=scenario.problem.integrator,
    )
    shown = np.isin(
        recording["time"], times
    )  # the page does not show the instants of the input between its rows
    assert shown.sum() == times.size
    for column in recording:
        wanted = recording[column][shown]
        np.testing.assert_allclose(
            columns[column],
            wanted,
            atol=1e-10 * max(1e-300, np.abs(wanted).max()) + 1e-13,
            err_msg=column,
        )


def scenario_of(name):
    from airmuscle.files.library import plant_tables

    tables, location = plant_tables(name)
    return build_scenario(
        {key: tables[key] for key in ("title", "plant", "input", "run")}, location
    )


BY_HAND = """
const run = new airmuscle.PlantRun(DATA), live = run.live();
live.drive(0, 1);
for (let k = 0; k < 50; k++) live.advance(0.02);
live.drive(0, 0); live.drive(1, 0.5);
for (let k = 0; k < 50; k++) live.advance(0.02);
const again = run.scheduled(run.segmentsOf(live.schedule, live.time), 0.02);
console.log(JSON.stringify([live.schedule, live.columns, again.columns]));
"""


def test_a_run_by_hand_is_the_run_of_its_schedule(tmp_path):
    """To the tolerance of the integrator: a run by hand meets every row with a step, the schedule
    interpolates.
    """
    sheet = sheet_of_any("lift-dmsp-20")
    text = scripts("numbers") + sheet.pop("script") + scripts("plant-start", "plant-run") + BY_HAND
    schedule, live, again = run_script(text, sheet, tmp_path)
    assert [name for name in schedule if schedule[name]] == ["fill", "discharge"]
    for column in ("pressure", "position", "air_mass"):
        size = np.abs(live[column]).max()
        np.testing.assert_allclose(again[column], live[column], atol=2e-5 * size)


OWN = f'title = "own"{LIFT}'
START = """
const run = new airmuscle.PlantRun(DATA[0]);
for (const [path, value] of Object.entries(DATA[1])) run.set(DATA[0].parameters.find((row) => row.path === path), value);
console.log(JSON.stringify([run.initial.settled, Array.from(run.initial.state), Array.from(run.values)]));
"""
CHANGES = {
    "lift-dmsp-20": (
        {"mechanism.mass": 17.0},
        {
            "muscle.contractile.geometry.radius": 0.012,
            "ambient.pressure": 9e4,
            "ambient.temperature": 310.0,
        },
    ),
    "joint-dmsp-20-proportional": ({"mechanism.weight_torque": 4.0, "mechanism.radius": 0.035},),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_run_with_other_parameters_begins_at_their_equilibrium(name, tmp_path):
    sheet = sheet_of_any(name)
    text = scripts("numbers") + sheet.pop("script") + scripts("plant-start", "plant-run") + START
    scenario = scenario_of(name)
    pressure = 2.5e5 if name.startswith("joint") else 0.0
    for changes in CHANGES[name]:
        settled, state, values = run_script(text, [sheet, changes], tmp_path)
        plant = with_parameters(scenario.plant, values)
        expected = am.find_equilibrium(plant, pressure=pressure)
        assert settled
        for variable, found in zip(plant.states, state, strict=True):
            assert found == pytest.approx(
                expected[variable.name], rel=1e-8, abs=1e-9 * variable.nominal
            )


def test_a_start_that_the_page_cannot_find_is_the_original_one(tmp_path):
    """The volume of a wall that lags depends on the parameters as well."""
    wall = 'wall = { model = "ViscoelasticWall", compliance = 5e-9, time_constant = 0.1 }'
    muscle = 'muscle = "dmsp-20-300"'
    assert muscle in OWN
    sheet = sheet_of_scenario_text(
        OWN.replace(muscle, f'muscle = {{ library = "dmsp-20-300", {wall} }}')
    )
    text = scripts("numbers") + sheet.pop("script") + scripts("plant-start", "plant-run") + START
    settled, state, _ = run_script(text, [sheet, {"mechanism.mass": 7.0}], tmp_path)
    assert not settled
    assert run_script(text, [sheet, {}], tmp_path)[:2] == [True, state]


def test_a_scenario_of_a_user_is_read_with_its_parameters():
    sheet = sheet_of_scenario_text(OWN)
    rows = {row["path"]: row for row in sheet["parameters"]}
    assert rows["mechanism.mass"]["value"] == 5.0
    assert len(rows["muscle.contractile.geometry.radius"]["places"]) == 2
    assert sheet["own_text"] == OWN
    values = list(sheet["values"])
    values[rows["mechanism.mass"]["places"][0]] = 7.5
    parts = sheet["toml"]
    written = tomllib.loads(
        fill_template(parts["plant"], values) + parts["input"] + "\n" + parts["run"]
    )
    scenario = build_scenario(written, Location("page", "", Path()))
    assert scenario.plant.mechanism.mass == 7.5
    np.testing.assert_array_equal(flatten(scenario.plant), values)


def test_every_plant_of_the_page_is_simulated_by_its_name():
    offered = [row["name"] for row in library_list()["plants"]]
    assert "lift-dmsp-20" in offered
    assert [load_scenario(name).title for name in offered] == [
        row["title"] for row in library_list()["plants"]
    ]


CONTROLLED = """
const run = new airmuscle.PlantRun(DATA[0]);
for (const [path, value] of Object.entries(DATA[1])) run.set(DATA[0].parameters.find((row) => row.path === path), value);
const r = run.controlled(DATA[0].duration, 0.005);
console.log(JSON.stringify([r.status, r.columns]));
"""


@pytest.mark.parametrize("example", ["pressure_loop", "joint_cascade"])
def test_an_own_scenario_runs_under_its_controller_also_with_other_parameters(example, tmp_path):
    """With the drivers and sensors of the file, as the library computes it, to the tolerance of the
    integrator.
    """
    given = (EXAMPLES / f"{example}.toml").read_text(encoding="utf-8")
    # with a gain of 1.5 a pulse is as long as the delay of the valve, to rounding
    given = given.replace('"1.5 1/bar"', '"1.6 1/bar"')
    sheet = sheet_of_scenario_text(given)
    script = (
        scripts("numbers") + sheet.pop("script") + scripts("plant-start", "plant-run") + CONTROLLED
    )
    path = "mechanism.mass" if example == "pressure_loop" else "mechanism.inertia"
    row = next(row for row in sheet["parameters"] if row["path"] == path)
    for value in (row["value"], 1.4 * row["value"]):
        status, columns = run_script(script, [sheet, {path: value}], tmp_path)
        values = list(sheet["values"])
        for place in row["places"]:
            values[place] = value
        written = (
            fill_template(sheet["toml"]["plant"], values)
            + sheet["toml"]["input"]
            + "\n"
            + sheet["toml"]["run"]
        )
        recording = build_scenario(tomllib.loads(written), Location("page", "", Path())).simulate()
        assert status == 0
        _, own, other = np.intersect1d(
            np.round(columns["time"], 9), np.round(recording["time"], 9), return_indices=True
        )
        np.testing.assert_allclose(
            columns["time"], 0.005 * np.arange(1 + round(sheet["duration"] / 0.005)), atol=1e-9
        )
        assert own.size > 100
        name = "pressure" if example == "pressure_loop" else "angle"
        np.testing.assert_allclose(
            np.array(columns[name])[own],
            recording[name][other],
            atol=1e-6 * np.ptp(recording[name]),
        )


def test_a_saved_page_contains_everything(tmp_path):
    file = export_page(["dmsp-20-300", "lift-dmsp-20"], tmp_path / "page.html")
    page = file.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
    assert "unsafe" not in policy
    assert "default-src 'none'" in policy
    assert policy.count("sha256-") == page.count("<script>") + page.count("<style>")
    assert not re.search(r'<(?:script|link|img)[^>]*(?:src|href)="(?!data:)', page)
    assert "Permission is hereby granted" in page
    assert page.count("airmusclePrograms[") >= 2


def test_a_page_that_cannot_be_written_leaves_no_file(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        export_page(["dmsp-20-300"], tmp_path / "missing" / "page.html")
    with pytest.raises(ParameterError, match="give at least one name"):
        export_page([], tmp_path / "page.html")
    with pytest.raises(ParameterError, match="allowed range: at most 12"):
        export_page(["dmsp-20-300"] * 13, tmp_path / "page.html")
    assert list(tmp_path.iterdir()) == []


def luminance(colour):
    """Relative luminance of #rrggbb, WCAG 2.2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


def contrast(a, b):
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_colours_of_the_page_have_the_contrast_of_wcag_aa(theme):
    """4.5 for texts, 3 for curves and edges of fields."""
    block = re.findall(
        r":root[^{]*\{(.*?)\}", (WEB / "style.css").read_text(encoding="utf-8"), re.DOTALL
    )[theme]
    colours = dict(re.findall(r"--([\w-]+): (#\w{6})", block))
    texts = [(a, b) for a in ("ink", "soft", "accent") for b in ("card", "ground")]
    texts += [
        ("on-accent", "accent"),
        ("ink", "wash"),
        ("error", "error-wash"),
        ("soft", "wash"),
        ("card", "ink"),
    ]
    curves = [(f"c{i}", "card") for i in range(1, 7)] + [("edge", "card"), ("edge", "ground")]
    pairs = [*((pair, 4.5) for pair in texts), *((pair, 3.0) for pair in curves)]
    assert {
        pair: c
        for pair, least in pairs
        if (c := contrast(colours[pair[0]], colours[pair[1]])) < least
    } == {}


def test_the_command_writes_a_page_and_names_a_missing_package(tmp_path, monkeypatch):
    file = tmp_path / "page.html"
    done = airmuscle("studio", "tondu-lopez", "--export", file)
    assert (done.exit_code, done.stdout) == (0, f"page: {file}\n")
    assert file.read_text(encoding="utf-8").startswith("<!doctype html>")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    done = airmuscle("studio")
    assert done.exit_code == 1
    assert (
        "error: the studio needs starlette and uvicorn. Install them: pip install starlette uvicorn"
        in done.stderr
    )


@pytest.mark.parametrize("name", ["unknown-muscle", "matrix-821", "missing.toml"])
def test_the_command_names_what_cannot_be_shown(name):
    done = airmuscle("studio", name, "--no-browser")
    assert done.exit_code == 1
    assert done.stderr.startswith("error: ")
    assert name in done.stderr


def test_the_loop_of_a_scenario_has_the_margins_of_the_library():
    """Equal to those that are computed here, at the end of the run; OnOffController has no slope
    anywhere.
    """
    path = EXAMPLES / "joint_cascade.toml"
    scenario = load_scenario(path)
    done = am.solve(scenario.problem)
    linear = linearise_loop(
        scenario.plant, scenario.problem.input, done.final_state, control_state=done.control_state
    )
    found = linear.margins()
    shown = sheet_of_scenario_text(path.read_text())["loop"]
    values = {name: float(value) for name, value, _ in shown["rows"]}
    assert values["gain margin"] == pytest.approx(found.gain, rel=1e-3)
    assert values["phase margin"] == pytest.approx(np.degrees(found.phase), rel=1e-3)
    assert values["delay margin"] == pytest.approx(1e3 * found.delay, rel=1e-3)
    assert values["sensitivity peak"] == pytest.approx(found.peak, rel=1e-3)
    assert [base64.b64decode(each.partition(",")[2])[:5] for each in shown["figures"]] == [
        b"<?xml"
    ] * 2
    text = (EXAMPLES / "pressure_loop.toml").read_text()
    assert "with valves open by 0.01" in (once := sheet_of_scenario_text(text))["loop"]["text"]
    assert sheet_of_scenario_text(text)["id"] == once["id"], "equal scenarios have one sheet"
    switched = text.replace('model = "PID"', 'model = "OnOffController"').replace(
        'gain = "1.5 1/bar"', 'hysteresis = "0.1 bar"'
    )
    row = sheet_of_scenario_text(re.sub("integral_time.*", "", switched))["loop"]
    assert row["text"].startswith("There are no margins: linearise_loop: ")
    assert row["figures"] == []
    assert sheet_of_any("lift-dmsp-20")["loop"] is None
