/* Drawing of a joint at one instant, to scale: two muscles that bulge, coloured by their pressure, and the pulley. */
"use strict";

(() => {
  const { svg, shortText } = airmuscle;
  const WIDTH = 360, HEIGHT = 430, TOP = 92, BOTTOM = 372, SHADES = 24;
  const line = (d, width = 2, extra = {}) => svg("path", { d, stroke: "var(--ink)", "stroke-width": width, fill: "none", "stroke-linecap": "round", ...extra });
  const label = (x, y, text, anchor = "middle", extra = {}) => svg("text", { x, y, "text-anchor": anchor, fill: "var(--ink)", "font-size": 15, ...extra }, text);
  const shade = (share) => `color-mix(in srgb, var(--accent) ${(8 + 84 * Math.min(1, Math.max(0, share))).toFixed(1)}%, var(--card))`;

  class JointDrawing {
    constructor(host) {
      this.picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img" });
      host.append(this.picture);
    }

    /* run: a PlantRun; columns by name at one instant; wanted: set point of the angle [rad] */
    show(run, at, wanted) {
      const { sheet, values } = run, radius = sheet.mechanism.radius, muscles = sheet.muscles.map((muscle) => {
        const length = muscle.length_index === null ? muscle.length : values[muscle.length_index], contraction = at(`${muscle.prefix}contraction`);
        return { name: muscle.name, contraction, points: airmuscle.halfOutline(muscle, contraction, length), length, now: length * (1 - contraction), pressure: at(`${muscle.prefix}pressure`), tension: at(`${muscle.prefix}force`) };
      });
      const angle = at(sheet.mechanism.coordinates[0]), longest = Math.max(...muscles.map((m) => m.length)), scale = (BOTTOM - TOP - 20) / (1.06 * longest), x = WIDTH / 2, r = radius * scale;
      const parts = [line(`M${x - 120} ${BOTTOM}H${x + 120}`, 4)];
      muscles.forEach((m, k) => {
        const side = k ? 1 : -1, widest = Math.max(...m.points.map((p) => p[1])) * scale, middle = x + side * Math.max(r, widest + 5), top = BOTTOM - m.now * scale, place = (s, radial) => [middle + radial * scale, BOTTOM - s * scale];
        parts.push(svg("path", { d: airmuscle.bodyPath(m.points, place), fill: shade(m.pressure / sheet.pressure_range[1]), stroke: "var(--ink)", "stroke-width": 1.5 }));
        parts.push(line(`M${middle.toFixed(1)} ${top.toFixed(1)}L${(x + side * r).toFixed(1)} ${TOP}`, 2));
        const text = x + side * 78, anchor = side < 0 ? "end" : "start";
        parts.push(label(text, 222, m.name, anchor, { "font-weight": 600 }), label(text, 242, `${(m.pressure / 1e5).toFixed(2)} bar`, anchor), label(text, 261, `${shortText(100 * m.contraction, 3)} %`, anchor), label(text, 280, `${m.tension.toFixed(0)} N`, anchor));
      });
      /* the first muscle, on the left, increases the angle: the pulley turns to the left */
      const tip = (q, length) => [x - length * Math.sin(q), TOP - length * Math.cos(q)].map((v) => v.toFixed(1)).join(" ");
      parts.push(svg("circle", { cx: x, cy: TOP, r, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 2 }));
      if (Number.isFinite(wanted)) parts.push(line(`M${x} ${TOP}L${tip(wanted, 84)}`, 2, { stroke: "var(--c2)", "stroke-dasharray": "6 5" }));
      parts.push(line(`M${x} ${TOP}L${tip(angle, 80)}`, 6), svg("circle", { cx: x, cy: TOP, r: 4.5, fill: "var(--card)", stroke: "var(--ink)", "stroke-width": 2 }));
      parts.push(label(x, BOTTOM + 20, `angle ${(angle * 180 / Math.PI).toFixed(1).replace("-", "−")}°`), ...legend(sheet.pressure_range[1]));
      this.picture.replaceChildren(...parts);
      this.picture.setAttribute("aria-label", `Joint to scale at an angle of ${(angle * 180 / Math.PI).toFixed(1)} degrees; ${muscles.map((m) => `${m.name} ${(m.pressure / 1e5).toFixed(2)} bar`).join(", ")}. Dashed: wanted angle.`);
    }
  }

  /* Colours of the gauge pressure */
  function legend(highest) {
    const left = 92, width = (WIDTH - 2 * left) / SHADES, y = HEIGHT - 24;
    const boxes = Array.from({ length: SHADES }, (_, i) => svg("rect", { x: left + i * width, y, width: width + 0.5, height: 10, fill: shade((i + 0.5) / SHADES) }));
    return [...boxes, svg("rect", { x: left, y, width: WIDTH - 2 * left, height: 10, fill: "none", stroke: "var(--edge)" }), label(left - 7, y + 10, "0", "end", { "font-size": 14 }), label(WIDTH - left + 7, y + 10, `${shortText(highest / 1e5, 3)} bar`, "start", { "font-size": 14 })];
  }

  Object.assign(airmuscle, { JointDrawing });
})();
