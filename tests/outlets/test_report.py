"""A report is complete, self-contained and reproducible.

It appears completely or not at all. Its page loads nothing from elsewhere, and formulas are MathML.
Every verdict is computed and stated in words. The same chapters give the same bytes, and JSON
contains neither NaN nor infinity.
"""

from __future__ import annotations

import csv
import dataclasses
import datetime
import json
import math
import os
import re
import sys
import time
import types
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from airmuscle.core import Reference, atomic_folder, check_writable, plotting
from airmuscle.errors import FileError, SolveError, UnknownNameError
from airmuscle.papers import run
from airmuscle.report import (
    BY_ROW,
    MARKS,
    MAX_SVG_BYTES,
    MEANINGS,
    AtLeast,
    AtMost,
    Chapter,
    Claim,
    Equal,
    Kind,
    Plot,
    Table,
    TableColumn,
    as_json,
    as_text,
    count_verdicts,
    format_number,
    format_published,
    format_reproduced,
    render_cell,
    render_header,
    shown_columns,
    statements,
    to_mathtext,
    to_plain,
    write_report,
)
from airmuscle.units import display

pytestmark = pytest.mark.drawn
DATE = datetime.date(2024, 5, 17)
KEYS = {
    "paper",
    "kind",
    "claim",
    "statement",
    "case",
    "place",
    "published",
    "expected",
    "reproduced",
    "unit",
    "tolerance",
    "verdict",
    "note",
}


def a_plot(name: str, points: int = 20) -> Plot:
    figure, axes = plotting.new_figure()
    x = np.linspace(0.0, 30.0, points)
    axes.plot(x, 1000.0 * np.cos(x), label="300 kPa")
    axes.set(xlabel="contraction [%]", ylabel="force [N]")
    plotting.legend_outside(axes)
    return Plot(name, f"Caption of {name} & more", figure)


def a_chapter(paper: str = "Saga 2007", fibres: float = 48.0) -> Chapter:
    """A chapter whose middle claim is computed from a number that a test can perturb."""
    return Chapter(
        paper,
        f"{paper}: straight fibres <in rubber>",
        "First paragraph.\n\nSecond paragraph.",
        claims=(
            Claim(paper, "rings", Equal(4.0), 4, "1"),
            Claim(paper, "force", Equal(480.0, 1.0), 10.0 * fibres, "N", note="as Fig. 7"),
            Claim(paper, "damping", None, 0.1, "1/s"),
            Claim(paper, "strain", AtMost(0.3), math.nan, "1"),
            Claim(paper, "stress", AtLeast(0.3, 0.1), None, "Pa"),
        ),
        tables=(
            Table(
                f"{paper} outline",
                "Outline",
                {"x [mm]": [0.1, math.nan], "closure": ["circle", "a,b"]},
            ),
            Table(f"{paper} series", "Series", {"time [s]": np.array([0.1, 1 / 3])}, shown=False),
        ),
        plots=(a_plot(f"{paper} isobars"),),
        references=(
            Reference("s", "Saga, N.", "Muscle", "J. Robotics", 2007, "10.1000/x", note="eq. (1)"),
        ),
        chosen=(("modulus of the fibres", "70 GPa", "chosen"),),
    )


class Links(HTMLParser):
    """Collects every address that a page asks a browser to load, or offers to follow."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.followed: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for key, value in attrs:
            if key in ("src", "srcset", "data", "poster") or (key == "href" and tag != "a"):
                self.loaded.append(value or "")
            if key == "href" and tag == "a":
                self.followed.append(value or "")
            if key == "id":
                self.ids.append(value or "")


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    return write_report(
        [a_chapter(), a_chapter("Borzikova", fibres=40.0)], folder, title="Papers", date=DATE
    )


def test_a_result_of_two_chapters_is_written_once_in_the_brief_view():
    first, second, other = (
        Chapter(name, name, (result, "More."))
        for name, result in (("a", "One law."), ("b", "One law."), ("c", "Another law."))
    )
    assert as_text([first, second, other], 80).split("\n") == [
        "a",
        "One law.",
        "",
        "b",
        "",
        "c",
        "Another law.",
    ]


def test_the_folder_holds_page_claims_figures_and_data(report: Path):
    found = {
        path.relative_to(report.parent).as_posix()
        for path in report.parent.rglob("*")
        if path.is_file()
    }
    papers = ("Saga 2007", "Borzikova")
    wanted = {f"figures/{paper} isobars.{kind}" for paper in papers for kind in ("svg", "png")}
    wanted |= {f"data/{paper} {table}.csv" for paper in papers for table in ("outline", "series")}
    assert found == wanted | {"report.html", "claims.json"}


def test_claims_come_back_from_json_as_they_went_in(report: Path):
    claims = json.loads((report.parent / "claims.json").read_text(encoding="utf-8"))
    assert [set(claim) for claim in claims] == [KEYS] * 10
    assert claims[1] == {
        "paper": "Saga 2007",
        "kind": "claim",
        "claim": "force",
        "statement": "force",
        "case": "",
        "published": 480.0,
        "expected": None,
        "reproduced": 480.0,
        "unit": "N",
        "tolerance": 1.0,
        "verdict": "holds",
        "place": "",
        "note": "as Fig. 7",
    }
    assert [claim["verdict"] for claim in claims[:5]] == ["holds", "holds", *["not printed"] * 3]
    assert claims[6]["verdict"] == "differs", "40 fibres do not give 480 N"


def test_what_is_not_finite_is_null_in_json_and_empty_in_csv(report: Path):
    text = (report.parent / "claims.json").read_text(encoding="utf-8")
    assert not re.search(r"\b(NaN|Infinity)\b", text)
    assert json.loads(text)[3]["reproduced"] is None
    plain = as_json(
        {
            "a": [math.inf, np.float32(0.5), np.int64(3), np.array([1.0, math.nan])],
            "b": (True, "NaN"),
        }
    )
    assert json.loads(plain) == {"a": [None, 0.5, 3, [1.0, None]], "b": [True, "NaN"]}
    with (report.parent / "data" / "Saga 2007 outline.csv").open(
        encoding="utf-8", newline=""
    ) as file:
        assert list(csv.reader(file)) == [["x [mm]", "closure"], ["0.1", "circle"], ["", "a,b"]]


def test_data_keep_every_digit(report: Path):
    lines = (
        (report.parent / "data" / "Saga 2007 series.csv").read_text(encoding="utf-8").splitlines()
    )
    assert lines[0] == "time [s]"
    assert [float(line) for line in lines[1:]] == [0.1, 1 / 3]


def test_the_page_needs_nothing_but_itself(report: Path):
    text = report.read_text(encoding="utf-8")
    links = Links(text)
    assert len(links.loaded) == 2
    assert all(address.startswith("data:image/svg+xml;base64,") for address in links.loaded)
    assert not {"script", "link", "iframe", "object"} & set(links.tags)
    assert not re.search(r"@import|url\(", text)
    outside = [address for address in links.followed if not address.startswith("#")]
    assert set(outside) == {"https://doi.org/10.1000/x"}
    assert {address[1:] for address in links.followed if address.startswith("#")} <= set(links.ids)


def test_the_page_words_every_verdict_and_names_its_pedigree(report: Path):
    text = re.sub(r"data:[^\"]*", "", report.read_text(encoding="utf-8"))
    for verdict, count in (("✓ holds", 3), ("✗ differs", 1), ("– not printed", 6)):
        assert text.count(f">{verdict}</span>") == count + 1, "and once in the overview"
    for word in (
        "2024-05-17",
        "numpy",
        np.__version__,
        "Python",
        "modulus of the fibres",
        "70 GPa",
        "Saga, N.",
    ):
        assert word in text
    assert "straight fibres &lt;in rubber&gt;" in text
    assert "480 ± 1" in text
    assert "≥ 0.3 ± 0.1" in text
    assert "Series" in text, "a table that is not shown is named with its file"


def test_two_runs_give_the_same_bytes(tmp_path: Path):
    first, second = (
        write_report([a_chapter()], tmp_path / name, date=DATE).parent for name in "ab"
    )
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert len(files) == 6
    for file in files:
        assert (first / file).read_bytes() == (second / file).read_bytes(), file


def test_a_dense_figure_enters_the_page_as_pixels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("airmuscle.report.write.MAX_SVG_BYTES", limit := MAX_SVG_BYTES // 10)
    figure, axes = plotting.new_figure()
    axes.plot(
        *np.random.default_rng(0).normal(size=(2, 4000))
    )  # a line: many markers are an image in any case
    chapter = Chapter("p", "t", "s", plots=(Plot("dense", "Dense", figure),))
    page = write_report([chapter], tmp_path, date=DATE)
    assert (tmp_path / "figures" / "dense.svg").stat().st_size > limit
    assert Links(page.read_text(encoding="utf-8")).loaded[0].startswith("data:image/png;base64,")


def test_two_figures_of_one_name_are_refused(tmp_path: Path):
    with pytest.raises(
        ValueError, match=r"plots: names must be unique and valid file names; check Saga 2007 iso"
    ):
        write_report([a_chapter(), a_chapter()], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_report_without_claims_writes_none(tmp_path: Path):
    write_report([dataclasses.replace(a_chapter(), claims=())], tmp_path, date=DATE)
    assert not (tmp_path / "claims.json").exists()
    assert "Overview of the claims" not in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_other_files_in_the_folder_stay(tmp_path: Path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "mine.csv").write_text("1")
    (tmp_path / "report.html").write_text("old")
    write_report([a_chapter()], tmp_path, date=DATE)
    assert (tmp_path / "data" / "mine.csv").read_text() == "1"
    assert (tmp_path / "report.html").read_text(encoding="utf-8") != "old"


# Whole or not at all


def blocked_by_a_file(tmp_path: Path) -> Path:
    (tmp_path / "taken").write_text("a file")
    return tmp_path / "taken" / "deep"


def blocked_by_permission(tmp_path: Path) -> Path:
    (tmp_path / "locked").mkdir(mode=0o500)
    if os.access(tmp_path / "locked", os.W_OK):
        pytest.skip("this user may write anywhere")
    return tmp_path / "locked" / "deep"


def blocked_by_a_folder(tmp_path: Path) -> Path:
    (tmp_path / "claims.json").mkdir()
    return tmp_path


@pytest.mark.parametrize("blocked", [blocked_by_a_file, blocked_by_permission, blocked_by_a_folder])
def test_a_folder_that_cannot_be_written_is_named_and_left_alone(
    tmp_path: Path, blocked: Callable[[Path], Path]
):
    folder = blocked(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FileError) as caught:
        write_report([a_chapter()], folder)
    assert str(caught.value).startswith(f"{folder}: cannot be written to: ")
    assert str(caught.value).endswith("Specify a folder with write permission.")
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("reason", [SolveError("no"), KeyboardInterrupt()])
def test_work_that_breaks_off_leaves_nothing(tmp_path: Path, reason: BaseException):
    def work() -> None:
        with atomic_folder(tmp_path / "deep" / "out") as place:
            (place / "half").write_text("half")
            raise reason

    with pytest.raises(type(reason)):
        work()
    assert list(tmp_path.rglob("*")) == []


def test_asking_whether_a_folder_is_writable_leaves_nothing(tmp_path: Path):
    check_writable(tmp_path / "deep" / "out")
    assert list(tmp_path.rglob("*")) == []


# Wording


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1234567.0, "1.235e+06"),
        (2.6167e-9, "2.617e-09"),
        (101325.0, "101300"),
        (281.4976, "281.5"),
        (-0.0, "0"),
        (-1e-9 * 0, "0"),
        (250_000, "250000"),
        (3, "3"),
        (np.float64(0.5), "0.5"),
        (None, "–"),
        (math.nan, "–"),
        (-math.inf, "-∞"),
        ("circle", "circle"),
        (True, "yes"),
    ],
)
def test_numbers_have_four_significant_digits(value: object, text: str):
    assert format_number(value) == text


def cell(header: str, value: object) -> str:
    """The HTML of a cell under a heading."""
    (column,) = shown_columns(Table("t", "t", {header: [value]}))
    return render_cell(column.cells[0], column)


@pytest.mark.parametrize(
    ("header", "value", "text"),
    [
        ("a_ij", "1.6846648427e-01", "0.1685"),
        ("a_ij", "-7.6323055877e-05", "−7.632 × 10⁻⁵"),
        ("rms [%]", "0.1118", "0.1118"),
        ("v", "-1.18 to -0.00", "−1.18 to 0.00"),
        ("force [N]", 1e-7, "10⁻⁷"),
        ("p-value", 2.95575e-309, "&lt; 0.001"),
        ("p-value", 0.04321, "0.043"),
        ("p-value", math.nan, "–"),
        ("unit", "kg m^2", "kg m²"),
        ("unit", "1", ""),
        ("method", "Rodas4(rtol=1e-06)", "Rodas4(rtol=1e-06)"),
        ("length", "30 mm <a>", "30\u00a0mm &lt;a&gt;"),
    ],
)
def test_a_cell_of_the_page(header: str, value: object, text: str):
    assert cell(header, value) == text


def test_a_header_shows_no_unit_1():
    assert render_header("contraction [1]") == "contraction"
    assert render_header("area [mm2]") == "area [mm²]"
    assert render_header("N/A") == "N/A"


def test_a_symbol_of_a_table_is_mathml():
    assert "<msub><mi>&#x003B5;</mi><mrow><mn>0</mn></mrow></msub>" in cell("symbol", "eps_0")
    assert "<msub><mi>p</mi><mtext>amb</mtext></msub>" in cell("symbol", "p_amb")
    assert cell("symbol", "geometry.radius") == "geometry.radius", "a path is no formula"


def test_formulas_are_mathml_on_the_page_and_plain_in_the_files(tmp_path: Path):
    formula = r"\(k = k_\text{max}\,(1 - \text{e}^{v})\)"
    plot = dataclasses.replace(a_plot("p"), caption=f"Curve {formula}.")
    table = Table(
        "t", f"Table {formula}", {r"\(k_\text{max}\) [%]": [40.0], "law": [r"\(w = 2\), line A"]}
    )
    claim = Claim("p", f"claim {formula} <b>", Equal(1.0), 1.0, "1", note=r"with \(k_\text{max}\)")
    chapter = Chapter(
        "p", "t", f"Summary {formula}.", claims=(claim,), tables=(table,), plots=(plot,)
    )
    page = write_report([chapter], tmp_path, date=DATE).read_text(encoding="utf-8")
    assert page.count("<math") == 7
    assert "\\(" not in page
    assert 'alt="Curve k = k_max (1 - e^v)."' in page
    assert "<msup><mtext>e</mtext><mrow><mi>v</mi></mrow></msup>" in page
    assert "&lt;b&gt;" in page
    assert not {"script", "link", "img:http"} & set(Links(page).tags)
    stored = json.loads((tmp_path / "claims.json").read_text(encoding="utf-8"))[0]
    assert (stored["claim"], stored["note"]) == ("claim k = k_max (1 - e^v) <b>", "with k_max")
    with (tmp_path / "data" / "t.csv").open(encoding="utf-8", newline="") as file:
        assert list(csv.reader(file)) == [["k_max [%]", "law"], ["40.0", "w = 2, line A"]]


@pytest.mark.parametrize(
    ("latex", "text"),
    [
        (r"-p\,\frac{\text{d}V}{\text{d}L}", "-p dV/dL"),
        (r"1 - \text{SSE}/\text{SST}", "1 - SSE/SST"),
        (r"x^{-2}", "x^(-2)"),
        (r"\frac{a + b}{c}", "(a + b)/c"),
        (r"\varepsilon_{0i}", "ε_0i"),
        (r"k < k_\text{max}", "k < k_max"),
    ],
)
def test_the_plain_form_of_a_formula(latex: str, text: str):
    assert to_plain(rf"\({latex}\)") == text


def test_a_formula_in_a_figure_is_mathtext():
    assert to_mathtext(r"\(w = 2\), line A") == "$w = 2$, line A"


def test_a_bound_reads_as_one():
    assert format_published(Claim("p", "c", AtMost(2.0, 0.5), 1.0, "1")) == "≤ 2 ± 0.5"
    assert format_published(Claim("p", "c", None, 1.0, "1")) == "–"


# Reproducing


def add_paper(monkeypatch: pytest.MonkeyPatch, name: str, chapter: Callable[[], Chapter]) -> None:
    module = types.ModuleType(f"paper_{name}")
    module.chapter = chapter  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(run.PAPERS, name, module.__name__)


@pytest.fixture
def two_papers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "PAPERS", {})
    add_paper(monkeypatch, "saga2007", a_chapter)
    add_paper(monkeypatch, "borzikova", lambda: a_chapter("Borzikova"))


def papers_in(folder: Path) -> list[str]:
    claims = json.loads((folder / "claims.json").read_text(encoding="utf-8"))
    return list(dict.fromkeys(claim["paper"] for claim in claims))


@pytest.mark.usefixtures("two_papers")
@pytest.mark.parametrize(
    ("asked", "found"),
    [
        (None, ["Saga 2007", "Borzikova"]),
        (["b"], ["Borzikova"]),
        (["b", "saga2007", "s"], ["Saga 2007", "Borzikova"]),
    ],
)
def test_papers_are_named_by_a_unique_beginning(
    tmp_path: Path, asked: list[str] | None, found: list[str]
):
    assert run.reproduce(asked, tmp_path) == tmp_path / "report.html"
    assert papers_in(tmp_path) == found


@pytest.mark.usefixtures("two_papers")
def test_an_unknown_paper_is_refused_before_any_work(tmp_path: Path):
    with pytest.raises(
        UnknownNameError, match=r"no paper 'saga2008'; there are saga2007, borzikova.*'saga2007'\?"
    ):
        run.reproduce(["saga2008"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("two_papers")
def test_an_unwritable_folder_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    add_paper(monkeypatch, "saga2007", lambda: pytest.fail("the work began"))
    with pytest.raises(FileError, match="taken"):
        run.reproduce(None, blocked_by_a_file(tmp_path))


@pytest.mark.usefixtures("two_papers")
@pytest.mark.parametrize("reason", [SolveError("no"), KeyboardInterrupt()])
def test_an_interrupted_run_leaves_the_chapters_that_are_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: BaseException
):
    def breaks_off() -> Chapter:
        raise reason

    add_paper(monkeypatch, "borzikova", breaks_off)
    with pytest.raises(type(reason)):
        run.reproduce(None, tmp_path)
    assert papers_in(tmp_path) == ["Saga 2007"]
    assert "(incomplete)" in (tmp_path / "report.html").read_text(encoding="utf-8")


PAPER_MODULE = """
import time
from airmuscle.core.plotting import new_figure
from airmuscle.report.chapter import Chapter, Plot
from airmuscle.report.claims import Claim, Equal

def chapter():
    time.sleep({seconds})
    figure, axes = new_figure()
    axes.plot([0, 1], [0, 1])
    return Chapter("{name}", "Title", "Text.", (Claim("{name}", "c", Equal(1.0), 1.0, "1"),), plots=(Plot("{name}", "p", figure),))
"""


def write_papers(folder: Path, monkeypatch: pytest.MonkeyPatch, seconds: dict[str, float]) -> None:
    """Modules of papers that other processes can import too."""
    for name, duration in seconds.items():
        (folder / f"paper_{name}.py").write_text(
            PAPER_MODULE.format(name=name, seconds=duration), encoding="utf-8"
        )
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(run, "PAPERS", {name: f"paper_{name}" for name in seconds})


def test_processes_write_the_same_report_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_papers(tmp_path, monkeypatch, {"first": 0.0, "second": 0.0})
    run.reproduce(None, tmp_path / "one", workers=1)
    run.reproduce(None, tmp_path / "two", workers=2)
    for file in ("claims.json", "figures/first.svg", "figures/first.png", "figures/second.svg"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), (
            file
        )


def test_an_interruption_does_not_wait_for_the_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    write_papers(tmp_path, monkeypatch, {"long": 300.0, "short": 0.0})

    def interrupt(name: str, chapter: Chapter, seconds: float) -> None:
        raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run.reproduce(None, tmp_path / "out", workers=2, finished=interrupt)
    assert time.monotonic() - start < 120.0
    assert papers_in(tmp_path / "out") == ["short"]


def test_the_table_of_papers_names_modules_of_this_package():
    assert list(run.PAPERS) == ["saga2007", "borzikova", "hosovsky"]
    assert all(module.startswith("airmuscle.papers.") for module in run.PAPERS.values())


def test_a_chosen_bound_is_never_given_out_as_published():
    claim = Claim("paper", "low pressure", AtMost(0.04, chosen=True), 0.03, "MPa")
    assert claim.verdict == "holds"
    assert claim.as_dict()["published"] is None
    assert claim.as_dict()["tolerance"] == 0.04
    assert format_published(claim) == "≤ 0.04 (chosen)"


def test_a_derived_value_is_never_given_out_as_published():
    claim = Claim("paper", "conductance", Equal(15.7, 0.005, derived=True), 15.7002, "NL/(min bar)")
    record = claim.as_dict()
    assert (record["verdict"], record["published"], record["expected"], record["tolerance"]) == (
        "holds",
        None,
        15.7,
        0.005,
    )
    assert format_published(claim) == "15.7 ± 0.005 (derived)"


def cases(*values: float | None, kind: Kind = Kind.CLAIM, **more: bool) -> tuple[Claim, ...]:
    return tuple(
        Claim("paper", "strong", AtLeast(1.0), value, "1", case=f"line {i}", kind=kind, **more)
        for i, value in enumerate(values)
    )


@pytest.mark.parametrize(
    ("claims", "verdict"),
    [
        (cases(2.0, 3.0), "holds"),
        (cases(0.0, 0.5), "differs"),
        (cases(2.0, 0.5), "depends"),
        (cases(2.0, None), "holds"),
        (cases(None), "not printed"),
        (cases(2.0, 0.5, untestable=True), "not testable"),
    ],
)
def test_a_statement_with_several_cases_counts_once(claims: tuple[Claim, ...], verdict: str):
    (statement,) = statements(claims)
    assert statement.verdict == verdict
    assert {key: count for key, count in count_verdicts(claims).items() if count} == {verdict: 1}


def test_a_note_that_all_cases_share_stands_once(tmp_path: Path):
    same = tuple(dataclasses.replace(case, note="Note of all.") for case in cases(2.0, 0.5))
    page = write_report([Chapter("paper", "t", "s", same)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    assert page.count("Note of all.") == 1
    other = (dataclasses.replace(same[0], note="Another note."), same[1])
    page = write_report([Chapter("paper", "t", "s", other)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    assert (page.count("Note of all."), page.count("Another note.")) == (1, 1)


def test_checks_and_comparisons_are_listed_and_counted_apart(tmp_path: Path):
    claims = (*cases(2.0, 0.5), *cases(1.0, kind=Kind.CHECK), *cases(0.0, kind=Kind.FINDING))
    assert [sum(count_verdicts(claims, kind).values()) for kind in Kind] == [1, 1, 1]
    assert count_verdicts(claims, Kind.CHECK)["holds"] == 1
    page = write_report([Chapter("paper", "t", "s", claims)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    headings = re.findall(r"<h3>(.*?)</h3>", page)
    assert headings == [
        "Overview of the claims",
        "Claims of the paper",
        "Comparisons of this report, which the paper does not make",
        "Checks of the computation",
    ]
    assert (
        ">± depends</span>"
        in page.partition("Claims of the paper")[2].partition("Comparisons of this")[0]
    )
    kinds = [
        record["kind"]
        for record in json.loads((tmp_path / "claims.json").read_text(encoding="utf-8"))
    ]
    assert kinds == ["claim", "claim", "check", "comparison"]


def test_the_readings_of_a_claim_are_folded_beneath_it_and_counted(tmp_path: Path):
    claims = (*cases(2.0, 3.0, 0.5), Claim("paper", "single", AtLeast(1.0), 2.0, "1"))
    page = write_report([Chapter("paper", "t", "s", claims)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    assert "<summary>3 readings: 2 hold, 1 differs</summary>" in page
    assert page.count("<details") == 1
    assert page.count(">strong") == 1, "the claim stands once"


def test_the_range_of_the_readings_and_the_place_of_a_claim_are_seen_without_unfolding(
    tmp_path: Path,
):
    """The range contains the readings with the criterion and the unit of the first one."""
    share = Claim("paper", "strong", AtLeast(100.0), 87.0, "%", case="all chosen values")
    claims = (*(dataclasses.replace(case, place="Fig. 8") for case in cases(2.0, None, 0.5)), share)
    (statement,) = statements(claims)
    assert format_reproduced(statement) == "0.5 to 2"
    page = write_report([Chapter("paper", "t", "s", claims)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    unfolded = page.partition("<details")[0]
    assert ">≥ 1<" in unfolded
    assert ">0.5 to 2<" in unfolded
    assert ">Fig. 8<" in unfolded
    assert "no page numbers" in unfolded
    assert format_reproduced(statements(cases(3.0, 3.0))[0]) == "3"
    assert format_reproduced(statements(cases(None))[0]) == "–"


def test_answers_terms_and_commands_stand_before_the_claims_and_a_folded_table_after_its_title(
    tmp_path: Path,
):
    chapter = Chapter(
        "paper",
        "t",
        "Summary.",
        cases(2.0),
        (Table("long", "A long table", {"x [1]": [1.0]}, folded=True),),
        answers=(("May I use it?", "Yes & no."),),
        terms=((r"\(w\)", "A factor."),),
        commands=(("airmuscle list", "Names."),),
    )
    page = write_report([chapter], tmp_path, date=DATE).read_text(encoding="utf-8")
    order = [
        "<dt>May I use it?</dt><dd>Yes &amp; no.</dd>",
        "Summary.",
        "A factor.",
        "<code>airmuscle list</code>",
        "Claims of the paper",
        '<details class="table"><summary',
    ]
    assert sorted(order, key=page.index) == order


def test_the_page_explains_each_verdict_and_counts_each_kind_first(tmp_path: Path):
    claims = (*cases(2.0, 0.5), *cases(1.0, kind=Kind.CHECK), *cases(0.0, kind=Kind.FINDING))
    page = write_report([Chapter("paper", "t", "s", claims)], tmp_path, date=DATE).read_text(
        encoding="utf-8"
    )
    overview = page.partition("Overview of the claims")[2].partition("</section>")[0]
    for verdict, meaning in MEANINGS.items():
        assert f"{MARKS[verdict]} {verdict}</span></dt><dd>{meaning}</dd>" in overview
    assert "1 claim of the papers" in overview
    assert "1 check of the computation" in overview


def test_the_tables_of_the_page_are_in_display_units_and_their_files_are_not(tmp_path: Path):
    columns = {
        "pressure": TableColumn([1e5, 2e5], "Pa", "MPa"),
        "value": TableColumn([0.3, 2.0], BY_ROW),
        "unit": ["m", "1"],
    }
    chapter = Chapter("paper", "t", "s", tables=(Table("sizes", "Sizes", columns),))
    with display("bar", "mm"):
        page = write_report([chapter], tmp_path / "chosen", date=DATE).read_text(encoding="utf-8")
    usual = write_report([chapter], tmp_path / "usual", date=DATE).read_text(encoding="utf-8")
    assert "pressure [bar]" in page
    assert ">300</td>" in page
    assert ">mm</td>" in page
    assert "pressure [MPa]" in usual
    assert ">0.3</td>" in usual
    files = [(tmp_path / name / "data" / "sizes.csv").read_bytes() for name in ("chosen", "usual")]
    assert files[0] == files[1]


def test_a_meaning_that_all_coefficients_share_is_shown_once_and_its_file_keeps_it(tmp_path: Path):
    columns = {"parameter": ["a", "b", "c"], "meaning": ["coefficients", "coefficients", "limit"]}
    chapter = Chapter("paper", "t", "s", tables=(Table("t", "t", columns),))
    write_report([chapter], tmp_path, date=DATE)
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count("coefficients") == 1
    assert (tmp_path / "data" / "t.csv").read_text(encoding="utf-8").count("coefficients") == 2


def test_wide_equations_and_texts_of_tables_scroll_in_their_boxes_on_a_phone(report: Path):
    page = report.read_text(encoding="utf-8")
    assert ".equation { overflow-x: auto; }" in page
    assert ".scroll td:not(.right, .short) { min-width: 15rem; }" in page
