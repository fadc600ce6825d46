/* Outline: the muscle at its working point, to scale, beside its outline at rest. */
"use strict";

(() => {
  const { svg } = airmuscle;
  const WIDTH = 900, MARGIN = 34, FITTING = 22, HIGHEST = 150;

  function pathOf(outline, x, y) {
    const upper = outline.axial.map((a, i) => `${x(a).toFixed(1)} ${y(outline.radius[i]).toFixed(1)}`);
    const lower = outline.axial.map((a, i) => `${x(a).toFixed(1)} ${y(-outline.radius[i]).toFixed(1)}`).reverse();
    return `M${upper.join("L")}L${lower.join("L")}Z`;
  }

  class Drawing {
    constructor(host) {
      this.host = host;
      this.picture = svg("svg", { role: "img", viewBox: `0 0 ${WIDTH} 200` });
      this.text = airmuscle.element("p.small.soft");
      host.append(this.picture, this.text);
    }

    /* The muscle of a law at a contraction under a force [N]. */
    show(law, contraction, force) {
      const length = law.restingLength, rest = law.outline(0), now = law.outline(contraction);
      if (!length || !Number.isFinite(contraction)) {
        this.clear(length ? "No contraction is in equilibrium at this point." : "The entry states no resting length; nothing can be drawn to scale.");
        return;
      }
      const limits = law.contractionRange, longest = length * Math.max(1, 1 - Math.max(limits[0], -0.1));
      const largest = rest ? Math.max(0.02 * length, ...[0, 0.25, 0.5, 0.75, 1].map((t) => widest(law.outline(limits[0] + t * (limits[1] - limits[0]))))) : 0.03 * length;
      const scale = Math.min((WIDTH - 2 * MARGIN - FITTING - 120) / longest, HIGHEST / largest), middle = Math.max(46, largest * scale + 26), height = 2 * middle + 30;
      const shift = (of) => (a) => MARGIN + FITTING + (a + of / 2) * scale, y = (r) => middle - r * scale;
      const current = length * (1 - contraction), end = MARGIN + FITTING + current * scale, parts = [];
      parts.push(svg("rect", { x: MARGIN, y: middle - 20, width: FITTING, height: 40, fill: "var(--fitting)" }));
      const bar = { axial: [-0.5, 0.5], radius: [0.015 * length, 0.015 * length] };
      const shape = now || { axial: bar.axial.map((a) => a * current), radius: bar.radius };
      const before = rest || { axial: bar.axial.map((a) => a * length), radius: bar.radius };
      parts.push(svg("path", { d: pathOf(shape, shift(current), y), fill: "var(--muscle)", stroke: "var(--ink)", "stroke-width": 1.5 }));
      parts.push(svg("path", { d: pathOf(before, shift(length), y), fill: "none", stroke: "var(--edge)", "stroke-dasharray": "6 4" }));
      parts.push(svg("rect", { x: end, y: middle - 20, width: FITTING, height: 40, fill: "var(--fitting)" }));
      if (force > 0) parts.push(...arrow(end + FITTING, middle, force));
      parts.push(...scaleBar(length, scale, height));
      this.picture.setAttribute("viewBox", `0 0 ${WIDTH} ${height.toFixed(0)}`);
      this.picture.replaceChildren(...parts);
      const inUnit = (value) => airmuscle.units.text("length", value);
      const radius = now ? `, maximum radius ${inUnit(widest(now))}` : ", without a geometry (drawn as a bar)";
      this.text.textContent = `Length ${inUnit(current)} of ${inUnit(length)}${radius}. Dashed: at rest.`;
      this.picture.setAttribute("aria-label", `Outline of the muscle. ${this.text.textContent}`);
    }

    clear(text) {
      this.picture.replaceChildren();
      this.picture.setAttribute("viewBox", `0 0 ${WIDTH} 1`);
      this.text.textContent = text;
    }
  }

  const widest = (outline) => (outline ? Math.max(0, ...outline.radius.filter(Number.isFinite)) : 0);

  function arrow(x, y, force) {
    const tip = x + 62;
    return [
      svg("path", { d: `M${x} ${y}H${tip}M${tip - 9} ${y - 6}L${tip} ${y}L${tip - 9} ${y + 6}`, fill: "none", stroke: "var(--accent)", "stroke-width": 2.5 }),
      svg("text", { x: x + 6, y: y - 10, fill: "var(--ink)", "font-size": 17 }, airmuscle.units.text("force", force)),
    ];
  }

  function scaleBar(length, scale, height) {
    const { factor } = airmuscle.units.length, [, step = length / factor] = airmuscle.roundSteps(0, length / factor, 5), size = step * factor * scale, x = MARGIN + FITTING, y = height - 18;
    return [
      svg("path", { d: `M${x} ${y - 5}V${y}H${x + size}V${y - 5}`, fill: "none", stroke: "var(--soft)" }),
      svg("text", { x: x + size + 8, y: y + 3, fill: "var(--soft)", "font-size": 15 }, `${airmuscle.shortText(step)} ${airmuscle.units.length.name}`),
    ];
  }

  Object.assign(airmuscle, { Drawing });
})();
