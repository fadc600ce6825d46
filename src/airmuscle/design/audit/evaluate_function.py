"""Program that evaluates a function of a user at points, in a process of its own.

It reads {"module", "function", "points"} from the file of its argument and writes a line of JSON
for each point: {"value"} or {"error"}. It imports nothing of this package.
"""

import importlib
import json
import sys
from pathlib import Path
from typing import Any


def main() -> None:
    """Evaluate the function at each point; an error of the function is an answer."""
    request = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    answers = sys.stdout
    sys.stdout = sys.stderr  # what the function prints is no answer
    sys.path.insert(0, "")
    try:
        function: Any = importlib.import_module(request["module"])
        for name in request["function"].split("."):
            function = getattr(function, name)
    except Exception as error:  # whatever the module of the user raises
        answers.write(json.dumps({"missing": f"{type(error).__name__}: {error}"}) + "\n")
        return
    for point in request["points"]:
        try:
            value = complex(function(*point))
            answer = {"value": value.real} if value.imag == 0.0 else {"error": "a complex number"}
        except Exception as error:  # whatever the function of the user raises
            answer = {"error": f"{type(error).__name__}: {error}"[:300]}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
