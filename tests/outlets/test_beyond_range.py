"""Beyond the range of a law the printed programs move a plant as NumPy and the machine code do.

Each law hangs a mass at seeded points of pressure and contraction, stretched, slack, and far above
the rated pressure. Scale of a deviation: the greatest rate of its column.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import plants
import printed
import pytest

from airmuscle.engine.compile import compile_system, functions
from airmuscle.engine.compile.text import languages
from airmuscle.errors import AirmuscleWarning
from airmuscle.physics import Ratings, ValidityRange

LAWS = (
    "chou-hannaford",
    "dmsp-20-300",
    "reynolds2003",
    "serres2009",
    "sarosi",
    "surface",
    "circle",
)
STATED = ValidityRange(0.5e5, 6e5, 0.0, 0.2)
JAVASCRIPT = """
import * as M from "./models.mjs";
import {readFileSync} from "fs";
const d = JSON.parse(readFileSync("data.json"));
const c = new Float64Array(d.held);
M.prepare(d.parameters, c);
console.log(JSON.stringify(d.states.map((x, i) => {
  const f = new Float64Array(x.length), J = new Float64Array(d.jacobian);
  M.jac(x, d.inputs[i], c, f, J);
  return [...f];
})));
"""


def plant_of(name):
    plant = plants.EXAMPLES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        muscle = replace(plant.muscle, validity_range=STATED, ratings=Ratings(max_force=1500.0))
        return replace(plant, muscle=muscle)


def points_beyond(name, plant, count=40):
    """States and inputs; the braid ends at -10 %, straight fibres end at 0."""
    rng = np.random.default_rng(5)
    length = plant.muscle.geometry.resting_length
    low = 1e-5 if name == "circle" else -0.09
    states = []
    for pressure, contraction in zip(
        rng.uniform(0.0, 12e5, count), rng.uniform(low, 0.45, count), strict=True
    ):
        state = plant.state_at(pressure=float(pressure), position=float(contraction * length))
        states.append([{**state, "speed": 0.02}[s.name] for s in plant.states])
    return np.array(states), np.full((count, len(plant.inputs)), 0.3)


@pytest.mark.parametrize("name", LAWS)
def test_every_printed_program_has_the_force_beyond_the_range(name, tmp_path):
    plant = plant_of(name)
    states, inputs = points_beyond(name, plant)
    ready = compile_system(plant)
    numbers = np.array(
        [
            [
                plant.rates(
                    dict(zip((s.name for s in plant.states), x.tolist(), strict=True)),
                    dict(zip(plant.inputs, u.tolist(), strict=True)),
                )[s.name]
                for s in plant.states
            ]
            for x, u in zip(states, inputs, strict=True)
        ]
    )
    found = {"machine code": [ready.rates(x, u) for x, u in zip(states, inputs, strict=True)]}
    text, sizes = functions.system_module(ready.program.traced, languages.CLanguage(public=None))
    library = printed.shared_library("#include <math.h>\n" + text, tmp_path, level="-O0")
    held = np.zeros(sizes.held + 1)
    printed.call(library.prepare, ready.parameters, held)
    found["C"] = []
    for x, u in zip(states, inputs, strict=True):
        rates = np.zeros(sizes.states)
        printed.call(library.jac, x, np.append(u, 0.0), held, rates, np.zeros(sizes.jacobian + 1))
        found["C"].append(rates)
    text, sizes = functions.system_module(ready.program.traced, languages.JavaScriptLanguage())
    (tmp_path / "models.mjs").write_text(text)
    data = {
        "held": sizes.held + 1,
        "jacobian": sizes.jacobian + 1,
        "parameters": ready.parameters.tolist(),
        "states": states.tolist(),
        "inputs": inputs.tolist(),
    }
    found["JavaScript"] = printed.run_node(JAVASCRIPT, data, tmp_path)
    assert np.isfinite(numbers).all()
    for outlet, rates in found.items():
        scale = np.abs(numbers).max(axis=0)
        worst = (np.abs(np.array(rates) - numbers) / scale).max()
        assert worst < 1e-11, outlet
