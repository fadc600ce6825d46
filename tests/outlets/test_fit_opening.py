"""The report of a static fit begins with the result: a sentence, points and law, the numbers with
their intervals, the use, and what to measure next.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import write
from airmuscle.bench.comparison import LawSelection, compare, error_interval, result_chapter


@pytest.fixture(scope="module")
def reported(tmp_path_factory) -> tuple[str, dict]:
    """Page and JSON of a comparison on data of the library."""
    folder = tmp_path_factory.mktemp("fit")
    write(am.load_data("dmsp-20-300"), folder / "bench.csv")
    out = folder / "out"
    done = airmuscle("fit", folder / "bench.csv", "--compare", "--out", out, "--json")
    assert done.exit_code == 0, done.stderr
    return (out / "report.html").read_text("utf-8"), json.loads(done.stdout)


def position(page: str, text: str) -> int:
    assert text in page, text
    return page.index(text)


def test_result_picture_numbers_and_use_stand_before_contents_formula_and_ranking(reported):
    page = reported[0]
    order = ["rms error of", "<img", "rms error, rows of the fit", "Use it for", "Measure next"]
    order += ["<nav", "Parameters as symbols", "Ranking by cross-validation"]
    places = [position(page, text) for text in order]
    assert places == sorted(places)


def test_the_numbers_are_those_of_fit_and_comparison(reported):
    page, data = reported
    stated = data["result"]["rms_error_rows_of_the_fit"]
    assert stated == data["fit"]["rms_error"]
    judged = [value for key, value in data["result"].items() if key.startswith("rms_error_levels")]
    assert judged == [data["comparison"]["ranking"][0]["cross_validation_rms_error"]]
    (shown,) = re.findall(r"rms error, rows of the fit</dt><dd>([\d.]+)", page)
    assert float(shown) == pytest.approx(stated, rel=2e-3)


def test_the_picture_is_shown_once(reported):
    assert len(re.findall(r'id="isobars"', reported[0])) == 1


def test_a_long_ranking_shows_six_laws_and_unfolds_to_all(tmp_path: Path):
    from airmuscle.report import Chapter, Table, write_report

    table = Table("t", "Title", {"law": [f"law {i}" for i in range(9)]}, head=6)
    write_report([Chapter("c", "C", "Text.", tables=(table,))], tmp_path, title="T")
    page = (tmp_path / "report.html").read_text("utf-8")
    assert page.count("law 5<") == 2
    assert page.count("law 6<") == 1
    assert "All 9 rows" in page


def test_the_interval_of_an_error_contains_it_and_narrows_with_equal_parts():
    class Part:
        def __init__(self, rmse: float) -> None:
            self.rmse = rmse
            self.rows = 10

    class Model:
        fold_scores = tuple(Part(rmse) for rmse in (2.0, 3.0, 4.0, 5.0, 6.0))

    low, high = error_interval(Model())
    error = np.sqrt(np.mean([part.rmse**2 for part in Model.fold_scores]))
    assert low < error < high
    Model.fold_scores = (Part(3.0),) * 5
    assert error_interval(Model()) == pytest.approx((3.0, 3.0))
    Model.fold_scores = (Part(3.0),) * 3
    assert error_interval(Model()) is None


@pytest.mark.parametrize("misfit", [None, "The law does not follow the data."])
def test_a_law_is_recommended_only_where_it_follows_the_data(misfit, monkeypatch):
    bench = am.load_data("dmsp-20-300")
    comparison = compare(bench)
    model = comparison.recommended
    fitted = model.fit.chapter()
    monkeypatch.setattr(am.Fit, "misfit", misfit)
    selection = LawSelection((comparison,), (model,), "")
    chapter = result_chapter.result_chapter("T", model.fit, fitted, [bench], selection)
    words = "the best of those compared" if misfit else "recommended"
    assert f", {words} by cross-validation," in chapter.paragraphs[0]
    assert chapter.paragraphs[1:] == ((misfit,) if misfit else ())
