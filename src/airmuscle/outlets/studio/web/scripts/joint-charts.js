/* Charts of the tab Joint: run in time, frequency response, and the reachable region of angle and stiffness. */
"use strict";

(() => {
  const { Chart, element, shortText } = airmuscle;
  const DEGREE = Math.PI / 180, FREQUENCIES = 90;

  const TRACES = [
    ["angle", "angle [°]", (sheet) => [["angle", 1 / DEGREE, "angle", "c1", []], ["setpoint.angle", 1 / DEGREE, "set point", "c2", [7, 5]]]],
    ["pressure", "gauge pressure [bar]", (sheet) => sheet.muscles.map((m, i) => [`${m.prefix}pressure`, 1e-5, m.name, i ? "c4" : "c1", i ? [8, 5] : []])],
    ["stiffness", "stiffness [N m/rad]", () => [["stiffness", 1, "stiffness", "c1", []], ["wanted stiffness", 1, "at the working point", "c2", [7, 5]]]],
    ["command", "commands", (sheet) => sheet.inputs.filter((i) => i.name !== "external_torque").map((input, i) => [input.name, input.unit === "Pa" ? 1e-5 : 1, input.unit === "Pa" ? `${input.name} [bar]` : input.name, ["c1", "c2", "c4", "c3"][i % 4], [[], [8, 5], [2, 4], [10, 3, 2, 3]][i % 4]])],
  ];

  class JointTraces {
    constructor(host) { this.host = host; this.charts = []; }

    begin(sheet) {
      this.charts = TRACES.map(([key, title, rowsOf]) => {
        const rows = rowsOf(sheet), holder = element("div"), last = key === "command";
        const chart = new Chart(holder, { label: `${title} over time`, x: last ? "time [s]" : "", y: "", height: key === "angle" ? 190 : last ? 142 : 120, overlay: (...drawing) => this.drawCursor(...drawing) });
        return { rows, chart, top: element("div", {}, element("div.row.small", {}, element("strong", {}, title), ...rows.map(([, , name, colour, dash]) => element("span.row.soft", {}, lineKey(colour, dash), name))), holder) };
      });
      this.host.replaceChildren(...this.charts.map((c) => c.top));
    }

    show(columns) {
      const { time } = columns;
      for (const { rows, chart } of this.charts) {
        let low = Infinity, high = -Infinity;
        const curves = rows.filter(([name]) => columns[name]).map(([name, factor, title, colour, dash]) => {
          const values = columns[name].map((v) => v * factor);
          for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
          return { values, colour, dash, width: 1.8, label: title };
        });
        const spare = Math.max(0.06 * (high - low), 1e-3 * Math.abs(high) + 1e-9);
        chart.show(curves, time, { x: [time[0], time.at(-1)], y: Number.isFinite(low) ? [low - spare, high + spare] : [0, 1] });
      }
    }

    setCursor(time) { this.cursor = time; for (const { chart } of this.charts) chart.redraw(); }

    drawCursor(chart, ctx, box) {
      if (!Number.isFinite(this.cursor)) return;
      const x = chart.px(this.cursor);
      ctx.strokeStyle = chart.colours.soft;
      ctx.lineWidth = 1;
      ctx.setLineDash([]);
      ctx.beginPath(); ctx.moveTo(x, box.top); ctx.lineTo(x, box.top + box.height); ctx.stroke();
    }
  }

  /* A piece of a line as in the chart */
  function lineKey(colour, dash) {
    const made = airmuscle.svg("svg", { width: 26, height: 8, "aria-hidden": "true" });
    made.append(airmuscle.svg("path", { d: "M0 4H26", stroke: `var(--${colour})`, "stroke-width": 2.5, "stroke-dasharray": dash.join(" ") }));
    return made;
  }

  /* Magnitude and phase of the open loop over the frequency. */
  class BodeCharts {
    constructor(host) {
      const splits = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200].map(Math.log10), options = (label, x, ySplits) => ({ label, x, y: "", height: 205, ySplits, xSplits: splits, xText: (v) => shortText(10 ** v, 3), overlay: (...drawing) => this.overlay(...drawing) });
      const parts = [["magnitude [dB]", "frequency [Hz]", [-60, -40, -20, 0, 20, 40]], ["phase [°]", "frequency [Hz]", [-360, -270, -180, -90, 0]]].map(([title, x, rows]) => { const holder = element("div"); return [new Chart(holder, options(`Open loop, ${title} over the frequency`, x, rows)), element("div", {}, element("div.row.small", {}, element("strong", {}, title)), holder)]; });
      [this.magnitude, this.phase] = parts.map(([chart]) => chart);
      host.append(element("div.bode", {}, ...parts.map(([, holder]) => holder)));
    }

    static frequencies(sampleTime) {
      const last = Math.min(100, 0.5 / sampleTime);
      return Array.from({ length: FREQUENCIES }, (_, i) => 0.1 * (last / 0.1 * 0.999) ** (i / (FREQUENCIES - 1)));
    }

    show(frequencies, response) {
      this.margins = response;
      const x = frequencies.map(Math.log10), range = [x[0], x.at(-1)], clip = (rows, low, high) => rows.map((v) => (v < low || v > high || !Number.isFinite(v) ? null : v));
      this.magnitude.show([{ values: clip(response.magnitude, -80, 60), colour: "c1", dash: [], width: 2, label: "magnitude" }], x, { x: range, y: [-60, 40] });
      this.phase.show([{ values: clip(response.phase, -720, 90), colour: "c1", dash: [], width: 2, label: "phase" }], x, { x: range, y: [-360, 0] });
    }

    overlay(chart, ctx, box) {
      const { margins } = this, level = chart === this.magnitude ? 0 : -180;
      ctx.strokeStyle = chart.colours.ink; ctx.lineWidth = 1; ctx.setLineDash([4, 4]);
      ctx.beginPath(); ctx.moveTo(box.left, chart.py(level)); ctx.lineTo(box.left + box.width, chart.py(level)); ctx.stroke();
      ctx.setLineDash([]);
      const mark = (frequency, from, to, text) => {
        if (!Number.isFinite(frequency)) return;
        const x = chart.px(Math.log10(frequency)), right = x > box.left + 0.72 * box.width, y = Math.min(box.top + box.height - 8, Math.max(box.top + 16, 0.5 * (chart.py(from) + chart.py(to)) + 5));
        ctx.strokeStyle = chart.colours.c2; ctx.lineWidth = 2.5;
        ctx.beginPath(); ctx.moveTo(x, chart.py(from)); ctx.lineTo(x, chart.py(to)); ctx.stroke();
        chart.write(ctx, text, x + (right ? -7 : 7), y, chart.colours.ink, right ? "right" : "left");
      };
      if (chart === this.magnitude) mark(margins.phaseCrossover, 0, -margins.gainMargin, `${shortText(margins.gainMargin, 3)} dB`);
      else mark(margins.crossover, -180, -180 + margins.phaseMargin, `${shortText(margins.phaseMargin, 3)}°`);
    }
  }

  /* Region of angle and stiffness that the pressures reach, with the working point. */
  class RegionChart {
    constructor(host, moved) {
      this.chart = new Chart(host, { label: "Reachable region of angle and stiffness; drag or use the arrow keys to move the working point", x: "angle [°]", y: "stiffness [N m/rad]", height: (width) => Math.round(Math.min(330, Math.max(230, 0.6 * width))), overlay: (...drawing) => this.overlay(...drawing) });
      this.moved = moved;
      host.tabIndex = 0;
      host.setAttribute("role", "application");
      host.setAttribute("aria-label", this.chart.options.label);
      host.addEventListener("pointerdown", (event) => { if (event.button === 0) { host.setPointerCapture(event.pointerId); this.drag(event); } });
      host.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.drag(event); });
      host.addEventListener("keydown", (event) => {
        const step = event.shiftKey ? 5 : 1, move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!move || !this.point) return;
        event.preventDefault();
        this.moved(this.point.angle + move[0] * step * DEGREE, this.point.stiffness + move[1] * step * this.step);
      });
    }

    drag(event) {
      const at = this.chart.valuesAt(event);
      if (Number.isFinite(at.x) && Number.isFinite(at.y)) this.moved(at.x * DEGREE, at.y);
    }

    begin(sheet) {
      const { angle, least, greatest } = sheet.region, x = angle.map((q) => q / DEGREE), low = Math.min(...least), high = Math.max(...greatest), spare = 0.06 * (high - low);
      this.step = 0.01 * (high - low);
      this.chart.show([{ values: least, colour: "c1", dash: [], width: 1.8, label: "minimum" }, { values: greatest, colour: "c1", dash: [], width: 1.8, label: "maximum" }], x, { x: [x[0] - 1, x.at(-1) + 1], y: [low - spare, high + spare] });
      this.sheet = sheet;
    }

    setPoint(point, path) { this.point = point; this.path = path; this.chart.redraw(); }

    overlay(chart, ctx) {
      if (!this.sheet || !this.point) return;
      const { angle, least, greatest } = this.sheet.region, edge = (rows, i) => [chart.px(angle[i] / DEGREE), chart.py(rows[i])];
      ctx.fillStyle = chart.colours.shade;
      ctx.beginPath();
      angle.forEach((_, i) => ctx.lineTo(...edge(greatest, i)));
      for (let i = angle.length - 1; i >= 0; i--) ctx.lineTo(...edge(least, i));
      ctx.fill();
      if (this.path) {
        ctx.strokeStyle = chart.colours.c2; ctx.lineWidth = 1.6; ctx.setLineDash([]);
        ctx.beginPath();
        this.path.angle.forEach((q, i) => ctx.lineTo(chart.px(q / DEGREE), chart.py(this.path.stiffness[i])));
        ctx.stroke();
      }
      const x = chart.px(this.point.angle / DEGREE), y = chart.py(this.point.stiffness);
      ctx.beginPath(); ctx.arc(x, y, 7, 0, 2 * Math.PI); ctx.fillStyle = chart.colours.ink; ctx.fill(); ctx.lineWidth = 2; ctx.strokeStyle = chart.colours.card; ctx.stroke();
    }
  }

  Object.assign(airmuscle, { JointTraces, BodeCharts, RegionChart });
})();
