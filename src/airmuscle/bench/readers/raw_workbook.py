"""Reader of old Excel workbooks (.xls) and OpenDocument spreadsheets (.ods): one table for each sheet with a table."""

from __future__ import annotations

from pathlib import Path

from .optional_dependency import import_lab_package, run_reader
from .raw_excel import Rows, check_sheet_exists, nonempty_rows, tables_of_sheets
from .separate_process import read_in_separate_process
from .table import RawTable
from .text_format import TextFormat


def read_workbook_tables(
    path: Path, sheet: str | None = None, text_format: TextFormat = TextFormat()
) -> tuple[RawTable, ...]:
    """Read one table from each sheet that contains one, or from the named sheet, as `read_excel_tables`.

    The package for these formats is native code, therefore a separate process reads the file. Raises FileError or
    ColumnError.
    """
    tables: tuple[RawTable, ...] = read_in_separate_process(
        "python_calamine", __name__, "read_workbook_tables_here", path, sheet, text_format
    )
    return tables


def read_workbook_tables_here(path: Path, sheet: str | None, text_format: TextFormat) -> tuple[RawTable, ...]:
    """As `read_workbook_tables`, in this process."""
    calamine = import_lab_package("python_calamine", path)

    def read() -> dict[str, Rows]:
        with calamine.CalamineWorkbook.from_path(str(path)) as book:
            check_sheet_exists(path, sheet, book.sheet_names)
            names = book.sheet_names if sheet is None else [sheet]
            rows = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in names}
        return {name: nonempty_rows(tuple(row) for row in table) for name, table in rows.items()}

    return tables_of_sheets(path, run_reader(path, f"a workbook ({path.suffix})", read), text_format)
