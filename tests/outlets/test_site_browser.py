"""Site of the studio in a browser, opened from disk without a network: the whole library computes the
numbers of the program.
"""

from __future__ import annotations

import numpy as np
import pytest

import airmuscle as am
from airmuscle.errors import PhysicsError
from airmuscle.outlets import write_site

pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
from studio_browser import PAGES, WAIT, browser, opened

__all__ = ["browser"]
pytestmark = [
    pytest.mark.tool,
    pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning"),
]
TOLERANCE = 1e-9
WITHOUT_CLOSED_FORM = ("festo-tool-dmsp-10", "festo-tool-dmsp-20", "festo-tool-dmsp-40")
"""Tables of numbers, which the page shows as the polynomials whose errors it states."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The address of the folder of a site."""
    return write_site(tmp_path_factory.mktemp("site") / "page").page.parent


@pytest.fixture
def page(browser, folder):
    with from_disk(browser, folder) as shown:
        yield shown


def from_disk(browser, folder, fragment="", **options):
    address = (folder / "index.html").as_uri() + fragment
    return opened(browser, address, origin=folder.as_uri(), offline=True, **options)


SOLVE = """
async ([name, points]) => {
  const law = new airmuscle.Law(await airmuscle.source.named("law", name));
  return points.map((point) => ["force", "contraction", "pressure"].map((missing) => law.solve(missing, point)));
}
"""


def test_every_law_gives_the_numbers_of_the_program_from_disk(page):
    names = page.evaluate("airmuscle.source.library().then((l) => l.laws.map((row) => row.name))")
    assert set(names) == set(am.files.list_laws()) - {"saga2007-exact"}
    wrong = {}
    compared = 0
    for name in names:
        if name in WITHOUT_CLOSED_FORM:
            continue
        entry = am.load(name)
        law = entry.characteristic
        points = points_inside(entry)
        compared += len(points)
        solved = np.array(page.evaluate(SOLVE, [name, points]), dtype=float)
        for (force, contraction, pressure), point in zip(solved, points, strict=True):
            expected = (
                or_nan(law.force, point["pressure"], point["contraction"]),
                or_nan(law.contraction, point["pressure"], point["force"]),
                or_nan(law.pressure, point["contraction"], point["force"]),
            )
            agreed = pytest.approx(expected, rel=TOLERANCE, nan_ok=True)
            if (force, contraction, pressure) != agreed:
                wrong[name] = (force, contraction, pressure), expected
    assert wrong == {}
    assert compared > 50


def or_nan(function, *arguments):
    try:
        return float(function(*arguments))
    except PhysicsError:
        return float("nan")


def points_inside(entry):
    """Points of a law in its validity range, without those at which a muscle is slack."""
    limits = entry.validity_range
    law = entry.characteristic
    highest = 3e5 if limits is None else limits.max_pressure
    shortest = 0.1 if limits is None else 0.6 * limits.max_contraction
    points = []
    for pressure in (0.5 * highest, 0.8 * highest):
        for contraction in (0.3 * shortest, 0.7 * shortest):
            force = or_nan(law.force, pressure, contraction)
            if force > 1.0:
                points.append({"pressure": pressure, "contraction": contraction, "force": force})
    return points


def shown(page, tab, name):
    page.wait_for_selector(f'#panel-{tab}[data-shown="{name}"]', timeout=WAIT)


def test_two_muscles_are_compared_and_the_address_keeps_the_state(browser, folder, page):
    page.get_by_label("Muscle or law of the library").select_option("chou-hannaford")
    shown(page, "muscle", "chou-hannaford")
    page.get_by_label("Muscle or law of the library").select_option("tondu-lopez")
    shown(page, "muscle", "tondu-lopez")
    page.get_by_label("Solve for pressure").check()
    page.get_by_label("Contraction [%]").fill("10")
    page.get_by_label("Force [N]").fill("100")
    law = am.load("tondu-lopez").characteristic
    field = page.get_by_label("Pressure [bar]")
    assert float(field.input_value()) == pytest.approx(law.pressure(0.1, 100.0) / 1e5, rel=1e-5)
    page.wait_for_timeout(400)
    fragment = page.evaluate("location.hash")
    assert len(fragment) > 20
    with from_disk(browser, folder, fragment) as other:
        shown(other, "muscle", "tondu-lopez")
        assert other.get_by_label("Pressure [bar]").input_value() == field.input_value()


def test_units_of_choice_and_own_points(page):
    law = am.load("dmsp-20-300").characteristic
    points = "pressure [bar]; contraction [%]; force [N]\n3; 10; 270\n4; 5; 700"
    page.get_by_text("Draw own points over the law").click()
    page.get_by_label("Own points (CSV)", exact=True).fill(points)
    page.get_by_role("button", name="Draw these points").click()
    errors = [float(law.force(3e5, 0.1)) - 270.0, float(law.force(4e5, 0.05)) - 700.0]
    row = page.locator("#panel-muscle tr", has_text="dmsp-20-300").locator("td")
    rms = float(row.nth(2).inner_text())
    assert rms == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=5e-3)
    page.get_by_label("Units").select_option("psi, lbf, in")
    assert float(row.nth(2).inner_text()) == pytest.approx(rms / 4.4482216152605, rel=5e-3)
    page.get_by_label("Solve for pressure").check()
    page.get_by_label("Contraction [%]").fill("10")
    page.get_by_label("Force [lbf]").fill("50")
    expected = law.pressure(0.1, 50 * 4.4482216152605) / 6894.757293168361
    field = page.get_by_label("Pressure [psi]", exact=True)
    assert float(field.input_value()) == pytest.approx(expected, rel=1e-5)


ISOTONICS = """
async () => {
  const panel = new airmuscle.CurvePanel(document.createElement("div"));
  const law = new airmuscle.Law(await airmuscle.source.named("law", "dmsp-20-300"));
  Object.assign(panel, { laws: [law], active: law, pressures: [3e5, 6e5], span: [0, 0.2], greatestForce: 1000 });
  return ["isotonics", "stiffness"].map((kind) => {
    panel.kind.value = kind;
    const plan = panel[kind]();
    return plan.levels.map((level) => [level, plan.grid, plan.grid.map((at) => plan.valueOf(law, level, at))]);
  });
}
"""


def test_isotonics_and_stiffness_are_those_of_the_law(page):
    law = am.load("dmsp-20-300").characteristic
    isotonics, stiffness = page.evaluate(ISOTONICS)
    assert [level for level, *_ in isotonics] == [200.0, 400.0, 600.0, 800.0, 1000.0]
    for force, grid, percents in isotonics:
        expected = [100 * or_nan(law.contraction, pressure, force) for pressure in grid]
        assert percents == pytest.approx(expected, rel=TOLERANCE, abs=TOLERANCE, nan_ok=True)
    for pressure, grid, values in stiffness:
        taut = [at for at in grid if law.force(pressure, at) > 0.0]
        assert len(taut) > 40
        expected = [float(law.stiffness(pressure, at)) / 0.3 / 1e3 for at in taut]
        shown = [value for value in values if np.isfinite(value)]
        assert shown == pytest.approx(expected, rel=TOLERANCE)


def test_every_plant_and_joint_runs_in_the_page(page):
    for tab, label in (("plant", "Plant of the library"), ("joint", "Joint of the library")):
        page.get_by_role("tab", name=tab.capitalize()).click()
        choice = page.get_by_label(label)
        names = choice.locator("option").evaluate_all("(options) => options.map((o) => o.value)")
        assert len(names) >= 6
        for name in names:
            choice.select_option(name)
            shown(page, tab, name)


@pytest.mark.parametrize(("width", "scheme"), PAGES)
def test_the_page_fits_every_width(browser, folder, width, scheme):
    with from_disk(browser, folder, width=width, scheme=scheme) as page:
        for tab in ("Muscle", "Plant", "Joint"):
            page.get_by_role("tab", name=tab).click()
            page.wait_for_timeout(200)
            assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_page_without_javascript_says_so(browser, folder):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((folder / "index.html").as_uri())
    assert "allow JavaScript" in page.locator("main").inner_text()
    context.close()
