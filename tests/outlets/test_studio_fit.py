"""Tab Fit of the studio, its server: it reads files of users within limits, and fits as the library
does.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import subprocess
import sys
import time
import zipfile
from io import BytesIO
from urllib.parse import urlencode

import numpy as np
import pytest
from command_line import airmuscle
from studio_pages import InThisProcess, request
from studio_tasks import WorkerHere, fail, write_slowly

pytest.importorskip("starlette", reason="needs starlette")

from arm_episodes import made_episodes

import airmuscle as am
from airmuscle.bench import Candidate, ColumnMapping, LevelSplit, compare, read, standard_candidates
from airmuscle.bench.comparison import model_selection
from airmuscle.errors import IdentificationError
from airmuscle.outlets.studio import (
    FIT_WORKERS,
    MAX_SETTINGS,
    MAX_WAITING,
    BadRequest,
    FitQueue,
    FitService,
    LimitedWorker,
    UploadStore,
    arm_task,
    check_file_name,
    create_app,
    fit_routes,
    fit_uploads,
    run_fit,
    self_contained_page,
)
from airmuscle.report import Chapter, Plot, Table

LAW = am.load("dmsp-20-300").characteristic
COLUMNS = {
    "Zeit": {"quantity": "time", "unit": "s"},
    "Druck": {"quantity": "pressure", "unit": "bar"},
}
HEADINGS = {"Zeit": "time [s]", "Druck": "pressure [bar]"}


def german_table(levels=(1.0, 2.5, 4.0), rows=9, step=7.0):
    """A CSV file of a German logger: two units are not stated; the branches differ by twice `step`
    [N].
    """
    lines = ["Zeit;Druck;Kontraktion (%);Kraft (N);Kommentar"]
    time_ = 0.0
    there = np.linspace(0.0, 0.16, rows)
    for level in levels:
        for sign, contraction in [(1, c) for c in there] + [(-1, c) for c in there[::-1]]:
            force = (
                max(float(LAW.force(level * 1e5, contraction)), 0.0)
                - sign * step
                + 0.5 * np.sin(37 * time_)
            )
            lines.append(
                f"{time_:.1f};{level:.3f};{100 * contraction:.3f};{force:.2f};ok".replace(".", ",")
            )
            time_ += 0.5
    return "\n".join(lines).encode("latin-1")


@pytest.fixture
def app(tmp_path):
    """The application, which fits in this process."""
    return make_app(tmp_path)


def make_app(folder, task=run_fit, **options):
    queue = FitQueue(task, make_worker=WorkerHere, **options)
    return create_app(
        pool=InThisProcess(), fits=FitService(InThisProcess(), UploadStore(folder), queue)
    )


def upload(app, name, content, known=""):
    query = {"name": name, **({"set": known} if known else {})}
    return request(app, "POST", "/api/fit/file", content, query=urlencode(query).encode())


def post(app, address, **content):
    return request(app, "POST", f"/api/fit/{address}", json.dumps(content).encode())


def finished(app, task):
    for _ in range(6000):
        status = request(app, "GET", f"/api/fit/task/{task}").json()
        if status["state"] not in ("waiting", "running"):
            return status
        time.sleep(0.02)
    raise AssertionError("the fit has not ended")


def problems(answer):
    return {row["field"]: row["text"] for row in answer.json()["problems"]}


# What was understood


def test_columns_with_units_are_recognised_and_the_others_are_asked_for(app):
    """A problem names the field of the column; a correction removes it."""
    name = upload(app, "Messung.csv", german_table()).json()["set"]
    first = post(app, "read", set=name, settings={})
    assert set(problems(first)) == {"column:Druck"}  # one unit of time alone gives a usual record
    assert "unit of 'Druck' (pressure) is not stated" in problems(first)["column:Druck"]
    sheet = post(app, "read", set=name, settings={"columns": COLUMNS}).json()
    (columns,) = (file["columns"] for file in sheet["files"])
    assert [(c["quantity"], c["unit"]) for c in columns] == [
        ("time", "s"),
        ("pressure", "bar"),
        ("contraction", "%"),
        ("force", "N"),
        ("", ""),
    ]
    (recording,) = sheet["recordings"]
    assert sheet["ready"]
    assert [(run["kind"], run["level"]) for run in recording["runs"]] == [
        ("isobaric", "pressure 100 kPa"),
        ("isobaric", "pressure 250 kPa"),
        ("isobaric", "pressure 400 kPa"),
    ]
    assert recording["branches"] == 6
    assert recording["points"]["pressure"][0] == 1e5


WRONG = (
    (
        {"columns": {**COLUMNS, "Druck": {"quantity": "pressure", "unit": "barr"}}},
        "column:Druck",
        "barr",
    ),
    (
        {"columns": {**COLUMNS, "Druck": {"quantity": "pressure", "unit": "mm"}}},
        "column:Druck",
        "mm",
    ),
    (
        {"columns": {**COLUMNS, "Zeit": {"quantity": "force", "unit": "N"}}},
        "column:Zeit",
        "both read as force",
    ),
    ({"columns": {**COLUMNS, "Kraft (N)": {"quantity": ""}}}, "columns", "no column is a force"),
    (
        {
            "columns": COLUMNS,
            "sheet": "x",
            "rules": [{"ranges": {"pressure": [0, 1]}, "keep": True}],
        },
        "rules",
        "no row",
    ),
    ({"columns": COLUMNS, "rules": [{"ranges": {"volume": [0, 1]}}]}, "rules", "volume"),
    ({"columns": COLUMNS, "file_name": "run{nonsense}"}, "file_name", "nonsense"),
)


@pytest.mark.parametrize(
    ("settings", "field", "text"), WRONG, ids=[row[1] + row[2] for row in WRONG]
)
def test_a_problem_names_its_field(app, settings, field, text):
    name = upload(app, "Messung.csv", german_table()).json()["set"]
    answer = post(app, "read", set=name, settings=settings)
    found = (
        problems(answer)
        if answer.status == 200
        else {answer.json()["field"]: answer.json()["error"]}
    )
    assert text in found[field]


def test_a_length_needs_the_resting_length_and_a_pressure_is_gauge_unless_stated(app):
    table = "p [bar];Länge [mm];F [N]\n1,0;300;50\n1,0;290;40\n2,0;300;90\n2,0;290;80\n"
    name = upload(app, "a.csv", table.encode()).json()["set"]
    assert "such as 300 mm" in problems(post(app, "read", set=name, settings={}))["resting_length"]
    for settings in (
        {"resting_length": "300 mm"},
        {"files": {"a.csv": {"resting_length": "30 cm"}}},
    ):
        (recording,) = post(app, "read", set=name, settings=settings).json()["recordings"]
        assert recording["constants"] == {"resting_length": "300 mm"}
        assert recording["points"]["contraction"] == pytest.approx([0, 1 / 30, 0, 1 / 30], rel=1e-6)
        assert any("is read as gauge" in note for note in recording["notes"])


def test_each_delimiter_that_the_form_offers_is_taken_as_it_is(app):
    """Also a tab and a blank, which are no texts."""
    form = {
        field["name"]: field for field in request(app, "GET", "/api/library").json()["forms"]["fit"]
    }
    offered = [value for value, _ in form["delimiter"]["offered"] if value]
    assert {"\t", " "} < set(offered)
    rows = [("pressure_bar", "contraction", "force_N"), (1.5, 0.1, 50.5), (2.5, 0.1, 90.5)]
    for right in offered:
        table = "\n".join(right.join(map(str, row)) for row in rows)
        name = upload(app, "a.csv", table.encode()).json()["set"]
        for given in (each for each in offered if each == right or not (each + right).isspace()):
            sheet = post(app, "read", set=name, settings={"delimiter": given}).json()
            forces = [force for each in sheet["recordings"] for force in each["points"]["force"]]
            assert forces == ([50.5, 90.5] if given == right else []), (given, right)


def test_a_column_may_state_the_resting_length(app):
    """By its heading, or because the user selects it."""
    table = (
        "p [bar],L [mm],F [N],rest_length [cm],note"
        " [mm]\n1,300,50,30,310\n2,290,40,30,310\n3,280,40,30,310\n"
    )
    name = upload(app, "a.csv", table.encode()).json()["set"]
    constant = {
        "note [mm]": {"quantity": "resting_length", "unit": "mm"},
        "rest_length [cm]": {"quantity": ""},
    }
    for settings, length, column in (({}, "300 mm", 3), ({"columns": constant}, "310 mm", 4)):
        sheet = post(app, "read", set=name, settings=settings).json()
        assert sheet["recordings"][0]["constants"]["resting_length"] == length
        assert sheet["files"][0]["columns"][column]["quantity"] == "resting_length"
        assert sheet["ready"]


REFUSED = (
    ({"resting_length": "300"}, "resting_length"),
    ({"resting_length": "-3 mm"}, "resting_length"),
    ({"resting_length": "3 kg"}, "resting_length"),
    ({"resting_length": "nan m"}, "resting_length"),
    ({"resting_length": "x" * 300}, "resting_length"),
    ({"resting_length": 3}, "resting_length"),
    ({"braid_radius": "10", "braid_angle": "24 deg"}, "braid_radius"),
    ({"braid_radius": "10 mm"}, "braid_angle"),
    ({"braid_radius": "10 mm", "braid_angle": "24 mm"}, "braid_angle"),
    ({"ambient": "0 bar"}, "ambient"),
    ({"entry": "../../etc/passwd"}, "entry"),
    ({"leave_out": "rows"}, "leave_out"),
    ({"decimal": ";"}, "decimal"),
    ({"delimiter": "x"}, "delimiter"),
    ({"time": "yesterday"}, "time"),
    ({"columns": []}, "columns"),
    ({"columns": {"p": "bar"}}, "column:p"),
    ({"columns": {"p": {"quantity": "os.system"}}}, "column:p"),
    ({"columns": {"p": {"quantity": "force", "unit": "N" * 50}}}, "column:p"),
    ({"files": {"a.csv": {"length": "3"}}}, "file:a.csv"),
    ({"files": {"a.csv": {"owner": "x"}}}, "file:a.csv"),
    ({"files": {"a.csv": 1}}, "file:a.csv"),
    ({"rules": {}}, "rules"),
    ({"rules": [1]}, "rules"),
    ({"rules": [{}]}, "rules"),
    ({"rules": [{"rows": [-1, 2]}]}, "rules"),
    ({"rules": [{"rows": [0.5, 2]}]}, "rules"),
    ({"rules": [{"ranges": {"force": [2, 1]}}]}, "rules"),
    ({"rules": [{"ranges": {"force": ["a", 1]}}]}, "rules"),
    ({"rules": [{"rows": [0, 1]}] * 201}, "rules"),
    ({"rules": [{"recordings": [1], "rows": [0, 1]}]}, "rules"),
)


def test_settings_that_are_not_possible_are_refused_with_their_field(app):
    name = upload(app, "Messung.csv", german_table()).json()["set"]
    for settings, field in REFUSED:
        answer = post(app, "read", set=name, settings=settings)
        assert (answer.status, answer.json().get("field")) == (422, field), settings
        assert "Traceback" not in answer.text
    for body in (
        b"",
        b"[",
        b"[]",
        b"null",
        b"\xff",
        b"[" * 100000,
        b'{"set": 1}',
        b'{"set": "x"}',
        b'{"set": "../.."}',
    ):
        assert request(app, "POST", "/api/fit/read", body).status in (400, 404)
    assert request(app, "POST", "/api/fit/read", b" " * (MAX_SETTINGS + 1)).status == 413


def test_a_quantity_is_refused_in_the_words_of_the_command(app, tmp_path):
    """Both are built from one declaration of the request."""
    name = upload(app, "Messung.csv", german_table()).json()["set"]
    (tmp_path / "Messung.csv").write_bytes(german_table())
    for field, text in (
        ("resting_length", "0 mm"),
        ("ambient", "-5 kPa"),
        ("displacement_zero", "3 s"),
    ):
        refused = post(app, "read", set=name, settings={field: text}).json()["error"]
        assert (
            airmuscle(
                "inspect", tmp_path / "Messung.csv", f"--{field.replace('_', '-')}", text
            ).stderr
            == f"error: {refused}\n"
        )


# Uploads

NAMES = (
    "",
    "a",
    "a.exe",
    "../a.csv",
    "/etc/passwd.csv",
    "..\\a.csv",
    "a/b.csv",
    ".a.csv",
    "a\0.csv",
    "a\n.csv",
    " a.csv",
    "C:a.csv",
    "a.csv/..",
    "\u202ea.csv",
    "a*.csv",
    "<script>.csv",
    "a" * 130 + ".csv",
    "\ud800.csv",
)


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_the_name_of_a_file_is_no_path(name):
    with pytest.raises(BadRequest) as error:
        check_file_name(name)
    assert len(str(error.value)) < 600


def test_names_of_laboratories_are_accepted():
    for name in ("Messung 1 (Länge).csv", "run_2,5bar.xlsx", "log#3.MAT", "測定.tdms"):
        assert check_file_name(name) == name


BAD_FILES = (
    ("a.csv", b"", 400),
    ("a.csv", b"\x00\x01\x02" * 99, 200),
    ("a.csv", b"PK\x03\x04xxxx", 200),
    ("a.csv", b"1,2\n", 200),
    ("a.csv", b"p,F\n1,2\n", 200),
    ("a.csv", b"p [bar],F [N]\n1,x\n", 200),
    ("a.csv", b"p [bar],F [N]\n1\n", 200),
    ("a.csv", b"p [bar],F [N]\nnan,inf\n", 200),
    ("a.csv", b"\xff\xfe\x00", 200),
    ("a.csv", b"," * 5000 + b"\n1\n", 200),
    ("a.xlsx", b"PK\x03\x04" + b"x" * 99, 200),
    ("a.tdms", b"TDSm" + b"\xff" * 99, 200),
    ("a.parquet", b"PAR1xxPAR1", 200),
    ("a.csv", b"t [s],p [bar],eps [%],F [N]\n0,1,1,1\n", 200),
)


@pytest.mark.parametrize(("file", "content", "status"), BAD_FILES, ids=range(len(BAD_FILES)))
def test_a_file_that_is_no_measurement_is_named_with_the_reason(
    app, tmp_path, file, content, status
):
    answer = upload(app, file, content)
    assert answer.status == status
    if status != 200:
        return
    sheet = post(app, "read", set=answer.json()["set"], settings={})
    assert sheet.status == 200
    assert not sheet.json()["ready"]
    assert sheet.json()["problems"]
    for row in sheet.json()["problems"]:
        assert 10 < len(row["text"]) < 3000
        assert not re.search(r"Traceback|/src/|airmuscle-studio", row["text"])
        assert str(tmp_path.parent) not in row["text"]


def test_large_and_many_files_are_refused_and_leave_nothing(app, tmp_path, monkeypatch):
    monkeypatch.setattr(fit_uploads, "MAX_FILE", 10_000)
    monkeypatch.setattr(fit_uploads, "MAX_SET", 15_000)
    monkeypatch.setattr(fit_uploads, "MAX_FILES", 3)
    large = upload(app, "a.csv", b"x" * 100_000)
    assert large.status == 413
    assert large.unread > 5
    name = upload(app, "b.csv", b"x" * 9_000).json()["set"]
    assert upload(app, "c.csv", b"x" * 9_000, name).status == 413
    assert upload(app, "c.csv", b"x" * 4_000, name).json()["files"] == ["b.csv", "c.csv"]
    assert upload(app, "b.csv", b"x" * 100, name).status == 200
    assert upload(app, "d.csv", b"x" * 100, name).status == 200
    assert "at most 3 files" in upload(app, "e.csv", b"x", name).json()["error"]
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {
        "b.csv",
        "c.csv",
        "d.csv",
    }


def test_the_number_of_sets_is_bounded_and_those_in_use_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(fit_uploads, "MAX_SETS", 2)
    store = UploadStore(tmp_path)
    first, second = (store.new_set(lambda name: False) for _ in range(2))
    for name in (first, second):
        (store.folder(name) / "files" / "a.csv").touch()
    with pytest.raises(BadRequest, match="all are in use"):
        store.new_set(lambda name: True)
    store.new_set(lambda name: name == first)
    assert store.folder(first).is_dir()
    with pytest.raises(BadRequest, match="drop them again"):
        store.folder(second)


def test_of_too_many_sets_the_one_that_is_idle_for_the_longest_time_goes(tmp_path):
    store = UploadStore(tmp_path)
    names = []
    for _ in range(2 * fit_uploads.MAX_SETS):
        names.append(store.new_set(lambda name: False))
        (store.folder(names[-1]) / "files" / "a.csv").touch()
        store.folder(names[0])  # is in use
    with pytest.raises(BadRequest, match="drop them again"):
        store.folder(names[1])
    kept = [name for name in names if name in store._used]
    assert kept == [names[0], *names[-fit_uploads.MAX_SETS + 1 :]]


def test_refused_uploads_and_removed_files_occupy_no_set(app, tmp_path, monkeypatch):
    monkeypatch.setattr(fit_uploads, "MAX_SETS", 2)
    assert {upload(app, "a.csv", b"").status for _ in range(5)} == {400}
    for _ in range(4):
        name = upload(app, "a.csv", b"x").json()["set"]
        assert post(app, "remove", set=name, name="a.csv").status == 200
    assert upload(app, "a.csv", german_table()).status == 200
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {"a.csv"}


def test_the_files_of_a_killed_server_are_removed_by_the_next_one(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    abandoned = tmp_path / f"airmuscle-studio-{ended.pid}-x"
    other = tmp_path / f"airmuscle-studio-{os.getpid()}-x"
    for folder in (abandoned, other):
        (folder / "files").mkdir(parents=True)
    store = UploadStore(tmp_path)
    store.new_set(lambda name: False)
    assert not abandoned.exists()
    assert other.exists()
    store.stop()
    assert list(tmp_path.iterdir()) == [other]


def test_values_in_another_file_are_not_read(app, tmp_path):
    """An HDF5 file may name any file of the server as the place of its values."""
    h5py = pytest.importorskip("h5py", reason="needs h5py")
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.arange(64.0).tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("force", (64,), dtype="f8", external=[(str(secret), 0, 512)])
    name = upload(app, "a.h5", (tmp_path / "a.h5").read_bytes()).json()["set"]
    assert (
        "values of a dataset are in another file"
        in problems(post(app, "read", set=name, settings={}))["file:a.h5"]
    )


# Fits


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A fit of the page, its task, and the comparison of the library on the same file; of three
    laws, to be short.
    """
    folder = tmp_path_factory.mktemp("studio")
    app = make_app(folder)
    rules = [
        {"recordings": ["Messung.csv"], "rows": [0, 2]},
        {"ranges": {"contraction": [0.159, 0.2]}},
    ]
    settings = {"columns": COLUMNS, "rules": rules, "leave_out": "contraction"}
    (folder / "Messung.csv").write_bytes(german_table())
    (recording,) = read(folder / "Messung.csv", ColumnMapping(columns=HEADINGS))
    kept = (np.arange(len(recording)) >= 2) & (recording["contraction"] < 0.159)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            model_selection, "started_candidates", lambda runs: (standard_candidates(runs)[1:4], ())
        )
        task = fit_of(app, settings)
        return app, task, compare(recording.rows(kept), leave_out=LevelSplit("contraction"))


def fit_of(app, settings, rows=9):
    """The identifier of a fit that is complete."""
    name = upload(app, "Messung.csv", german_table(rows=rows)).json()["set"]
    task = post(app, "start", set=name, settings=settings).json()["task"]
    status = finished(app, task)
    assert status["state"] == "done", status
    return task


def fetched(result, name):
    app, task, _ = result
    return request(app, "GET", f"/api/fit/task/{task}/{name}")


def column_texts(table):
    """The texts of a table of the page by its headings."""
    return {
        each["text"]: [row[i] for row in table["rows"]] for i, each in enumerate(table["headings"])
    }


def numbers(texts):
    """Numbers of the page, with their typographic signs."""
    return [
        float(re.sub(r" × 10", "e", text).translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")))
        for text in texts
    ]


def test_the_numbers_are_those_of_the_library(result):
    shown = fetched(result, "result.json").json()
    comparison = result[2]
    tables = shown["comparisons"][0]["tables"]
    ranking = column_texts(tables["ranking"])
    assert ranking["law"] == [m.candidate.name for m in comparison.ranking]
    for heading, attribute in {
        "in-sample rms error [N]": "in_sample_rmse",
        "cross-validation rms error [N]": "cross_validated_rmse",
    }.items():
        assert numbers(ranking[heading]) == pytest.approx(
            [getattr(m, attribute) for m in comparison.ranking], rel=5e-4
        )
    best = comparison.recommended.fit
    assert shown["recommended"] == comparison.recommended.candidate.name
    assert shown["reason"] == comparison.reason
    estimates = column_texts(shown["fit"]["tables"]["parameters"])
    factors = [1e-3 if unit.startswith("kPa") else 1.0 for unit in estimates["unit"]]
    assert len(factors) == len(best.values)
    assert numbers(estimates["value"]) == pytest.approx(list(best.values), rel=5e-4)
    assert shown["parity"]["residual"] == list(best.residuals)
    excluded = column_texts(tables["excluded"])
    assert excluded["law"] == [e.name for e in comparison.excluded]


def test_the_specimen_that_does_not_follow_the_others_is_named(tmp_path):
    text = "Specimen c does not follow the others."
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            model_selection, "started_candidates", lambda runs: (standard_candidates(runs)[1:3], ())
        )
        patch.setattr("airmuscle.outlets.requests.fitting.specimen_notes", lambda errors: [text])
        app = make_app(tmp_path)
        task = fit_of(app, {"columns": COLUMNS, "resting_length": "300 mm"})
    notes = request(app, "GET", f"/api/fit/task/{task}/result.json").json()["notes"]
    assert notes[0].strip() == "Specimen c does not follow the others."


BRAID = {"braid_radius": "10 mm", "braid_angle": "24.4 deg"}


@pytest.mark.parametrize("laws", [slice(1, 3), slice(0, 1)], ids=["without", "with"])
def test_the_muscle_has_the_braid_of_the_page_unless_its_law_has_one(tmp_path, laws):
    fixed = ("geometry.resting_length", "wall_thickness", "c1", "c2", "c3", "geometry.radius")
    with pytest.MonkeyPatch.context() as patch:
        chosen = [Candidate("own", LAW, fixed)] if laws.start == 0 else None
        patch.setattr(
            model_selection,
            "started_candidates",
            lambda runs: (chosen or standard_candidates(runs)[laws], ()),
        )
        app = make_app(tmp_path)
        task = fit_of(app, {"columns": COLUMNS, "resting_length": "300 mm", **BRAID})
    (tmp_path / "muscle.toml").write_bytes(
        request(app, "GET", f"/api/fit/task/{task}/muscle.toml").body
    )
    notes = request(app, "GET", f"/api/fit/task/{task}/result.json").json()["notes"]
    muscle = am.load(tmp_path / "muscle.toml")
    if chosen:
        assert [note for note in notes if note.startswith("The braid is not used: ")] != []
    else:
        assert muscle.geometry == am.geometry.Braid(0.010, math.radians(24.4), 0.3)
        assert notes == []


def test_a_braid_needs_one_resting_length(tmp_path):
    app = make_app(tmp_path)
    name = upload(app, "Messung.csv", german_table()).json()["set"]
    task = post(app, "start", set=name, settings={"columns": COLUMNS, **BRAID}).json()["task"]
    status = finished(app, task)
    assert status["field"] == "resting_length"
    assert status["error"] == "a braid has exactly one resting length; the data state none."


def test_bands_and_equation_are_shown(result):
    shown = fetched(result, "result.json").json()
    curve = shown["bands"]["curves"][0]
    assert all(
        a <= b <= c for a, b, c in zip(curve["low"], curve["value"], curve["high"], strict=True)
    )
    assert all(a <= b for a, b in zip(curve["prediction_low"], curve["low"], strict=True))
    assert shown["equations"][0]["lines"][0].startswith("<math")
    assert "Excel" in " ".join(shown["equations"][0]["sources"])


def test_report_and_muscle_are_downloaded(result, tmp_path):
    (tmp_path / "muscle.toml").write_bytes(fetched(result, "muscle.toml").body)
    muscle = am.load(tmp_path / "muscle.toml")
    assert muscle.characteristic == result[2].recommended.fit.model
    assert "Fitted to Messung.csv" in muscle.note
    report = fetched(result, "report.html")
    assert "attachment" in report.headers["content-disposition"]
    assert "Messung.csv: 8 of 54 rows are left out, as specified by the user." in " ".join(
        report.text.split()
    )
    names = zipfile.ZipFile(BytesIO(fetched(result, "report.zip").body)).namelist()
    assert {"muscle.toml", "report.html", "data/ranking.csv"} <= set(names)
    assert not [name for name in names if name.startswith(("/", ".."))]


@pytest.mark.parametrize(
    "name", ["..", "../result.json", "data/ranking.csv", "x", "report.html/..", "settings"]
)
def test_a_result_has_no_other_files(result, name):
    assert fetched(result, name).status == 404


@pytest.mark.slow
def test_a_complete_fit_is_that_of_the_command_line(tmp_path):
    """All laws and the friction, with the same texts; the command fits in processes of its own."""
    app = make_app(tmp_path)
    task = fit_of(
        app, {"columns": COLUMNS, "resting_length": "300 mm", "hysteresis": True}, rows=25
    )
    shown = request(app, "GET", f"/api/fit/task/{task}/result.json").json()
    (tmp_path / "Messung.csv").write_bytes(german_table(rows=25))
    options = [f"--column={key}={text}" for key, text in HEADINGS.items()]
    command = ["fit", "Messung.csv", "--compare", "--json", "--resting-length", "300 mm", *options]
    done = subprocess.run(
        [sys.executable, "-m", "airmuscle", *command], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)["comparison"]["ranking"]
    ranking = column_texts(shown["comparisons"][0]["tables"]["ranking"])
    assert ranking["law"] == [row["law"] for row in printed]
    errors = [row["cross_validation_rms_error"] for row in printed]
    assert numbers(ranking["cross-validation rms error [N]"]) == pytest.approx(errors, rel=5e-4)
    muscle = request(app, "GET", f"/api/fit/task/{task}/muscle.toml").text
    written = (tmp_path / "fit" / "muscle.toml").read_text(encoding="utf-8")
    digits = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")
    assert digits.sub("#", muscle) == digits.sub("#", written)
    found = [[float(number) for number in digits.findall(text)] for text in (muscle, written)]
    assert found[0] == pytest.approx(found[1], rel=1e-8)
    assert len(shown["hysteresis"]["loops"]) == 3
    laws = column_texts(shown["hysteresis"]["loops"][0]["tables"]["laws"])
    assert numbers(laws["branch gap without friction [N]"])[0] == pytest.approx(14.0, abs=3.0)
    assert "friction.html" in shown["files"]


def test_a_task_is_known_to_its_page_only(result):
    """There is no list of tasks or files, and an identifier cannot be guessed."""
    app, task, _ = result
    assert len(task) == 22
    for other in (
        "",
        "x",
        task[:-1],
        task[:-1] + ("A" if task[-1] != "A" else "B"),
        f"../{task}",
        "*",
    ):
        for address in (f"/api/fit/task/{other}", f"/api/fit/task/{other}/result.json"):
            assert request(app, "GET", address).status == 404
        assert request(app, "POST", f"/api/fit/task/{other}/cancel").status == 404
    for address in (
        "/api/fit",
        "/api/fit/task",
        "/api/fit/task/",
        "/api/fit/file",
        "/api/fit/read",
        "/api/fit/start",
    ):
        assert request(app, "GET", address).status in (404, 405)
    mine, theirs = (
        upload(app, "a.csv", text).json() for text in (b"p [bar]\n1\n", b"p [bar]\n2\n")
    )
    assert mine["set"] != theirs["set"]
    assert post(app, "read", set=mine["set"], settings={}).json()["recordings"][0]["ranges"][
        "pressure"
    ] == [100, 100]


def test_other_pages_cannot_upload_or_start(app):
    for address in ("file", "read", "start", "remove", "task/x/cancel"):
        for headers in (
            {"x-airmuscle": None},
            {"origin": "http://evil.example"},
            {"sec-fetch-site": "cross-site"},
        ):
            assert request(app, "POST", f"/api/fit/{address}", b"", headers=headers).status == 403


def test_a_fit_without_enough_data_fails_with_a_reason_in_words_of_the_page(app):
    name = upload(app, "a.csv", german_table(levels=(2.0,), rows=3)).json()["set"]
    task = post(app, "start", set=name, settings={"columns": COLUMNS}).json()["task"]
    status = finished(app, task)
    assert status["state"] == "failed"
    assert len(status["error"]) > 20
    assert not re.search(r"--\w|leave_out=|Traceback", status["error"])
    assert request(app, "GET", f"/api/fit/task/{task}/result.json").status == 404


# Queue


def test_ten_users_are_served_in_turn_and_further_ones_are_refused(tmp_path):
    running = []
    most = []
    order = []

    def task(folder, out, user, report):
        running.append(user)
        most.append(len(running))
        order.append(user)
        time.sleep(0.02)
        running.remove(user)

    queue = FitQueue(task, make_worker=WorkerHere)
    tasks = [queue.submit("set", tmp_path, user) for user in range(10)]
    end = time.monotonic() + 60
    while any(queue.status(each)["state"] != "done" for each in tasks) and time.monotonic() < end:
        time.sleep(0.01)
    queue.stop()
    assert sorted(order) == list(range(10))
    assert max(most) <= FIT_WORKERS
    assert not queue.is_needed("set")


def test_results_that_are_forgotten_leave_no_files(tmp_path, monkeypatch):
    monkeypatch.setattr(fit_routes, "MAX_TASKS", 2)
    queue = FitQueue(write_slowly, count=1, make_worker=WorkerHere)
    for count in range(5):
        task = queue.submit("set", tmp_path, 0.0)
        wait_until(lambda task=task: queue.status(task)["state"] == "done")
        assert len(list(tmp_path.rglob("result.json"))) == min(count + 1, 2)
    queue.stop()


def test_a_bounded_number_of_fits_waits(tmp_path):
    queue = FitQueue(write_slowly, count=1)
    queue._count = 0  # no process takes a task
    tasks = [queue.submit("set", tmp_path, 0.0) for _ in range(MAX_WAITING)]
    with pytest.raises(BadRequest, match="fits wait already"):
        queue.submit("set", tmp_path, 0.0)
    assert queue.status(tasks[3])["before"] == 3
    queue.cancel(tasks[0])
    assert queue.status(tasks[0])["state"] == "cancelled"
    assert queue.status(tasks[3])["before"] == 2
    assert queue.is_needed("set")


def test_a_fit_that_is_cancelled_writes_nothing_and_the_next_one_runs(tmp_path):
    """In a process of its own, which tells its progress."""
    queue = FitQueue(write_slowly, count=1)
    try:
        slow, quick = queue.submit("set", tmp_path, 600.0), queue.submit("set", tmp_path, 0.0)
        wait_until(lambda: queue.status(slow)["fraction"] == 0.5)
        assert queue.status(slow)["text"] == "half of it"
        assert queue.status(quick)["state"] == "waiting"
        queue.cancel(slow)
        wait_until(lambda: queue.status(quick)["state"] == "done")
        assert queue.status(slow)["state"] == "cancelled"
        wait_until(lambda: not queue.find(slow).folder.exists())
        assert (queue.find(quick).folder / "complete").exists()
    finally:
        queue.stop()


def test_an_error_of_a_task_keeps_its_field(tmp_path):
    queue = FitQueue(fail, count=1, make_worker=WorkerHere)
    tasks = [queue.submit("set", tmp_path, field) for field in ("resting_length", "")]
    wait_until(lambda: all(queue.status(each)["state"] == "failed" for each in tasks))
    assert [queue.status(each)["field"] for each in tasks] == ["resting_length", ""]
    assert queue.status(tasks[0])["error"] == "this is wrong."
    queue.stop()


def test_a_worker_ends_with_its_server(tmp_path):
    """Also during a task, so that a killed server leaves no process and no result."""
    script = (
        "import sys, pathlib, time\nfrom airmuscle.outlets.studio.fit_routes import FitQueue; from"
        " studio_tasks import write_slowly\nif __name__ == '__main__':\n    queue ="
        " FitQueue(write_slowly, count=1); task = queue.submit('set', pathlib.Path(sys.argv[1]),"
        " 600.0)\n    while queue.status(task)['fraction'] != 0.5: time.sleep(0.01)\n   "
        " print([worker._worker._process.pid for worker in queue._running.values()][0],"
        " flush=True); input()\n"
    )
    (tmp_path / "server.py").write_text(script, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(tmp_path / "server.py"), str(tmp_path)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, env=environment, text=True
    ) as server:
        worker = int(server.stdout.readline())
        server.kill()
    wait_until(lambda: not is_alive(worker))
    assert [
        path for path in tmp_path.rglob("result.json") if ".unfinished" not in str(path.parent)
    ] == []


def is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = subprocess.run(
        ["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True
    ).stdout.strip()
    return bool(state) and not state.startswith("Z")


def wait_until(holds, seconds=120.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "not within the time"
        time.sleep(0.02)


def test_a_worker_reports_nothing_unless_asked():
    worker = LimitedWorker()
    try:
        assert worker.call(sum, ([1, 2],), 60.0) == 3
    finally:
        worker.stop()


def test_a_saved_page_contains_no_fit():
    page = self_contained_page([], {})
    assert "fitSource" not in page
    assert "MuscleTab" in page


# Settings of the files, as on the command line


def logged(outliers=()):
    """A table below a preamble, with a displacement, codes of missing values, and outliers in some
    rows.
    """
    rows = [
        [f"{0.1 * i:.1f}", "100", f"{12 + 0.1 * i:.1f}", f"{90 - 0.9 * i + 0.1 * (i % 3):.2f}"]
        for i in range(80)
    ]
    rows[5][3] = "-999"
    rows[9][3] = "OL"
    for row in outliers:
        rows[row][3] = "400"
    head = ["Bench 3,Monday,,", "time [s],pressure [kPa],displacement [mm],force [N]"]
    return "\n".join([*head, *map(",".join, rows)]).encode()


LOGGED = {
    "resting_length": "300 mm",
    "displacement_zero": "12 mm",
    "missing": "drop",
    "missing_code": "-999; OL",
    "skip_rows": "1",
}


def test_the_page_has_the_reading_settings_of_the_command_line(app, tmp_path):
    """Lines above the headings, codes of missing values, and the zero of a displacement give the
    same columns.
    """
    content = logged()
    name = upload(app, "a.csv", content).json()["set"]
    (recording,) = post(app, "read", set=name, settings=LOGGED).json()["recordings"]
    (tmp_path / "a.csv").write_bytes(content)
    (expected,) = read(
        tmp_path / "a.csv",
        ColumnMapping(
            resting_length="300 mm",
            displacement_zero="12 mm",
            skip_rows=1,
            missing=am.bench.DropMissing((-999.0, "OL")),
        ),
    )
    assert recording["rows"] == len(expected) == 78
    assert recording["points"]["contraction"] == pytest.approx(expected["contraction"], abs=1e-8)
    assert recording["points"]["contraction"][0] == 0


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("missing", "zero"),
        ("skip_rows", "-1"),
        ("skip_rows", "two"),
        ("outliers", "mend"),
        ("displacement_zero", "nan mm"),
        ("displacement_zero", "12"),
    ],
)
def test_reading_settings_that_are_not_possible_name_their_field(app, setting, value):
    name = upload(app, "a.csv", logged()).json()["set"]
    answer = post(app, "read", set=name, settings={**LOGGED, setting: value})
    assert (answer.status, answer.json()["field"]) == (422, setting)


def test_missing_values_name_the_field_that_treats_them(app):
    name = upload(app, "a.csv", logged()).json()["set"]
    found = problems(
        post(app, "read", set=name, settings={**LOGGED, "missing": "", "missing_code": "-999, OL"})
    )
    assert "select 'leave out the rows' in the field 'Missing values'" in found["missing"]


def test_outliers_are_left_out_as_by_the_command_line(app, tmp_path):
    """More outliers than are listed are found by the function of `drop_outliers`; rules keep the
    rows of the file.
    """
    content = logged(range(12, 80, 8))
    name = upload(app, "a.csv", content).json()["set"]
    rule = {"recordings": ["a.csv"], "rows": [70, 78], "keep": False}
    (recording,) = post(
        app, "read", set=name, settings={**LOGGED, "outliers": "drop", "rules": [rule]}
    ).json()["recordings"]
    (tmp_path / "a.csv").write_bytes(content)
    stated = {"resting_length": "300 mm", "displacement_zero": "12 mm", "skip_rows": 1}
    missing = am.bench.DropMissing((-999.0, "OL"))
    (complete,) = read(tmp_path / "a.csv", am.ColumnMapping(**stated, missing=missing))
    (expected,) = read(
        tmp_path / "a.csv", am.ColumnMapping(**stated, missing=missing, drop_outliers=True)
    )
    left_out = np.flatnonzero(~np.isin(complete["time"], expected["time"]))
    assert recording["outliers"] == len(left_out) > 5
    assert recording["left_out"] == list(left_out)
    assert recording["used"] == 78 - len({*left_out, *range(70, 78)})


# Episodes of an arm

MADE = made_episodes(20)


def csv(run):
    rows = np.column_stack([np.degrees(run.angle), np.degrees(run.speed), run.pressure / 1e3])
    lines = [",".join(f"{value:.7g}" for value in row) for row in rows]
    return "angle,speed,pressure1,pressure2\n" + "\n".join(lines)


def archive(folder="episodes/"):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for number, run in enumerate(MADE.runs):
            file.writestr(f"{folder}{number:02d}.csv", csv(run))
    return data.getvalue()


def sheet_of(app, name, content, **settings):
    """The identifier of the set, and what was understood of its episodes."""
    files = upload(app, name, content).json()["set"]
    return files, post(app, "read", set=files, settings={"record": "arm", **settings})


@pytest.mark.parametrize("folder", ["episodes/", "a/b/", ""])
def test_an_archive_of_episodes_is_read_by_the_mapping_that_is_proposed(app, folder):
    _, answer = sheet_of(app, "episodes.zip", archive(folder))
    asked = answer.json()
    assert not asked["ready"]
    assert 'columns = ["pressure1", "pressure2"]\nunit = "?"  # kPa or psi?' in asked["mapping"]
    mapping = asked["mapping"].replace('unit = "?"', 'unit = "kPa"')
    _, answer = sheet_of(app, "episodes.zip", archive(folder), mapping=mapping)
    sheet = answer.json()
    assert sheet["ready"], sheet["problems"]
    text = " ".join(sheet["lines"])
    assert text.startswith("20 episodes of 95 rows at 100")
    assert "pressure 1 raises angle 1 (t = " in text


def test_several_files_are_a_folder_of_episodes(app):
    files = upload(app, "00.csv", csv(MADE.runs[0]).encode()).json()["set"]
    for number, run in enumerate(MADE.runs[1:], start=1):
        upload(app, f"{number:02d}.csv", csv(run).encode(), files)
    asked = post(app, "read", set=files, settings={"record": "arm"}).json()
    mapping = asked["mapping"].replace('unit = "?"', 'unit = "kPa"')
    settings = {"record": "arm", "mapping": mapping}
    sheet = post(app, "read", set=files, settings=settings).json()
    assert sheet["ready"]
    assert "20 episodes from 20 files (.csv)" in sheet["lines"]


@pytest.mark.parametrize(
    ("name", "content", "settings", "field", "text"),
    [
        ("a.zip", b"PK no archive", {}, "mapping", "a.zip: cannot be read as a ZIP archive"),
        (
            "a.zip",
            None,
            {"mapping": "[angles]\n"},
            "mapping",
            "no table [pressures]; name its columns",
        ),
        (
            "a.zip",
            None,
            {
                "mapping": (
                    'sample_time = "10 ms"\n[angles]\ncolumns = "q"\n[pressures]\ncolumns = "p"'
                )
            },
            "mapping",
            "00.csv: no column 'q'; there are angle, speed, pressure1, pressure2",
        ),
        (
            "a.zip",
            None,
            {"mapping": "x" * 30_000},
            "mapping",
            "must be a text of at most 20000 characters",
        ),
        ("a.zip", None, {"horizon": "2"}, "horizon", "horizon is 2; allowed range: 5 to 1000"),
        (
            "a.zip",
            None,
            {"known": "joint-dmsp-20-matrx"},
            "known",
            "Did you mean 'joint-dmsp-20-matrix'?",
        ),
        (
            "a.zip",
            None,
            {"known": "/etc/passwd"},
            "known",
            "'/etc/passwd' is no plant of the library",
        ),
        (
            "a.zip",
            None,
            {"known": '[plant]\nmuscle = "../m.toml"'},
            "known",
            "must not refer to files",
        ),
        ("a.zip", None, {"known": "[plant"}, "known", "known.toml"),
        (
            "a.zip",
            None,
            {"known": "joint-dmsp-20-matrix", "residual": "yes"},
            "residual",
            "known exclude each other",
        ),
        ("a.zip", None, {"residual": "no"}, "residual", "residual is 'no'; give yes, or nothing"),
        ("a.zip", None, {"free": "zeros"}, "free", "free requires known"),
    ],
)
def test_an_impossible_record_names_the_field(app, name, content, settings, field, text):
    _, answer = sheet_of(app, name, archive() if content is None else content, **settings)
    found = (
        problems(answer)
        if answer.status == 200
        else {answer.json()["field"]: answer.json()["error"]}
    )
    assert text in found[field]
    assert "/tmp" not in found[field]


def test_what_forbids_a_fit_is_a_problem_of_the_mapping(app):
    mapping = (
        'sample_time = "10 ms"\n[angles]\ncolumns = "angle"\nunit = "deg"\n[pressures]\ncolumns ='
        " {}\n[arm]\npairs = [[2, 1]]"
    )
    columns = '["pressure1", "pressure2"]'
    _, answer = sheet_of(app, "a.zip", archive(), mapping=mapping.replace("{}", columns))
    assert (
        "muscles are exchanged: the mapping says that pressure 1 lowers angle 1"
        in problems(answer)["mapping"]
    )


def fitted(source, asked, progress):
    """In place of the fit, which takes a minute: a chapter of the same form, from the same
    request.
    """
    from matplotlib.figure import Figure

    progress("delay of the pressures: 0 rows")
    count = len(list(source.iterdir()))
    table = Table("joint-errors", "Errors", {"prediction by": ["model"], "joint 1": [0.1]})
    plots = (Plot("horizon", "Error against the horizon", Figure),)
    values = {
        "summary": f"{count} files, horizon {asked.horizon}, {asked.known}, {asked.free}",
        "tables": (table,),
        "plots": plots,
    }
    return Chapter(name="joint", title="Identified arm", notes=("not separated",), **values), {
        "scenario.toml": "a = 1\n",
        "muscles/m0.toml": "b = 1\n",
    }


def test_the_fit_is_that_of_the_command_and_offers_its_files(app, monkeypatch):
    monkeypatch.setattr(arm_task, "fit_requested_arm", fitted)
    files, answer = sheet_of(app, "episodes.zip", archive())
    settings = {"record": "arm", "mapping": answer.json()["mapping"], "horizon": "30"}
    settings |= {"known": "joint-dmsp-20-matrix", "free": "mechanism.inertia, zeros"}
    task = post(app, "start", set=files, settings=settings).json()["task"]
    assert finished(app, task)["state"] == "done"
    result = request(app, "GET", f"/api/fit/task/{task}/result.json").json()
    assert result["arm"]["paragraphs"] == [
        "20 files, horizon 30, joint-dmsp-20-matrix, ('mechanism.inertia', 'zeros')"
    ]
    assert result["arm"]["notes"] == ["not separated"]
    assert result["figures"][0]["src"].startswith("data:image/svg+xml;base64,")
    assert result["files"] == ["report.html", "scenario.toml", "report.zip"]
    assert request(app, "GET", f"/api/fit/task/{task}/scenario.toml").body == b"a = 1\n"
    with zipfile.ZipFile(
        io.BytesIO(request(app, "GET", f"/api/fit/task/{task}/report.zip").body)
    ) as packed:
        assert packed.read("muscles/m0.toml") == b"b = 1\n"


def test_an_error_of_the_fit_is_shown_at_the_fit(app, monkeypatch):
    def refuse(source, asked, progress):
        raise IdentificationError("no episode is as long as a window")

    monkeypatch.setattr(arm_task, "fit_requested_arm", refuse)
    files, answer = sheet_of(app, "episodes.zip", archive())
    settings = {"record": "arm", "mapping": answer.json()["mapping"]}
    status = finished(app, post(app, "start", set=files, settings=settings).json()["task"])
    assert (status["state"], status["field"]) == ("failed", "fit")
    assert "no episode is as long as a window" in status["error"]
    assert json.loads(json.dumps(status))["text"]
