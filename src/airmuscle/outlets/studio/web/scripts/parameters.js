/* Parameters: a slider and a field for each declared parameter, with symbol, unit, meaning, bounds and source. */
"use strict";

(() => {
  const { element, shortText, readNumber } = airmuscle;
  const STEPS = 400;

  /* Range of a slider: half to twice the value of the file, or one unit around zero, within the bounds (chosen). */
  function sliderRange(row) {
    const [low, high] = row.bounds, size = Math.abs(row.value) || row.factor;
    const wanted = row.value > 0 ? [0.5 * size, 2 * size] : row.value < 0 ? [-2 * size, -0.5 * size] : [-size, size];
    return [Math.max(wanted[0], low ?? -Infinity), Math.min(wanted[1], high ?? Infinity)];
  }

  function boundsText(row) {
    const [low, high] = row.bounds, shown = (v) => shortText(v / row.factor);
    if (low === null && high === null) return "not bounded";
    if (low === null) return `at most ${shown(high)} ${row.shown_unit}`;
    if (high === null) return `at least ${shown(low)} ${row.shown_unit}`;
    return `allowed: ${shown(low)} to ${shown(high)} ${row.shown_unit}`;
  }

  let counter = 0;

  /* One row; changed(value) receives SI values. */
  function parameterRow(row, value, changed) {
    const id = `p${counter++}`, [low, high] = sliderRange(row);
    const field = element("input", { type: "text", id, inputmode: "decimal", autocomplete: "off", "aria-describedby": `${id}-note` });
    const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${row.meaning}, ${row.symbol}` });
    const holder = element("div.parameter", {},
      element("div.head", {}, element("label", { for: id }, airmuscle.symbolNode(row.symbol), ` ${row.meaning}`), field, element("span.unit", {}, row.shown_unit)),
      slider,
      element("div.note", { id: `${id}-note` }, element("span", {}, `${row.path} · ${row.source}`),
        element("span", {}, row.standard_error ? `standard error ${shortText(row.standard_error / row.factor)} ${row.shown_unit} · ` : "", boundsText(row))));
    const show = (v, typed) => {
      slider.value = String(Math.round((v - low) / (high - low) * STEPS));
      slider.setAttribute("aria-valuetext", `${shortText(v / row.factor)} ${row.shown_unit}`);
      if (!typed) field.value = shortText(v / row.factor, 6);
      field.removeAttribute("aria-invalid");
      field.title = "";
      holder.classList.toggle("changed", v !== row.value);
    };
    slider.addEventListener("input", () => {
      const v = low + Number(slider.value) / STEPS * (high - low);
      show(v, false);
      changed(v);
    });
    slider.addEventListener("dblclick", () => { show(row.value, false); changed(row.value); });
    field.addEventListener("input", () => {
      const v = readNumber(field.value) * row.factor, [least, greatest] = row.bounds;
      const wrong = Number.isNaN(v) || (least !== null && v < least) || (greatest !== null && v > greatest);
      if (wrong) { field.setAttribute("aria-invalid", "true"); field.title = boundsText(row); return; }
      show(v, true);
      changed(v);
    });
    show(value, false);
    return { holder, show };
  }

  /* Rows in groups of one part of a plant each; one group without a heading for a law. */
  class ParameterPanel {
    constructor(host) { this.host = host; this.rows = []; }

    /* changed(index, value); groupOf(path) names the group of a row */
    show(table, values, changed, groupOf = () => "") {
      this.table = table;
      this.rows = table.map((row, i) => parameterRow(row, values[i], (v) => changed(i, v)));
      const groups = new Map();
      table.forEach((row, i) => { const name = groupOf(row.path); groups.set(name, [...(groups.get(name) ?? []), this.rows[i].holder]); });
      const parts = [...groups].map(([name, holders], k) => (name ? element("details", { open: k === 0 }, element("summary", {}, `${name} (${holders.length})`), ...holders) : element("div", {}, ...holders)));
      this.host.replaceChildren(...parts);
    }

    reset() { this.rows.forEach((row, i) => row.show(this.table[i].value, false)); }
  }

  Object.assign(airmuscle, { ParameterPanel });
})();
