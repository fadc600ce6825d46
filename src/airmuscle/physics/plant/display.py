"""Display of a plant: card in a notebook, and animation of a run with the muscles coloured by
pressure.
"""

import os
import tempfile
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from ...core import (
    BLACK,
    LINES,
    ColumnError,
    FileError,
    ParameterError,
    as_finite_float,
    new_figure,
    quantity_text,
)
from ...recording import Recording
from ...recording.notebook import Card, NotebookDisplay
from ..muscle.isobars import plot_isobars
from .drawing import Row, Scene, scene_of

FRAMES = 25.0
"""Frames a second (chosen)."""
MOST_FRAMES = 3000
"""Largest number of frames of an animation (chosen)."""
_METAL = "#8a8f98"
_BAR = 1e5


class Animation:
    """Animation of a recording, to be written with `save` or shown in a notebook.

    figure  the Matplotlib figure
    times   time [s] of each frame (F,)
    """

    def __init__(self, scene: Scene, recording: Recording, speed: float = 1.0) -> None:
        speed = as_finite_float("animate: speed", speed)
        if not speed > 0:
            raise ParameterError(
                f"animate: the speed is {speed:g}; it must be positive: 1 for real time."
            )
        time = recording["time"]
        if time.size < 2:
            raise ColumnError(
                f"{recording.origin}: an animation needs two rows or more; there are {time.size}."
            )
        count = 1 + int((time[-1] - time[0]) * FRAMES / speed)
        if count > MOST_FRAMES:
            raise ParameterError(
                f"animate: {count} frames; at most {MOST_FRAMES} are allowed. Raise the speed, or"
                " select rows with recording.rows(...)."
            )
        self.times = time[0] + np.arange(count) * speed / FRAMES
        prefixes = scene.muscles.prefixes
        pressures = [f"{prefix}pressure" for prefix in prefixes]
        names = [*pressures, *(f"{prefix}contraction" for prefix in prefixes), *scene.coordinates]
        self._columns = {name: np.interp(self.times, time, recording[name]) for name in names}
        self._scene, self._full_scale = scene, max(scene.muscles.pressure, 1.0)
        self.figure, self._drawn = self._prepare(recording, pressures)
        self.draw(0)
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # the layout of the first frame serves for all

    def _prepare(self, recording: Recording, pressures: list[str]) -> tuple[Any, Any]:
        """The figure with the curves, and the axes of the drawing."""
        import matplotlib as mpl

        grid = {"width_ratios": [1.25, 1.0]}
        figure, axes = new_figure(2, 2, width=6.4, height=4.2, gridspec_kw=grid)
        for axis in axes[:, 0]:
            axis.remove()
        drawn = figure.add_subplot(axes[0, 0].get_gridspec()[:, 0])
        left, right, lower, upper = self._scene.limits
        drawn.set(xlim=(left, right), ylim=(lower, upper), aspect="equal")
        drawn.set_axis_off()
        time = recording["time"]
        coordinate = self._scene.coordinates[0]
        factor, unit = (180 / np.pi, "°") if coordinate != "position" else (1e3, "mm")
        for name, colour in zip(self._scene.coordinates, LINES, strict=False):
            axes[0, 1].plot(time, factor * recording[name], color=colour)
        axes[0, 1].set_ylabel(
            f"{coordinate if len(self._scene.coordinates) == 1 else 'angles'} [{unit}]"
        )
        for i, name in enumerate(pressures):
            label = name.removesuffix(".pressure") if len(pressures) > 1 else None
            dashes = "-" if i == 0 else "--"
            axes[1, 1].plot(
                time, recording[name] / _BAR, color=LINES[i], linestyle=dashes, label=label
            )
        axes[1, 1].set(xlabel="time [s]", ylabel="gauge pressure [bar]")
        if len(pressures) > 1:
            axes[1, 1].legend(loc="best", frameon=False, fontsize=8)
        self._cursors = [axis.axvline(time[0], color=BLACK, linewidth=0.8) for axis in axes[:, 1]]
        self._colours = mpl.colormaps["YlOrRd"]
        scale = mpl.cm.ScalarMappable(
            mpl.colors.Normalize(0.0, self._full_scale / _BAR), self._colours
        )
        colour_bar = figure.colorbar(scale, ax=drawn, location="left", shrink=0.6)
        colour_bar.set_label("gauge pressure [bar]", fontsize=9)
        colour_bar.ax.tick_params(labelsize=8)
        return figure, drawn

    def draw(self, frame: int) -> Any:
        """Draw one frame, from 0 on; the figure. Raises ParameterError for a frame that does not
        exist.
        """
        from matplotlib.patches import Circle, Polygon

        if not 0 <= frame < self.times.size:
            raise ParameterError(
                f"animation: there is no frame {frame}; allowed range: 0 to {self.times.size - 1}."
            )
        axes = self._drawn
        for artist in [*axes.patches, *axes.lines, *axes.texts]:
            artist.remove()
        row: Row = {name: float(values[frame]) for name, values in self._columns.items()}
        drawing = self._scene.draw(row)
        for line in drawing.lines:
            axes.plot(*line.T, color=BLACK, linewidth=1.6, zorder=2)
        for x, y, radius in drawing.circles:
            axes.add_patch(
                Circle((x, y), radius, facecolor="white", edgecolor=BLACK, linewidth=1.2, zorder=3)
            )
        for points, pressure in drawing.shapes:
            colour = (
                _METAL if pressure is None else self._colours(max(pressure, 0.0) / self._full_scale)
            )
            axes.add_patch(
                Polygon(points, facecolor=colour, edgecolor=BLACK, linewidth=0.8, zorder=4)
            )
        axes.text(0.02, 0.0, f"{self.times[frame]:.2f} s", transform=axes.transAxes, fontsize=9)
        for cursor in self._cursors:
            cursor.set_xdata([self.times[frame]] * 2)
        return self.figure

    def still(self, time: float) -> Any:
        """The figure at the frame nearest to a time [s]."""
        return self.draw(
            int(np.argmin(np.abs(self.times - as_finite_float("animation: time", time))))
        )

    def save(self, path: str | Path) -> Path:
        """Write the animation: .gif, .mp4 (needs ffmpeg) or .html, by the suffix; the path.

        Raises FileError for another suffix, without ffmpeg, or if the file cannot be written.
        """
        from matplotlib import animation

        path = Path(path)
        writers = {".gif": "pillow", ".mp4": "ffmpeg", ".html": "html"}
        if path.suffix.lower() not in writers:
            raise FileError(
                f"{path}: an animation is written as {', '.join(writers)}; change the suffix."
            )
        writer = writers[path.suffix.lower()]
        if writer != "html" and not animation.writers.is_available(writer):
            raise FileError(
                f"{path}: writing {path.suffix} needs {writer}, which is not installed; write .gif"
                " or .html."
            )
        try:
            with tempfile.TemporaryDirectory(prefix=".animation-", dir=path.parent) as folder:
                temporary = Path(folder) / f"animation{path.suffix.lower()}"
                if writer == "html":
                    temporary.write_text(self._matplotlib().to_jshtml(fps=FRAMES), encoding="utf-8")
                else:
                    self._matplotlib().save(temporary, writer=writer, fps=FRAMES, dpi=100)
                os.replace(temporary, path)
        except OSError as error:
            raise FileError(f"{path}: cannot be written: {error.strerror or error}.") from None
        return path

    def _matplotlib(self) -> Any:
        from matplotlib.animation import FuncAnimation

        return FuncAnimation(
            self.figure, self.draw, frames=self.times.size, interval=1000 / FRAMES, blit=False
        )

    def _repr_html_(self) -> str:
        return str(self._matplotlib().to_jshtml(fps=FRAMES))


MAX_CHARTS = 2
"""Maximum number of muscles with a chart; muscles with the same law have one."""


class PlantDisplay(NotebookDisplay):
    """Base of Plant for its display."""

    def animate(self, recording: Recording, speed: float = 1.0) -> Animation:
        """Animation of a run of this plant; see Recording.animate."""
        plant: Any = self
        geometries = [muscle.geometry for muscle in plant.muscles]
        return Animation(
            scene_of(geometries, plant.prefixes, plant.mechanism, recording), recording, speed
        )

    def _card(self) -> Card:
        plant: Any = self
        rows = [("component", "value")]
        for muscle in plant.muscles:
            length = quantity_text(muscle.geometry.resting_length, "m", "mm")
            label = "muscle" if muscle.name == "muscle" else f"muscle {muscle.name}"
            rows.append((label, f"{type(muscle.contractile).__name__}, {length}"))
        circuits = zip(plant.circuit_prefixes, plant.circuits, strict=True)
        rows += [(f"circuit {prefix}".rstrip("."), _brief(circuit)) for prefix, circuit in circuits]
        rows += [("mechanism", _brief(plant.mechanism)), ("gas", _brief(plant.gas))]
        rows.append(
            ("ambient", f"{quantity_text(plant.ambient.pressure, 'Pa', 'kPa', 6)} absolute")
        )
        rows.append((f"{len(plant.states)} states", ", ".join(s.name for s in plant.states)))
        rows.append((f"{len(plant.inputs)} inputs", ", ".join(plant.inputs)))
        return Card(
            f"Plant with {len(plant.muscles)} muscle{'s' * (len(plant.muscles) > 1)}",
            rows,
            self._draw,
        )

    def _draw(self) -> Any:
        plant: Any = self
        muscles_of_law: dict[str, list[Any]] = {}
        for muscle in plant.muscles:
            # muscles with one law and one range have one chart
            law = repr((muscle.contractile, muscle.validity_range))
            muscles_of_law.setdefault(law, []).append(muscle)
        groups = list(muscles_of_law.values())[:MAX_CHARTS]
        count = len(groups)
        figure, axes = new_figure(count, 1, height=2.6 * count, squeeze=False)
        for axis, muscles in zip(axes[:, 0], groups, strict=True):
            first = muscles[0]
            names = ", ".join(muscle.name for muscle in muscles)
            shortened = textwrap.shorten(names, 70, placeholder=" …")
            title = f"{shortened}: {type(first.contractile).__name__}"
            plot_isobars(first.contractile, title, first.validity_range, ax=axis)
        return figure


def _brief(part: Any) -> str:
    return textwrap.shorten(str(part), 120, placeholder=" …")
