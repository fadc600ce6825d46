"""Every component of a plant can be written into a scenario file, and what is read from there is
the same plant.

The file is written with SI numbers here; the words of an error and units as text are the matter of
test_scenario.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plants import EXAMPLES
from widths import widened

from airmuscle.errors import ParameterError
from airmuscle.files import load_scenario
from airmuscle.files.library import (
    Location,
    build_plant,
    model_class,
    model_names,
    read_toml,
    write,
)


def text_of(plant):
    places = "".join(f', "{c.name}" = "0.005 {c.unit}"' for c in plant.mechanism.coordinates)
    start = f'initial_state = {{ pressure = "2 bar"{places} }}' if places else ""
    tables = write.part_toml("plant", plant)
    return f'{tables}\n[run]\nduration = "20 ms"\noutput_times = "5 ms"\n{start}\n'


def written(name, folder):
    file = folder / "plant.toml"
    file.write_text(text_of(EXAMPLES[name]), encoding="utf-8")
    return file


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_plant_in_a_file_is_the_plant(name, tmp_path):
    file = written(name, tmp_path)
    assert (
        build_plant(read_toml(file)["plant"], Location(str(file), "plant", tmp_path))
        == EXAMPLES[name]
    )


DIFFERENT = {
    "stop, lagging wall",
    "Maxwell slip",
    "closed",
    "held for good",
    "tube with inertia",
    "overlap",
    "manifold on tank and regulator",
    "prescribed",
    "load in another program",
    "arm",
    "muscles in series",
}
"""Plants that differ in their states, inputs and starts: one muscle or several, without inputs,
without coordinates.
"""


@pytest.mark.parametrize("name", widened(EXAMPLES, lambda name: name in DIFFERENT))
def test_a_plant_in_a_file_runs(name, tmp_path):
    scenario = load_scenario(written(name, tmp_path))
    assert scenario.plant == EXAMPLES[name]
    run = scenario.simulate()
    assert run["time"][-1] == pytest.approx(0.02)
    assert all(np.isfinite(run[column]).all() for column in run)


TUBE = """
[plant]
muscle = { library = "dmsp-20-300", series = { model = "SeriesSpring", stiffness = "200 N/mm" }, damper = "Serres2009Damper", stop = { model = "EndStop", contraction = "20 %", contact = { model = "HuntCrossley", stiffness = 1e9 } } }
gas = { model = "EnergyBalance", heat_transfer = "0.5 W/K" }
[plant.circuit]
model = "WithTubes"
tube = { model = "DistributedTube", length = "1.5 m", diameter = "4 mm", segment_count = 5 }
[plant.circuit.circuit]
model = "ThreePositionValve"
supply = { model = "Tank", volume = "5 l", feed = { model = "TubeOrifice", length = "3 m", diameter = "6 mm" }, supply = { model = "Supply", pressure = "7 bar" } }
fill = { library = "matrix-821" }
discharge = { library = "matrix-821" }
[plant.mechanism]
model = "HangingMass"
mass = "10 kg"
[input]
valve = [["10 ms", 1], ["60 ms", -1]]
[run]
duration = "100 ms"
initial_state = { pressure = "2 bar" }
"""


def test_components_nest_in_a_file_with_units_as_text(tmp_path):
    file = tmp_path / "tube.toml"
    file.write_text(TUBE, encoding="utf-8")
    scenario = load_scenario(file)
    tube = scenario.plant.circuit.tube
    muscle = scenario.plant.muscle
    assert (tube.length, tube.diameter, tube.segment_count) == (1.5, 0.004, 5)
    assert muscle.series.stiffness == 2e5
    assert muscle.damper.shortening == 2900.0
    assert muscle.stop.contraction == 0.2
    run = scenario.simulate()
    assert run["tube1.pressure"].max() > run["tube5.pressure"][0] + 1e4
    assert {"supply.air_mass", "inner_contraction", "temperature", "tube3.flow"} <= set(run)


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        (
            "segment_count = 5",
            "segment_count = 0",
            r"DistributedTube: segment_count is 0; allowed range: 1 to 200",
        ),
        (
            'diameter = "4 mm"',
            'diameter = "4 m"',
            r"diameter \(D, inner diameter of the tube\) is 4 m; allowed range: 0.0005 to 0.1 m",
        ),
        (
            'tube = { model = "DistributedTube"',
            'tube = { model = "Supply", pressure = "1 bar" } #',
            r"Supply is not allowed here; a TubeModel is required",
        ),
        (
            'damper = "Serres2009Damper"',
            'damper = "LinearSpring"',
            r"LinearSpring is not allowed here; a Damper is required",
        ),
        (
            'valve = [["10 ms", 1]',
            'valve = [["10 ms", 2]',
            r"the input 'valve' is 2 .* allowed range: -1 to 1",
        ),
        (
            'supply = { model = "Tank"',
            'supply = "SharedSupply" #',
            r"SharedSupply\(\) is allowed only as the supply of a branch in a Manifold",
        ),
    ],
)
def test_what_is_wrong_with_a_component_is_said_with_its_place(right, wrong, message, tmp_path):
    file = tmp_path / "tube.toml"
    file.write_text(TUBE.replace(right, wrong), encoding="utf-8")
    with pytest.raises(ParameterError, match=message):
        load_scenario(file)


def test_the_page_of_components_names_each_with_a_line():
    page = (Path(__file__).parents[2] / "docs" / "guides/components.md").read_text(encoding="utf-8")
    parts = ("pneumatics", "muscle")
    modules = {n: model_class(n, "").__module__.split(".") for n in model_names()}
    owned = [
        "HuntCrossley",
        *(n for n, m in modules.items() if m[2] in parts and len(m) == 4 and n != "Muscle"),
    ]
    assert len(owned) > 30
    assert [n for n in owned if f"`{n}`" not in page] == []
