"""Writes docs/nomenclature.md from the declared fields: python docs/make_nomenclature.py"""

from __future__ import annotations

from pathlib import Path

from airmuscle.core.declaration import parameters
from airmuscle.library.models import model_class, model_names
from airmuscle.recording import QUANTITIES

PAGE = Path(__file__).with_name("nomenclature.md")

ARGUMENTS = {
    "airs": "pressure and temperature of the air in every muscle that a circuit feeds",
    "air": "pressure and temperature of the air at one place",
    "inlet": "pressure and temperature of the air at a supply",
    "content": "what a chamber holds: its air mass, and its internal energy where the gas keeps account of it",
    "flow": "air that comes in: mass flow [kg/s] and the enthalpy that it carries [W]",
    "drawn": "flow that is drawn from a supply",
    "volume_rate": "growth of a volume in time [m3/s]",
    "place": "place of a spool [1], or what follows a command",
    "branches": "circuits on one supply",
    "tube": "volume and resistance between a valve and a muscle",
    "pieces": "number of pieces that a tube is cut into",
    "leak": "orifice that is never shut",
    "valve": "orifice that is opened and shut",
    "spool": "how the spool of a valve follows its command",
    "lag": "how something follows its command, or by what time",
    "muscles": "how many muscles are fed",
    "feed": "orifice by which a tank is filled",
    "creep": "elements that relax, in parallel with a muscle",
    "wall": "volume that a muscle has beyond its geometry's",
    "series": "what gives way between the contractile element and the load",
    "stop": "what ends a muscle's way",
    "contact": "law of a contact",
    "depth": "depth of a contact [m]",
    "density": "of the air [kg/m3]",
    "beside": "coefficient of damping beside a damper [N s/m]",
    "stretch": "stretch of a series spring [m]",
    "inner_contraction": "contraction of the contractile part [1], behind a series spring",
    "inner_speed": "speed of shortening of the contractile part [m/s]",
    "coordinate": "name of a coordinate of a mechanism",
    "pulls": "generalised forces on the coordinates of a mechanism [N, N m]",
    "values": "values by name",
    "friction": "force with memory",
    "displacement": "way that a friction element was moved [m]",
    "bristles": "states of a friction element",
    "name": "name of an entry, a column or a part",
    "names": "several such names",
    "name_or_path": "name in the library, or path of a file of the same form",
    "path": "file to read or to write",
    "recording": "one run, measured or simulated",
    "characteristic": "static law that binds pressure, contraction and force",
    "variations": "values of parameters by their paths, one a plant",
    "keep": "columns of a batch to be kept",
    "into": "folder that a batch is written to",
    "precision": "digits that a batch computes with",
    "cores": "threads, one a core",
    "plant": "muscles, circuits, mechanism and surroundings",
    "state": "values of a plant's states by name",
    "inputs": "values of a plant's inputs by name",
    "command": "what the inputs do in time",
    "changes": "instants and values of each input",
    "points": "corners of each input's course in time",
    "duration": "length of a run [s]",
    "start": "state that a run begins at",
    "start_time": "time that a run begins at [s]",
    "dt": "length of one advance [s]",
    "method": "numerical method that carries a plant through time",
    "output": "spacing or instants of the recorded rows [s]",
    "complete": "whether a run that ends early is an error",
    "thing": "any noun of airmuscle",
    "muscle": "one muscle, or a tuple of them",
    "orifice": "restriction that air flows through",
    "valves": "valves that are combined into one",
    "kv": "flow coefficient Kv [m3/h of water at 1 bar]",
    "cv": "flow coefficient Cv [US gallons a minute of water at 1 psi]",
    "area": "effective area of a valve [m2]",
    "diameter": "of a round hole [m]",
    "discharge_coefficient": "share of a hole's area that a flow takes up [1]",
    "volume_flow": "volume flow at the reference atmosphere [m3/s]",
    "circuit": "what feeds a muscle, or a tuple of them",
    "mechanism": "what the muscles pull at",
    "gas": "how the air takes up pressure",
    "ambient": "the surroundings: pressure, temperature",
    "geometry": "volume and outline from contraction",
    "contractile": "contractile characteristic of a Hill muscle",
    "spring": "parallel spring",
    "damper": "damper",
    "supply": "source of air",
    "fill": "valve from the supply",
    "discharge": "valve to the surroundings",
    "inner": "what a wrapper wraps",
    "upstream": "absolute pressure before a valve [Pa]",
    "downstream": "absolute pressure behind a valve [Pa]",
    "opening": "0 shut to 1 open",
    "openings": "opening of every valve by name",
    "resting_lengths": "resting length of every muscle [m]",
    "q": "generalised coordinates by name",
    "v": "speeds of the coordinates by name",
    "tensions": "pull of every muscle [N]",
    "ports": "pneumatic and mechanical state of every muscle",
    "coordinates": "coordinates and speeds by name",
    "entry": "one file of the library",
    "key": "short name of a reference",
    "authors": "of a reference",
    "title": "of a reference, a file or a table",
    "where": "journal, standard or place of a reference",
    "year": "of a reference",
    "doi": "of a reference",
    "note": "what the reader should know",
    "columns": "columns of a recording by name",
    "constants": "what does not change in a recording",
    "origin": "where a recording comes from",
    "notes": "what to know of a recording",
    "selection": "rows to select",
    "specimen": "name of the measured muscle",
    "loss": "how residuals are weighed",
    "censoring": "how rows cut off by a clamp are treated",
    "resolution": "smallest difference that a sensor shows",
    "prepared": "a system with its compiled functions",
    "segments": "a command cut at its instants",
    "times": "instants of the recorded rows [s]",
    "most_steps": "ceiling of the number of steps",
    "tables": "tables of a file",
    "source": "file, files, glob or folder to read",
    "mapping": "what files do not say of themselves, or a TOML file of it",
    "delimiter": "sign between the cells of a text file",
    "decimal": "decimal sign of a text file",
    "sheet": "worksheet of an Excel file",
    "group": "group of a TDMS or MDF file, struct of a MAT file",
    "downsampling": "reduction of very long files",
    "ordered": "whether time that does not increase is refused",
    "progress": "function that is told how far the reading has come",
    "along": "place along an outline, from its middle to its end [1]",
    "angle_squared": "square of half the angle that a circular outline spans [rad2]",
    "arc_excess": "integral of the radius beyond its resting value over the arc [m2]",
    "arc_excess_squared": "integral of its square over the arc [m3]",
    "condition": "condition number of a scaled design",
    "correlations": "correlation matrix of fitted parameters",
    "degree": "greatest total power of a polynomial",
    "direction": "which of pressure, contraction and force a law was fitted in",
    "end_radius": "radius at the ends of a straight-fibre muscle [m]",
    "error": "greatest error of a stand-in, or error of a residual",
    "estimates": "fitted values with their standard deviations",
    "fibre_length": "length of the fibres of one segment [m]",
    "fibre_sum": "how the fibres of a half shell add up",
    "fibres": "number of fibres",
    "fixed": "parameters that a fit leaves alone",
    "force_degree": "greatest power of force",
    "pressure_degree": "greatest power of pressure",
    "index": "correlation index",
    "meridian": "outline of a straight-fibre muscle",
    "model": "the law or muscle that was fitted",
    "pressure_unit": "size of the unit of pressure [Pa]",
    "rank": "number of directions that data determine",
    "rings": "number of rings that divide a muscle into equal segments",
    "rmse": "root mean square error",
    "rows_censored": "rows cut off by a clamp",
    "rows_dropped": "rows left out",
    "rubber": "hoop stress of the rubber against its strain",
    "rubber_integral": "whether hoop stress is summed over the axis or the arc",
    "segment": "one segment between two rings, its integrals",
    "sides": "which rows are cut off below or above",
    "sigma": "standard deviation of one reading",
    "surrogate_of": "the law that a stand-in replaces",
    "validity_range": "rectangle of pressure and contraction",
    "by": "what a bootstrap draws",
    "candidates": "laws to be compared",
    "cells": "parts of the validity range by pressure and contraction",
    "change": "law of what changes with length",
    "free": "points of free contraction",
    "leave_out": "what a cross-validation leaves out at once",
    "level": "probability that an interval states",
    "other": "law that another is converted into",
    "problem": "what a fit was asked",
    "reading": "whether the noise of a reading is added",
    "recordings": "one or several runs",
    "refits": "number of refits",
    "seed": "start of the random numbers",
    "strain": "hoop strain [1]",
    "surface": "polynomial surface",
    "unit": "SI unit in which a column is wanted; None for as it stands",
    "units": "units of columns whose headers carry none",
    "functions": "functions of time by input",
    "drivers": "what stands between the command and the opening of an input",
    "signal": "course of one input in time",
    "memory": "what a driver still has under way, or a controller remembers",
    "measurement": "what a controller is given at a sampling instant",
    "measured": "state or output that a controller measures",
    "commanded": "input that a controller commands, or two of them, by Split",
    "positive": "input that a command above zero goes to",
    "negative": "input that a command below zero goes to",
    "told": "course of all inputs before any driver",
    "lacks": "how the message about an unknown name begins",
}
"""Arguments of public functions that are neither a declared parameter nor a measurable quantity."""


def rows(cells: list[tuple[str, ...]]) -> str:
    """Lines of a Markdown table."""
    return "\n".join("| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in cells)


def table(header: tuple[str, ...], cells: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return f"{rows([header])}\n{rows([('---',) * len(header)])}\n{rows(cells)}\n"


def bounds(low: float, high: float) -> str:
    """Bounds as text; empty where there are none."""
    return "" if (low, high) == (-float("inf"), float("inf")) else f"{low:g} to {high:g}"


def page() -> str:
    """The whole page."""
    parts = [
        "# Names, symbols and units\n",
        "Generated from the code by `docs/make_nomenclature.py`; all values are SI.\n",
    ]
    parts.append("## Quantities of a recording\n")
    parts.append(
        table(
            ("name", "unit", "symbol", "meaning"),
            [(f"`{n}`", q.unit, q.symbol, q.meaning) for n, q in QUANTITIES.items()],
        )
    )
    parts.append("## Parameters of the models\n")
    parts.append(
        "The units `u`, `y` and `u/y` of a controller follow from where it stands: `u` is the unit of the input that "
        "it commands, `y` that of the column that it measures.\n"
    )
    for name in model_names():
        declared = (
            parameters(model_class(name, "nomenclature"))
            if hasattr(model_class(name, ""), "__dataclass_fields__")
            else ()
        )
        if declared:
            parts.append(f"### {name}\n")
            cells = [(f"`{p.name}`", p.unit, p.symbol, p.meaning, bounds(*p.bounds)) for p in declared]
            parts.append(table(("name", "unit", "symbol", "meaning", "allowed"), cells))
    parts.append("## Arguments\n")
    parts.append(table(("name", "meaning"), [(f"`{n}`", meaning) for n, meaning in sorted(ARGUMENTS.items())]))
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
