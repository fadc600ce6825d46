/* Chart of isobars: force over contraction at constant gauge pressures of one or several laws, with a working point. */
"use strict";

(() => {
  const { Chart, shortText, roundSteps, units } = airmuscle;
  const POINTS = 1000, MAX_RATIO = 8, LABEL_GAP = 15, LABEL_WIDTH = 48;
  const COLOURS = ["c1", "c2", "c3", "c4", "c5", "c6"];
  const DASHES = [[], [8, 5], [2, 4], [], [8, 5], [2, 4]];
  const SPARE = 0.04;

  /* Pressures of the isobars [Pa]: round steps over the validity range, or below the greatest rated pressure. */
  function usualPressures(laws) {
    const highest = Math.max(...laws.map(greatestPressure)), { factor } = units.pressure, steps = roundSteps(0, highest / factor, laws.length > 1 ? 4 : 8).map((step) => step * factor);
    return steps.filter((p) => p > 0);
  }

  function greatestPressure(law) {
    const { validity_range: valid, ratings } = law.sheet;
    return (valid && valid.max_pressure) || ratings.max_pressure || Math.min(law.pressureRange[1], 6e5);
  }

  /* Range of contraction in the chart: the validity range or, without one, up to zero force at the greatest pressure. */
  function contractionSpan(law) {
    const valid = law.sheet.validity_range, [least, greatest] = law.contractionRange;
    if (valid) return [Math.min(0, valid.min_contraction), Math.min(valid.max_contraction, 0.8)];
    const free = law.contraction(greatestPressure(law), Math.max(0, law.forceRange[0]));
    return [Math.max(Math.min(0, least), -0.05), Number.isNaN(free) ? Math.min(greatest, 0.4) : Math.min(free, greatest)];
  }

  class IsobarChart {
    constructor(host, moved) {
      this.chart = new Chart(host, {
        label: "Force over contraction at constant gauge pressures; drag or use the arrow keys to move the working point",
        x: "contraction [%]", y: "force [N]", height: (width) => Math.round(Math.min(560, Math.max(300, 0.62 * width))),
        overlay: (...drawing) => this.overlay(...drawing),
      });
      this.laws = [];
      this.moved = moved;
      this.buffers = [];
      this.lines = [];
      this.own = [];
      host.tabIndex = 0;
      host.setAttribute("role", "application");
      host.setAttribute("aria-label", this.chart.options.label);
      host.addEventListener("pointerdown", (event) => { if (event.button === 0) { host.setPointerCapture(event.pointerId); this.drag(event); } });
      host.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.drag(event); });
    }

    drag(event) {
      const at = this.chart.valuesAt(event);
      if (Number.isFinite(at.x) && Number.isFinite(at.y)) this.moved({ contraction: at.x / 100, force: Math.max(0, at.y) * units.force.factor });
    }

    /* laws with colour numbers; keepAxes: the axes stay as they are, as while a slider moves */
    show(laws, active, pressures, keepAxes) {
      this.laws = laws;
      this.active = active;
      this.pressures = pressures;
      this.setUnits();
      if (!keepAxes || !this.span) this.setSpan();
      this.compute();
      if (!keepAxes || !this.top) this.top = this.greatestForce();
      const low = 100 * this.span[0], high = 100 * this.span[1];
      this.chart.show(this.lines, this.percent, { x: [low, high], y: [0, this.top] });
    }

    /* The forces of the lines are in the unit of choice. */
    setUnits() {
      const label = `force [${units.force.name}]`;
      if (this.chart.options.y !== label) this.chart.styles = "";
      this.chart.options.y = label;
    }

    setSpan() {
      const spans = this.laws.map(contractionSpan), low = Math.min(...spans.map((s) => s[0])), high = Math.max(...spans.map((s) => s[1]));
      const spare = SPARE * (high - low);
      this.span = [low - spare, high + spare];
      this.grid = Float64Array.from({ length: POINTS }, (_, i) => this.span[0] + i / (POINTS - 1) * (this.span[1] - this.span[0]));
      this.percent = Array.from(this.grid, (c) => 100 * c);
    }

    compute() {
      this.lines = [];
      this.laws.forEach((law, k) => {
        for (const pressure of this.pressures) {
          const values = this.buffers[this.lines.length] ??= new Array(POINTS);
          law.isobar(pressure, this.grid, values);
          clip(values, this.grid, law.contractionRange);
          inUnit(values);
          this.lines.push({
            values, colour: COLOURS[k], dash: DASHES[k], width: law === this.active ? 1.8 : 1.4, pressure, law,
            label: `${law.sheet.name}, ${units.text("pressure", pressure)}`, spanned: !law.program.force,
          });
        }
      });
    }

    /* Greatest force within the validity ranges, at most MAX_RATIO of the median, for laws that diverge. */
    greatestForce() {
      const forces = [];
      for (const { values, law } of this.lines) {
        const valid = law.sheet.validity_range;
        for (let i = 0; i < POINTS; i += 5) if (values[i] > 0 && (!valid || this.grid[i] >= valid.min_contraction)) forces.push(values[i]);
      }
      forces.sort((a, b) => a - b);
      if (!forces.length) return 1;
      return 1.06 * Math.min(forces[forces.length - 1], MAX_RATIO * forces[forces.length >> 1]);
    }

    setPoint(point) { this.point = point; this.chart.redraw(); }

    overlay(chart, ctx, box) {
      const valid = this.active && this.active.sheet.validity_range;
      if (valid) {
        ctx.fillStyle = chart.colours.shade;
        const left = chart.px(100 * valid.min_contraction), right = chart.px(100 * valid.max_contraction);
        if (left > box.left) ctx.fillRect(box.left, box.top, left - box.left, box.height);
        if (right < box.left + box.width) ctx.fillRect(right, box.top, box.left + box.width - right, box.height);
      }
      this.drawOwn(chart, ctx);
      for (const { x, y, text, colour } of this.labels(chart, box)) chart.write(ctx, text, x, y, chart.colours[colour]);
      const at = this.point;
      if (!at || ![at.contraction, at.force, at.pressure].every(Number.isFinite)) return;
      this.drawPoint(chart, ctx, box, at);
    }

    /* The points of the user. */
    drawOwn(chart, ctx) {
      ctx.lineWidth = 1.5;
      ctx.strokeStyle = chart.colours.card;
      ctx.fillStyle = chart.colours.c4;
      for (const { contraction, force } of this.own) {
        ctx.beginPath();
        ctx.arc(chart.px(100 * contraction), chart.py(force / units.force.factor), 4.5, 0, 2 * Math.PI);
        ctx.fill();
        ctx.stroke();
      }
    }

    drawPoint(chart, ctx, box, at) {
      const line = this.pointLine ??= new Array(200), grid = this.pointGrid ??= new Float64Array(200);
      for (let i = 0; i < 200; i++) grid[i] = this.span[0] + i / 199 * (this.span[1] - this.span[0]);
      if (this.active.program.force) {
        this.active.isobar(at.pressure, grid, line);
        clip(line, grid, this.active.contractionRange);
        inUnit(line);
        ctx.beginPath();
        let pen = false;
        for (let i = 0; i < 200; i++) {
          if (line[i] === null) { pen = false; continue; }
          const x = chart.px(100 * grid[i]), y = chart.py(line[i]);
          if (pen) ctx.lineTo(x, y); else ctx.moveTo(x, y);
          pen = true;
        }
        ctx.strokeStyle = chart.colours.ink;
        ctx.lineWidth = 2.4;
        ctx.setLineDash([]);
        ctx.stroke();
      }
      const x = chart.px(100 * at.contraction), y = chart.py(at.force / units.force.factor);
      ctx.setLineDash([4, 4]);
      ctx.lineWidth = 1;
      ctx.strokeStyle = chart.colours.soft;
      ctx.beginPath();
      ctx.moveTo(box.left, y); ctx.lineTo(x, y); ctx.lineTo(x, box.top + box.height);
      ctx.stroke();
      ctx.setLineDash([]);
      ctx.beginPath();
      ctx.arc(x, y, 7, 0, 2 * Math.PI);
      ctx.fillStyle = chart.colours.ink;
      ctx.fill();
      ctx.lineWidth = 2;
      ctx.strokeStyle = chart.colours.card;
      ctx.stroke();
      const left = x > box.left + box.width - 90;
      chart.write(ctx, units.text("pressure", at.pressure), x + (left ? -12 : 12), Math.max(box.top + 16, y - 10), chart.colours.ink, left ? "right" : "left");
    }

    /* Pressure at the left end of each isobar of the active law; labels that would overlap are left out. */
    labels(chart, box) {
      const found = [], free = (x, y) => found.every((other) => Math.abs(other.y - y) >= LABEL_GAP || Math.abs(other.x - x) >= LABEL_WIDTH);
      for (const { values, law, pressure, colour } of [...this.lines].reverse()) {
        if (law !== this.active) continue;
        const i = values.findIndex((v) => v !== null && v <= this.top * 0.95 && v > 0);
        if (i < 0) continue;
        const x = Math.max(box.left + 5, chart.px(this.percent[i]) + 5), y = Math.min(box.top + box.height - 4, chart.py(values[i]) - 4);
        if (i < POINTS * 0.6 && free(x, Math.max(y, box.top + 13))) found.push({ x, y: Math.max(y, box.top + 13), text: units.text("pressure", pressure), colour });
      }
      return found;
    }

    /* The same as a figure for documents. */
    figure(title) {
      const marks = [], at = this.point;
      for (const { values, law, pressure, colour } of this.lines) {
        const i = values.findIndex((v) => v !== null && v <= this.top * 0.95 && v > 0);
        if (law === this.active && i >= 0) marks.push({ x: this.percent[i], y: values[i], label: units.text("pressure", pressure), colour });
      }
      if (at && Number.isFinite(at.force + at.contraction + at.pressure)) marks.push({ x: 100 * at.contraction, y: at.force / units.force.factor, dot: true, label: `${units.text("pressure", at.pressure)}, ${shortText(100 * at.contraction)} %, ${units.text("force", at.force)}` });
      marks.push(...this.own.map((point) => ({ x: 100 * point.contraction, y: point.force / units.force.factor, dot: true })));
      return {
        title, marks, x: { label: "contraction [%]", range: this.chart.ranges.x }, y: { label: `force [${units.force.name}]`, range: this.chart.ranges.y },
        curves: this.lines.map(({ values, colour, dash, width, spanned }) => ({ x: this.percent, y: values, colour, dash, width, spanned })),
      };
    }

    csv() {
      const { factor } = units.force;
      const columns = this.lines.map(({ values, law, pressure }) => ({ heading: `force of ${law.sheet.name} at ${shortText(pressure / 1e3, 6)} kPa [N]`, values: values.map((value) => (value === null ? null : value * factor)) }));
      return airmuscle.csvText([{ heading: "contraction [1]", values: this.grid }, ...columns]);
    }
  }

  /* A law has no meaning outside its range, and a muscle does not push. */
  function clip(values, grid, [low, high]) {
    for (let i = 0; i < values.length; i++) if (grid[i] < low || grid[i] > high || !(values[i] > -1e12)) values[i] = null;
  }

  function inUnit(values) {
    const { factor } = units.force;
    if (factor !== 1) for (let i = 0; i < values.length; i++) if (values[i] !== null) values[i] /= factor;
  }

  Object.assign(airmuscle, { IsobarChart, usualPressures, MUSCLE_COLOURS: COLOURS, MUSCLE_DASHES: DASHES });
})();
