"""Linear model predictive control as C99: its sample with the quadratic program, printed from the kernels."""

import dataclasses

import numpy as np

from ...control import LinearModelPredictive
from ...core import Array
from ...engine.compile.kernel_text import CKernels
from ...engine.loop.controller import Measurement
from ...engine.run.sampled_loop import SampledLoop
from .identifiers import c_array, c_integers, c_number, filled, provenance
from .printed_controller import PrintedController, ReplayedSamples

TOLERANCE = 1e-9
"""Part of its range by which a command in C may differ from that in Python (chosen): sums are in another order."""
FRAME = ("y", "r", "low", "high", "predicted", "plan", "inputs", "active", "counts")
"""Arguments of the kernel that the frame in C names itself."""
NOTE = (
    "The quadratic program is solved by the dual active-set method that runs in Python, printed from the same source; "
    "no library is needed. A sample without a solution applies the last plan and counts it in the last number of the "
    "memory."
)


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedPredictive(PrintedController):
    """A predictive controller as the kernel of its sample with its constants."""

    law: LinearModelPredictive  # type: ignore[assignment]

    def source_files(self) -> dict[str, str]:
        law, arrays = self.law, self.law.arrays()
        shapes = {name: tuple(map(str, array.shape)) for name, array in arrays.items()}
        known = {**law.constants, "operating": law.observer.inputs, "sizes": law.observer.input_sizes,
                 "at_measured": law.observer.measured, "at_controlled": law.target.controlled,
                 "low": self._deviations(0), "high": self._deviations(1)}  # fmt: skip
        places = {
            **self.places, "constants": self._constants(),
            "tables": "".join(_table(f"{self.name}_{name}", array) for name, array in known.items()),
            "functions": CKernels(shapes).text("predictive", ["predictive_sample"]),
            "work": "".join(
                f"  {'int' if array.dtype == np.int64 else 'double'} {name}{''.join(f'[{k}]' for k in array.shape)};\n"
                for name, array in arrays.items() if name not in {*FRAME, *law.constants}
            ).rstrip(),
            "arguments": ", ".join(f"{self.name}_{name}" if name in known else name for name in arrays),
            **{f"{name}_at": str(list(law.initial_memory).index(f"{name}0")) for name in law.init()._fields},
            "measured": str(len(law.measured)), "controlled": str(len(law.controlled)),
        }  # fmt: skip
        return {
            f"{self.name}.h": filled("controller.h", places, self.name),
            f"{self.name}.c": filled("predictive.c", places, self.name),
        }

    def _deviations(self, side: int) -> Array:
        """The minima or maxima of the inputs as scaled deviations."""
        model = self.law.observer
        return (np.array([pair[side] for pair in self.ranges]) - model.inputs) / model.input_sizes

    def replay(self, measured: Array, setpoints: Array, *, single: bool = False) -> ReplayedSamples:
        """The commands to measurements (K, p) and set points (K, q), in Python; in double precision alone."""
        law, memory, rows = self.law, self.law.init(), []
        ranges = dict(zip(law.inputs, self.ranges, strict=True))
        for values, points in zip(measured.tolist(), setpoints.tolist(), strict=True):
            seen = Measurement(
                dict(zip(law.measured, values, strict=True)), dict(zip(law.controlled, points, strict=True)), ranges
            )
            commands, memory = law.step(memory, seen, 0.0)
            rows.append([commands[name] for name in law.inputs])
        return ReplayedSamples(measured, setpoints, np.array(rows))


def print_predictive(prepared: SampledLoop, name: str, title: str) -> PrintedPredictive:
    """The predictive controller of a prepared loop, with its ranges as constants."""
    law = prepared.loop.controller
    assert isinstance(law, LinearModelPredictive)
    about = (f"Sample time {c_number(prepared.loop.sample_time)} s; set points {', '.join(law.controlled)}; measured "
             f"{', '.join(law.measured)}; commanded {', '.join(law.inputs)}.")  # fmt: skip
    lines = provenance(title or type(law).__name__, law, notes=[about, NOTE])
    return PrintedPredictive(
        name, law, {}, {}, [prepared.ranges[n] for n in law.inputs], (), lines, tolerance=TOLERANCE
    )


def _table(name: str, array: Array) -> str:
    """A constant array; a table is not const, because C converts no pointer to rows of constants."""
    if array.dtype == np.int64:
        return c_integers(f"static const int {name}[{len(array)}]", array.tolist())
    size = "".join(f"[{k}]" for k in array.shape)
    return c_array(f"static {'const ' if array.ndim == 1 else ''}double {name}{size}", array)
