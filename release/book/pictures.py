"""Pictures of models: isobars of characteristics, loops of friction laws, outlines of geometries,
flow of valves.

A model that needs parameters is drawn with those of its first library entry, otherwise with the
chosen ones of SAMPLES.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from airmuscle import characteristic, geometry, physics
from airmuscle.bench.hysteresis import plot_loops
from airmuscle.core import plotting
from airmuscle.core.errors import AirmuscleError
from airmuscle.physics import (
    Characteristic,
    Friction,
    Geometry,
    LoopScales,
    Orifice,
    PulleyProfile,
    ValidityRange,
)
from airmuscle.physics.muscle.isobars import compute_isobars, isobar_figure

from .model_pages import components, entries_of, rooms

BRAID = geometry.Braid(radius=0.010, braid_angle=0.426, resting_length=0.300)
IDEAL = characteristic.VirtualWork(BRAID)
RANGE = ValidityRange(0.0, 6e5, 0.0, 0.25)
VALVE = physics.Valve(conductance=2.6167e-9, critical_ratio=0.433)
LOOP = LoopScales(stroke=5e-3, amplitude=20.0, elements=3)
"""Scales of the loops of friction laws."""
SAMPLES: dict[str, Any] = {
    "VirtualWork": IDEAL,
    "Clamped": characteristic.Clamped(IDEAL, 0.0, 800.0),
    "EffectiveLength": characteristic.EffectiveLength(IDEAL, resting_length=0.3, dead_length=0.02),
    "Braid": BRAID,
    "Valve": VALVE,
    "SubsonicIndexValve": physics.SubsonicIndexValve(2.6167e-9, 0.3, 0.6, cracking_pressure=2e4),
    "CheckValve": physics.CheckValve(VALVE),
    "TubeOrifice": physics.TubeOrifice(length=1.0, diameter=4e-3),
    "ConstantRadius": physics.ConstantRadius(),
    "PolynomialProfile": physics.PolynomialProfile((0.4, -0.2)),
    "CrankProfile": physics.CrankProfile(0.3),
}
"""Objects with chosen parameters, for models without a library entry."""


def figures() -> Iterator[tuple[str, Any]]:
    """(class name, Matplotlib figure) of every model that can be drawn."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for classes in rooms().values():
            for cls in classes:
                figure = draw(cls)
                if figure is not None:
                    yield cls.__name__, figure


def draw(cls: type[Any]) -> Any:
    """The figure of a model, or None."""
    thing, title = _example(cls)
    if isinstance(thing, Characteristic):
        return _isobars(thing, title, _range_of(cls))
    if isinstance(thing, Friction):
        figure = plot_loops(thing)
        figure.axes[0].set_title(title, fontsize=9)
        return figure
    drawing = {Geometry: _outline, Orifice: _flow, PulleyProfile: _profile}
    return next(
        (draw(thing, title) for kind, draw in drawing.items() if isinstance(thing, kind)), None
    )


def _example(cls: type[Any]) -> tuple[Any, str]:
    """An object of a class, and the source of its numbers."""
    for entry in entries_of(cls):
        for thing in components(entry):
            if type(thing) is cls:
                return thing, f"{cls.__name__}: {entry.title}"
    sample = cls.guess(LOOP) if issubclass(cls, Friction) else SAMPLES.get(cls.__name__)
    return sample, f"{cls.__name__}; all numbers chosen"


def _range_of(cls: type[Any]) -> ValidityRange:
    ranges = [e.validity_range for e in entries_of(cls) if type(e.characteristic) is cls]
    return ranges[0] if ranges and ranges[0] is not None else RANGE


def _isobars(law: Characteristic, title: str, limits: ValidityRange) -> Any:
    try:
        return isobar_figure(law, title, compute_isobars(law, limits), limits)
    except AirmuscleError:
        return None


def _outline(shape: Geometry, title: str) -> Any:
    """Outline of a muscle at several contractions, and its volume."""
    low, high = shape.contraction_range
    contractions = np.linspace(max(0.0, low), min(0.35, 0.98 * high), 4)
    figure, (left, right) = plotting.new_figure(1, 2, width=8.0, height=3.0)
    for contraction, colour, dash in zip(
        contractions, plotting.LINES, plotting.DASHES, strict=False
    ):
        x, radius = shape.outline(float(contraction))
        left.plot(
            1e3 * x, 1e3 * radius, color=colour, linestyle=dash, label=f"{100 * contraction:.0f} %"
        )
    figure.suptitle(title, fontsize=9)
    left.set(xlabel="axial position [mm]", ylabel="radius [mm]", ylim=(0.0, None))
    left.legend(title="contraction")
    grid = np.linspace(contractions[0], contractions[-1], 81)
    right.plot(
        100 * grid,
        1e6 * np.array([float(shape.volume(float(c))) for c in grid]),
        color=plotting.BLUE,
    )
    right.set(xlabel="contraction [%]", ylabel="volume [cm³]")
    return figure


def _flow(valve: Orifice, title: str) -> Any:
    """Mass flow of a valve, fully open, over the downstream pressure."""
    upstream = 7e5
    downstream = np.linspace(1e5, 8e5, 281)
    figure, axes = plotting.new_figure(width=5.6, height=3.2)
    flow = [float(valve.mass_flow(upstream, float(p), 1.0, 293.15)) for p in downstream]
    axes.plot(downstream / 1e5, 1e3 * np.array(flow), color=plotting.BLUE)
    axes.axvline(upstream / 1e5, color="0.5", linewidth=0.8)
    axes.set(xlabel="downstream pressure [bar absolute]", ylabel="mass flow [g/s]")
    axes.set_title(f"{title}; upstream 7 bar absolute", fontsize=9)
    return figure


def _profile(profile: PulleyProfile, title: str) -> Any:
    """Ratio of a pulley profile over the joint angle."""
    angles = np.linspace(-1.0, 1.0, 101)
    figure, axes = plotting.new_figure(width=5.6, height=2.8)
    axes.plot(
        np.degrees(angles), [float(profile.ratio(float(a))) for a in angles], color=plotting.BLUE
    )
    axes.set(
        xlabel="joint angle [deg]", ylabel="moment arm over radius", ylim=(0.0, None), title=title
    )
    return figure


def write(folder: Path) -> tuple[str, ...]:
    """Write all figures as SVG to a folder; returns the names of the models."""
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for name, figure in figures():
        plotting.save(figure, folder / f"{name}.svg")
        names.append(name)
    return tuple(names)
