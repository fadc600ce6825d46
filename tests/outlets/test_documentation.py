"""Documentation: every page, model, command and function has its place, links lead somewhere,
formulas are valid.

The generators of the site run here; Sphinx itself only in the slow test, if it is installed.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import make_front_figure
import numpy as np
import printed
import pytest
from book import command_pages, function_pages, gallery, model_pages
from book.accessible import accessible
from book.ascii_math import FormulaError, to_latex
from book.contents import DOCS, ROOT, broken_links, documents, listed, parts
from book.docstrings import to_markdown
from book.formulas_in_text import markdown
from book.search_index import page_rows
from book.sources import COPIED, index, site_text
from code_blocks import alternatives, python_blocks
from matplotlib.image import imread as image_of

import airmuscle
from airmuscle.bench import write
from airmuscle.core import parameters
from airmuscle.files.library import model_class, model_names
from airmuscle.outlets.cli import COMMANDS, app
from airmuscle.report import to_display_mathml

FORMULA = re.compile(r"```\{math\}\n(.*?)\n```|\{math\}`([^`]+)`", re.DOTALL)

BOOK = ROOT / "release" / "book"


@pytest.fixture(scope="module")
def models() -> dict[str, str]:
    """The generated pages of the models."""
    return dict(model_pages.pages())


# Contents


def test_every_page_is_in_the_index_once():
    pages = [target for target in listed() if not target.startswith("../")]
    assert sorted(pages) == sorted(path.relative_to(DOCS).as_posix() for path in documents())


def test_the_four_parts_are_in_the_index():
    titles = {part.above or part.title for part in parts()}
    assert titles >= {"Tutorials", "How-to guides", "Reference", "Explanation"}


@pytest.mark.parametrize(
    "page", [*documents(), ROOT / "README.md", DOCS / "README.md"], ids=lambda path: path.name
)
def test_relative_links_lead_to_a_file_and_a_heading(page: Path):
    assert broken_links(page) == []


def test_a_link_without_a_target_is_found(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text(
        "# Title\n\n[a](#title) [b](#none) [c](none.md) ![d](none.png)\n\n```\n[e](code.md)\n```\n"
    )
    assert broken_links(page) == ["page.md: #none", "page.md: none.md", "page.md: none.png"]


def test_the_table_of_contents_of_the_site_has_all_pages():
    text = index(parts())
    trees = "\n".join(re.findall(r"```\{toctree\}(.*?)```", text, re.DOTALL)).splitlines()
    assert {path.stem for path in documents()} | {
        name.removesuffix(".md") for name in COPIED
    } <= set(trees)
    assert {"models/index", "commands/index", "functions/index"} <= set(trees)


@pytest.mark.parametrize("name", COPIED)
def test_a_page_from_outside_docs_has_its_images_and_skips_no_level_of_headings(name: str):
    text = site_text((ROOT / name).read_text("utf-8"), depth=name.count("/"))
    levels = [
        len(marks)
        for marks in re.findall(
            r"^(#+) ", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M
        )
    ]
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    images = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)
    assert [
        image
        for image in images
        if not (DOCS / image.removeprefix("../" * name.count("/"))).exists()
    ] == []


# Reference


def test_every_model_has_a_page_with_its_parameters_and_references(models: dict[str, str]):
    pages = {
        path.rpartition("/")[2]: text for path, text in models.items() if not path.endswith("index")
    }
    assert set(pages) == set(model_names())
    for name, text in pages.items():
        cls = model_class(name, "test")
        declared = parameters(cls) if dataclasses.is_dataclass(cls) else ()
        assert [p.name for p in declared if f"| `{p.name}` |" not in text] == [], name
        references = getattr(cls, "references", ()) or ()
        assert [r.key for r in references if model_pages.reference_text(r) not in text] == [], name


def test_every_formula_of_the_models_is_valid_mathematics(models: dict[str, str]):
    texts = {
        latex
        for page in models.values()
        for pair in FORMULA.findall(page)
        for latex in pair
        if latex
    }
    assert len(texts) > 300
    for latex in texts:
        assert ElementTree.fromstring(to_display_mathml(latex)).tag.endswith("math"), latex
        assert "\\" not in "".join(ElementTree.fromstring(to_display_mathml(latex)).itertext()), (
            latex
        )


def test_laws_of_papers_show_a_formula(models: dict[str, str]):
    tables = {"Tabulated", "TabulatedGeometry"}
    papers = [
        cls
        for cls in (model_class(n, "test") for n in model_names())
        if getattr(cls, "references", ())
    ]
    laws = {
        cls.__name__
        for cls in papers
        if "characteristic" in cls.__module__ or "friction" in cls.__module__
    } - tables
    pages = {path.rpartition("/")[2]: text for path, text in models.items()}
    without = {name for name in laws if "{math}" not in pages[name]}
    assert without == set()


def test_every_command_and_option_is_on_a_page():
    pages = dict(command_pages.pages())
    context = app.make_context("airmuscle", ["list"], resilient_parsing=True)
    for row in COMMANDS:
        text = pages[f"commands/{row.name}"]
        options = [
            name
            for p in app.get_command(context, row.name).params
            for name in p.opts
            if name.startswith("--")
        ]
        assert [name for name in options if name != "--help" and f"`{name}`" not in text] == [], (
            row.name
        )


def test_every_public_function_of_the_top_level_is_on_a_page():
    text = dict(function_pages.pages())["functions/airmuscle"]
    functions = [n for n in airmuscle.__all__ if type(getattr(airmuscle, n)).__name__ == "function"]
    assert [name for name in functions if f"## {name}\n\n```python\n{name}(" not in text] == []


def test_every_package_of_the_interface_has_names_on_its_page():
    pages = dict(function_pages.pages())
    assert [
        face for face in function_pages.FACES if "\n## " not in pages[f"functions/{face}"]
    ] == []


# Formulas


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("a/b c", r"\frac{a}{b} c"),
        ("(a + b)/(2 c)", r"\frac{a + b}{2 c}"),
        ("sin(psi)/psi", r"\frac{\sin \left( \psi \right)}{\psi }"),
        ("x^(3/2)", r"x^{\frac{3}{2}}"),
        ("k_max", r"k_{\text{max}}"),
        ("z_i'", r"z_{i}'"),
        ("dV/deps", r"\frac{\mathrm{d}V}{\mathrm{d}\varepsilon }"),
        ("Sum_{i=0..m} a_ij", r"\sum_{i = 0 \ldots m} a_{ij}"),
        ("sqrt|s| <= 1e-3", r"\sqrt{\left| s \right|} \le 1 \cdot 10^{-3}"),
        ("s(p) F_1", r"s\left( p \right) F_{1}"),
    ],
)
def test_plain_formulas_become_latex(text: str, latex: str):
    def plain(formula: str) -> str:
        return re.sub(r"\s+", "", formula)

    assert plain(to_latex(text)) == plain(latex)


@pytest.mark.parametrize("text", ["(a + b", "a + b)", "/ b", "a ^", "a \N{SNOWMAN} b", "|x"])
def test_a_text_that_is_no_formula_is_refused(text: str):
    with pytest.raises(FormulaError):
        to_latex(text)


def test_prose_keeps_its_words_and_formulas_are_found_in_it():
    text = markdown("A muscle with k_max = 0.4 and a * b < c [Pa], see `code_x`.")
    assert text.startswith("A muscle with {math}`k_{\\text{max}} = 0.4` and")
    assert text.endswith("see `code_x`.")


def test_names_of_the_code_in_prose_are_no_formulas():
    assert markdown("with min_angle and initial_state") == "with min\\_angle and initial\\_state"
    assert (
        markdown("with eps_max and F_KE")
        == "with {math}`\\varepsilon _{\\text{max}}` and {math}`F_{\\text{KE}}`"
    )


def test_a_docstring_has_its_formula_displayed():
    text = to_markdown("Linear law: F = k x.\n\nx: stretch [m]; k: stiffness.\n")
    assert text.startswith("Linear law.\n\n```{math}\nF = k x\n```")
    assert "{math}`x`: stretch" in text


def test_arguments_of_a_function_become_a_list():
    text = to_markdown(
        "Simulate it.\n\nplant      a System [1]\nduration   time, of\n           a run [s]\n"
    )
    assert text.endswith("* `plant`: a System \\[1\\]\n* `duration`: time, of a run \\[s\\]\n")


def test_indented_formulas_of_a_page_are_rendered_and_commands_are_not():
    page = (
        "Text\n\n    m x'' = F - m g,   F = k x\n\nText\n\n    airmuscle evaluate dmsp-20-300"
        " --force = 3\n\nText\n"
    )
    text = site_text(page)
    assert text.count("```{math}") == 1
    assert "    airmuscle evaluate" in text


def test_links_of_the_site_stay_within_it():
    page = (
        "[a](../benchmarks/RESULTS.md) [b](control.md#pid) [c](../AGENTS.md) [d](https://doi.org/1)"
    )
    assert (
        site_text(page) == "[a](benchmarks/RESULTS.md) [b](control.md#pid) c [d](https://doi.org/1)"
    )
    assert all((ROOT / name).exists() for name in COPIED)


# Gallery


def test_the_first_figure_of_the_gallery_is_made():
    assert gallery.figure_of(gallery.examples()[0]).axes


@pytest.mark.slow
@pytest.mark.parametrize("example", gallery.examples(), ids=lambda each: each.title)
def test_every_figure_of_the_gallery_is_made(example: gallery.Example):
    assert gallery.figure_of(example).axes


# Code of the pages


def test_an_alternative_in_a_comment_replaces_the_value_that_it_follows():
    block = 'a = f(\n    1\n)  # or g("x", b=2)\nc = a  # or simply the same\nd = h(a)\n'
    assert alternatives(block) == ['a = g("x", b=2)\nc = a  # or simply the same\nd = h(a)\n']


@pytest.mark.parametrize(
    ("page", "block"),
    [
        pytest.param(page, block, id=page.name)
        for page in (BOOK / "index.md", ROOT / "README.md", *documents())
        for text in python_blocks(page)
        for block in alternatives(text)
    ],
)
def test_code_in_comments_runs_as_the_code_beside_it(page: Path, block: str, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(airmuscle.load_data("dmsp-20-300"), Path("bench.csv"))
    exec(compile(block, page.name, "exec"), {})


def test_the_first_page_and_the_readme_give_an_alternative_in_a_comment():
    for page in (BOOK / "index.md", ROOT / "README.md"):
        assert any(map(alternatives, python_blocks(page)))


@pytest.mark.drawn
def test_the_picture_of_the_first_page_is_what_its_block_draws(tmp_path: Path):
    """The same picture in squares of 8 by 8 pixels, whose mean brightness differs by a few per cent
    between versions of the fonts."""
    make_front_figure.main(tmp_path / "drawn.png")
    pictures = [brightness(path) for path in (tmp_path / "drawn.png", make_front_figure.PICTURE)]
    assert pictures[0].shape == pictures[1].shape
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.01
    assert np.corrcoef(pictures[0].ravel(), pictures[1].ravel())[0, 1] > 0.9
    text = (BOOK / "index.md").read_text(encoding="utf-8")
    block = text.index("```python")
    image = re.search(r"!\[[^]]*\]\(([^)]+)\)", text[block:])
    assert image is not None
    assert DOCS / image[1] == make_front_figure.PICTURE


def brightness(path: Path, size: int = 8) -> np.ndarray:
    """The mean brightness of squares of pixels, from 0 to 1."""
    pixels = image_of(path)[..., :3].mean(axis=2)
    rows, columns = (length // size * size for length in pixels.shape)
    squares = pixels[:rows, :columns].reshape(rows // size, size, columns // size, size)
    return squares.mean(axis=(1, 3))


# Site


@pytest.mark.slow
def test_the_site_is_built_without_warnings_and_needs_no_network(tmp_path: Path):
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    pytest.importorskip("furo", reason="the extra docs is not installed")
    from book.build import main  # imports the studio, which only this test needs

    assert main(["--out", str(tmp_path), "--without-figures"]) == 0
    pages = list((tmp_path / "html").rglob("*.html"))
    assert len(pages) > len(documents())
    loaded = re.compile(r"<(?:script|img|iframe|link)\b[^>]*\b(?:src|href)=\"(?:https?:)?//")
    assert (tmp_path / "html" / "_static" / "page" / "index.html").is_file()
    assert [page.name for page in pages if loaded.search(page.read_text(encoding="utf-8"))] == []
    law = (tmp_path / "html" / "models" / "characteristic" / "TonduLopez2000.html").read_text(
        encoding="utf-8"
    )
    assert "<math" in law


def test_symbols_in_running_text_are_typeset():
    text = (
        "The angle theta_g and eps of r_1, `theta_g`, [a](theta_g.md), 30 psi, x_y.z,"
        " tests/rho_1.py and rho."
    )
    assert site_text(text) == (
        r"The angle {math}`\theta _{g}` and {math}`\varepsilon` of {math}`r_{1}`, `theta_g`, a, 30"
        r" psi, x_y.z, "
        r"tests/rho_1.py and {math}`\rho`."
    )


def test_captions_landmarks_and_regions_that_scroll_are_accessible():
    page = (
        '<p class="caption" role="heading">A</p><aside'
        ' class="sidebar-drawer"><pre><span></span>x</pre></aside>'
    )
    assert (
        accessible(page)
        == '<p class="caption" role="heading" aria-level="2">A</p><aside class="sidebar-drawer"'
        ' aria-label="Pages"><pre tabindex="0"><span></span>x</pre></aside>'
    )


def test_the_index_of_the_search_has_each_section_with_its_text():
    article = (
        '<section id="a"><h1>Reading<a class="headerlink" href="#a">#</a></h1><p>Decimal &amp;'
        ' <b>comma</b></p><section id="b"><h2>Units<a class="headerlink"'
        ' href="#b">#</a></h2><p>kPa</p></section></section>'
    )
    assert page_rows("reading.html", article) == [
        ["Reading", "Reading", "reading.html", "Decimal & comma"],
        ["Reading", "Units", "reading.html#b", "kPa"],
    ]


SEARCHED = (
    [
        "Reading",
        "Reading",
        "reading.html",
        "Files of German loggers with a decimal comma. A displacement has a zero.",
    ],
    ["Units", "Units", "units.html", "The decimal point of reports."],
    ["Joints", "Joints", "joints.html", "Two muscles on a pulley are displaced."],
)


@pytest.mark.parametrize(
    ("query", "first"),
    [
        ("German decimal comma", "reading.html"),
        ("displacements", "reading.html"),
        ("pulleys", "joints.html"),
        ("point of a report", "units.html"),
        ("hydraulics", None),
    ],
)
def test_the_search_takes_all_forms_of_any_of_the_words(
    query: str, first: str | None, tmp_path: Path
):
    script = BOOK / "static" / "search.js"
    call = f"require({json.dumps(str(script))}).search({json.dumps(query)}, {json.dumps(SEARCHED)})"
    done = subprocess.run(
        [printed.require("node"), "-p", f"({call}[0] || {{}}).address"],
        capture_output=True,
        text=True,
    )
    assert done.stdout.strip() == str(first or "undefined"), done.stderr


@pytest.mark.parametrize("page", documents(), ids=lambda path: path.name)
def test_lines_of_code_fit_the_column_of_the_site(page: Path):
    """Output of the program, in blocks without a language, scrolls."""
    blocks = re.findall(
        r"^```(?:python|sh|toml|c)\n(.*?)^```",
        page.read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
    assert [line for block in blocks for line in block.splitlines() if len(line) > 95] == []
