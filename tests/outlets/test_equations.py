"""A fit report shows the equation of its law, and the text for LaTeX, MATLAB, Excel and C gives the
values of the law.

Each text is evaluated by its own rules, C by a compiler if there is one. Within the validity range
it differs from the law by rounding only; the physical form of a polynomial, too.
"""

from __future__ import annotations

import ctypes
import math
import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from airmuscle import geometry, load
from airmuscle.bench import fit, fit_chapter
from airmuscle.bench.statics.static_fit_chapter import equation_section
from airmuscle.core import model, ops, parameter
from airmuscle.files import library, load_data
from airmuscle.physics import (
    Characteristic,
    ContractileSurface,
    ContractionLaw,
    EffectiveLength,
    ForceLaw,
    InverseLength,
    LinearInPressure,
    LogarithmicLength,
    MartensBoblan2017,
    PressureLaw,
)
from airmuscle.physics.muscle.characteristic import modes
from airmuscle.report import EXAMPLE, source_codes, write_report
from airmuscle.report.equation import LawEquation, law_equation

Values = Mapping[str, npt.NDArray[np.float64]]
RANGES = {"pressure": (5e4, 5e5), "contraction": (0.01, 0.12), "force": (10.0, 400.0)}
REFUSED_BEYOND = {"pressure": (5e4, 3.5e5), "force": (45.0, 260.0)}
"""The range of the surfaces of Borzikova et al., which refuse what lies beyond."""
TOLERANCE = 1e-12
NAMES = {"p": "pressure", "eps": "contraction", "F": "force"}
WITHOUT_EQUATION = {
    "festo-tool-dmsp-10",
    "festo-tool-dmsp-20",
    "festo-tool-dmsp-40",
    "saga2007-circle",
    "saga2007-exact",
}
"""Laws of the library that are tables, are solved by iteration, or are too long."""


def a_surface(degree: int, seed: int = 1) -> ContractileSurface:
    """A surface with coefficients of several magnitudes and signs, as a fit gives them."""
    count = (degree + 1) * (degree + 2) // 2
    values = np.random.default_rng(seed).normal(0.0, 100.0, count) / np.arange(1, count + 1)
    return ContractileSurface((600.0, *values[1:]), 3.1e4, 6.2e5, 0.007, 0.19, -1e4, 2e4, degree)


@model
class OperationsOfLaws(ForceLaw):
    """A law of all operations that laws may contain and those of the library do not: choices with
    conditions, logical operations, absolute values, accurate forms of functions near zero.
    """

    limit: float = parameter("N", "a", "force at the limit", bounds=(0.0, 1e4), default=50.0)
    slope: float = parameter("1", "b", "slope", bounds=(-1e3, 1e3), default=-3.0)

    def force(self, pressure: Any, contraction: Any) -> Any:
        scaled = pressure / 3e5
        middle = ops.both(scaled > 0.5, ops.logical_not(contraction > 0.08))
        rare = ops.either(ops.both(middle, scaled < 1.2), contraction == 0.0)
        steps = ops.where(rare, self.limit, 2.0 * self.limit * contraction)
        kink = (
            ops.abs(scaled - 1.0)
            - (contraction + self.limit)
            - 3.0 * (self.slope * contraction - 2.0 * scaled)
        )
        smooth = ops.log1p(contraction) + ops.expm1(-scaled) + ops.arctan2(scaled, contraction)
        return ops.where(scaled < 0.9, 0.0, steps) + kink * smooth / (contraction**3 * scaled + 1.0)


def library_laws() -> dict[str, Characteristic]:
    """The laws of the library that have an equation."""
    names = {path.stem for path in library.LAWS.glob("*.toml")}
    entries = {name: load(name) for name in sorted(names)}
    return {name: entry.characteristic for name, entry in entries.items() if entry.characteristic}


def laws() -> dict[str, Characteristic]:
    named = {name: law for name, law in library_laws().items() if name not in WITHOUT_EQUATION}
    surfaces = {f"surface of degree {n}": a_surface(n) for n in (1, 2, 5, 9)}
    families = {
        "inverse length": InverseLength(a_surface(4), a_surface(2, 7), 0.2, 0.3),
        "logarithmic length": LogarithmicLength(a_surface(3), a_surface(3, 7), 0.2, 0.3),
        "effective length": EffectiveLength(a_surface(3), 0.2, 0.01, 1e-4),
    }
    further = {
        "Martens and Boblan": MartensBoblan2017(
            geometry.Braid(0.01, 0.45, 0.3), 1.8e-3, 9e7, -7e8, 1.5e9, -5e8
        ),
        "linear in pressure": LinearInPressure((6e-4, -2e-3), (-10.0,), 5.0),
        "operations": OperationsOfLaws(),
    }
    return {**named, **surfaces, **families, **further}


LAWS = laws()


def quantity_of(law: Characteristic) -> tuple[str, tuple[str, str]]:
    if isinstance(law, ContractionLaw):
        return "contraction", ("pressure", "force")
    return (
        ("pressure", ("contraction", "force"))
        if isinstance(law, PressureLaw)
        else ("force", ("pressure", "contraction"))
    )


def points(law: Characteristic) -> dict[str, npt.NDArray[np.float64]]:
    """Points in the validity range, the ends included."""
    random = np.random.default_rng(3)
    _, arguments = quantity_of(law)
    ranges = {**RANGES, **(REFUSED_BEYOND if quantity_of(law)[0] == "contraction" else {})}
    grid = {
        name: np.concatenate([ranges[name], random.uniform(*ranges[name], 60)])
        for name in arguments
    }
    return {
        "p" if n == "pressure" else "eps" if n == "contraction" else "F": v for n, v in grid.items()
    }


def equations(law: Characteristic) -> tuple[LawEquation, ...]:
    quantity, arguments = quantity_of(law)
    return law_equation(law, quantity, arguments, RANGES)


def check_values(
    law: Characteristic, equation: LawEquation, evaluated: npt.NDArray[np.float64]
) -> None:
    quantity, arguments = quantity_of(law)
    at = points(law)
    given = [at[n] for name in arguments for n in NAMES if NAMES[n] == name]
    with modes.formula_alone():  # an equation is the formula, also beyond the range
        expected = np.asarray(getattr(law, quantity)(*given))
    np.testing.assert_allclose(
        evaluated, expected, rtol=TOLERANCE, atol=TOLERANCE * np.abs(expected).max()
    )


def arguments_of(law: Characteristic, equation: LawEquation) -> dict[str, npt.NDArray[np.float64]]:
    at = points(law)
    return {
        each.name: at["p"] / 1e5 if each.name == "P" else at[each.name]
        for each in equation.arguments
    }


def evaluate_c(
    text: str, equation: LawEquation, at: Values, folder: Path
) -> npt.NDArray[np.float64]:
    # a name is loaded once
    source = folder / "law.c"
    library = folder / f"{len(list(folder.iterdir()))}.so"
    source.write_text(text, encoding="utf-8")
    subprocess.run(
        ["gcc", "-O0", "-Wall", "-Werror", "-shared", "-fPIC", "-o", library, source, "-lm"],
        check=True,
    )
    name = re.search(r"double (\w+)\(", text)
    assert name
    function = getattr(ctypes.CDLL(str(library)), name[1])
    function.restype, function.argtypes = (
        ctypes.c_double,
        [ctypes.c_double] * len(equation.arguments),
    )
    return np.array(
        [function(*row) for row in np.column_stack([at[each.name] for each in equation.arguments])]
    )


FUNCTIONS: dict[str, Any] = {
    **{
        name: getattr(np, name)
        for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "abs")
    },
    "max": np.maximum,
    "min": np.minimum,
    "atan": np.arctan,
    "asinh": np.arcsinh,
    "pi": math.pi,
    "__builtins__": {},
}


def evaluate_matlab(text: str, equation: LawEquation, at: Values) -> npt.NDArray[np.float64]:
    """A MATLAB function by the rules of MATLAB: elementwise signs between arrays, matrix signs with
    a scalar only.
    """
    variables: dict[str, Any] = dict(at)
    for line in text.splitlines()[1:-1]:
        statement = line.partition("%")[0].strip().rstrip(";")
        if statement:
            name, _, expression = statement.partition(" = ")
            for matlab, python in (
                (".^", "**"),
                ("^", "**"),
                (".*", "*"),
                ("./", "/"),
                ("~=", "!="),
            ):
                expression = expression.replace(matlab, python)
            variables[name] = eval(expression, dict(FUNCTIONS), variables)
    return np.asarray(variables[equation.result.name])


EXCEL = {
    "POWER": np.power,
    "MAX": np.maximum,
    "MIN": np.minimum,
    "LN": np.log,
    "PI": lambda: math.pi,
    "IF": np.where,
    "NOT": np.logical_not,
    "AND": np.logical_and,
    "OR": np.logical_or,
    **{
        name: getattr(np, name.lower())
        for name in ("SQRT", "EXP", "SIN", "COS", "TAN", "SINH", "COSH", "ABS")
    },
    "ATAN": np.arctan,
    "ASINH": np.arcsinh,
    "__builtins__": {},
}


def evaluate_excel(text: str, at: Values) -> npt.NDArray[np.float64]:
    """Two rows of a worksheet; the power sign, which binds weaker than a sign in Excel, must not
    occur.
    """
    headers, cells = (row.split("\t") for row in text.splitlines())
    assert len(headers) == len(cells)
    variables: dict[str, Any] = {}
    for i, (header, cell) in enumerate(zip(headers, cells, strict=True)):
        name = header.partition(" ")[0]
        if not cell.startswith("="):
            assert float(cell) == EXAMPLE[name]
            variables[f"{chr(65 + i)}2"] = at[name]
            continue
        assert "^" not in cell
        assert len(cell) < 8192, "Excel's limit of a formula"
        variables[f"{chr(65 + i)}2"] = eval(
            cell[1:].replace(" = ", " == ").replace("<>", "!="), dict(EXCEL), variables
        )
    return np.asarray(variables[f"{chr(64 + len(cells))}2"])


def evaluate_latex(text: str, equation: LawEquation, at: Values) -> npt.NDArray[np.float64]:
    """The lines of an align environment: values and definitions are collected, then evaluated as
    they are needed.
    """
    body = (
        text.partition(r"\begin{align*}")[2]
        .partition(r"\end{align*}")[0]
        .replace("\\\\\n&\\quad {}", " ")
    )
    lines = dict(line.split(" &= ", 1) for line in re.split(r"\\\\\n", body.strip()))
    variables: dict[str, Any] = {
        {"eps": r"\varepsilon"}.get(name, name): value for name, value in at.items()
    }
    names = {{"eps": r"\varepsilon"}.get(each.result.name, each.result.name) for each in [equation]}

    def value_of(name: str) -> Any:
        if name not in variables:
            variables[name] = LatexReader(lines[name].partition(r"\,\mathrm")[0], value_of).sum()
        return variables[name]

    return np.asarray(value_of(names.pop()))


TOKEN = re.compile(
    r"\s*(\\begin\{cases\}|\\end\{cases\}|\\\\|&|\\text\{otherwise\}|\\(?:le|ne|land|lor|lnot|arctan)\b|[<=()]"
    r"|\\left\(|\\right\)|\\left\||\\right\||\\frac|\\sqrt|\\cdot|\\,|\\pi\b|\\(?:ln|exp|sin|cos|tan|sinh|cosh|min|max)\b"
    r"|\d+(?:\.\d+)?|(?:\\?[A-Za-z]+|\\text\{\w+\})(?:_\\text\{\w+\}|_\{(?:[^{}]|\{\w+\})*\})?|[-+^{},])"
)


RELATIONS: dict[str, Any] = {
    "<": np.less,
    r"\le": np.less_equal,
    "=": np.equal,
    r"\ne": np.not_equal,
    r"\land": np.logical_and,
    r"\lor": np.logical_or,
}


class LatexReader:
    """Value of an expression in LaTeX, by recursive descent."""

    def __init__(self, text: str, value_of: Any) -> None:
        self.tokens = TOKEN.findall(text)
        self.value_of = value_of
        assert re.sub(r"\s", "", "".join(self.tokens)) == re.sub(r"\s", "", text), text

    def peek(self) -> str:
        return self.tokens[0] if self.tokens else ""

    def take(self, expected: str = "") -> str:
        token: str = self.tokens.pop(0)
        assert expected in ("", token), (expected, token)
        return token

    def sum(self) -> Any:
        total = -self.term() if self.peek() == "-" and self.take() else self.term()
        while self.peek() in ("+", "-"):
            total = total + self.term() if self.take() == "+" else total - self.term()
        return total

    def term(self) -> Any:
        value = self.power()
        while self.peek() in (r"\,", r"\cdot"):
            self.take()
            value = value * self.power()
        return value

    def power(self) -> Any:
        base = self.atom()
        if self.peek() == "^":
            self.take()
            return base ** self.group()
        return base

    def group(self) -> Any:
        self.take("{")
        value = self.sum()
        self.take("}")
        return value

    def condition(self) -> Any:
        if self.peek() == r"\lnot" and self.take():
            return np.logical_not(self.sum())
        left = self.sum()
        return RELATIONS[self.take()](left, self.sum())

    def choice(self) -> Any:
        when_true = self.sum()
        self.take("&")
        holds = self.sum()
        self.take(r"\\")
        when_false = self.sum()
        for token in ("&", r"\text{otherwise}", r"\end{cases}"):
            self.take(token)
        return np.where(holds, when_true, when_false)

    def atom(self) -> Any:
        token = self.take()
        if token[0].isdigit():
            return float(token)
        if token == r"\left(":
            value = self.sum()
            self.take(r"\right)")
            return value
        if token == "(":
            value = self.condition()
            self.take(")")
            return value
        if token == r"\left|":
            value = np.abs(self.sum())
            self.take(r"\right|")
            return value
        if token == r"\begin{cases}":
            return self.choice()
        if token == r"\frac":
            return self.group() / self.group()
        if token in (r"\sqrt", r"\pi"):
            return np.sqrt(self.group()) if token == r"\sqrt" else math.pi
        name = token.removeprefix("\\")
        if name in ("ln", "exp", "sin", "cos", "tan", "arctan", "sinh", "cosh", "min", "max"):
            self.take(r"\left(")
            values = [self.sum()]
            while self.peek() == ",":
                self.take()
                values.append(self.sum())
            self.take(r"\right)")
            return FUNCTIONS[{"ln": "log", "arctan": "atan"}.get(name, name)](*values)
        return self.value_of(token)


@pytest.mark.parametrize("name", LAWS)
def test_the_text_for_each_language_gives_the_values_of_the_law(name: str, tmp_path: Path) -> None:
    law = LAWS[name]
    shown = equations(law)
    assert shown
    for equation in shown:
        texts = source_codes(equation, "Valid.")
        at = arguments_of(law, equation)
        check_values(law, equation, evaluate_matlab(texts["MATLAB"], equation, at))
        check_values(law, equation, evaluate_excel(texts["Excel"], at))
        check_values(law, equation, evaluate_latex(texts["LaTeX"], equation, at))
        if shutil.which("gcc"):
            check_values(law, equation, evaluate_c(texts["C"], equation, at, tmp_path))


@pytest.mark.parametrize(
    "name", [name for name in LAWS if "surface of degree" in name and name[-1] != "1"]
)
def test_a_polynomial_surface_reads_as_a_sum_of_monomials_in_scaled_and_in_physical_form(
    name: str,
) -> None:
    law = LAWS[name]
    assert isinstance(law, ContractileSurface)
    scaled, physical = equations(law)
    text = source_codes(scaled, "")["MATLAB"]
    assert "a_00 + a_10*x + a_20*x.^2" in text
    assert "a_11*x.*q" in text
    assert not physical.parameters
    assert [each.unit for each in physical.arguments] == ["bar", "1"]
    expected = law.monomial_coefficients(1e5)
    tex = source_codes(physical, "")["LaTeX"]
    assert re.search(rf"{abs(expected[1, 0]):.6g}"[:5], tex)


def test_the_equation_holds_in_the_range_of_the_data_and_names_each_unit() -> None:
    result = fit(ContractileSurface.blank(2), load_data("dmsp-20-300"))
    shown, (symbols,) = equation_section(result)
    assert "[N]" in shown[0].note
    assert "[Pa]" in shown[0].note
    assert "[1]" not in shown[0].note
    assert "Valid for pressure 35 to 675 kPa and contraction 0.0133" in shown[0].note
    values = dict(zip(symbols.columns["symbol"], symbols.columns["value"], strict=True))
    assert values["a_00"] == result["coefficients[0]"].value
    assert values["a_02"] == result["coefficients[5]"].value
    assert dict(zip(symbols.columns["symbol"], symbols.columns["unit"], strict=True))["a_02"] == "N"


def test_the_page_of_a_fit_shows_the_equation_as_mathml_and_as_text(tmp_path: Path) -> None:
    entry = load("dmsp-20-300")
    result = fit(ContractileSurface.blank(2), load_data("dmsp-20-300"))
    write_report([fit_chapter(result, entry)], tmp_path / "report")
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert re.search(r'<math [^>]*display="block">', page)
    assert "double muscle_force(double p, double eps)" in page
    assert "double muscle_force(double P, double eps)" in page
    assert r"\begin{align*}" in page
    assert "<script" not in page


@pytest.mark.parametrize("name", sorted(WITHOUT_EQUATION))
def test_a_law_without_a_closed_form_of_a_length_that_can_be_shown_has_no_equation(
    name: str,
) -> None:
    law = load(name).characteristic
    assert law_equation(law, *quantity_of(law), RANGES) == ()


@pytest.mark.parametrize("name", ["inverse length", "logarithmic length"])
def test_the_physical_form_of_a_family_of_lengths_holds_for_any_resting_length(name: str) -> None:
    law = LAWS[name]
    assert isinstance(law, InverseLength | LogarithmicLength)
    _, physical = equations(law)
    assert [(each.name, each.value) for each in physical.parameters] == [("L_0", 0.2)]
    text = source_codes(physical, "")["MATLAB"]
    assert "L_0 = 0.2;" in text
    assert re.search(r"log\(L_0/0\.3\)|0\.3/L_0", text)
    longer = text.replace("L_0 = 0.2;", "L_0 = 0.7;")
    values = evaluate_matlab(longer, physical, arguments_of(law, physical))
    check_values(law.with_resting_length(0.7), physical, values)


def test_the_physical_form_contains_a_length_that_scales_the_contraction_as_a_number() -> None:
    _, physical = equations(LAWS["effective length"])
    assert physical.parameters == ()
    assert physical.parts == ()


def test_the_symbol_of_a_shared_part_is_that_of_no_parameter() -> None:
    law = load("dmsp-20-300").characteristic
    (equation,) = equations(law)
    letters = {each.name.partition("_")[0] for each in equation.parameters}
    assert "c" in letters
    assert equation.parts
    assert not letters & {part.name.partition("_")[0] for part, _ in equation.parts}
