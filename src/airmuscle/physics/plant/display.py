"""Display of a plant in a notebook: charts of its muscles, and a table of its components, states and inputs."""

from __future__ import annotations

import textwrap
from typing import Any

from ...core.display import quantity_text
from ...core.notebook import Card, NotebookDisplay
from ...core.plotting import new_figure
from ...recording import Recording
from ..muscle.display import plot_isobars
from .animation import Animation
from .drawing import scene_of

MAX_CHARTS = 2
"""Maximum number of muscles with a chart; muscles with the same law have one."""


class PlantDisplay(NotebookDisplay):
    """Base of Plant for its display."""

    def animate(self, recording: Recording, speed: float = 1.0) -> Animation:
        """Animation of a run of this plant; see Recording.animate."""
        plant: Any = self
        scene = scene_of([muscle.geometry for muscle in plant.muscles], plant.prefixes, plant.mechanism)
        return Animation(scene, recording, speed)

    def _card(self) -> Card:
        plant: Any = self
        rows = [("component", "value")]
        for muscle in plant.muscles:
            length = quantity_text(muscle.geometry.resting_length, "m", "mm")
            label = "muscle" if muscle.name == "muscle" else f"muscle {muscle.name}"
            rows.append((label, f"{type(muscle.contractile).__name__}, {length}"))
        rows += [
            (f"circuit {p}".rstrip("."), _brief(c)) for p, c in zip(plant.circuit_prefixes, plant.circuits, strict=True)
        ]
        rows.append(("mechanism", _brief(plant.mechanism)))
        rows.append(("gas", _brief(plant.gas)))
        rows.append(("ambient", f"{quantity_text(plant.ambient.pressure, 'Pa', 'kPa', 6)} absolute"))
        rows.append((f"{len(plant.states)} states", ", ".join(s.name for s in plant.states)))
        rows.append((f"{len(plant.inputs)} inputs", ", ".join(plant.inputs)))
        return Card(f"Plant with {len(plant.muscles)} muscle{'s' * (len(plant.muscles) > 1)}", rows, self._draw)

    def _draw(self) -> Any:
        plant: Any = self
        laws: dict[Any, Any] = {}
        for muscle in plant.muscles:
            laws.setdefault(repr((muscle.contractile, muscle.validity_range)), []).append(muscle)
        groups = list(laws.values())[:MAX_CHARTS]
        figure, axes = new_figure(len(groups), 1, height=2.6 * len(groups), squeeze=False)
        for axis, muscles in zip(axes[:, 0], groups, strict=True):
            names = textwrap.shorten(", ".join(m.name for m in muscles), 70, placeholder=" …")
            title = f"{names}: {type(muscles[0].contractile).__name__}"
            plot_isobars(muscles[0].contractile, title, muscles[0].validity_range, ax=axis)
        return figure


def _brief(part: Any) -> str:
    return textwrap.shorten(str(part), 120, placeholder=" …")
