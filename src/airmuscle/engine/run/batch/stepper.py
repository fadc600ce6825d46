"""BatchStepper: many plants of one structure that are stepped together by hand, in lanes."""

import concurrent.futures
import ctypes
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import ParameterError, System
from ....core.system import check_system
from ...compile.cache.kernel import aligned_array, lane_blocks
from ...compile.program import compile_system
from ...processes import available_cores
from ..integrators import ExplicitRungeKutta
from .lanes import Double, Precision

Columns = npt.NDArray[Any]
"""An array (B, k, W) of B blocks of W lanes, in the precision of the batch."""
_PREPARE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


class BatchStepper:
    """Plants of one structure with states, inputs and parameters of their own, advanced together in
    equal steps.

    plant       any System
    count       number of plants N
    integrator  of fixed step: RungeKutta4(1e-3)
    precision   Double() or Single()
    cores       threads; all cores of this process unless given. The result does not depend on it

    states, inputs, parameters, outputs   (B, k, W): blocks of W lanes; plant i is lane i % W of
                                          block i // W. The last block is filled up with further
                                          plants, whose numbers are not used

    Nothing is checked between steps: a state that is impossible becomes a number that is not
    finite. `close` ends the threads. Raises ParameterError for a number of plants or an integrator
    that is impossible.
    """

    def __init__(
        self,
        plant: System,
        count: int,
        integrator: ExplicitRungeKutta,
        *,
        precision: Precision = Double(),
        cores: int | None = None,
    ) -> None:
        check_system("BatchStepper", plant)
        if not isinstance(count, int) or count < 1:
            raise ParameterError(
                f"BatchStepper: count is {count!r}; it must be a whole number from 1 on."
            )
        if not isinstance(integrator, ExplicitRungeKutta):
            raise ParameterError(
                f"BatchStepper: the integrator is {integrator!r}; it must have a fixed step, such"
                " as RungeKutta4(1e-3)."
            )
        if cores is not None and (not isinstance(cores, int) or cores < 1):
            raise ParameterError(
                f"BatchStepper: cores is {cores!r}; it must be a whole number from 1 on."
            )
        compiled = compile_system(plant)
        number = precision.number
        self.plant = plant
        self.count = count
        self.width = number.lanes
        self._options = {"integrator": integrator, "precision": precision, "cores": cores}
        self.dtype: Any = precision.dtype
        self.blocks = -(-count // self.width)
        (prepare, *functions), prepared_numbers = compiled.program.lanes(
            integrator.tableau(), number
        )
        self._program, self._prepare = compiled.program, _PREPARE(prepare)
        sizes = compiled.sizes
        self.states, self.inputs = self._columns(sizes.states), self._columns(sizes.inputs)
        self.parameters, self.outputs = (
            self._columns(sizes.parameters),
            self._columns(sizes.outputs),
        )
        self._held = self._columns(prepared_numbers)
        self.parameters[:] = compiled.parameters[None, :, None]
        self.prepare()
        cores = min(cores or available_cores(), self.blocks)
        ends = np.linspace(0, self.blocks, cores + 1).astype(np.int64)
        self._steps = np.zeros(1, dtype=np.int64)
        self._parts = [
            self._bind(functions, ends[i : i + 2].copy(), integrator.step) for i in range(cores)
        ]
        self._threads = concurrent.futures.ThreadPoolExecutor(cores - 1) if cores > 1 else None

    def __getstate__(self) -> dict[str, Any]:
        """Arguments and arrays; threads, kernels and addresses belong to a process."""
        arrays = self.states, self.inputs, self.parameters, self.outputs
        return {
            "plant": self.plant,
            "count": self.count,
            "options": self._options,
            "arrays": arrays,
        }

    def __setstate__(self, stored: dict[str, Any]) -> None:
        self.__init__(stored["plant"], stored["count"], **stored["options"])  # type: ignore[misc]
        for table, array in zip(
            (self.states, self.inputs, self.parameters, self.outputs), stored["arrays"], strict=True
        ):
            table[...] = array
        self.prepare()

    def _columns(self, length: int, blocks: int | None = None) -> Columns:
        """An array (B, length, W) whose blocks begin at multiples of the size of a vector."""
        shape = (self.blocks if blocks is None else blocks, max(length, 1), self.width)
        columns: Columns = aligned_array(shape, self.dtype)
        return columns

    def _bind(self, functions: list[int], span: npt.NDArray[np.int64], length: float) -> Any:
        """The kernel for the blocks of one thread."""
        n = self.states.shape[1]
        m = self.inputs.shape[1]
        still = self._columns(m, 1)[0]
        h = self._columns(1, 1)[0]
        next_states = self._columns(n, 1)[0]
        h[:] = length
        step, outputs = functions
        return lane_blocks.bind(
            step=step,
            outputs=outputs,
            x=self.states,
            u=self.inputs,
            c=self._held,
            w=still,
            h=h,
            other=next_states,
            o=self.outputs,
            span=span,
            steps=self._steps,
        )

    def prepare(self, blocks: npt.NDArray[np.intp] | None = None) -> None:
        """Take over the parameters of these blocks, or of all, after they were changed."""
        for block in range(self.blocks) if blocks is None else blocks.tolist():
            self._prepare(self.parameters[block].ctypes.data, self._held[block].ctypes.data)

    def advance(self, steps: int) -> None:
        """Advance all plants by so many steps with the inputs held, and compute their outputs; 0
        steps are allowed.
        """
        self._steps[0] = steps
        waiting = [self._threads.submit(part) for part in self._parts[1:]] if self._threads else []
        self._parts[0]()
        for part in waiting:
            part.result()

    def rows(self, columns: Columns, first: int, last: int, dtype: Any) -> Columns:
        """Columns first .. last - 1 of an array (B, k, W) by plant: a new array (N, last -
        first).
        """
        table = np.empty((self.blocks * self.width, last - first), dtype)
        table.reshape(self.blocks, self.width, last - first)[...] = columns[
            :, first:last
        ].transpose(0, 2, 1)
        return table[: self.count]

    def column(self, columns: Columns, index: int, dtype: Any) -> Columns:
        """One column of an array (B, k, W) by plant: a new array (N,)."""
        return columns[:, index].astype(dtype).reshape(-1)[: self.count]

    def close(self) -> None:
        """End the threads."""
        if self._threads:
            self._threads.shutdown()
            self._threads = None
