"""Sheet of a sizing: one page of A4 in PDF and HTML, whose texts lie on the page and not on one
another, and whose values are those of the best choice; what has no source is "not known".
"""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import pytest
from command_line import airmuscle
from widths import widened

import airmuscle as am
from airmuscle.core import plotting
from airmuscle.design import (
    GripperRequirement,
    JointRequirement,
    LiftRequirement,
    SizingConditions,
    size_muscles,
    sizing_sheet,
)

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")

REQUIREMENTS: dict[str, Any] = {
    "lift": LiftRequirement(stroke=0.040, mass=20.0),
    "joint": JointRequirement(angle=math.radians(50.0), torque=4.0),
    "lever": LiftRequirement(stroke=0.200, mass=8.0, lever=5.0),
    "gripper": GripperRequirement(opening=0.020, grip=50.0, lever=2.0),
    "long lift": LiftRequirement(stroke=0.150, mass=60.0),
    "heavy lift": LiftRequirement(stroke=0.040, force=2500.0),
    "strong joint": JointRequirement(angle=math.radians(90.0), torque=40.0, inertia=0.2),
}
CONDITIONS = SizingConditions(supply=6e5)
FEW = ("dmsp-10-250", "dmsp-20-300", "festo-tool-dmsp-20", "festo-tool-dmsp-40")


@pytest.fixture(
    scope="module",
    params=widened(REQUIREMENTS, lambda name: name in ("lift", "joint", "lever", "gripper")),
)
def drawn(request):
    entries = [am.load(name) for name in FEW]
    result = size_muscles(REQUIREMENTS[request.param], CONDITIONS, entries)
    return result, sizing_sheet(result)


def extents(figure):
    """Boxes of all texts in pixels, those that stand on the page itself first."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    return [
        (text.get_text(), text.get_window_extent(renderer))
        for text in figure.texts
        if text.get_text().strip()
    ]


def test_texts_lie_on_the_page_and_not_on_one_another(drawn):
    _, figure = drawn
    boxes = extents(figure)
    assert len(boxes) > 40
    width, height = figure.bbox.width, figure.bbox.height
    for text, box in boxes:
        assert box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height, text  # noqa: PT018
    for (first, a), (second, b) in itertools.combinations(boxes, 2):
        overlap = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(overlap) <= 1.0, (first, second)


def test_the_names_of_the_states_in_the_drawing_do_not_overlap(drawn):
    _, figure = drawn
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    texts = [text for text in figure.axes[0].texts if text.get_text().strip()]
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts]
    names = [(text, box) for text, box in boxes if "bar" in text]
    assert len(names) == 2
    (_, a), (_, b) = names
    drawing = figure.axes[0]
    for patch in drawing.patches[1:]:
        muscle = patch.get_window_extent(renderer)
        inside = min(a.x1, muscle.x1) - max(a.x0, muscle.x0)
        assert inside <= 1.0 or a.y0 >= muscle.y1 - 1.0 or a.y1 <= muscle.y0 + 1.0, patch
    assert a.x1 <= b.x0 + 1.0 or b.x1 <= a.x0 + 1.0


def test_the_values_are_those_of_the_best_choice(drawn):
    result, figure = drawn
    best = result.best
    texts = [text.get_text() for text in figure.texts]
    assert texts[0].startswith(best.size)
    assert any(result.requirement.describe() in text for text in texts)
    for value in (
        f"{1e3 * best.length:.4g} mm",
        f"{100 * best.design.reserve:.3g} %",
        f"{1e3 * best.reference_volume:.3g} l (ANR)",
    ):
        assert value in texts
    if best.design.radius is not None:
        assert f"{1e3 * best.design.radius:.4g} mm" in texts
    dimensions = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    for point in (best.design.extended, best.design.contracted):
        length = 1e3 * best.length * (1.0 - point.contraction)
        assert any(
            float(number) == pytest.approx(length, rel=1e-3)
            for number in re.findall(r"\d+\.?\d*", dimensions)
        )


def test_what_has_no_source_is_not_known(drawn):
    """Order code, price and life have no source; nor has the temperature of these products."""
    _, figure = drawn
    texts = [text.get_text() for text in figure.texts]
    unknown = "not known: no source is cited"
    for name in ("order code, price", "life", "temperature"):
        assert texts[texts.index(name) + 1] == unknown
    assert texts[texts.index("pressure (gauge)") + 1] != unknown


def test_the_command_writes_one_page_of_a4_as_pdf_and_html(tmp_path):
    words = ("size", "--grip", "50 N", "--opening", "2 cm", "--supply", "6 bar")
    result = airmuscle(*words, "--muscle", "dmsp-20-300", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    content = (tmp_path / "out" / "sheet.pdf").read_bytes()
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    sides = [float(side) / 72 * 25.4 for side in box.groups()]
    assert sides == pytest.approx([210.0, 297.0], abs=0.01)
    assert b"/Count 1" in content
    assert b"CreationDate" not in content
    page = (tmp_path / "out" / "sheet.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert "@page { size: A4; margin: 0 }" in page
    assert page.count("<svg") == 1
    assert not re.search(r'(?:src|href)="http', page)


def test_equal_sheets_have_identical_bytes():
    result = size_muscles(REQUIREMENTS["lift"], CONDITIONS, [am.load("dmsp-20-300")])
    files = [plotting.rendered(sizing_sheet(result), ("pdf", "svg")) for _ in range(2)]
    assert files[0] == files[1]


def test_a_law_without_geometry_has_a_sheet_that_says_so():
    load = LiftRequirement(stroke=0.02, force=60.0)
    entries = [am.load("hunt2017-festo-10")]
    figure = sizing_sheet(size_muscles(load, SizingConditions(supply=4e5), entries))
    texts = [text.get_text() for text in figure.texts]
    assert "not known: the law has no geometry" in texts
    assert any("no geometry is known" in text.get_text() for text in figure.axes[0].texts)
