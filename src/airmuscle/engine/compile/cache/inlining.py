"""Inlining by numba with shallow copies of scopes, which takes a third of the time of the compilation of large kernels.

numba copies each block of a function before it inlines it, and with every block all variables of the function. It then
replaces the variables of the copied blocks, so that of the scope the names suffice.
"""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def shallow_scope_copies() -> Iterator[None]:
    """Within the context a copied scope of numba shares its variables, unless this numba has scopes of another form."""
    from numba.core import ir

    scope = ir.Scope
    if hasattr(scope, "__deepcopy__") or set(vars(scope(None, ir.unknown_loc))) != _FIELDS:
        yield
        return
    scope.__deepcopy__ = _shallow_copy
    try:
        yield
    finally:
        del scope.__deepcopy__


_FIELDS = {"parent", "localvars", "loc", "redefined", "var_redefinitions"}


def _shallow_copy(self: Any, memo: dict[int, Any]) -> Any:
    """A scope with dictionaries of its own and the same variables."""
    copied = type(self)(self.parent, self.loc)
    copied.localvars._con = dict(self.localvars._con)
    copied.redefined = self.redefined.copy()
    copied.var_redefinitions = defaultdict(set, {name: set(names) for name, names in self.var_redefinitions.items()})
    memo[id(self)] = copied
    return copied
