"""Tab Size of the studio: its sheet contains the choices of the library; requests that mean nothing
are refused.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from studio_pages import InThisProcess, request

pytest.importorskip("starlette", reason="needs starlette")

from airmuscle import load
from airmuscle.design import (
    JointRequirement,
    LiftRequirement,
    SizingConditions,
    choose,
    scenario_text,
    size_muscles,
)
from airmuscle.errors import ParameterError, SolveError
from airmuscle.outlets.studio import create_app, joint_names, read_request
from airmuscle.outlets.studio.tasks import size_sheet

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
LIFT = {
    "load": "20 kg",
    "stroke": "40 mm",
    "supply": "6 bar",
    "max_length": "400 mm",
    "max_count": "1",
    "sort": "length",
}


@pytest.fixture(scope="module")
def app():
    return create_app(pool=InThisProcess())


def test_the_sheet_contains_the_choices_of_the_library_with_chart_and_scenario():
    sheet = size_sheet(json.dumps(LIFT))
    conditions = SizingConditions(6e5, max_length=0.4, max_count=1)
    choices = sorted(
        size_muscles(LiftRequirement(0.04, mass=20.0), conditions).choices, key=lambda c: c.length
    )
    assert [row["name"] for row in sheet["choices"]] == [choice.entry.name for choice in choices]
    table = sheet["tables"]["choices"]
    lengths = [
        row[[each["text"] for each in table["headings"]].index("nominal length [mm]")]
        for row in table["rows"]
    ]
    assert lengths == [f"{1e3 * choice.length:.4g}" for choice in choices]
    for row, choice in zip(sheet["choices"], choices, strict=True):
        chart = row["chart"]
        last = choice.design.contracted
        assert chart["points"][1] == pytest.approx(last._asdict())
        reached = np.interp(
            last.contraction, chart["capacity"]["contractions"], chart["capacity"]["forces"]
        )
        assert reached == pytest.approx(last.capacity, rel=5e-3)
        assert bool(row["scenario"]) != bool(row["reason"])
    assert sheet["tables"]["unsuitable"]["rows"]
    assert json.loads(json.dumps(sheet)) == sheet


WRONG = {
    "not JSON": "{",
    "fields": json.dumps([1]),
    "at most 60 characters": json.dumps(LIFT | {"load": "1" * 61}),
    "must be texts": json.dumps(LIFT | {"load": 20}),
    "no others": json.dumps(LIFT | {"file": "/etc/passwd"}),
    "or torque and angle for a joint": json.dumps(LIFT | {"torque": "5 N m"}),
    "sort is 'price'; allowed": json.dumps(LIFT | {"sort": "price"}),
    "give load and stroke for a lift": json.dumps(LIFT | {"stroke": ""}),
    "has no unit": json.dumps(LIFT | {"stroke": "40"}),
    "load": json.dumps(LIFT | {"load": "20 bar"}),
    "allowed range": json.dumps(LIFT | {"stroke": "0 mm"}),
    "supply": json.dumps(LIFT | {"supply": "nan bar"}),
    "give a whole number": json.dumps(LIFT | {"max_count": "1.5"}),
    "max_count": json.dumps(LIFT | {"max_count": "21"}),
    "torque": json.dumps({"angle": "60 deg", "torque": "0 N m", "supply": "6 bar", "sort": "air"}),
}


@pytest.mark.parametrize("reason", WRONG)
def test_a_request_that_means_nothing_is_refused_with_the_reason(app, reason):
    answer = request(app, "POST", "/api/size", WRONG[reason].encode())
    assert answer.status == 422
    assert reason in answer.json()["error"]


def test_brackets_without_end_are_no_request():
    with pytest.raises(ParameterError, match="not JSON"):
        read_request("[" * 100_000)


def test_other_joints_do_not_exist_and_requests_of_other_pages_are_refused(app):
    assert {
        name: request(app, "GET", f"/api/joint/{name}").status
        for name in ("lift", "arm-lilly-quesada", "..")
    } == {
        "lift": 404,
        "arm-lilly-quesada": 404,
        "..": 404,
    }
    assert [row["name"] for row in request(app, "GET", "/api/library").json()["joints"]] == list(
        joint_names()
    )
    assert request(app, "POST", "/api/size", b"{}", headers={"x-airmuscle": None}).status == 403


def test_a_joint_of_muscles_without_a_geometry_has_no_scenario():
    """The reason is stated, as for a lift."""
    conditions = SizingConditions(4e5)
    choice = choose(
        load("hunt2017-festo-10"), JointRequirement(angle=0.5, torque=1.0), conditions, 1
    )
    with pytest.raises(SolveError, match="geometry"):
        scenario_text(choice)
