/* Drawing of a plant at one instant: muscles to scale, with their mass, their pulley, or side by side. */
"use strict";

(() => {
  const { svg, shortText } = airmuscle;
  const WIDTH = 340, HEIGHT = 400;

  /* Half outline of a muscle at a contraction, from its fixed end: [[distance, radius], ...] in metres */
  function halfOutline(muscle, contraction, length) {
    const { contractions: grid, axial, radius } = muscle.outline, last = grid.length - 1;
    const place = Math.min(last - 1e-9, Math.max(0, (contraction - grid[0]) / (grid[last] - grid[0]) * last)), i = Math.floor(place), t = place - i;
    const mix = (rows) => rows[i].map((v, k) => v + t * (rows[i + 1][k] - v)), at = mix(axial), r = mix(radius), scale = length / muscle.length;
    return at.map((a, k) => [(a - at[0]) * scale, r[k]]);
  }

  function bodyPath(points, place) {
    const side = (sign) => points.map(([s, r]) => place(s, sign * r).map((v) => v.toFixed(1)).join(" "));
    return `M${side(1).join("L")}L${side(-1).reverse().join("L")}Z`;
  }

  const body = (points, place, pressure, highest) => svg("path", {
    d: bodyPath(points, place), fill: "var(--muscle)", stroke: "var(--ink)", "stroke-width": 1.5, "fill-opacity": (0.35 + 0.65 * Math.max(0, Math.min(1, pressure / highest))).toFixed(2),
  });
  const line = (x1, y1, x2, y2, width = 2) => svg("path", { d: `M${x1} ${y1}L${x2} ${y2}`, stroke: "var(--ink)", "stroke-width": width, fill: "none" });
  const bar = (pressure) => `${shortText(Math.round(pressure / 1e3) / 100, 3)} bar`;
  const label = (x, y, text, anchor = "middle") => svg("text", { x, y, "text-anchor": anchor, fill: "var(--ink)", "font-size": 15 }, text);

  class PlantDrawing {
    constructor(host) {
      this.picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": "Drawing of the plant" });
      host.append(this.picture);
    }

    begin(run) {
      this.run = run;
      this.kind = run.sheet.mechanism.kind;
    }

    /* columns: name to value at one instant */
    show(at) {
      const { sheet, values } = this.run, parts = [], muscles = sheet.muscles.map((muscle) => {
        const length = muscle.length_index === null ? muscle.length : values[muscle.length_index], contraction = at(`${muscle.prefix}contraction`);
        return { muscle, length, contraction, points: halfOutline(muscle, contraction, length), current: length * (1 - contraction), pressure: at(`${muscle.prefix}pressure`) };
      });
      const highest = Math.max(3e5, ...muscles.map((m) => m.pressure));
      if (this.kind === "lift") this.lift(parts, muscles[0], highest);
      else if (this.kind === "joint") this.joint(parts, muscles, highest, at(sheet.mechanism.coordinates[0]), sheet.mechanism.radius);
      else this.sideBySide(parts, muscles, highest);
      this.picture.replaceChildren(...parts);
    }

    lift(parts, { points, length, current, pressure }, highest) {
      const scale = 270 / (1.05 * length), x = WIDTH / 2, top = 30, place = (s, r) => [x + r * scale, top + s * scale], end = top + current * scale;
      parts.push(line(x - 90, top, x + 90, top, 4), body(points, place, pressure, highest), line(x, end, x, end + 18));
      parts.push(svg("rect", { x: x - 34, y: end + 18, width: 68, height: 46, rx: 3, fill: "var(--fitting)" }));
      parts.push(svg("path", { d: `M${x + 40} ${top + length * scale}H${x + 125}`, stroke: "var(--edge)", "stroke-dasharray": "5 4" }), label(x + 70, top + length * scale - 6, "at rest", "start"));
      parts.push(label(x - 52, top + current * scale / 2, bar(pressure), "end"), label(x + 52, top + current * scale / 2, `${shortText(1000 * current, 4)} mm`, "start"));
    }

    joint(parts, muscles, highest, angle, radius) {
      const length = Math.max(...muscles.map((m) => m.length)), scale = 270 / (length * 1.05), x = WIDTH / 2, y = 62, r = Math.max(14, radius * scale), base = y + 300;
      parts.push(line(x - 110, base, x + 110, base, 4));
      muscles.forEach((m, k) => {
        const side = k === 0 ? -1 : 1, gap = Math.max(r, Math.max(...m.points.map((p) => p[1])) * scale + 6), at = x + side * gap, place = (s, radial) => [at + radial * scale, base - s * scale], top = base - m.current * scale;
        parts.push(body(m.points, place, m.pressure, highest), line(at, top, x + side * r, y, 2), label(at + side * 46, base - 60, bar(m.pressure), side < 0 ? "end" : "start"), label(at + side * 46, base - 40, m.muscle.name, side < 0 ? "end" : "start"));
      });
      /* the first muscle, on the left, increases the angle: the pulley turns to the left */
      const armX = x - 92 * Math.sin(angle), armY = y - 51 * Math.cos(angle);
      parts.push(svg("circle", { cx: x, cy: y, r, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 2 }), line(x, y, x - r * Math.sin(angle), y - r * Math.cos(angle), 4), line(x, y, armX, armY, 2), svg("circle", { cx: x, cy: y, r: 3.5, fill: "var(--ink)" }));
      parts.push(label(x, base + 24, `angle ${shortText(angle * 180 / Math.PI, 3)}°`));
    }

    sideBySide(parts, muscles, highest) {
      const scale = Math.min(300 / Math.max(...muscles.map((m) => m.length)), 0.8 * (WIDTH / muscles.length) / (2 * Math.max(...muscles.flatMap((m) => m.points.map((p) => p[1])))));
      muscles.forEach((m, k) => {
        const x = WIDTH / muscles.length * (k + 0.5), top = 24, place = (s, r) => [x + r * scale, top + s * scale];
        parts.push(line(x - 34, top, x + 34, top, 4), body(m.points, place, m.pressure, highest), label(x, top + m.length * scale + 26, bar(m.pressure)), ...m.muscle.name.slice(0, 30).split("_").map((word, i) => label(x, top + m.length * scale + 46 + 16 * i, word)));
      });
    }
  }

  Object.assign(airmuscle, { PlantDrawing, halfOutline, bodyPath });
})();
