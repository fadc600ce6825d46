"""Fit-out of a body: the muscles of all its routes, for what is demanded of them."""

import dataclasses
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import Array, ParameterError, plotting
from ...files.library import Entry
from ...physics.pneumatics import Orifice
from ...physics.pneumatics.gas import REFERENCE_DENSITY
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ..sizing import SizingConditions, catalogue
from ..sizing.laws_of_product import LawOfProduct, coverage_of, sorted_laws
from ..sizing.static_muscle import product_of
from .body import BodyRoute
from .demand import balance
from .kinematics import sample_routes
from .motion_flow import MotionOfRoute, RouteFlow, route_flow
from .picture import body_figure
from .route_muscle import (
    FITTING_DIAMETERS,
    Criterion,
    RouteDemand,
    RouteMuscle,
    UnservedRoute,
    by_volume,
    check_served,
    choose_for_route,
    least_reserve,
)
from .study import BodyStudy

PASSES = 4
"""Passes of the choice, each with the residual tensions of the antagonists before (chosen)."""
LENGTHS = 121
"""Lengths of the figure of a route (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FitOut(Reported):
    """The muscles of a body.

    study       what the routes ask for
    conditions  supply, reserve and limits
    muscles     of the routes that are served
    unserved    the other routes, with what would serve them
    demands     lengths and demanded tensions of each route
    flows       flows of air that the motions of the study demand; empty without a motion
    valve       valve of each muscle with which they are compared; None without
    """

    study: BodyStudy
    conditions: SizingConditions
    criterion: Criterion
    muscles: tuple[RouteMuscle, ...]
    unserved: tuple[UnservedRoute, ...]
    demands: Mapping[str, RouteDemand]
    flows: tuple[RouteFlow, ...] = ()
    valve: Orifice | None = None

    def check_served(self) -> None:
        """Raise SolveError if a route is not served, with what would serve it."""
        check_served(self.unserved)

    def chapter(self) -> Chapter:
        """The description of the fit-out."""
        body = self.study.body
        shares = [self._used(route.name) for route in body.routes]
        picture = functools.partial(body_figure, body, shares, "demand over capacity")
        plots = [Plot("body", "The body with its routes; red ones are not served.", picture)]
        for choice in self.muscles:
            caption = (
                f"{choice.name}: tension over the length of the route, from the least to the"
                " greatest, with what is demanded."
            )
            draw = functools.partial(route_figure, choice, self.demands[choice.name])
            plots.append(Plot(f"route_{_plain(choice.name)}", caption, draw))
        return Chapter(
            "fit_out",
            f"Muscles of {body.name}, supply {self.conditions.supply / 1e5:.4g} bar",
            self._summary(),
            values=(
                NamedValue("number of routes", len(body.routes)),
                NamedValue("number of muscles", sum(choice.count for choice in self.muscles)),
            ),
            tables=(
                *self._choice_tables(),
                *self._order_tables(),
                *self._flow_tables(),
                *self._unserved_tables(),
            ),
            plots=tuple(plots),
            problems=tuple(self._problems()),
            notes=self._notes(),
            chosen=(
                (
                    "length of an end fitting",
                    f"{FITTING_DIAMETERS:.3g} nominal diameters",
                    "chosen",
                ),
                ("factor on the demand", f"{self.conditions.safety_factor:.4g}", "given"),
            ),
        )

    def order(self) -> list[tuple[str, float, int]]:
        """Product, nominal length [m] to the mm above, and number of what is to be ordered."""
        items: dict[tuple[str, float], int] = {}
        for choice in self.muscles:
            length = np.ceil(1e3 * choice.length - 1e-6) / 1e3
            key = choice.product, float(length)
            items[key] = items.get(key, 0) + choice.count
        return [(product, length, number) for (product, length), number in sorted(items.items())]

    def _used(self, route: str) -> float:
        """Part of the capacity that is demanded; 1 and more for a route that is not served."""
        for choice in self.muscles:
            if choice.name == route:
                return 1.0 / (1.0 + choice.reserve)
        return 2.0

    def _summary(self) -> str:
        served = len(self.muscles)
        number = sum(choice.count for choice in self.muscles)
        total = served + len(self.unserved)
        least = (self.criterion.__doc__ or "").split(".")[0].split(";")[0].lower()
        text = (
            f"{served} of {total} routes are served, by {number} muscles: for each the ones with"
            f" the least {least}, of those that keep every pose within its contraction and"
            f" {self.conditions.safety_factor:.3g} times the demand within its capacity, against"
            " the residual tension of the other muscles. A tackle is used where none serve without."
        )
        if self.unserved:
            names = ", ".join(item.sweep.route.name for item in self.unserved)
            text += f" Not served: {names}."
        return text

    def _notes(self) -> tuple[str, ...]:
        notes = []
        for choice in self.muscles:
            parts = ", ".join(
                f"{name} {100 * part:+.3g} %" for name, part in choice.contradictions.items()
            )
            if parts:
                notes.append(
                    f"{choice.name}: other laws of {choice.product} give another force at the pose"
                    f" of the least reserve: {parts}. Measure a muscle there before you order."
                )
        return (*notes, *self.study.body.remarks)

    def _choice_tables(self) -> tuple[Table, ...]:
        muscles = self.muscles
        if not muscles:
            return ()
        reserves = [None if np.isinf(item.reserve) else item.reserve for item in muscles]
        columns: dict[str, Any] = {
            "route": [choice.name for choice in muscles],
            "number": [choice.count for choice in muscles],
            "product": [choice.product for choice in muscles],
            "nominal length": TableColumn([item.length for item in muscles], "m", "mm"),
            "tackle": [f"{choice.tackle}:1" for choice in muscles],
            "contraction": TableColumn([item.contraction for item in muscles], "1", "%", 3),
            "reserve": TableColumn(reserves, "1", "%", 3),
            "tendon": TableColumn([item.tendon for item in muscles], "m", "mm"),
            "fittings": TableColumn([item.fittings for item in muscles], "m", "mm"),
            "law": TableColumn([item.muscle.entry.name for item in muscles], brief=False),
        }
        note = (
            "Contraction: in the longest and the shortest pose. Reserve: capacity beyond the demand"
            " in the worst pose; none where nothing is demanded. Tackle 2:1: the route moves twice"
            " as far as the muscle, with half its force. Tendon and both fittings fill the route."
        )
        return (Table("muscles", "Muscles of the routes", columns, note, brief=len(muscles)),)

    def _order_tables(self) -> tuple[Table, ...]:
        items = self.order()
        if not items:
            return ()
        columns: dict[str, Any] = {
            "product": [product for product, _, _ in items],
            "nominal length": TableColumn([length for _, length, _ in items], "m", "mm"),
            "number": [number for _, _, number in items],
        }
        return (Table("order", "Order list", columns, brief=len(items)),)

    def _problems(self) -> Iterator[str]:
        """Routes that are not served, and valves that are too small for a motion."""
        for item in self.unserved:
            yield f"{item.sweep.route.name}: no muscle serves it. {item.reason}."
        for flow in self.flows:
            if flow.use is not None and flow.use > 1.0:
                yield (
                    f"{flow.route}: the motion demands {flow.use:.3g} times the flow of the valve."
                    f" A sonic conductance of {1e8 * flow.conductance:.3g} dm3/(s bar) for each"
                    " muscle would serve, or a slower motion."
                )

    def _flow_tables(self) -> tuple[Table, ...]:
        flows = self.flows
        if not flows:
            return ()
        columns: dict[str, Any] = {
            "route": [flow.route for flow in flows],
            "muscles": [flow.count for flow in flows],
            "greatest flow in": TableColumn(
                [flow.volume_flow for flow in flows], "m3/s", "l/min", 3
            ),
            "greatest flow out": TableColumn(
                [flow.discharge / REFERENCE_DENSITY for flow in flows], "m3/s", "l/min", 3
            ),
            "conductance": TableColumn(
                [flow.conductance for flow in flows], "m3/(s Pa)", "dm3/(s bar)", 3
            ),
            "part of the valve": TableColumn([flow.use for flow in flows], "1", "%", 3),
        }
        total = sum(flow.count * flow.volume_flow for flow in flows)
        note = (
            "Of one muscle of each route, at the reference atmosphere (ANR); the air stays at the"
            " temperature of the surroundings. Conductance: the least of a valve to the supply and"
            " to the surroundings. All muscles that fill at once at their greatest flows would take"
            f" {6e4 * total:.3g} l/min from the supply; the motion demands at most that."
        )
        return (Table("flows", "Flows that the motion demands", columns, note, brief=len(flows)),)

    def _unserved_tables(self) -> tuple[Table, ...]:
        if not self.unserved:
            return ()
        columns = {
            "route": [item.sweep.route.name for item in self.unserved],
            "reason": [item.reason for item in self.unserved],
        }
        return (Table("unserved", "Routes that no muscle serves", columns),)


def fit_out(
    study: BodyStudy,
    conditions: SizingConditions,
    muscles: Sequence[Entry] | None = None,
    criterion: Criterion = by_volume,
    progress: Callable[[float], None] = lambda fraction: None,
    *,
    valve: Orifice | None = None,
) -> FitOut:
    """The muscles of the routes of a body, each of least cost.

    study       the routes and what is demanded of them
    conditions  supply, factor on the demand, greatest number side by side
    muscles     library entries; by default those of the catalogue
    criterion   what is made least: by_volume, by_number, by_total_length
    valve       valve of each muscle, with whose flow that of a motion is compared

    The demand contains the residual tension of the other muscles at the least working pressure; it
    is repeated with the muscles chosen before until the choice remains. Raises ParameterError.
    """
    entries = catalogue() if muscles is None else tuple(muscles)
    if not entries:
        raise ParameterError("fit_out: muscles must be one or more library entries.")
    laws = laws_of_products(entries, conditions)
    chosen: dict[str, RouteMuscle] = {}
    unserved: dict[str, UnservedRoute] = {}
    demands: dict[str, RouteDemand] = {}
    for number in range(PASSES):
        demands = _demands(study, chosen)
        previous = {name: (item.product, item.count, item.tackle) for name, item in chosen.items()}
        chosen = {}
        unserved = {}
        for sweep in study.sweeps:
            name = sweep.route.name
            if not sweep.route.is_path:
                unserved[name] = UnservedRoute(sweep, "it is a fixed tendon, without a length")
                continue
            choice = choose_for_route(sweep, demands[name], laws, conditions, criterion)
            if isinstance(choice, UnservedRoute):
                unserved[name] = choice
            else:
                chosen[name] = choice
        progress((number + 1) / PASSES)
        now = {name: (item.product, item.count, item.tackle) for name, item in chosen.items()}
        if now == previous and _is_sufficient(study, chosen, conditions):
            break
    demands = _demands(study, chosen)
    final = tuple(
        dataclasses.replace(choice, reserve=least_reserve(choice, demands[name]))
        for name, choice in chosen.items()
    )
    progress(1.0)
    flows = tuple(_flows(study, {item.name: item for item in final}, conditions, valve))
    return FitOut(
        study, conditions, criterion, final, tuple(unserved.values()), demands, flows, valve
    )


def _is_sufficient(
    study: BodyStudy, chosen: Mapping[str, RouteMuscle], conditions: SizingConditions
) -> bool:
    """Whether the muscles give their demand with the residual tensions of all of them."""
    demands = _demands(study, chosen)
    needed = conditions.safety_factor - 1.0
    return all(least_reserve(item, demands[name]) >= needed - 1e-3 for name, item in chosen.items())


def laws_of_products(
    entries: Sequence[Entry], conditions: SizingConditions
) -> dict[str, tuple[Entry, ...]]:
    """The usable laws of each product, the one to use first."""
    laws = []
    for entry in entries:
        coverage, extent = coverage_of(entry, conditions)
        if coverage > 0.0:
            laws.append(LawOfProduct(entry, product_of(entry), coverage, extent, {}, {}))
    products: dict[str, tuple[Entry, ...]] = {}
    for law in sorted_laws(laws):
        products[law.product] = (*products.get(law.product, ()), law.entry)
    return products


def _demands(study: BodyStudy, chosen: Mapping[str, RouteMuscle]) -> dict[str, RouteDemand]:
    """Lengths and demanded tensions of all routes, with the residual tensions of their muscles."""
    routes = study.body.routes
    floor = _floor(routes, chosen)
    lengths: list[Array] = []
    tensions: list[Array] = []
    for item in study.balances:
        lengths.append(sample_routes(study.body, item.demand.poses).length)
        tensions.append(balance(study.body, item.demand, floor).tension)
    everywhere = np.concatenate(lengths)
    needed = np.concatenate(tensions)
    return {
        route.name: RouteDemand(everywhere[:, column], needed[:, column])
        for column, route in enumerate(routes)
    }


def _floor(
    routes: Sequence[BodyRoute], chosen: Mapping[str, RouteMuscle]
) -> Callable[[Array], Array]:
    """The function from lengths (N, R) [m] to the residual tensions of the muscles [N]."""

    def floor(lengths: Array) -> Array:
        floors = np.zeros(lengths.shape)
        for column, route in enumerate(routes):
            if route.name in chosen:
                floors[:, column] = chosen[route.name].floor(lengths[:, column])
        return floors

    return floor


def _flows(
    study: BodyStudy,
    chosen: Mapping[str, RouteMuscle],
    conditions: SizingConditions,
    valve: Orifice | None,
) -> Iterator[RouteFlow]:
    """The flows of all routes whose muscles are chosen, in the motions of the study."""
    routes = study.body.routes
    for item in study.balances:
        time = item.demand.time
        if time is None:
            continue
        lengths = sample_routes(study.body, item.demand.poses).length
        tensions = balance(study.body, item.demand, _floor(routes, chosen)).tension
        for column, route in enumerate(routes):
            if route.name not in chosen:
                continue
            motion = MotionOfRoute(time, lengths[:, column], tensions[:, column])
            flow = route_flow(chosen[route.name], motion, conditions, valve)
            if flow is not None:
                yield flow


def route_figure(choice: RouteMuscle, demand: RouteDemand) -> Any:
    """Tension over the length of a route: capacity, residual tension, demand."""
    figure, axes = plotting.new_figure()
    sweep = choice.sweep
    length = np.linspace(sweep.shortest.length, sweep.longest.length, LENGTHS)
    axes.plot(1e3 * length, choice.capacity(length), color=plotting.BLACK, label="greatest tension")
    axes.plot(
        1e3 * length,
        choice.floor(length),
        color=plotting.BLUE,
        label=f"at {choice.muscle.pressure_range[0] / 1e5:.3g} bar",
    )
    axes.plot(
        1e3 * demand.length,
        demand.tension,
        linestyle="none",
        marker=".",
        markersize=2,
        color=plotting.RED,
        label="demand in the poses",
    )
    axes.set_xlabel("length of the route in mm")
    axes.set_ylabel("tension in N")
    number = f"{choice.count} x " if choice.count > 1 else ""
    axes.set_title(
        f"{choice.name}: {number}{choice.product}, {1e3 * choice.length:.4g} mm,"
        f" tackle {choice.tackle}:1"
    )
    plotting.legend_outside(axes)
    return figure


def _plain(name: str) -> str:
    """A name for a file."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)
