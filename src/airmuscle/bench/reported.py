"""Results of an identification that describe themselves: one chapter for `print`, notebooks,
reports and outlets.
"""

import abc
import shutil
from collections.abc import Sequence

from .. import recording
from ..recording.notebook import Card, NotebookDisplay
from ..report.chapter import Chapter, TableColumn
from ..report.shown import shown_columns, value_cells
from ..report.text import as_text

WIDTH = 100
"""Width of a printed table where there is no terminal [characters] (chosen)."""


class Reported(NotebookDisplay):
    """Base of results with a chapter, which `print` and notebooks show."""

    @abc.abstractmethod
    def chapter(self) -> Chapter:
        """The description of the result: summary, quantities, tables, figures and notes."""

    def __str__(self) -> str:
        return as_text(
            [self.chapter()], shutil.get_terminal_size((WIDTH, 24)).columns, "its chapter()"
        )

    def _card(self) -> Card:
        chapter = self.chapter()
        columns = next(
            (shown_columns(table, brief=True) for table in chapter.tables if table.brief_rows), []
        )
        table = [
            tuple(column.heading for column in columns),
            *zip(*(column.texts for column in columns), strict=True),
        ]
        lines = [
            f"{value.name}: {' '.join(filter(None, (*value_cells(value), value.remark)))}"
            for value in chapter.values
            if value.brief
        ]
        plot = chapter.plots[0].figure if chapter.plots else None
        notes = (*chapter.paragraphs, *(["; ".join(lines)] if lines else []), *chapter.notes)
        return Card(chapter.title, table if columns else (), plot, notes)


def unit_column(names: Sequence[str]) -> TableColumn:
    """The column "unit" of a table each row of which has a value of another quantity, by the names
    of columns.
    """
    known = [recording.quantity_of(name) for name in names]
    shown = [recording.display_scale(name)[1].removesuffix("-") for name in names]
    return TableColumn(
        ["" if quantity is None else quantity.unit for quantity in known], shown=shown
    )
