"""Plain data as a text in standard JSON."""

import json
import math
from typing import Any


def as_json(content: Any) -> str:
    """Return standard JSON: NumPy values become plain ones, values that are not finite become
    null.
    """
    return json.dumps(_json_value(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _json_value(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _json_value(item) for key, item in value.items()}
    if type(value).__module__ == "numpy":
        return _json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [_json_value(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
