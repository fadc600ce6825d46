"""Display in notebooks: a card with a chart and a short table, as HTML that is readable on light
and dark grounds.
"""

import abc
import base64
import dataclasses
import html
from collections.abc import Callable, Sequence
from typing import Any

from .. import core
from ..core import AirmuscleError, ShortRepr

MAX_ROWS = 14
MAX_NOTES = 5
MAX_TEXT = 600
"""Maximum number of rows of a table, of notes, and of characters of a text in a card."""
MAX_CHART = 130_000
RESOLUTIONS = (100, 70, 45)
"""Maximum number of bytes of a chart, and its resolutions [dots per inch]: the first that keeps to
it is taken.
"""


@dataclasses.dataclass(frozen=True)
class Card:
    """Content of the display in a notebook.

    title  one line
    table  rows of texts; the first row is the header
    draw   function that makes the Matplotlib figure, or None
    notes  sentences below the table
    """

    title: str
    table: Sequence[Sequence[str]] = ()
    draw: Callable[[], Any] | None = None
    notes: Sequence[str] = ()


class NotebookDisplay(ShortRepr, abc.ABC):
    """Base of objects that show themselves in a notebook, with a short `repr` elsewhere."""

    @abc.abstractmethod
    def _card(self) -> Card:
        """The content of the display."""

    def _repr_html_(self) -> str:
        return render_card(self._card())


def render_card(card: Card) -> str:
    """A card as well-formed HTML without scripts: all texts are escaped, and the chart is an image
    in the page.
    """
    parts = [
        f'<div style="max-width: 62em"><p style="margin: 0.3em 0"><b>{_text(card.title)}</b></p>'
    ]
    parts += [_chart(card), _table(card.table) if card.table else ""]
    parts += [
        f'<p style="margin: 0.3em 0; font-size: 90%">{_text(note)}</p>'
        for note in card.notes[:MAX_NOTES]
    ]
    if len(card.notes) > MAX_NOTES:
        parts.append(
            f'<p style="margin: 0.3em 0; font-size: 90%">and {len(card.notes) - MAX_NOTES} more'
            " notes</p>"
        )
    return "".join([*parts, "</div>"])


def _text(text: object) -> str:
    shown = str(text)
    return html.escape(shown if len(shown) <= MAX_TEXT else f"{shown[:MAX_TEXT]} …")


def _table(table: Sequence[Sequence[str]]) -> str:
    """The rows as an HTML table in the colours of the notebook; those beyond `MAX_ROWS` are
    counted.
    """
    head = table[0]
    rows = table[1:]
    shown = rows[:MAX_ROWS]
    style = (
        "text-align: left; padding: 0.15em 0.8em 0.15em 0; background: transparent; color: inherit"
    )
    lines = ["".join(f'<th style="{style}">{_text(cell)}</th>' for cell in head)]
    lines += ["".join(f'<td style="{style}">{_text(cell)}</td>' for cell in row) for row in shown]
    if len(rows) > len(shown):
        lines.append(
            f'<td style="{style}" colspan="{len(head)}">and {len(rows) - len(shown)} more</td>'
        )
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _chart(card: Card) -> str:
    """The chart as an image on a white ground, which is readable on a dark page too; a reason if
    there is none.
    """
    if card.draw is None:
        return ""
    try:
        figure = card.draw()
    except AirmuscleError as error:
        return f'<p style="margin: 0.3em 0; font-size: 90%">no chart: {_text(error)}</p>'
    content = b""
    for resolution in RESOLUTIONS:
        content = core.rendered(figure, ("png",), dots_per_inch=resolution)["png"]
        if len(content) <= MAX_CHART:
            break
    data = base64.b64encode(content).decode("ascii")
    style = "background: #fff; border-radius: 4px; max-width: 100%; height: auto"
    width = round(90 * float(figure.get_figwidth()))
    return (
        f'<img alt="{_text(card.title)}" width="{width}" style="{style}"'
        f' src="data:image/png;base64,{data}"/>'
    )
