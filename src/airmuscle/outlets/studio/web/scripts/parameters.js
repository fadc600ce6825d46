/* Parameters and gains: a slider and a field for each, with symbol, unit, meaning, bounds and source. */
"use strict";

(() => {
  const { element, symbolNode, complain, noNumber, shortText, readNumber } = airmuscle;
  const STEPS = 400;

  /* Range of a slider: half to twice the value of the file, or one unit around zero, within the bounds (chosen). */
  function sliderRange(row) {
    const [low, high] = row.bounds, size = Math.abs(row.value) || row.factor;
    const wanted = row.value > 0 ? [0.5 * size, 2 * size] : row.value < 0 ? [-2 * size, -0.5 * size] : [-size, size];
    return [Math.max(wanted[0], low ?? -Infinity), Math.min(wanted[1], high ?? Infinity)];
  }

  function boundsText([low, high], factor, unit) {
    const shown = (v) => `${shortText(v / factor)} ${unit}`.trim();
    if (low === null && high === null) return "not bounded";
    if (low === null) return `at most ${shown(high)}`;
    if (high === null) return `at least ${shown(low)}`;
    return `allowed: ${shortText(low / factor)} to ${shown(high)}`;
  }

  let counter = 0;

  /* A field and a slider of a number; scale: {toStep(value), toValue(step)}, with steps from 0 to STEPS; changed(value)
     receives SI values. A wrong entry changes nothing, and a sentence says so. */
  function numberRow(row, unit, digits, scale, note, value, changed) {
    const id = `n${counter++}`, { factor, bounds } = row, text = (v, count) => shortText(v / factor, count);
    const field = element("input", { type: "text", id, inputmode: "decimal", autocomplete: "off", "aria-describedby": `${id}-note` });
    const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${row.meaning}, ${row.symbol}` });
    const message = element("p", { role: "alert" });
    const holder = element("div.parameter", {},
      element("div.head", {}, element("label", { for: id }, symbolNode(row.symbol), ` ${row.meaning}`), field, element("span.unit", {}, unit)), slider, message,
      element("div.note", { id: `${id}-note` }, ...note));
    let shown = value;
    const show = (v, typed) => {
      shown = v;
      slider.value = String(Math.min(STEPS, Math.max(0, Math.round(scale.toStep(v)))));
      slider.setAttribute("aria-valuetext", `${text(v)} ${unit}`);
      if (!typed) field.value = text(v, digits);
      complain(message, "", field);
      holder.classList.toggle("changed", row.value !== undefined && v !== row.value);
    };
    const take = (v, typed) => { show(v, typed); changed(v); };
    slider.addEventListener("input", () => take(scale.toValue(Number(slider.value)), false));
    slider.addEventListener("dblclick", () => { if (row.value !== undefined) take(row.value, false); });
    field.addEventListener("input", () => {
      const v = readNumber(field.value) * factor, [least, greatest] = bounds;
      const wrong = Number.isNaN(v) ? noNumber(field.value, unit) : (least !== null && v < least) || (greatest !== null && v > greatest) ? `${field.value} is out of bounds, ${boundsText(bounds, factor, unit)}.` : "";
      if (wrong) complain(message, `${wrong} What is shown belongs to ${text(shown)} ${unit}.`, field); else take(v, true);
    });
    show(value, false);
    return { holder, show };
  }

  function parameterRow(row, value, changed) {
    const [low, high] = sliderRange(row), scale = { toStep: (v) => (v - low) / (high - low) * STEPS, toValue: (s) => low + s / STEPS * (high - low) };
    const error = row.standard_error ? `standard error ${shortText(row.standard_error / row.factor)} ${row.shown_unit} · ` : "";
    const note = [element("span", {}, `${row.path} · ${row.source}`), element("span", {}, error, boundsText(row.bounds, row.factor, row.shown_unit))];
    return numberRow(row, row.shown_unit, 6, scale, note, value, changed);
  }

  /* A gain of a control law: its slider is logarithmic, unless its range begins at zero. */
  function gainRow(row, value, changed) {
    const { low, high, factor } = row, log = low > 0;
    const scale = {
      toValue: (s) => factor * (log ? low * (high / low) ** (s / STEPS) : low + s / STEPS * (high - low)),
      toStep: (v) => STEPS * (log ? Math.log(Math.max(v / factor, low) / low) / Math.log(high / low) : (v / factor - low) / (high - low)),
    };
    return numberRow(row, row.unit, 4, scale, [], value, changed).holder;
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

  Object.assign(airmuscle, { ParameterPanel, gainRow });
})();
