"""Sheet of a plant: a scenario with its printed program, names, units and start, for a run in the
page.
"""

import base64
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ...core import AirmuscleError, ParameterError, cite, leaves, plotting
from ...files.library import Location, part_toml, tables_toml
from ...files.scenario.scenario import TABLES, Scenario, build_scenario, initial_pressure
from ...recording.columns import display_scale
from ...report.shown import value_cells
from ..export.write import make_run
from .law_sheet import parameter_row, sampled_outline, toml_template, with_script

NAMES = ("states", "inputs", "outputs", "run", "Solver", "prepare", "outputsOf", "SIZES")
"""What the page uses of a printed program; of one with a controller also the run of the loop."""
MAX_DURATION = 1000.0
MAX_PARAMETERS = 120
"""Longest run in the page [s], and maximum number of parameters with a slider (chosen)."""
OUTLINE_CONTRACTIONS = 31
OUTLINE_POINTS = 25
"""Grid of an outline (chosen)."""
OPENED = 0.01
"""Opening of the filling valves at whose closed position a loop has no slope (chosen)."""


def sheet_of_tables(
    tables: Mapping[str, Any],
    location: Location,
    name: str,
    sources: Mapping[str, str],
    text: str = "",
) -> dict[str, Any]:
    """The sheet of the tables of a scenario. Raises ParameterError for a run that the page cannot
    carry out.
    """
    scenario = build_scenario(tables, location)
    if scenario.problem.duration > MAX_DURATION:
        raise ParameterError(
            f"{location}: the run lasts {scenario.problem.duration:g} s; allowed range in the page:"
            f" up to {MAX_DURATION:g} s."
        )
    program = make_run(scenario.problem, name="plant", title=scenario.title, with_loop=True)
    module = am.outlets.JavaScript().run_files(program)["plant.mjs"]
    plant = scenario.plant
    system = program.system
    columns = list[dict[str, Any]]()
    for column in system.known.column_names:
        si_unit = system.units[column]
        usual = {"rad": (180.0 / np.pi, "deg"), "Pa": (1e-3, "kPa")}.get(
            si_unit, display_scale(column)
        )
        factor, unit = usual if usual[1] else (1.0, si_unit)
        columns.append(
            {"name": column, "factor": factor, "unit": "" if unit in ("1", "-") else unit}
        )
    sheet: dict[str, Any] = {
        "plant": True,
        "name": name,
        "title": scenario.title,
        "provenance": str(tables.get("provenance", "the file of the user")),
        **{key: str(tables.get(key, "")) for key in ("note", "warning")},
        "start_equilibrium": initial_pressure(tables, location, plant) is not None,
        "duration": scenario.problem.duration,
        "values": system.defaults.tolist(),
        "temperature_index": [leaf.path for leaf in leaves(plant)].index("ambient.temperature"),
        "parameters": _parameter_rows(plant, sources),
        "inputs": _input_rows(plant),
        "controlled": program.loop is not None,
        "columns": columns,
        "muscles": [_muscle_row(plant, i) for i in range(len(plant.muscles))],
        "mechanism": _mechanism_row(plant),
        "references": [str(reference) for reference in cite(plant)],
        "toml": {
            "plant": toml_template(lambda model: part_toml("plant", model), plant),
            "input": tables_toml({"input": tables.get("input", {})}),
            "run": tables_toml({"run": tables["run"]}),
        },
        "own_text": text,
        "loop": _loop_row(scenario),
    }
    return with_script(sheet, module, (*NAMES, "simulate") if program.loop else NAMES)


def sheet_of_plant(tables: Mapping[str, Any], location: Location, name: str) -> dict[str, Any]:
    """The sheet of the tables of a plant of the library, or of a file of the same form."""
    scenario = {key: tables[key] for key in TABLES if key in tables}
    sheet = sheet_of_tables(scenario, location, name, tables.get("sources", {}))
    return {**sheet, **{key: str(tables.get(key, "")) for key in ("provenance", "note", "warning")}}


def _parameter_rows(plant: am.Plant, sources: Mapping[str, str]) -> list[dict[str, Any]]:
    """The parameters of a plant by their paths, with the places of their values; tables of
    coefficients are left out. A geometry that a muscle shares with its law is one parameter at two
    places."""
    known = list(leaves(plant))
    places = {leaf.path: i for i, leaf in enumerate(known)}
    rows = []
    for i, leaf in enumerate(known):
        geometry_path = leaf.path.replace(".contractile.geometry.", ".geometry.")
        law = re.sub(r"^(muscle(?:\[\d+\])?)\.geometry\.", r"\1.contractile.geometry.", leaf.path)
        twin = places.get(law) if law != leaf.path else None
        if leaf.path.endswith("]") or any(
            part in leaf.path for part in ("validity_range", ".ratings.")
        ):
            continue
        if twin is not None and known[twin].value == leaf.value:
            continue
        shared = (
            [places[geometry_path]]
            if geometry_path != leaf.path
            and geometry_path in places
            and known[places[geometry_path]].value == leaf.value
            else []
        )
        path = re.sub(
            r"\[\d+\]", "", leaf.path
        )  # its source is that of the longest path in [sources] that begins it
        matching = [key for key in sources if path == key or path.startswith(f"{key}.")]
        source = sources[max(matching, key=len)] if matching else "the model or its entry"
        rows.append({**parameter_row(leaf.path, leaf, source), "places": [i, *shared]})
    order = ("mechanism", "circuit", "ambient", "gas", "muscle", "")
    rows.sort(
        key=lambda row: next(i for i, part in enumerate(order) if row["path"].startswith(part))
    )
    return rows[:MAX_PARAMETERS]


def _input_rows(plant: am.Plant) -> list[dict[str, Any]]:
    rows = []
    for variable in plant.input_variables:
        low, high = (
            end if np.isfinite(end) else None for end in (variable.minimum, variable.maximum)
        )
        unit = "" if variable.unit == "1" else variable.unit
        rows.append({"name": variable.name, "unit": unit, "minimum": low, "maximum": high})
    return rows


def _muscle_row(plant: am.Plant, index: int) -> dict[str, Any]:
    muscle = plant.muscles[index]
    prefix = plant.prefixes[index]
    paths = [leaf.path for leaf in leaves(plant)]
    start = "muscle" if not isinstance(plant.muscle, tuple) else f"muscle[{index}]"
    ends = (f"{start}.geometry.resting_length", f"{start}.contractile.geometry.resting_length")
    length = next((paths.index(path) for path in ends if path in paths), None)
    value = float(muscle.geometry.resting_length)
    low, high = map(float, muscle.geometry.contraction_range)
    grid = np.linspace(max(low, -0.05), min(high, 0.45), OUTLINE_CONTRACTIONS)
    return {
        "name": muscle.name,
        "prefix": prefix,
        "length_index": length,
        "length": value,
        "outline": sampled_outline(muscle.geometry, grid, OUTLINE_POINTS, 6),
    }


def _mechanism_row(plant: am.Plant) -> dict[str, Any]:
    """The kind of the drawing, and the coordinates."""
    mechanism: Any = plant.mechanism
    while hasattr(mechanism, "inner"):
        mechanism = mechanism.inner
    kinds = {1: (am.HangingMass, "lift"), 2: (am.physics.AntagonisticJoint, "joint")}
    drawn, word = kinds.get(len(plant.muscles), ((), ""))
    radius = getattr(mechanism, "radius", None)
    return {
        "model": type(plant.mechanism).__name__,
        "kind": word if isinstance(mechanism, drawn) else "muscles",
        "coordinates": [c.name for c in plant.mechanism.coordinates],
        "radius": float(radius) if isinstance(radius, float) else 0.04,
    }


def _loop_row(scenario: Scenario) -> dict[str, Any] | None:
    """Margins, Bode and Nyquist plot of the loop of a scenario, linearised where its run ends; the
    reason without them. Where valves are closed there, whose slopes differ on both sides, they are
    open by OPENED. None without a loop.
    """
    loop = scenario.problem.input
    if not isinstance(loop, am.engine.ControlLoop):
        return None
    done = am.solve(scenario.problem)
    opened = {name: OPENED for name in loop.controller.inputs if name.rpartition(".")[2] == "fill"}
    reason = "the run of the scenario ended early."
    for where, options in (
        ("where its run ends", {"control_state": done.control_state}),
        (f"where its run ends, with valves open by {OPENED:g}", {"inputs": opened}),
    ):
        try:
            linear = am.control.linearise_loop(scenario.plant, loop, done.final_state, **options)
            values = linear.margins().chapter().values
        except AirmuscleError as error:
            reason = str(error)
            continue
        rows = [(value.name, *value_cells(value)) for value in values]
        text = f"Open loop at {linear.laws[0].measured[0]}, linearised {where}."
        return {
            "text": text,
            "rows": rows,
            "figures": [svg_uri(linear.bode()), svg_uri(linear.nyquist())],
        }
    return {"text": f"There are no margins: {reason}", "rows": [], "figures": []}


def svg_uri(figure: Any) -> str:
    """A Matplotlib figure as an address of its SVG text; equal content gives equal texts."""
    return f"data:image/svg+xml;base64,{base64.b64encode(plotting.rendered(figure, ('svg',))['svg']).decode()}"  # noqa: E501
