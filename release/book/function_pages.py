"""Pages of the Python interface: functions and classes in the faces of the packages, with signature
and docstring.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import textwrap
from collections.abc import Iterator
from typing import Any

from airmuscle.files.library.fields import model_names

from .docstrings import docstring, to_markdown

FACES = {
    "airmuscle": "The most used names",
    "airmuscle.recording": "Recordings",
    "airmuscle.bench.readers": "Measurement files",
    "airmuscle.bench.inspection": "Inspection of recordings",
    "airmuscle.bench.diagnosis": "Diagnoses of data and fits",
    "airmuscle.bench.estimation": "Estimation",
    "airmuscle.bench.statics": "Static identification",
    "airmuscle.bench.comparison": "Comparison of laws",
    "airmuscle.bench.dynamics": "Dynamic identification",
    "airmuscle.bench.hysteresis": "Identification of hysteresis and creep",
    "airmuscle.bench.prediction": "Prediction of further records",
    "airmuscle.bench.campaign": "Bench campaigns",
    "airmuscle.physics.muscle.characteristic": "Characteristics",
    "airmuscle.physics.muscle.geometry": "Geometries",
    "airmuscle.physics.muscle.friction": "Friction",
    "airmuscle.physics.muscle": "Muscle",
    "airmuscle.physics.pneumatics": "Pneumatics",
    "airmuscle.physics.mechanism": "Mechanisms",
    "airmuscle.physics.plant": "Plant",
    "airmuscle.control.laws": "Control laws",
    "airmuscle.engine.loop": "Control loops",
    "airmuscle.engine.loop.inputs": "Input signals",
    "airmuscle.engine.loop.sampled_signal": "Sampled signals and trajectories",
    "airmuscle.engine.run": "Simulation",
    "airmuscle.engine.run.batch": "Batch simulation",
    "airmuscle.control.estimation": "Estimators and predictive controllers",
    "airmuscle.physics.analysis": "Analysis of a plant",
    "airmuscle.physics.equilibrium": "Equilibria",
    "airmuscle.files.library.scaling": "Scaling of muscles",
    "airmuscle.design.sizing": "Sizing",
    "airmuscle.outlets.environments": "Learning environments",
    "airmuscle.design.study": "Parameter studies",
    "airmuscle.design.tuning": "Tuning",
    "airmuscle.design.control_comparison": "Comparison of controllers",
    "airmuscle.outlets.export": "Export",
    "airmuscle.outlets.studio": "Studio",
    "airmuscle.core": "Interfaces for models",
}
"""Packages of the interface, in the order of the pages, with their titles."""
MAX_LINE = 100
"""Longest signature on one line."""


def pages() -> Iterator[tuple[str, str]]:
    """(path without suffix, text) of all pages."""
    yield "functions/index", overview(list(FACES))
    for name in FACES:
        yield f"functions/{name}", face_page(name)


def _names(module: str) -> list[str]:
    """The functions and classes of a face, or of a module without one, that are not models, in
    alphabetical order.
    """
    face = importlib.import_module(module)
    models = frozenset(model_names())
    own = [
        name
        for name, thing in vars(face).items()
        if getattr(thing, "__module__", "") == module and name[0] != "_"
    ]
    things = ((name, getattr(face, name)) for name in getattr(face, "__all__", own))
    return sorted(
        name
        for name, thing in things
        if (inspect.isfunction(thing) or inspect.isclass(thing)) and name not in models
    )


def overview(modules: list[str]) -> str:
    """The index of the packages."""
    lines = [f"* [{FACES[name]}]({name}.md): `{room_of(name)}`" for name in modules]
    tree = "\n".join(modules)
    head = (
        "# Python interface\n\nFunctions and classes that users import, by package. Models, which"
        " files may name too, have [pages of their own](../models/index.md); the"
        " [nomenclature](../nomenclature.md) explains arguments.\n"
    )
    return "\n".join([head, *lines, "", f"```{{toctree}}\n:hidden:\n\n{tree}\n```", ""])


def room_of(module: str) -> str:
    """The face from which users import: the package airmuscle or one of its rooms."""
    return ".".join(module.split(".")[:2])


def face_page(module: str) -> str:
    """The page of one package."""
    face = importlib.import_module(module)
    things = [(name, getattr(face, name)) for name in _names(module)]
    summary = to_markdown((face.__doc__ or "").strip().split("\n\n")[0])
    parts = [f"# {FACES[module]}\n", f"`{room_of(module)}`: {summary}"]
    parts += [
        class_section(name, thing) if inspect.isclass(thing) else function_section(name, thing)
        for name, thing in things
    ]
    return "\n".join(parts)


def signature(function: Any, name: str, *, method: bool = False) -> str:
    """The signature as written in the code, without `self`; one argument a line if it is long."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, TypeError, SyntaxError):
        return f"{name}(...)"
    node = next((n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)), None)
    if node is None:
        return f"{name}(...)"
    if method and node.args.args:
        node.args.args.pop(0)
    returns = f" -> {annotation(node.returns)}" if node.returns else ""
    line = f"{name}({', '.join(arguments(node.args))}){returns}"
    if len(line) <= MAX_LINE:
        return line
    lines = "".join(f"    {argument},\n" for argument in arguments(node.args))
    return f"{name}(\n{lines}){returns}"


def arguments(args: ast.arguments) -> Iterator[str]:
    """The arguments of a function as texts, with their annotations and defaults."""
    positional = [*args.posonlyargs, *args.args]
    missing = [None] * (len(positional) - len(args.defaults))
    for arg, default in zip(positional, [*missing, *args.defaults], strict=True):
        yield _argument(arg, default)
    if args.vararg:
        yield f"*{_argument(args.vararg, None)}"
    elif args.kwonlyargs:
        yield "*"
    for arg, default in zip(args.kwonlyargs, args.kw_defaults, strict=True):
        yield _argument(arg, default)
    if args.kwarg:
        yield f"**{_argument(args.kwarg, None)}"


def annotation(node: ast.expr) -> str:
    """The text of an annotation, without the quotes of a name that is defined later."""
    return (
        node.value
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        else ast.unparse(node)
    )


def _argument(arg: ast.arg, default: ast.expr | None) -> str:
    text = f"{arg.arg}: {annotation(arg.annotation)}" if arg.annotation else arg.arg
    if default is None:
        return text
    return (
        f"{text} = {ast.unparse(default)}" if arg.annotation else f"{text}={ast.unparse(default)}"
    )


def function_section(name: str, function: Any, level: int = 2) -> str:
    """Heading, signature and docstring of a function."""
    text = to_markdown(docstring(function))
    return f"{'#' * level} {name}\n\n```python\n{signature(function, name)}\n```\n\n{text}"


def class_section(name: str, cls: type[Any]) -> str:
    """Heading, docstring and methods of a class."""
    parts = [f"## {name}\n", to_markdown(docstring(cls))]
    for method, member in vars(cls).items():
        function = member.__func__ if isinstance(member, classmethod | staticmethod) else member
        text = (
            docstring(function)
            if inspect.isfunction(function) or isinstance(member, property)
            else ""
        )
        if method.startswith("_") or not text:
            continue
        label = f"{name}.{method}"
        if isinstance(member, property):
            parts.append(f"### {label}\n\n{to_markdown(inspect.cleandoc(text))}")
            continue
        shown = signature(function, label, method=not isinstance(member, staticmethod))
        parts.append(f"### {label}\n\n```python\n{shown}\n```\n\n{to_markdown(text)}")
    return "\n".join(parts)
