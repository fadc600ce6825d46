"""Exact derivatives of recorded expressions, by elimination on their graph.

Every node is a vertex, every dependence an edge with a local partial derivative. A vertex v between
p and s is eliminated by c_sp += c_sv c_vp; finally, all edges lead from inputs to results. The next
vertex is always one with the fewest products (Markowitz criterion), which requires fewer operations
than the forward or reverse mode.

Reference: Griewank, A., Walther, A., Evaluating Derivatives, 2nd ed., SIAM 2008, chapters 9 and 10.
"""

import copy
import heapq
from collections.abc import Sequence

from ....core import Node, TraceError, nodes, slopes

Place = tuple[int, int]
"""Number of a result, and number of an input."""


def nonzeros(results: Sequence[Node], inputs: Sequence[Node]) -> dict[Place, Node]:
    """The derivatives of results by inputs that are not zero, by row and column.

    Vertices of equal cost are eliminated in the order of the nodes or in reverse order, whichever
    requires fewer operations. Raises TraceError for an operation without a differentiation rule.
    """
    graph = _Graph(results, inputs)
    candidates = [_eliminated(graph.copy(), sign) for sign in (1, -1)]
    forward, backward = (
        len(nodes.in_order([*results, *candidate.values()])) for candidate in candidates
    )
    return candidates[backward < forward]


class _Graph:
    """Vertices by number: inputs, the nodes that depend on them in order, then results.

    slopes_into    of each vertex the slope by each vertex before it
    successors     of each vertex those after it
    """

    def __init__(self, results: Sequence[Node], inputs: Sequence[Node]) -> None:
        self.inputs = len(inputs)
        self.slopes_into: dict[int, dict[int, Node]] = {}
        self.successors: list[set[int]] = [set() for _ in inputs]
        place = {id(node): number for number, node in enumerate(inputs)}
        for node in nodes.in_order(results, place):
            if any(id(argument) in place for argument in node.arguments):
                self._append(node, place)
        first = len(self.successors)
        self.results = range(first, first + len(results))
        for vertex, result in zip(self.results, results, strict=True):
            source = place.get(id(result))
            if source is not None:
                self.slopes_into[vertex] = {source: nodes.ONE}
                self.successors[source].add(vertex)

    def _append(self, node: Node, place: dict[int, int]) -> None:
        if node.operation not in slopes.RULES:
            raise TraceError(
                f"operation {node.operation.name} has no derivative; write the law over"
                " airmuscle.core.ops."
            )
        row: dict[int, Node] = {}
        for argument, slope in zip(node.arguments, slopes.partials(node), strict=True):
            source = place.get(id(argument))
            if source is not None and slope is not nodes.ZERO:
                row[source] = slopes.plus(row[source], slope) if source in row else slope
        if not row:
            return
        vertex = place[id(node)] = len(self.successors)
        self.slopes_into[vertex] = row
        self.successors.append(set())
        for source in row:
            self.successors[source].add(vertex)

    def copy(self) -> "_Graph":
        """A graph whose vertices can be eliminated, while those of this one remain."""
        copied = copy.copy(self)
        copied.slopes_into = {vertex: row.copy() for vertex, row in self.slopes_into.items()}
        copied.successors = [targets.copy() for targets in self.successors]
        return copied

    def cost(self, vertex: int) -> int:
        """How many products the elimination of a vertex requires."""
        return len(self.slopes_into[vertex]) * len(self.successors[vertex])

    def eliminate(self, vertex: int) -> set[int]:
        """Lead all edges of a vertex past it; the vertices whose cost changed."""
        row = self.slopes_into.pop(vertex)
        targets = sorted(self.successors[vertex])
        for source in row:
            self.successors[source].discard(vertex)
        for target in targets:
            sums = self.slopes_into[target]
            factor = sums.pop(vertex)
            for source, slope in row.items():
                product = slopes.times(factor, slope)
                sums[source] = slopes.plus(sums[source], product) if source in sums else product
                self.successors[source].add(target)
        return {*row, *targets}


def _eliminated(graph: _Graph, sign: int) -> dict[Place, Node]:
    between = range(graph.inputs, graph.results.start)
    queue = [(graph.cost(vertex), sign * vertex, vertex) for vertex in between]
    heapq.heapify(queue)
    while queue:
        cost, _, vertex = heapq.heappop(queue)
        if vertex not in graph.slopes_into or cost != graph.cost(vertex):
            continue
        for changed in graph.eliminate(vertex):
            if changed in between and changed in graph.slopes_into:
                heapq.heappush(queue, (graph.cost(changed), sign * changed, changed))
    return {
        (row, column): graph.slopes_into[vertex][column]
        for row, vertex in enumerate(graph.results)
        for column in range(graph.inputs)
        if column in graph.slopes_into.get(vertex, ())
    }
