/* Gains of a control law: a slider with a logarithmic scale and a field for each. */
"use strict";

(() => {
  const { element, shortText, readNumber } = airmuscle;
  const STEPS = 400;
  let counter = 0;

  /* row: a gain of the sheet; changed(value) receives SI values. A range from zero is linear. */
  function gainRow(row, value, changed) {
    const id = `g${counter++}`, { low, high, factor } = row, log = low > 0;
    const toValue = (s) => factor * (log ? low * (high / low) ** (s / STEPS) : low + s / STEPS * (high - low));
    const toStep = (v) => Math.round(STEPS * (log ? Math.log(Math.max(v / factor, low) / low) / Math.log(high / low) : (v / factor - low) / (high - low)));
    const field = element("input", { type: "text", id, inputmode: "decimal", autocomplete: "off" });
    const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${row.meaning}, ${row.symbol}` });
    const show = (v, typed) => {
      slider.value = String(Math.min(STEPS, Math.max(0, toStep(v))));
      slider.setAttribute("aria-valuetext", `${shortText(v / factor)} ${row.unit}`);
      if (!typed) field.value = shortText(v / factor);
      field.removeAttribute("aria-invalid");
      field.title = "";
    };
    slider.addEventListener("input", () => { const v = toValue(Number(slider.value)); show(v, false); changed(v); });
    field.addEventListener("input", () => {
      const v = readNumber(field.value) * factor, [least, greatest] = row.bounds;
      if (Number.isNaN(v) || (least !== null && v < least) || (greatest !== null && v > greatest)) {
        field.setAttribute("aria-invalid", "true");
        field.title = `allowed: ${shortText((least ?? -Infinity) / factor)} to ${shortText((greatest ?? Infinity) / factor)} ${row.unit}`;
        return;
      }
      show(v, true);
      changed(v);
    });
    show(value, false);
    return element("div.parameter", {}, element("div.head", {}, element("label", { for: id }, airmuscle.symbolNode(row.symbol), ` ${row.meaning}`), field, element("span.unit", {}, row.unit)), slider);
  }

  Object.assign(airmuscle, { gainRow });
})();
