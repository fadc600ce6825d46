"""Source folder of the site: pages of docs/ with rendered formulas and links of the site, and generated pages."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from . import command_pages, function_pages, model_pages
from .contents import DOCS, GENERATED, ROOT, Part, documents, parts
from .docstrings import joined_lines
from .formulas_in_text import displayed, is_formula_block

COPIED = ("benchmarks/RESULTS.md", "benchmarks/CONTROL.md", "benchmarks/REAL_DATA.md", "CHANGELOG.md")
"""Pages outside docs/ that belong to the site."""
INDENTED = re.compile(r"(?<=\n\n)(?:    .*\n|\n(?=    ))+(?=\n|\Z)")
FENCED = re.compile(r"(^```.*?^```\n?)", re.MULTILINE | re.DOTALL)


def write_sources(folder: Path, pictures: tuple[str, ...]) -> None:
    """Write all pages to a folder; `pictures` are the models with a figure in models/images."""
    for page in documents():
        write(folder / page.name, site_text(page.read_text(encoding="utf-8")))
    for name in COPIED:
        text = (ROOT / name).read_text(encoding="utf-8")
        write(folder / name, site_text(text, depth=name.count("/")))
    shutil.copytree(DOCS / "images", folder / "images", dirs_exist_ok=True)
    for path, text in (*model_pages.pages(pictures), *command_pages.pages(), *function_pages.pages()):
        write(folder / f"{path}.md", text)
    write(folder / "index.md", index(parts()))


def write(path: Path, text: str) -> None:
    """Write a page, and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def site_text(text: str, depth: int = 0) -> str:
    """A page of the repository as a page of the site: indented formulas are rendered, links lead to the site."""
    pieces = FENCED.split(text)
    for i in range(0, len(pieces), 2):
        pieces[i] = INDENTED.sub(_formula_block, pieces[i])
    return _links("".join(pieces), depth)


def _formula_block(match: re.Match[str]) -> str:
    lines = [line[4:] for line in match[0].strip("\n").split("\n") if line.strip()]
    if not is_formula_block(lines):
        return match[0]
    return displayed(joined_lines("\n".join(lines)))


def _links(text: str, depth: int) -> str:
    """Links of the repository as links of the site; what is not part of it is shown without link."""
    up = "../" * depth

    def replaced(match: re.Match[str]) -> str:
        label, target = match[1], match[2]
        path, _, anchor = target.partition("#")
        name = re.sub(r"^(?:\.\./)+", "", path)
        if re.match(r"[a-z]+:", target) or target.startswith("#") or path.startswith("images/"):
            return match[0]
        end = f"#{anchor}" if anchor else ""
        if name in ("README.md", "docs/README.md"):
            return f"[{label}]({up}index.md)"
        if name in COPIED:
            return f"[{label}]({up}{name}{end})"
        if (DOCS / Path(name).name).exists() and name.endswith(".md"):
            return f"[{label}]({up}{Path(name).name}{end})"
        return label

    return re.sub(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)", replaced, text)


def _document(target: str) -> str:
    """Name of a page in a table of contents."""
    return re.sub(r"^\.\./|\.md$", "", target)


def index(contents: tuple[Part, ...]) -> str:
    """The first page: the four parts with their pages, and the tables of contents of the sidebar."""
    head = (DOCS / "book" / "index.md").read_text(encoding="utf-8")
    lists, trees, above = [], [], ""
    for part in contents:
        if part.above and part.above != above:
            lists.append(f"## {part.above}\n")
        above = part.above
        lists.append(f"{'###' if part.above else '##'} {part.title}\n")
        if part.introduction:
            lists.append(part.introduction + "\n")
        items = [f"* [{item.title}]({_document(item.target)}.md): {item.text}" for item in part.items]
        extra = GENERATED.get(part.title, ())
        items += [f"* {GENERATED_TEXTS[name]}" for name in extra]
        lists.append("\n".join(items) + "\n")
        pages = "\n".join([*(_document(item.target) for item in part.items), *extra])
        trees.append(f"```{{toctree}}\n:hidden:\n:caption: {part.title}\n\n{pages}\n```\n")
    return "\n".join([head, *(_links(text, 0) for text in lists), *trees])


GENERATED_TEXTS = {
    "models/index": "[Models](models/index.md): formula, parameters, bounds and references of each.",
    "commands/index": "[Command line](commands/index.md): every command with its options and examples.",
    "functions/index": "[Python interface](functions/index.md): functions and classes by package.",
}
