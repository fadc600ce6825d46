"""Models that are added to a copy of the project step by step, as AGENTS.md lists; numbers are
chosen.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

HEAD = '''"""A model of a test."""

from __future__ import annotations

from {root}core.declaration import model, parameter
'''
LAW = """from {root}core.reference import Reference
from .base import ForceLaw


@model
class {name}(ForceLaw):
    \"\"\"F = p A (1 - eps/eps_0), with effective area A.\"\"\"

    references = (Reference("dummy-2026", "Dummy, D.", "A law", "A journal", 2026),)

    area: float = parameter("m2", "A", "effective area of a test", bounds=(0.0, 1.0))

    def force(self, pressure, contraction):
        return pressure * self.area * (1.0 - contraction / 0.3)
"""
LAW_FILE = """title = "Law of a test"
provenance = "chosen"

[characteristic]
model = "{name}"
area = "10 cm^2"

[validity_range]
min_pressure = "50 kPa"
max_pressure = "600 kPa"
min_contraction = 0.0
max_contraction = "28 %"

[[check]]
quantity = "force"
pressure = "1 bar"
contraction = "15 %"
equals = "50 N"
tolerance = "0.001 N"
source = "the formula, by hand"
"""
VALVE = """from .valve import Orifice


@model
class {name}(Orifice):
    \"\"\"qm = z C (p1 - p2).\"\"\"

    slope: float = parameter("kg/(s Pa)", "C", "flow per pressure difference of a test", bounds=(0.0, 1.0))

    def mass_flow(self, upstream, downstream, opening, temperature):
        return opening * self.slope * (upstream - downstream)
"""
FRICTION = """from {root}core import ops
from {root}core.system import StateVariable
from .base import Friction
from .path import deflection


@model
class {name}(Friction):
    \"\"\"dz/dt = v - |v| z/s,  F = K z.\"\"\"

    bristle_stiffness: float = parameter("N/m", "K", "stiffness of a test", bounds=(1e-3, 1e9))
    slip: float = parameter("m", "s", "presliding distance of a test", bounds=(1e-6, 1.0))

    @property
    def states(self):
        return (StateVariable("bristle", "m", self.slip),)

    @property
    def presliding_distance(self):
        return self.slip

    def rates(self, bristles, speed):
        return {{"bristle": speed - ops.absolute_value(speed) * bristles["bristle"] / self.slip}}

    def force(self, bristles, speed):
        return self.bristle_stiffness * bristles["bristle"]

    def force_along(self, displacement, time=None):
        return self.bristle_stiffness * deflection(displacement, self.slip)
"""
CONTROLLER = """from ...engine.loop import SisoController
from ...engine.loop.control_law import Commanded, commands


@model
class {name}(SisoController):
    \"\"\"u = K (r - y).\"\"\"

    measured: str
    commanded: Commanded
    proportional_gain: float = parameter("u/y", "K", "gain of a test")

    initial_memory = {{}}

    def step(self, memory, measurement, dt):
        error = measurement.setpoints[self.measured] - measurement.columns[self.measured]
        return commands(self.commanded, self.proportional_gain * error), memory
"""


@dataclass(frozen=True)
class Recipe:
    """A kind of model: its folder, its source text, and its example in tests/plants.py; None where
    it has none.
    """

    folder: str
    text: str
    example: str | None

    @property
    def package(self) -> str:
        return self.folder.replace("/", ".")

    @property
    def root(self) -> str:
        """The package airmuscle, relative to a module of the folder."""
        return "." * (2 + self.folder.count("/"))

    @property
    def steps(self) -> tuple[str, ...]:
        library = ("library",) if self.folder == "physics/muscle/characteristic" else ()
        return (
            "file",
            "export",
            *library,
            "example" if self.example else "exemption",
            "nomenclature",
        )


RECIPES = {
    "law": Recipe("physics/muscle/characteristic", LAW, "of({name}(1e-3))"),
    "valve": Recipe(
        "physics/pneumatics", VALVE, "fed(FillDischarge(Supply(5e5), {name}(1e-8), OTHER))"
    ),
    "friction": Recipe("physics/muscle/friction", FRICTION, "of(friction={name}(5e4, 4e-4))"),
    "controller": Recipe("control/laws", CONTROLLER, None),
}


def append(path: Path, text: str) -> None:
    """Add text at the end of a file, in a stub at its beginning, where the public names are."""
    old = path.read_text(encoding="utf-8") if path.exists() else ""
    path.write_text(text + old if path.suffix == ".pyi" else old + text, encoding="utf-8")


def add(root: Path, kind: str, name: str, without: str = "") -> None:
    """Add a model to a copy of the project, by all steps but one; the nomenclature is generated
    afterwards.
    """
    recipe = RECIPES[kind]
    module = name.lower()
    source = root / "src" / "airmuscle"
    package = source / recipe.folder
    line = f"from .{module} import {name}"
    edits = {
        "file": (
            package / f"{module}.py",
            (HEAD + recipe.text).format(name=name, root=recipe.root),
        ),
        "export": (package / "__init__.pyi", f"{line} as {name}\n"),
        "library": (source / "files" / "library" / f"{module}.toml", LAW_FILE.format(name=name)),
        "example": (
            root / "tests" / "plants.py",
            f"\nfrom airmuscle.{recipe.package}{line[5:]}\nEXAMPLES['{module}'] ="
            f" {recipe.example}\n".format(name=name),
        ),
        "exemption": (
            root / "tests" / "dynamics" / "test_continuity.py",
            f'\nNOT_IN_A_PLANT["{name}"] = ("{name}",)\n',
        ),
    }
    for step in recipe.steps:
        if step in edits and step != without:
            append(*edits[step])


def write_nomenclature(root: Path, omitted: tuple[str, ...] = ()) -> None:
    """Run release/make_nomenclature.py in a copy; then omit the sections of some models."""
    done = run(root, "release/make_nomenclature.py")
    assert done.returncode == 0, done.stderr
    page = root / "docs" / "reference/nomenclature.md"
    text = page.read_text(encoding="utf-8")
    for name in omitted:
        text = re.sub(rf"### {name}\n.*?(?=\n##)", "", text, flags=re.DOTALL)
    page.write_text(text, encoding="utf-8")


def run(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A Python command in a copy of the project, which imports the package of the copy."""
    environment = {**os.environ, "PYTHONPATH": str(root / "src")}
    return subprocess.run(
        [sys.executable, *arguments], cwd=root, env=environment, capture_output=True, text=True
    )
