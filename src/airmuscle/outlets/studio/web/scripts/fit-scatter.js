/* Scatter: points, lines and bands in a chart; a point is {x, y, group, off}. */
"use strict";

(() => {
  const { Chart } = airmuscle;
  const COLOURS = ["c1", "c2", "c3", "c4", "c5", "c6"], DASHES = [[], [8, 5], [2, 4], [], [8, 5], [2, 4]];
  const UNITS = { pressure: [1e-3, "kPa"], contraction: [100, "%"], length: [1000, "mm"], force: [1, "N"], time: [1, "s"] };

  /* Factor and unit in which a quantity is shown. */
  const scaleOf = (name) => UNITS[name] ?? [1, ""];
  const labelOf = (name) => `${name} [${scaleOf(name)[1]}]`;

  function rangeOf(values, share = 0.05) {
    let low = Infinity, high = -Infinity;
    for (const v of values) if (Number.isFinite(v)) { if (v < low) low = v; if (v > high) high = v; }
    if (!(high >= low)) return [0, 1];
    const spare = Math.max(share * (high - low), 1e-3 * Math.abs(high), 1e-9);
    return [low - spare, high + spare];
  }

  class Scatter {
    constructor(host, label, height = 360) {
      this.host = host;
      this.chart = new Chart(host, { label, x: " ", y: " ", height, overlay: (...drawing) => this.draw(...drawing) });
    }

    /* content: {x, y: labels, points: {x, y, group, off, colour}, lines: [{x, y, colour, dash}], bands: [{x, low, high, colour, light}], ranges, rectangle} */
    show(content) {
      this.content = content;
      const { points, lines = [], bands = [] } = content;
      const ranges = content.ranges ?? {
        x: rangeOf([...(points?.x ?? []), ...lines.flatMap((l) => l.x)]), y: rangeOf([...(points?.y ?? []), ...lines.flatMap((l) => l.y), ...bands.filter((b) => !b.light).flatMap((b) => [...b.low, ...b.high])]),
      };
      if (this.chart.options.x !== content.x || this.chart.options.y !== content.y) { Object.assign(this.chart.options, { x: content.x, y: content.y }); this.chart.styles = ""; }
      this.chart.show([{ values: [null, null], colour: "soft", label: content.y }], ranges.x, ranges);
      this.chart.redraw();
    }

    redraw() { this.chart.redraw(); }

    draw(chart, ctx, box) {
      const { points, lines = [], bands = [], rectangle } = this.content ?? {};
      ctx.setLineDash([]);
      for (const band of bands) this.drawBand(chart, ctx, band);
      if (points) this.drawPoints(chart, ctx, points);
      for (const line of lines) this.drawLine(chart, ctx, line);
      if (!rectangle) return;
      const x = chart.px(rectangle.x[0]), y = rectangle.y ? chart.py(rectangle.y[1]) : box.top;
      const width = chart.px(rectangle.x[1]) - x, height = rectangle.y ? chart.py(rectangle.y[0]) - y : box.height;
      ctx.fillStyle = chart.colours.shade;
      ctx.fillRect(x, y, width, height);
      ctx.strokeStyle = chart.colours.ink;
      ctx.lineWidth = 1;
      ctx.strokeRect(x, y, width, height);
    }

    drawPoints(chart, ctx, { x, y, group, off, colour }) {
      const size = x.length > 2500 ? 1.4 : x.length > 600 ? 2 : 2.6;
      for (let g = -1; g < COLOURS.length; g++) {
        ctx.beginPath();
        for (let i = 0; i < x.length; i++) {
          const left = off?.[i];
          if (left ? g >= 0 : g !== (group ? group[i] % COLOURS.length : 0)) continue;
          const px = chart.px(x[i]), py = chart.py(y[i]);
          if (left) { ctx.moveTo(px - 3, py - 3); ctx.lineTo(px + 3, py + 3); ctx.moveTo(px - 3, py + 3); ctx.lineTo(px + 3, py - 3); }
          else { ctx.moveTo(px + size, py); ctx.arc(px, py, size, 0, 2 * Math.PI); }
        }
        if (g < 0) { ctx.lineWidth = 1; ctx.strokeStyle = chart.colours.soft; ctx.stroke(); } else { ctx.fillStyle = chart.colours[colour ?? COLOURS[g]]; ctx.fill(); }
      }
    }

    drawBand(chart, ctx, { x, low, high, colour, light }) {
      const inside = x.map((_, i) => i).filter((i) => Number.isFinite(low[i]) && Number.isFinite(high[i]));
      if (!inside.length) return;
      ctx.beginPath();
      inside.forEach((i, k) => (k ? ctx.lineTo(chart.px(x[i]), chart.py(high[i])) : ctx.moveTo(chart.px(x[i]), chart.py(high[i]))));
      for (const i of inside.reverse()) ctx.lineTo(chart.px(x[i]), chart.py(low[i]));
      ctx.closePath();
      ctx.globalAlpha = light ? 0.13 : 0.34;
      ctx.fillStyle = chart.colours[colour];
      ctx.fill();
      ctx.globalAlpha = 1;
    }

    drawLine(chart, ctx, { x, y, colour = "ink", dash = [], width = 1.6 }) {
      ctx.beginPath();
      let pen = false;
      for (let i = 0; i < x.length; i++) {
        if (!Number.isFinite(y[i])) { pen = false; continue; }
        if (pen) ctx.lineTo(chart.px(x[i]), chart.py(y[i])); else ctx.moveTo(chart.px(x[i]), chart.py(y[i]));
        pen = true;
      }
      ctx.setLineDash(dash);
      ctx.lineWidth = width;
      ctx.strokeStyle = chart.colours[colour];
      ctx.stroke();
      ctx.setLineDash([]);
    }
  }

  Object.assign(airmuscle, { Scatter, scaleOf, labelOf, rangeOf, GROUP_COLOURS: COLOURS, GROUP_DASHES: DASHES });
})();
