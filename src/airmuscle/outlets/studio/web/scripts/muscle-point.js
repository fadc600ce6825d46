/* Working point: any two of pressure, contraction and force; the third is solved. */
"use strict";

(() => {
  const { element, complain, noNumber, shortText, readNumber, textBeyond } = airmuscle;
  const QUANTITIES = { pressure: ["Pressure", "bar", 1e5], contraction: ["Contraction", "%", 0.01], force: ["Force", "N", 1] };

  class PointPanel {
    /* changed(point, solved) after an entry of the user */
    constructor(host, changed) {
      this.changed = changed;
      this.fields = {};
      this.radios = {};
      const rows = Object.entries(QUANTITIES).flatMap(([name, [title, unit]]) => {
        const field = element("input", { type: "text", inputmode: "decimal", autocomplete: "off", id: `point-${name}`, "aria-label": `${title} [${unit}]` });
        const radio = element("input", { type: "radio", name: "solved", value: name, "aria-label": `Solve for ${title.toLowerCase()}` });
        field.addEventListener("input", () => this.typed(name));
        radio.addEventListener("change", () => this.changed(this.point, name));
        this.fields[name] = field;
        this.radios[name] = radio;
        return [element("label", { for: `point-${name}` }, title), field, element("span.row.small", {}, element("span.soft", {}, unit), element("label.row", {}, radio, "solve"))];
      });
      this.facts = element("dl.facts");
      this.message = element("p", { role: "status" });
      host.append(element("div.point", {}, ...rows), this.facts, this.message);
    }

    typed(name) {
      const value = readNumber(this.fields[name].value) * QUANTITIES[name][2];
      const solved = name === this.solved ? Object.keys(QUANTITIES).find((other) => other !== name) : this.solved;
      this.changed({ ...this.point, [name]: value }, solved, name);
    }

    /* The fields but the one in which the user types, and those with an entry that is no number */
    show(law, point, solved, typing) {
      this.point = point;
      this.solved = solved;
      for (const [name, [, , factor]] of Object.entries(QUANTITIES)) {
        if (name === solved || (name !== typing && !Number.isNaN(point[name]))) this.fields[name].value = shortText(point[name] / factor, 6);
        this.fields[name].setAttribute("aria-invalid", String(name !== solved && Number.isNaN(point[name])));
        this.fields[name].classList.toggle("solved", name === solved);
        this.radios[name].checked = name === solved;
      }
      this.showFacts(law, point);
      const missing = Object.keys(QUANTITIES).find((name) => name !== solved && Number.isNaN(point[name]));
      const [text, wrong] = missing ? [`${QUANTITIES[missing][0]}: ${noNumber(this.fields[missing].value, QUANTITIES[missing][1])}`, true] : remark(law, point, solved);
      complain(this.message, text);
      this.message.classList.toggle("error", wrong);
    }

    showFacts(law, { pressure, contraction, force }) {
      const length = law.restingLength, facts = [];
      if (Number.isFinite(pressure + contraction + force)) {
        const stiffness = law.stiffness(pressure, contraction);
        facts.push(["Stiffness", length ? `${shortText(stiffness / length / 1e3)} N/mm` : `${shortText(stiffness / 100)} N/%`]);
        if (length) facts.push(["Shortening", `${shortText(1e3 * length * contraction)} mm of ${shortText(1e3 * length)} mm`]);
        if (law.program.volume) facts.push(["Volume", `${shortText(1e6 * law.printed("volume", contraction, 0))} cm³`]);
        facts.push(["Pressure", `${shortText(pressure / 1e3)} kPa gauge`]);
      }
      this.facts.replaceChildren(...facts.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
    }
  }

  /* What must be said of a point, and whether it is an error. */
  function remark(law, point, solved) {
    const { pressure, contraction, force } = point, { validity_range: valid, ratings } = law.sheet;
    if (!Number.isFinite(point[solved])) return [`No ${solved} is in equilibrium with the other two values.`, true];
    const beyond = [];
    const limit = (name, value, low, high, factor, unit) => {
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) beyond.push(`${name} ${shortText(value / factor)} ${unit}`);
    };
    limit("force", force, -Infinity, ratings.max_force ?? Infinity, 1, "N");
    limit("pressure", pressure, ratings.min_pressure ?? -Infinity, ratings.max_pressure ?? Infinity, 1e5, "bar");
    limit("contraction", contraction, ratings.max_prestretch === undefined ? -Infinity : -ratings.max_prestretch, ratings.max_contraction ?? Infinity, 0.01, "%");
    if (beyond.length) return [`Beyond the values that the maker permits: ${beyond.join(", ")}.`, true];
    if (force < 0) return ["The force is negative; a muscle cannot push and is slack here.", true];
    const inside = !valid || (pressure >= valid.min_pressure && pressure <= valid.max_pressure && contraction >= valid.min_contraction && contraction <= valid.max_contraction);
    if (inside) return ["", false];
    const range = `${shortText(valid.min_pressure / 1e5)} to ${shortText(valid.max_pressure / 1e5)} bar and ${shortText(100 * valid.min_contraction)} to ${shortText(100 * valid.max_contraction)} %`;
    return [`Outside the validity range, ${range}: ${textBeyond(law, point)}.`, false];
  }

  Object.assign(airmuscle, { PointPanel });
})();
