/* Traces of a run: one chart for each physical quantity over a common time. */
"use strict";

(() => {
  const { Chart, element } = airmuscle;
  const COLOURS = ["c1", "c2", "c3", "c4", "c5", "c6"], DASHES = [[], [8, 5], [2, 4], [], [8, 5], [2, 4]];
  const TITLES = { pressure: "gauge pressure" };

  const last = (name) => name.slice(name.lastIndexOf(".") + 1);

  /* Columns by quantity: inputs, pressures, coordinates, forces; then what the user adds. */
  function groupsOf(sheet) {
    const inputs = new Set(sheet.inputs.map((i) => i.name)), groups = new Map();
    for (const column of sheet.columns) {
      const key = inputs.has(column.name) ? (column.unit ? `input [${column.unit}]` : "input") : `${(TITLES[last(column.name)] ?? last(column.name)).replaceAll("_", " ")} [${column.unit || "1"}]`;
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(column);
    }
    return groups;
  }

  class Traces {
    constructor(host) {
      this.choices = element("div.row.small");
      this.holder = element("div.traces");
      host.append(this.holder, element("details", {}, element("summary.small", {}, "Quantities in the charts"), this.choices));
      this.charts = new Map();
    }

    begin(sheet, shown) {
      this.groups = groupsOf(sheet);
      const wanted = [...this.groups.keys()].filter((key) => /^(input|gauge pressure|position|angle|force)/.test(key));
      this.shown = new Set((shown ?? wanted).filter((key) => this.groups.has(key)));
      this.choices.replaceChildren(...[...this.groups.keys()].map((key) => {
        const box = element("input", { type: "checkbox", checked: this.shown.has(key) });
        box.addEventListener("change", () => { if (box.checked) this.shown.add(key); else this.shown.delete(key); this.arrange(); this.again?.(); });
        return element("label.row", {}, box, key);
      }));
      this.arrange();
    }

    arrange() {
      this.charts.clear();
      this.holder.replaceChildren();
      for (const key of this.groups.keys()) {
        if (!this.shown.has(key)) continue;
        const host = element("div"), columns = this.groups.get(key);
        const names = columns.length > 1 ? columns.slice(0, 6).map((c, i) => element("span.row.soft", {}, element(`span.swatch.${COLOURS[i]}`), key.startsWith("input") ? c.name : c.name.slice(0, c.name.lastIndexOf(".")))) : [];
        this.holder.append(element("div", {}, element("div.row.small", {}, element("strong", {}, key), ...names), host));
        this.charts.set(key, new Chart(host, { label: `${key} over time`, x: "time [s]", y: "", height: 158, overlay: (...drawing) => this.drawCursor(...drawing) }));
      }
    }

    /* columns of a run; window: [from, to] in time */
    show(columns, [from, to]) {
      this.last = [columns, [from, to]];
      const { time } = columns;
      for (const [key, chart] of this.charts) {
        let low = Infinity, high = -Infinity;
        const curves = this.groups.get(key).slice(0, 6).map((column, i) => {
          const values = columns[column.name].map((v) => v * column.factor);
          for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
          return { values, colour: COLOURS[i], dash: DASHES[i], width: 1.7, label: column.name };
        });
        const spare = Math.max(0.06 * (high - low), 1e-9 + 1e-3 * Math.abs(high));
        chart.show(curves, time, { x: [from, to], y: Number.isFinite(low) ? [low - spare, high + spare] : [0, 1] });
      }
    }

    setCursor(time) {
      this.cursor = time;
      for (const chart of this.charts.values()) chart.redraw();
    }

    drawCursor(chart, ctx, box) {
      if (this.cursor === null || this.cursor === undefined) return;
      const x = chart.px(this.cursor);
      ctx.strokeStyle = chart.colours.soft;
      ctx.lineWidth = 1;
      ctx.setLineDash([]);
      ctx.beginPath();
      ctx.moveTo(x, box.top);
      ctx.lineTo(x, box.top + box.height);
      ctx.stroke();
    }
  }

  Object.assign(airmuscle, { Traces });
})();
