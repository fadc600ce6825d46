"""Source folder of the site: pages of docs/ with rendered formulas and links of the site, and
generated pages.
"""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path

from . import command_pages, function_pages, model_pages
from .ascii_math import FormulaError, to_latex
from .contents import DOCS, GENERATED, ROOT, Part, documents, parts
from .docstrings import joined_lines
from .formulas_in_text import displayed, is_formula_block
from .latex_symbols import GREEK

COPIED = (
    "benchmarks/RESULTS.md",
    "benchmarks/control/README.md",
    "benchmarks/control/CONTROL.md",
    "benchmarks/REAL_DATA.md",
    "CHANGELOG.md",
)
"""Pages outside docs/ that belong to the site."""
INDENTED = re.compile(r"(?<=\n\n)(?:    .*\n|\n(?=    ))+(?=\n|\Z)")
KEPT = re.compile(
    r"(^ {4}.*?$|^```.*?^```|`[^`]*`|\]\([^)]*\)|^\[[^\]]*\]:.*?$|<[^>]+>)",
    re.MULTILINE | re.DOTALL,
)
_GREEK = "|".join(sorted(GREEK - {"psi", "pi"} | {"eps"}, key=len, reverse=True))
SYMBOL = re.compile(
    rf"(?<![\w\\/.^-])(?:(?:{_GREEK}|[A-Za-z])_[A-Za-z0-9]+|(?:{_GREEK})'?)(?![\w(/.^-]\w|\w|\()"
)
FENCED = re.compile(r"(^```.*?^```\n?)", re.MULTILINE | re.DOTALL)


def write_sources(folder: Path, pictures: tuple[str, ...]) -> None:
    """Write all pages to a folder; `pictures` are the models with a figure in models/images."""
    for page in documents():
        write(folder / page.name, site_text(page.read_text(encoding="utf-8")))
    for name in COPIED:
        text = (ROOT / name).read_text(encoding="utf-8")
        write(folder / name, site_text(text, depth=name.count("/")))
    shutil.copytree(DOCS / "images", folder / "images", dirs_exist_ok=True)
    for path, text in (
        *model_pages.pages(pictures),
        *command_pages.pages(),
        *function_pages.pages(),
    ):
        write(folder / f"{path}.md", text)
    write(folder / "index.md", index(parts()))


def write(path: Path, text: str) -> None:
    """Write a page, and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def site_text(text: str, depth: int = 0) -> str:
    """A page of the repository as a page of the site: indented formulas are rendered, links lead to
    the site.
    """
    pieces = FENCED.split(text)
    for i in range(0, len(pieces), 2):
        pieces[i] = typeset_symbols(INDENTED.sub(_formula_block, pieces[i]))
    up = "../" * depth
    return (
        _links("".join(pieces), up)
        .replace(f"]({up}docs/images/", f"]({up}images/")
        .replace("](../images/", "](images/")
    )


def typeset_symbols(prose: str) -> str:
    """Prose with the symbols in it, such as theta_g, as mathematics; code, targets of links and
    blocks stay.
    """
    pieces = KEPT.split(prose)
    for i in range(0, len(pieces), 2):
        pieces[i] = SYMBOL.sub(_symbol, pieces[i])
    return "".join(pieces)


def _symbol(match: re.Match[str]) -> str:
    try:
        return f"{{math}}`{to_latex(match[0], display=False).strip()}`"
    except FormulaError:  # no symbol, such as x_2dot
        return match[0]


def _formula_block(match: re.Match[str]) -> str:
    lines = [line[4:] for line in match[0].strip("\n").split("\n") if line.strip()]
    if not is_formula_block(lines):
        return match[0]
    return displayed(joined_lines("\n".join(lines)))


def _links(text: str, up: str = "") -> str:
    """Links of the repository as links of the site, from below `up`; what is not part of it is
    shown without link.
    """

    def replaced(match: re.Match[str]) -> str:
        label = match[1]
        target = match[2]
        path, _, anchor = target.partition("#")
        name = re.sub(r"^(?:\.\./)+", "", path)
        if (
            re.match(r"[a-z]+:", target)
            or target.startswith("#")
            or path.startswith(("images/", "../images/"))
        ):
            return match[0]
        end = f"#{anchor}" if anchor else ""
        if name in ("README.md", "docs/README.md"):
            return f"[{label}]({up}index.md)"
        if name in COPIED:
            return f"[{label}]({up}{name}{end})"
        if Path(name).name in {page.name for page in documents()}:
            return f"[{label}]({up}{Path(name).name}{end})"
        return label

    return re.sub(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)", replaced, text)


def _document(target: str) -> str:
    """Name of a page in a table of contents."""
    page = target.removeprefix("../").removesuffix(".md")
    return page if page.startswith("benchmarks/") else page.rpartition("/")[2]


def index(contents: tuple[Part, ...]) -> str:
    """The first page: the four parts with their pages, and the tables of contents of the
    sidebar.
    """
    head = Path(__file__).with_name("index.md").read_text(encoding="utf-8")
    lists = []
    trees = []
    above = ""
    for part in contents:
        if part.above and part.above != above:
            lists.append(f"## {part.above}\n")
        above = part.above
        lists.append(f"{'###' if part.above else '##'} {part.title}\n")
        if part.introduction:
            lists.append(part.introduction + "\n")
        items = [
            f"* [{item.title}]({_document(item.target)}.md): {item.text}" for item in part.items
        ]
        extra = GENERATED.get(part.title, ())
        items += [f"* {GENERATED_TEXTS[name]}" for name in extra]
        lists.append("\n".join(items) + "\n")
        pages = "\n".join([*(_document(item.target) for item in part.items), *extra])
        trees.append(f"```{{toctree}}\n:hidden:\n:caption: {part.title}\n\n{pages}\n```\n")
    return "\n".join(
        [head.replace("@repository@", _repository()), *(_links(text) for text in lists), *trees]
    )


def _repository() -> str:
    """A line with the address of the repository, if pyproject.toml states it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    address = project["tool"]["hatch"]["metadata"]["hooks"]["custom"]["repository"]
    return f"Source code, issues and releases: [{address}]({address})." if address else ""


GENERATED_TEXTS = {
    "models/index": (
        "[Models](models/index.md): formula, parameters, bounds and references of each."
    ),
    "commands/index": (
        "[Command line](commands/index.md): every command with its options and examples."
    ),
    "functions/index": "[Python interface](functions/index.md): functions and classes by package.",
}
