"""Extras: packages that a part of the program needs and that a plain installation leaves out."""

from typing import Self

from .errors import AirmuscleError


class MissingPackageError(AirmuscleError):
    """A package of an extra is not installed; the message states the line that installs it."""

    def located(self, location: object) -> Self:
        """The same error: no place in a file is its cause."""
        return self


def install_command(extra: str) -> str:
    """The command that installs an extra. Its double quotes are those of every shell: cmd.exe
    knows no others, and zsh takes bare brackets for a pattern.
    """
    return f'pip install "airmuscle[{extra}]"'
