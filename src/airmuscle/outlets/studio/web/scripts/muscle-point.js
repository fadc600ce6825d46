/* Working point: any two of pressure, contraction and force; the third is solved. */
"use strict";

(() => {
  const { element, complain, noNumber, shortText, readNumber, textBeyond, units } = airmuscle;
  const QUANTITIES = { pressure: "Pressure", contraction: "Contraction", force: "Force" };

  class PointPanel {
    /* changed(point, solved) after an entry of the user */
    constructor(host, changed) {
      this.changed = changed;
      this.fields = {};
      this.units = {};
      this.radios = {};
      const rows = Object.entries(QUANTITIES).flatMap(([name, title]) => {
        const field = element("input", { type: "text", inputmode: "decimal", autocomplete: "off", id: `point-${name}` }), unit = this.units[name] = element("span.soft");
        const radio = element("input", { type: "radio", name: "solved", value: name, "aria-label": `Solve for ${title.toLowerCase()}` });
        field.addEventListener("input", () => this.typed(name));
        radio.addEventListener("change", () => this.changed(this.point, name));
        this.fields[name] = field;
        this.radios[name] = radio;
        return [element("label", { for: `point-${name}` }, title), field, element("span.row.small", {}, unit, element("label.row", {}, radio, "solve"))];
      });
      this.facts = element("dl.facts");
      this.message = element("p", { role: "status" });
      host.append(element("div.point", {}, ...rows), this.facts, this.message);
      this.nameUnits();
    }

    nameUnits() {
      for (const [name, title] of Object.entries(QUANTITIES)) {
        this.units[name].textContent = units[name].name;
        this.fields[name].setAttribute("aria-label", `${title} [${units[name].name}]`);
      }
    }

    typed(name) {
      const value = readNumber(this.fields[name].value) * units[name].factor;
      const solved = name === this.solved ? Object.keys(QUANTITIES).find((other) => other !== name) : this.solved;
      this.changed({ ...this.point, [name]: value }, solved, name);
    }

    /* The fields but the one in which the user types, and those with an entry that is no number */
    show(law, point, solved, typing) {
      this.point = point;
      this.solved = solved;
      for (const name of Object.keys(QUANTITIES)) {
        if (name === solved || (name !== typing && !Number.isNaN(point[name]))) this.fields[name].value = shortText(point[name] / units[name].factor, 6);
        this.fields[name].setAttribute("aria-invalid", String(name !== solved && Number.isNaN(point[name])));
        this.fields[name].classList.toggle("solved", name === solved);
        this.radios[name].checked = name === solved;
      }
      this.showFacts(law, point);
      const missing = Object.keys(QUANTITIES).find((name) => name !== solved && Number.isNaN(point[name]));
      const [text, wrong] = missing ? [`${QUANTITIES[missing]}: ${noNumber(this.fields[missing].value, units[missing].name)}`, true] : remark(law, point, solved);
      complain(this.message, text);
      this.message.classList.toggle("error", wrong);
    }

    showFacts(law, { pressure, contraction, force }) {
      const length = law.restingLength, facts = [], { force: forceUnit, length: lengthUnit } = units;
      if (Number.isFinite(pressure + contraction + force)) {
        const stiffness = law.stiffness(pressure, contraction);
        facts.push(["Stiffness", length ? `${shortText(stiffness / length / forceUnit.factor * lengthUnit.factor)} ${forceUnit.name}/${lengthUnit.name}` : `${shortText(stiffness / 100 / forceUnit.factor)} ${forceUnit.name}/%`]);
        if (length) facts.push(["Shortening", `${units.text("length", length * contraction)} of ${units.text("length", length)}`]);
        if (law.program.volume) facts.push(["Volume", units.text("volume", law.printed("volume", contraction, 0))]);
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
    const limit = (name, value, low, high) => {
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) beyond.push(`${name} ${units.text(name, value)}`);
    };
    limit("force", force, -Infinity, ratings.max_force ?? Infinity);
    limit("pressure", pressure, ratings.min_pressure ?? -Infinity, ratings.max_pressure ?? Infinity);
    limit("contraction", contraction, ratings.max_prestretch === undefined ? -Infinity : -ratings.max_prestretch, ratings.max_contraction ?? Infinity);
    if (beyond.length) return [`Beyond the values that the maker permits: ${beyond.join(", ")}.`, true];
    if (force < 0) return ["The force is negative; a muscle cannot push and is slack here.", true];
    const inside = !valid || (pressure >= valid.min_pressure && pressure <= valid.max_pressure && contraction >= valid.min_contraction && contraction <= valid.max_contraction);
    if (inside) return ["", false];
    const range = `${shortText(valid.min_pressure / units.pressure.factor)} to ${units.text("pressure", valid.max_pressure)} and ${shortText(100 * valid.min_contraction)} to ${shortText(100 * valid.max_contraction)} %`;
    return [`Outside the validity range, ${range}: ${textBeyond(law, point)}.`, false];
  }

  Object.assign(airmuscle, { PointPanel });
})();
