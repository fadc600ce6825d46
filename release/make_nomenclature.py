"""Generator of docs/reference/nomenclature.md from the declared parameters: python
release/make_nomenclature.py
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from airmuscle.core.declaration import parameters
from airmuscle.files.library.fields import model_class, model_names
from airmuscle.recording import QUANTITIES

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "nomenclature.md"
WORDS = Path(__file__).with_name("words.toml")
"""Main nouns and verbs of the program."""

ARGUMENTS = {
    "accelerations": "acceleration of each coordinate by its name [rad/s^2]",
    "axis": "axis of a joint in its frame",
    "column": "name of a column of a recording or of a plant",
    "commands": "commands of a control law by the names of the inputs",
    "controlled": "columns that a controller leads to their set points",
    "declared": "declaration of a parameter",
    "delay": "delay of a sensor [samples]",
    "deviate": "normal deviate",
    "elements": "friction of each joint",
    "first": "gauge pressure of the first of two muscles [Pa]",
    "second": "gauge pressure of the second of two muscles [Pa]",
    "index": "number of an item, from 0",
    "joint": "number of a joint of an arm, from 0",
    "outer": "control law whose commands are set points of an inner one",
    "every": "samples of the loop between those of a law",
    "jitter": "greatest random delay beyond the constant one [samples]",
    "tracking": "whether the saturation of an inner law reaches the outer one",
    "samples": "delay of set points or commands [samples]",
    "period_samples": "period of a motion [samples]",
    "lead_samples": "how much later an error is used than it was caused [samples]",
    "linear_loop": "LinearLoop at the working point",
    "scheduled": "path of the parameter that a schedule varies",
    "scheduling_column": "measured column that a schedule follows",
    "sensors": "sensors of the measured columns of a control law",
    "speed_column": "name of the column of a measured speed",
    "started": "1 after the first sample, else 0",
    "state_names": "names of the states of an observer",
    "disturbed": "states to whose rates an observer adds an unknown disturbance",
    "weighted": "states and inputs with a weight in the cost of a design",
    "noisy": "states and disturbances with process noise",
    "limited": "columns with limits",
    "bounded": "states whose rates have a bounded disturbance",
    "horizon": "number of samples of a prediction",
    "blocks": "numbers of samples over which planned inputs are held",
    "stuck_input": "input whose valve sticks",
    "wanted": "wanted output of an operator",
    "ax": "Matplotlib Axes into which a plot is drawn, or a sequence of them",
    "acceleration_setpoint": "name of the set point of an acceleration",
    "load_setpoint": "name of the set point of a load",
    "mean_setpoint": "name of the set point of the mean pressure of two muscles",
    "rate": "name of the set point of the rate of a signal",
    "setpoint_names": "names of the set points of a control law",
    "feed_forward": (
        "control law without measurement, whose commands are added to those of the feedback"
    ),
    "feedback": (
        "control law with measurement, whose commands are added to those of the feed-forward"
    ),
    "inverse": "static inverse of a muscle",
    "law": "law that another object contains: a control law or a force law",
    "laws": "control laws side by side",
    "comments": "whether a file begins with comments that state origin, constants and notes",
    "steps": "number of steps of an iterative method",
    "air_states": "air states (pressure, temperature) of the segments of a tube",
    "at": "evaluation of a plant: muscles, circuits, forces and accelerations at one state",
    "air": "air state: absolute pressure and temperature",
    "inlet": "air state at the supply",
    "flow": "inflow: mass flow [kg/s] and enthalpy flow [W]",
    "drawn": "flow drawn from a supply",
    "volume_rate": "rate of change of a volume [m3/s]",
    "position": "position of a spool, or output of a lag",
    "branches": "circuits on one supply",
    "tube": "tube model between valve and muscle",
    "segment_count": "number of segments of a tube",
    "leak": "orifice that is always open",
    "valve": "orifice with a variable opening",
    "spool": "lag of the spool of a valve behind its command",
    "lag": "lag of a set point",
    "muscle_count": "number of muscles",
    "population": "law of the mean muscle of a type, without the effects of specimens",
    "effects": "effects of specimens: what each adds to the law of the population",
    "specimens": "names of the measured muscles of a type",
    "feed": "orifice that feeds a tank",
    "creep": "creep elements in parallel with a muscle",
    "wall": "wall model: volume in addition to that of the geometry",
    "series": "series element between contractile element and load",
    "stop": "end stop of a muscle",
    "contact": "contact law",
    "depth": "contact depth [m]",
    "links": "links of an arm, from the first joint to the tip",
    "routes": "routes of the muscles over the joints of an arm, one for each muscle",
    "joints": "numbers of the joints that a muscle crosses, from 1",
    "angles": "joint angles [rad]",
    "profile": "profile of the pulleys of a joint",
    "profiles": "profile of the pulley at each joint that a muscle crosses",
    "density": "density of the air [kg/m3]",
    "extra_damping": "damping coefficient in parallel with a damper [N s/m]",
    "stretch": "stretch of a series spring [m]",
    "inner_contraction": "contraction of the contractile element behind a series spring [1]",
    "inner_speed": "speed of shortening of the contractile element [m/s]",
    "coordinate": "name of a coordinate of a mechanism",
    "forces": "generalised forces on the coordinates of a mechanism [N, N m]",
    "values": "values by name",
    "parameters": "values of all parameters of a plant, in the order of its leaves",
    "speed": "shortening speed of a muscle [m/s], or speed of an animation, 1 for real time",
    "snapshot": "time, states and inputs of a stepper",
    "friction": "friction model of a muscle",
    "displacement": "displacement of a friction element [m]",
    "bristles": "bristle deflections of a friction model by name",
    "name": "name of an entry, a column or a component",
    "names": "several names",
    "name_or_path": "name of a library entry, or path of a file in the same format",
    "file_name": "pattern of values in the names of files",
    "displacement_zero": "reading of a displacement at the resting length [m]",
    "skip_rows": "number of lines above the headings of a file",
    "missing": "treatment of missing values: refused, left out or interpolated",
    "sample_rate": "rows per second of a file without time [Hz]",
    "grid": "quantities of a grid: of its cells, first column and headings",
    "sections": "further keys of a mapping for the files of a pattern of names",
    "drop_outliers": "whether the rows of suspected outliers are left out",
    "path": "path of a file to read or to write",
    "recording": "a measured or simulated run",
    "characteristic": "static relation between pressure, contraction and force",
    "variations": "values of parameters by path, one per plant",
    "keep": "columns of a batch to keep",
    "into": "output folder of a batch",
    "precision": "floating-point precision of a batch",
    "cores": "number of threads, at most one per core",
    "plant": "muscles, circuits, mechanism and ambient air as one system",
    "state": "states of a plant by name",
    "inputs": "inputs of a plant by name",
    "command": "input signals over time",
    "changes": "times and values of each input",
    "points": "number of points, or times and values of each input",
    "duration": "duration of a run [s]",
    "compiled": "system with its machine code",
    "control_state": "states of the controller and the drivers of a control loop",
    "controller": "controller of a control loop",
    "diagnostics": "remarks on a result: assumptions, extrapolation, an early end",
    "final_state": "state at the end of a run",
    "final_time": "time of the final state [s]",
    "initial_state": "initial state of a run",
    "initial_states": "initial states of the plants of a batch",
    "input": "input signal or control loop of a run",
    "integrator": "numerical integrator",
    "known": "units of the known columns",
    "muscles": (
        "states of all muscles of a plant; air states (pressure, temperature) of those of a circuit"
    ),
    "other_inputs": "signal of the inputs that no controller commands",
    "output_times": "sample time [s] or times [s] of the recorded rows",
    "period": "period of a signal [s]",
    "sample_time": "sample time of a controller [s]",
    "setpoint": "reference signal of a controller",
    "setpoints": "set points of a sample, by name",
    "statistics": "steps of the integrator",
    "status": "how a computation ended",
    "system": "system of ordinary differential equations",
    "start": "initial state of a run",
    "start_time": "initial time of a run [s]",
    "dt": "duration of one step [s]",
    "method": "numerical integrator",
    "output": "sample time [s] or times [s] of the recorded rows",
    "complete": "whether a run that ends early raises an error",
    "obj": "any object of airmuscle",
    "muscle": "one muscle, or a tuple of muscles",
    "orifice": "flow restriction",
    "valves": "valves to be combined into one",
    "kv": "flow coefficient Kv [m3/h of water at 1 bar]",
    "cv": "flow coefficient Cv [US gal/min of water at 1 psi]",
    "area": "effective area of a valve [m2]",
    "diameter": "diameter [m]",
    "discharge_coefficient": "ratio of effective to geometric area [1]",
    "volume_flow": "volume flow at the reference atmosphere [m3/s]",
    "circuit": "pneumatic circuit of a muscle, or a tuple of circuits",
    "mechanism": "mechanical load of the muscles",
    "gas": "gas model of the air",
    "ambient": "ambient pressure and temperature",
    "geometry": "enclosed volume and outline as functions of contraction",
    "contractile": "characteristic of the contractile element of a Hill muscle",
    "spring": "parallel spring",
    "damper": "parallel damper",
    "supply": "source of compressed air",
    "fill": "valve between supply and muscle",
    "discharge": "valve between muscle and ambient air",
    "inner": "model inside a wrapper",
    "upstream": "absolute pressure upstream of a valve [Pa]",
    "downstream": "absolute pressure downstream of a valve [Pa]",
    "opening": "opening of a valve, 0 closed to 1 open",
    "resting_lengths": "resting length of every muscle [m]",
    "q": "generalised coordinates by name",
    "v": "generalised velocities by name",
    "tensions": "tension of every muscle [N]",
    "ports": "pneumatic and mechanical state of every muscle",
    "coordinates": "coordinates and velocities by name",
    "entry": "one file of the library",
    "key": "short name of a reference",
    "authors": "authors of a reference",
    "title": "title of a reference, a file or a table",
    "where": "journal, proceedings, report or standard of a reference",
    "year": "year of a reference",
    "doi": "DOI of a reference",
    "note": "remark for the user",
    "columns": "columns of a recording by name",
    "constants": "constant quantities of a recording",
    "origin": "source of a recording",
    "location": "place in a file or in arguments that an error message begins with",
    "notes": "remarks on a recording or a fit",
    "headings": "headings in the file, by column name, that are no names of a quantity",
    "references": "sources: of published measurements, or of the models of a simulation",
    "selection": "selected rows",
    "specimen": "name of the measured muscle",
    "loss": "loss function of the residuals",
    "censoring": "treatment of saturated observations",
    "resolution": "resolution of a sensor",
    "prepared": "a system with its compiled functions",
    "segments": "piecewise linear input signals",
    "times": "times of the recorded rows, or time constants [s]",
    "tables": "tables of a file",
    "source": "file, files, glob pattern or folder to read",
    "mapping": (
        "columns, units and constants that a file does not state, or the path of a TOML file with"
        " them"
    ),
    "delimiter": "delimiter between the cells of a text file",
    "decimal": "decimal separator of a text file",
    "sheet": "worksheet of an Excel file",
    "group": "group of a TDMS or MDF file, struct of a MAT file, segment of an LVM file",
    "downsampling": "downsampling of long files",
    "ordered": "whether time must increase",
    "progress": "function called with the progress of reading",
    "along": "normalised position along an outline, -1 to 1 [1]",
    "angle_squared": "square of the half angle of a circular meridian [rad2]",
    "arc_excess": "arc integral of the radius minus its resting value [m2]",
    "arc_excess_squared": "arc integral of the square of the radius minus its resting value [m3]",
    "condition": "condition number of the scaled design matrix",
    "correlations": "correlation matrix of the fitted parameters",
    "degree": "total degree of a polynomial",
    "direction": "direction of motion, or the quantity in which residuals are evaluated",
    "end_radius": "radius at the ends of a straight-fibre muscle [m]",
    "error": "error of a surrogate or of a residual",
    "estimates": "estimates with their standard errors",
    "parameter_covariance": "covariance of the estimates and what it was estimated from",
    "fibre_length": "length of the fibres of one segment [m]",
    "fibre_sum": "sum of the sines of the fibre angles",
    "fibres": "number of fibres",
    "correlation_index": "correlation indices IK and R^2 of a fit",
    "fitted_quantity": "quantity whose residuals are minimised, with its arguments",
    "residual": "residual in the SI unit of the fitted quantity",
    "fields": "fields of a mapping that replace its own",
    "fixed": "parameters excluded from a fit",
    "force_degree": "degree of a polynomial in force",
    "pressure_degree": "degree of a polynomial in pressure",
    "meridian": "meridian of a straight-fibre muscle",
    "model": "the fitted characteristic or muscle",
    "pressure_unit": "unit of pressure [Pa]",
    "rank": "rank of the design matrix",
    "rings": "number of rings that divide a muscle into equal segments",
    "rmse": "root mean square error",
    "rows_censored": "number of saturated rows",
    "rows_dropped": "number of omitted rows",
    "findings": "what rules find in a fit and its data, or the examination that gives it",
    "remarks": "notes on a fit and scatter of its data, or the examination that gives them",
    "rubber": "relation between hoop stress and strain of the rubber",
    "rubber_integral": "path of integration of the hoop stress, axis or arc",
    "segment": "shape and integrals of one segment between two rings",
    "sigma": "standard deviation of the measurement noise",
    "surrogate_of": "name of the model approximated by a surrogate",
    "ratings": "values that the maker of the muscle permits",
    "validity_range": "rectangle of pressure and contraction",
    "by": "resampling unit of a bootstrap",
    "candidates": "models to be compared",
    "cells": "subdivision of the validity range in pressure and contraction",
    "change": "length-dependent correction of a force law",
    "free": "points of free contraction",
    "leave_out": "groups of a cross-validation",
    "level": "confidence level",
    "other": "model that another is converted into",
    "problem": "definition of a fit",
    "recordings": "one or more runs",
    "refits": "number of bootstrap samples",
    "seed": "seed of the random number generator",
    "strain": "hoop strain [1]",
    "surface": "polynomial surface",
    "unit": "SI unit of a column; None: as recorded",
    "units": "units of columns whose headers state none",
    "functions": "functions of time by input",
    "drivers": "driver between the command and the opening of each input",
    "signal": "one input over time",
    "memory": "internal state of a driver or a controller",
    "measurement": "measured values at a sampling instant",
    "measured": "controlled variable: state or output measured by a controller",
    "commanded": (
        "manipulated variable: input commanded by a controller, or two inputs by SplitRange"
    ),
    "positive": "input for positive controller outputs",
    "negative": "input for negative controller outputs",
    "excess": "integral of the radius minus its resting value along a path [m2]",
}
"""Arguments of public functions that are neither a declared parameter nor a measurable quantity."""


def rows(cells: list[tuple[str, ...]]) -> str:
    """Lines of a Markdown table."""
    return "\n".join("| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in cells)


def table(header: tuple[str, ...], cells: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return f"{rows([header])}\n{rows([('---',) * len(header)])}\n{rows(cells)}\n"


def bounds(low: float, high: float) -> str:
    """Bounds as text; empty if there are none."""
    return "" if (low, high) == (-float("inf"), float("inf")) else f"{low:g} to {high:g}"


def page() -> str:
    """The text of the page."""
    parts = [
        "# Names, symbols and units\n",
        "Generated from the code by `release/make_nomenclature.py`; all values are in SI units.\n",
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
        "The units `u`, `y` and `u/y` of a controller depend on its loop: `u` is the unit of the"
        " commanded input, `y` that of the measured column.\n"
    )
    for name in model_names():
        declared = (
            parameters(model_class(name, "nomenclature"))
            if hasattr(model_class(name, ""), "__dataclass_fields__")
            else ()
        )
        if declared:
            parts.append(f"### {name}\n")
            cells = [
                (f"`{p.name}`", p.unit, p.symbol, p.meaning, bounds(*p.bounds)) for p in declared
            ]
            parts.append(table(("name", "unit", "symbol", "meaning", "allowed"), cells))
    for title, words in tomllib.loads(WORDS.read_text(encoding="utf-8")).items():
        parts.append(f"## Words of the code: {title}\n")
        parts.append(table(("word", "meaning"), list(words.items())))
    parts.append("## Arguments\n")
    parts.append(
        table(
            ("name", "meaning"), [(f"`{n}`", meaning) for n, meaning in sorted(ARGUMENTS.items())]
        )
    )
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
