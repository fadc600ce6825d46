/* Chart: uPlot with the colours of the theme, text in two languages of access (label and keyboard), and an overlay. */
"use strict";

(() => {
  const FONT = "13px 'Source Sans 3','Segoe UI','Helvetica Neue','Liberation Sans',Arial,sans-serif";

  class Chart {
    /* host: element; options: {label, x, y, height, overlay(chart, context), xSplits, xText, ySplits} */
    constructor(host, options) {
      this.host = host;
      this.options = options;
      this.styles = "";
      this.data = [[0], [0]];
      this.ranges = { x: [0, 1], y: [0, 1] };
      host.classList.add("chart");
      new ResizeObserver(() => this.resize()).observe(host);
      document.addEventListener("themechange", () => { this.styles = ""; if (this.curves) this.show(this.curves, this.data[0], this.ranges); });
    }

    /* curves: [{values, colour, dash, width, label, spanned}] over the grid x; ranges: {x: [low, high], y: [low, high]} */
    show(curves, x, ranges) {
      this.curves = curves;
      this.ranges = ranges;
      this.data = [x, ...curves.map((curve) => curve.values)];
      const styles = JSON.stringify(curves.map(({ colour, dash, width, label }) => [colour, dash, width, label]));
      if (styles !== this.styles || !this.plot) { this.styles = styles; this.build(); } else this.plot.setData(this.data);
    }

    redraw() { if (this.plot) this.plot.redraw(false, false); }

    get width() { return Math.max(200, this.host.clientWidth); }
    get height() { return typeof this.options.height === "function" ? this.options.height(this.width) : this.options.height; }

    resize() {
      if (this.plot && (this.plot.width !== this.width || this.plot.height !== this.height)) this.plot.setSize({ width: this.width, height: this.height });
    }

    build() {
      if (this.plot) this.plot.destroy();
      const colours = Object.fromEntries(["ink", "soft", "line", "c1", "c2", "c3", "c4", "c5", "c6", "shade", "card"].map((n) => [n, airmuscle.colour(n)]));
      this.colours = colours;
      const axis = (label, side) => ({
        ...(label ? { label } : {}), stroke: colours.ink, font: FONT, labelFont: FONT, labelSize: 24, size: side === 3 ? 58 : 40, side,
        grid: { stroke: colours.line, width: 1 }, ticks: { stroke: colours.line, width: 1 },
        values: (u, values) => values.map((v) => (v === null ? "" : (side === 2 && this.options.xText ? this.options.xText(v) : airmuscle.shortText(v, 6)))),
        ...(side === 2 && this.options.xSplits ? { splits: () => this.options.xSplits.filter((v) => v >= this.ranges.x[0] - 1e-9 && v <= this.ranges.x[1] + 1e-9) } : {}),
        ...(side === 3 && this.options.ySplits ? { splits: () => this.options.ySplits } : {}),
      });
      const series = this.curves.map((curve) => ({
        label: curve.label, stroke: colours[curve.colour], width: curve.width || 1.6, dash: curve.dash || [], points: { show: false }, pxAlign: 0, spanGaps: Boolean(curve.spanned),
      }));
      this.plot = new uPlot({
        width: this.width, height: this.height, legend: { show: false }, cursor: { show: false }, padding: [10, 14, 0, 0],
        scales: { x: { time: false, range: () => this.ranges.x }, y: { range: () => this.ranges.y } },
        axes: [axis(this.options.x, 2), axis(this.options.y, 3)], series: [{}, ...series],
        hooks: { draw: [() => this.drawOverlay()] },
      }, this.data, this.host);
      this.plot.root.setAttribute("role", "img");
      this.plot.root.setAttribute("aria-label", this.options.label);
    }

    drawOverlay() {
      if (!this.options.overlay || !this.plot) return;
      const { ctx, bbox } = this.plot, ratio = devicePixelRatio;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.scale(ratio, ratio);
      ctx.font = FONT;
      ctx.setLineDash([]);   /* that of the last curve */
      this.options.overlay(this, ctx, { left: bbox.left / ratio, top: bbox.top / ratio, width: bbox.width / ratio, height: bbox.height / ratio });
      ctx.restore();
    }

    px(x) { return this.plot.valToPos(x, "x", true) / devicePixelRatio; }
    py(y) { return this.plot.valToPos(y, "y", true) / devicePixelRatio; }

    /* Values under a pointer. */
    valuesAt(event) {
      const box = this.plot.over.getBoundingClientRect();
      return { x: this.plot.posToVal(event.clientX - box.left, "x"), y: this.plot.posToVal(event.clientY - box.top, "y") };
    }

    /* Text with a halo, so that it is readable on curves. */
    write(ctx, text, x, y, colour, align = "left") {
      ctx.textAlign = align;
      ctx.lineWidth = 4;
      ctx.lineJoin = "round";
      ctx.strokeStyle = this.colours.card;
      ctx.strokeText(text, x, y);
      ctx.fillStyle = colour;
      ctx.fillText(text, x, y);
    }
  }

  Object.assign(airmuscle, { Chart });
})();
