"""Site of the studio: a folder that is complete in itself, whose laws give the numbers of the
command in all directions.
"""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from command_line import airmuscle
from studio_pages import BEGINNING, run_script, scripts

import airmuscle as am
from airmuscle.errors import ParameterError
from airmuscle.files import to_toml
from airmuscle.outlets import write_site
from airmuscle.outlets.studio import Model, joint_names, sheet_of_any, site_files

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
TOLERANCE = 1e-9
SHOWN = ("dmsp-20-300", "saga2007", "sarosi-dmsp-10")
"""A law in each of the three forms."""


@pytest.fixture(scope="module")
def files():
    """The files of a site of three laws and a plant."""
    models = [Model("law", sheet_of_any(name)) for name in SHOWN]
    return site_files([*models, Model("plant", sheet_of_any("lift-dmsp-20"))])


def test_the_folder_contains_all_that_the_page_requests(files):
    page = files["index.html"]
    requested = re.findall(r'(?:src|href)="([^"#]+)"', page)
    beside = [name for name in requested if not name.startswith(("data:", "https://github.com/"))]
    assert len(beside) > 25
    assert [name for name in beside if name not in files] == []
    listed = re.findall(r'"file": "([^"]+)"', files["contents.js"])
    assert len(listed) == 4
    assert [name for name in listed if name not in files] == []


def test_the_policy_of_the_page_allows_no_request_elsewhere(files):
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', files["index.html"]).group(1)
    sources = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert sources["default-src"] == "'none'"
    assert "connect-src" not in sources
    assert "unsafe" not in policy
    assert not re.search(r"https?:", policy)


def test_a_page_without_javascript_says_so_in_one_sentence(files):
    shown = re.search(r"<noscript>(.*?)</noscript>", files["index.html"]).group(1)
    text = re.sub("<[^>]*>", "", shown)
    assert "allow JavaScript" in text
    assert text.count(".") == 1


EVALUATE = """
(async () => {
  const results = [];
  for (const [file, point] of DATA) {
    const law = new airmuscle.Law(airmuscleSite.sheets[file]);
    results.push(["force", "contraction", "pressure"].map((missing) => law.solve(missing, point)));
  }
  console.log(JSON.stringify(results));
})();
"""


def test_the_laws_of_the_folder_give_the_numbers_of_the_command(files, tmp_path):
    text = files["contents.js"] + scripts(*BEGINNING)
    data = []
    expected = []
    for name in SHOWN:
        file = f"models/law-{name}.js"
        text += files[file]
        quantities = {"pressure": "3 bar", "contraction": "10 %"}
        force = command_value(name, "force", quantities)
        point = {"pressure": 3e5, "contraction": 0.1, "force": force}
        data.append((file, point))
        solved = {
            "contraction": {"pressure": "3 bar", "force": f"{force!r} N"},
            "pressure": {"contraction": "10 %", "force": f"{force!r} N"},
        }
        expected.append(
            [force, *(command_value(name, missing, stated) for missing, stated in solved.items())]
        )
    for values, wanted in zip(run_script(text + EVALUATE, data, tmp_path), expected, strict=True):
        assert values == pytest.approx(wanted, rel=TOLERANCE)


def command_value(name, missing, stated):
    """The quantity that `airmuscle evaluate --json` gives for two others."""
    options = [part for key, text in stated.items() for part in (f"--{key}", text)]
    done = airmuscle("evaluate", name, *options, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)["evaluation"][missing]


POINTS = """
const law = new airmuscle.Law(airmuscleSite.sheets["models/law-dmsp-20-300.js"]);
console.log(JSON.stringify(DATA.map((text) => {
  try {
    const points = airmuscle.readPoints(text, 0.3);
    return { points, ...airmuscle.residualsOf(law, points) };
  } catch (error) { return error.message; }
})));
"""


def own_points(files, texts, folder):
    """What the page makes of texts: points with their residuals, or a sentence."""
    text = files["contents.js"] + scripts(*BEGINNING, "points-file")
    return run_script(text + files["models/law-dmsp-20-300.js"] + POINTS, texts, folder)


def test_points_in_other_separators_and_units_are_the_same_points(files, tmp_path):
    texts = [
        "pressure [bar],contraction [%],force [N]\n3,10,270\n4,5,700.5\n",
        "Contraction (%);Gauge pressure (kPa);Load (kN)\n10;300;0,27\n5;400;0,7005\n",
        "force [N]\tlength [mm]\tpressure [MPa]\tnote\n270\t270\t0.3\ta\n700.5\t285\t0.4\tb\n",
    ]
    law = am.load("dmsp-20-300").characteristic
    measured = [(3e5, 0.1, 270.0), (4e5, 0.05, 700.5)]
    errors = [float(law.force(p, c)) - f for p, c, f in measured]
    for answer in own_points(files, texts, tmp_path):
        points = [tuple(point.values()) for point in answer["points"]]
        assert np.array(points) == pytest.approx(np.array(measured), rel=1e-12)
        assert answer["rms"] == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=TOLERANCE)
        assert answer["greatest"] == pytest.approx(np.max(np.abs(errors)), rel=TOLERANCE)
        assert answer["mean"] == pytest.approx(np.mean(errors), rel=TOLERANCE)
        assert answer["count"] == 2


def test_a_text_that_contains_no_points_has_a_sentence_with_the_remedy(files, tmp_path):
    remedies = {
        "": "write a line with the headings, such as pressure [bar]; contraction [%]; force [N]",
        "1,2,3\n4,5,6": "the first line must have the form pressure [bar]; contraction [%]; force",
        "pressure [bar],force [N]\n1,2": "No heading names the contraction or length",
        "pressure,contraction [%],force [N]\n1,2,3": "states no unit; write pressure with one of",
        "pressure [ft],contraction [%],force [N]\n1,2,3": "states the unit ft; write pressure",
        "pressure [bar],contraction [%],force [N]\n1,2,x": "Line 2: “x” is no number",
    }
    for sentence, remedy in zip(
        own_points(files, list(remedies), tmp_path), remedies.values(), strict=True
    ):
        assert remedy in sentence


def test_units_of_choice_are_those_of_the_program(tmp_path):
    text = """
console.log(JSON.stringify(DATA.map((system) => {
  airmuscle.units.choose(system);
  return ["pressure", "force", "length"].map((quantity) => airmuscle.units[quantity]);
})));
"""
    systems = ["bar, N, mm", "kPa, N, mm", "MPa, N, mm", "psi, lbf, in"]
    answers = run_script(scripts("numbers", "units") + text, systems, tmp_path)
    for system, answer in zip(systems, answers, strict=True):
        assert [unit["name"] for unit in answer] == system.split(", ")
        for unit, base in zip(answer, ("Pa", "N", "m"), strict=True):
            assert unit["factor"] == pytest.approx(
                am.units.conversion(unit["name"], base).factor, rel=1e-14
            )


def test_what_is_no_file_or_has_the_name_of_another_model_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"'tondu-lopez' is no file; the page contains"):
        write_site(tmp_path / "page", ["tondu-lopez"])
    file = tmp_path / "my muscle.toml"
    file.write_text(to_toml(am.load("tondu-lopez")), encoding="utf-8")
    with pytest.raises(ParameterError, match="two models of the name 'my muscle'"):
        write_site(tmp_path / "page", [str(file), str(file)])
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.slow
def test_the_command_writes_the_whole_library_and_own_files(tmp_path):
    file = tmp_path / "my muscle.toml"
    file.write_text(to_toml(am.load("tondu-lopez")), encoding="utf-8")
    done = airmuscle("site", tmp_path / "page", file)
    assert done.exit_code == 0, done.stderr
    contents = (tmp_path / "page" / "contents.js").read_text(encoding="utf-8")
    omitted = re.findall(r"the page lacks ([\w-]+)\.", done.stderr)
    assert omitted == ["saga2007-exact"]
    for name in (*am.files.list_laws(), "my muscle", *joint_names()):
        assert (f'"name": "{name}"' in contents) == (name not in omitted), name
    size = sum(path.stat().st_size for path in (tmp_path / "page").rglob("*.*"))
    assert size < 15e6
