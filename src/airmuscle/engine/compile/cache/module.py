"""Machine code of printed modules: generated once per machine, stored, and loaded by later processes.

Code generation takes two thirds of the time in which a system is compiled. The name of a stored module is the hash of
its text, so that a system of the same structure finds it.
"""

from __future__ import annotations

import hashlib
from typing import Any

from ..llvm.jit import engine_of, object_code
from . import store


def load_module(text: str) -> Any:
    """An engine with the machine code of LLVM text; it must stay alive as long as its addresses are used."""
    name = "module-" + hashlib.sha256(text.encode()).hexdigest()[:40]
    code = store.load(name, ())
    if code is None:
        code = store.save(name, (), object_code(text))
    return engine_of(code)
