/* Isotonics and stiffness: contraction over pressure at constant forces, and stiffness over contraction at constant
   pressures, of the laws of the tab Muscle. */
"use strict";

(() => {
  const { Chart, element, shortText, roundSteps, units } = airmuscle;
  const POINTS = 81, DELAY = 200, SPARE = 1.06, KINDS = [["isotonics", "Contraction over pressure (isotonics)"], ["stiffness", "Stiffness over contraction"]];

  class CurvePanel {
    constructor(host) {
      const chartHost = element("div");
      this.kind = element("select", { "aria-label": "Curves" }, ...KINDS.map(([value, text]) => element("option", { value }, text)));
      this.kind.addEventListener("change", () => this.draw());
      const button = element("button", { type: "button", onclick: () => airmuscle.download(`${this.kind.value}.csv`, this.csv(), "text/csv") }, "Curves as CSV");
      host.append(element("div.row", {}, element("div.grow", {}, this.kind), button), chartHost);
      this.chart = new Chart(chartHost, { label: "Isotonics or stiffness of the muscles", x: "", y: "", height: (width) => Math.round(Math.min(400, Math.max(260, 0.45 * width))), overlay: (...drawing) => this.overlay(...drawing) });
    }

    /* Drawn when nothing has changed for a moment, because each point may be a root search. */
    show(laws, active, pressures, span, greatestForce) {
      Object.assign(this, { laws, active, pressures, span, greatestForce });
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.draw(), DELAY);
    }

    draw() {
      if (!this.laws) return;
      const plan = this.kind.value === "stiffness" ? this.stiffness() : this.isotonics();
      this.curves = this.laws.flatMap((law, k) => plan.levels.map((level) => ({
        values: plan.grid.map((at) => plan.valueOf(law, level, at)), colour: airmuscle.MUSCLE_COLOURS[k], dash: airmuscle.MUSCLE_DASHES[k], width: law === this.active ? 1.8 : 1.4,
        law, mark: plan.markOf(level), label: `${law.sheet.name}, ${plan.markOf(level)}`, spanned: false,
      })));
      for (const curve of this.curves) curve.values = curve.values.map((value) => (Number.isFinite(value) ? value : null));
      this.plan = plan;
      const shown = this.curves.flatMap(({ values }) => values.filter((value) => value !== null)).sort((a, b) => a - b);
      const top = shown.length ? SPARE * shown[Math.floor(0.98 * (shown.length - 1))] : 1;
      Object.assign(this.chart.options, { x: plan.x, y: plan.y });
      this.chart.styles = "";
      this.x = plan.grid.map((at) => at / plan.xFactor);
      this.chart.show(this.curves, this.x, { x: [this.x[0], this.x.at(-1)], y: [Math.min(0, shown[0] ?? 0), top] });
    }

    isotonics() {
      const highest = Math.max(...this.pressures), { pressure, force } = units;
      return {
        grid: grid(0, highest), xFactor: pressure.factor, x: `gauge pressure [${pressure.name}]`, y: "contraction [%]",
        levels: roundSteps(0, this.greatestForce / force.factor, 6).filter((value) => value > 0).map((value) => value * force.factor), markOf: (level) => units.text("force", level),
        valueOf: (law, level, at) => 100 * law.contraction(at, level),
      };
    }

    stiffness() {
      const { force, length } = units, perLength = this.laws.every((law) => law.restingLength);
      const unit = perLength ? `${force.name}/${length.name}` : `${force.name}/%`;
      return {
        grid: grid(...this.span), xFactor: 0.01, x: "contraction [%]", y: `stiffness [${unit}]`, levels: this.pressures, markOf: (level) => units.text("pressure", level),
        valueOf: (law, level, at) => (law.force(level, at) > 0 ? law.stiffness(level, at) / (perLength ? law.restingLength / length.factor : 100) / force.factor : NaN),
      };
    }

    /* The constant quantity of each curve of the active law at its last point; labels that would overlap are left out. */
    overlay(chart, ctx, box) {
      const placed = [];
      for (const { values, law, mark, colour } of this.curves ?? []) {
        if (law !== this.active) continue;
        const place = (this.kind.value === "stiffness" ? values.findIndex((v) => v !== null && v < 0.95 * chart.ranges.y[1]) : values.findLastIndex((v) => v !== null));
        if (place < 0) continue;
        const right = place > values.length / 2, x = chart.px(this.x[place]) + (right ? -5 : 5), y = Math.max(box.top + 13, Math.min(box.top + box.height - 4, chart.py(values[place]) - 4));
        if (placed.some((other) => Math.abs(other.x - x) < 50 && Math.abs(other.y - y) < 15)) continue;
        placed.push({ x, y });
        chart.write(ctx, mark, x, y, chart.colours[colour], right ? "right" : "left");
      }
    }

    csv() {
      return airmuscle.csvText([{ heading: this.plan.x, values: this.x }, ...this.curves.map(({ values, label }) => ({ heading: `${this.plan.y}: ${label}`, values }))]);
    }
  }

  const grid = (low, high) => Array.from({ length: POINTS }, (_, i) => low + i / (POINTS - 1) * (high - low));

  Object.assign(airmuscle, { CurvePanel });
})();
