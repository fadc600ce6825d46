/* Tab Muscle: laws of the library and of the user, their isobars, working point, outline and parameters. */
"use strict";

(() => {
  const { element, Law, source, say, download, oncePerFrame, units } = airmuscle;
  const MOST = 6, FIRST = "dmsp-20-300";

  class MuscleTab {
    constructor(host, stateChanged) {
      this.host = host;
      this.laws = [];
      this.pressures = null;
      this.point = { pressure: 3e5, contraction: NaN, force: 100 };
      this.solved = "contraction";
      this.stateChanged = stateChanged;
      this.build();
      this.redrawCurves = oncePerFrame(() => { this.curves(true); this.showPoint(); });
      this.redrawPoint = oncePerFrame(() => this.showPoint());
    }

    get active() { return this.laws[this.activeIndex] ?? this.laws[0]; }

    build() {
      const card = (title, ...children) => element(`section.card${{ "Force over contraction": ".first", "Isotonics and stiffness": ".late", "Outline to scale": ".early", Source: ".late" }[title] ?? ""}`, {}, element("h2", {}, title), ...children);
      this.select = element("select", { "aria-label": "Muscle or law of the library" });
      this.select.addEventListener("change", () => this.replaceActive(this.select.value));
      this.list = element("ul.chosen", { "aria-label": "Muscles in the chart" });
      this.compare = element("button", { type: "button", onclick: () => this.addSelected() }, "Compare");
      this.own = airmuscle.textField("Muscle file (TOML)", "Read this muscle", async (text) => { this.add(await source.ownText("law", text), { text }); say("The muscle was read."); });
      this.about = element("div.small");
      this.message = element("p", { role: "alert" });
      const pointHost = element("div"), chartHost = element("div"), drawingHost = element("div.drawing"), parameterHost = element("div"), curveHost = element("div"), ownHost = element("div");
      this.unitSelect = element("select", { "aria-label": "Units" }, ...units.systems.map((system) => element("option", { value: system }, system)));
      this.unitSelect.addEventListener("change", () => this.chooseUnits(this.unitSelect.value));
      this.pressureUnit = element("span.soft");
      this.pressureField = element("input.grow", { type: "text", autocomplete: "off" });
      this.pressureField.addEventListener("change", () => this.readPressures());
      this.pressureMessage = element("p", { role: "alert" });
      this.resetButton = element("button", { type: "button", onclick: () => this.reset() }, "Reset parameters");
      const button = (text, action) => element("button", { type: "button", onclick: () => action().catch((error) => say(error.message)) }, text);
      const exports = element("div.row", {}, element("span.small.soft", {}, "Download"),
        button("PNG", async () => download(`${this.active.sheet.name}.png`, await airmuscle.pngOf(this.svg()), "image/png")),
        button("SVG", async () => download(`${this.active.sheet.name}.svg`, this.svg(), "image/svg+xml")),
        button("CSV", async () => download("isobars.csv", this.chart.csv(), "text/csv")),
        button("TOML", async () => download(`${this.active.sheet.name}.toml`, this.active.toml(), "application/toml")));
      this.parameterCard = card("Parameters", this.resetButton, parameterHost);
      this.host.append(element("div.columns", {},
        element("div.stack", {},
          card("Muscle", element("div.row", {}, element("div.grow", {}, this.select), this.compare), this.list, this.message, element("details", { hidden: !source.hasServer }, element("summary", {}, "Own muscle file"), this.own)),
          card("Working point", element("div.row.small.units", {}, element("span.soft", {}, "Units"), this.unitSelect), pointHost), this.parameterCard),
        element("div.stack.second", {},
          card("Force over contraction", chartHost, element("div.row.small", {}, this.pressureUnit, this.pressureField, exports), this.pressureMessage, ownHost),
          card("Outline to scale", drawingHost), card("Isotonics and stiffness", curveHost), card("Source", this.about))));
      this.chart = new airmuscle.IsobarChart(chartHost, (at) => this.dragged(at));
      chartHost.addEventListener("keydown", (event) => this.key(event));
      this.panel = new airmuscle.PointPanel(pointHost, (point, solved, typing) => { this.point = point; this.solved = solved; this.showPoint(typing); });
      this.drawing = new airmuscle.Drawing(drawingHost);
      this.parameters = new airmuscle.ParameterPanel(parameterHost);
      this.moreCurves = new airmuscle.CurvePanel(curveHost);
      this.ownPoints = new airmuscle.OwnPoints(ownHost, () => this.active.restingLength, () => { this.curves(false); this.stateChanged(); });
      this.nameUnits();
    }

    chooseUnits(system) {
      units.choose(system);
      this.nameUnits();
      this.pressures = null;
      this.refresh();
    }

    nameUnits() {
      const { name } = units.pressure;
      this.unitSelect.value = units.system;
      this.pressureUnit.textContent = `Isobars [${name}]`;
      this.pressureField.setAttribute("aria-label", `Pressures of the isobars [${name}]`);
      this.panel.nameUnits();
    }

    /* Fill the list of the library, then open what the state names. */
    async start(library, state) {
      this.select.replaceChildren(...library.laws.map((law) => element("option", { value: law.name }, `${law.name} – ${law.title}`)));
      const opened = library.opened.filter((s) => !s.plant);
      const kept = state && Array.isArray(state.muscles) ? state.muscles.slice(0, MOST) : [];
      const wanted = kept.length || opened.length ? kept : [{ name: library.laws.some((l) => l.name === FIRST) ? FIRST : library.laws[0]?.name }];
      for (const item of wanted) if (item.name || item.text) await this.open(item);
      for (const sheet of opened) {
        const known = this.laws.some((law) => law.sheet.id === sheet.id);
        if (!known) this.add(await source.loadProgram(sheet), { text: sheet.own_text, quiet: true });
      }
      if (!this.laws.length) { this.host.replaceChildren(element("p.message", {}, "This page contains no muscle.")); return; }
      this.restore(state ?? {});
      this.refresh();
    }

    async open(item) {
      try {
        const sheet = item.text ? await source.ownText("law", item.text) : await source.named("law", item.name), law = this.add(sheet, { text: item.text, quiet: true });
        for (const [path, value] of Object.entries(item.values ?? {})) {
          const i = sheet.parameters.findIndex((row) => row.path === path), bounds = i < 0 ? [] : sheet.parameters[i].bounds;
          if (i >= 0 && Number.isFinite(value) && value >= (bounds[0] ?? -Infinity) && value <= (bounds[1] ?? Infinity)) law.values[i] = value;
        }
        law.prepare();
      } catch (error) { this.complain(error.message); }
    }

    restore(state) {
      if (state.units) { units.choose(state.units); this.nameUnits(); }
      this.ownPoints.restore(state.points);
      if (["pressure", "contraction", "force"].includes(state.solved)) this.solved = state.solved;
      for (const name of Object.keys(this.point)) if (Number.isFinite(state.point?.[name])) this.point[name] = state.point[name];
      if (Array.isArray(state.pressures) && state.pressures.length && state.pressures.every((p) => p > 0 && p <= 1e8)) this.pressures = state.pressures.slice(0, 20);
      if (Number.isInteger(state.active) && this.laws[state.active]) this.activeIndex = state.active;
    }

    state() {
      const muscles = this.laws.map((law) => {
        const values = Object.fromEntries(law.sheet.parameters.flatMap((row, i) => (law.values[i] === row.value ? [] : [[row.path, law.values[i]]])));
        return { ...(law.text ? { text: law.text } : { name: law.sheet.name }), values };
      });
      const point = Object.fromEntries(Object.entries(this.point).filter(([, v]) => Number.isFinite(v)));
      return { muscles, active: this.activeIndex ?? 0, point, solved: this.solved, pressures: this.pressures, units: units.system, points: this.ownPoints.state() };
    }

    add(sheet, { text, quiet } = {}) {
      if (this.laws.length === MOST) { this.complain(`At most ${MOST} muscles are compared; remove one first.`); return this.active; }
      const law = new Law(sheet);
      law.text = text;
      this.laws.push(law);
      this.activeIndex = this.laws.length - 1;
      if (!quiet) this.refresh();
      return law;
    }

    addSelected() { return this.select.value ? this.fetched(this.select.value, (sheet) => this.add(sheet)) : undefined; }

    replaceActive(name) {
      return this.fetched(name, (sheet) => {
        this.laws.splice(this.activeIndex ?? 0, 1, new Law(sheet));
        this.pressures = null;
        this.refresh();
      });
    }

    /* The sheet of a name; of several requests only the last one takes effect. */
    async fetched(name, use) {
      if (!name) return;
      const request = this.request = {};
      this.host.setAttribute("aria-busy", "true");
      this.complain("");
      try {
        const sheet = await source.named("law", name);
        if (request === this.request) use(sheet);
      } catch (error) {
        if (request === this.request) { this.complain(error.message); this.nameSelected(); }
      }
      if (request === this.request) this.host.removeAttribute("aria-busy");
    }

    nameSelected() {
      const { sheet, text } = this.active, known = !text && [...this.select.options].some((option) => option.value === sheet.name);
      this.select.querySelector('option[value=""]')?.remove();
      if (!known) this.select.prepend(element("option", { value: "" }, `${sheet.name} – own file`));
      this.select.value = known ? sheet.name : "";
    }

    remove(index) {
      this.laws.splice(index, 1);
      this.activeIndex = Math.min(this.activeIndex, this.laws.length - 1);
      this.refresh();
    }

    complain(text) { airmuscle.complain(this.message, text); }

    /* Everything after a change of the muscles. */
    refresh() {
      const law = this.active;
      this.nameSelected();
      this.list.replaceChildren(...this.laws.map((item, i) => element(`li${item === law ? ".active" : ""}`, {},
        element(`span.swatch.${airmuscle.MUSCLE_COLOURS[i]}`),
        element("button.name", { type: "button", "aria-pressed": String(item === law), onclick: () => { this.activeIndex = i; this.refresh(); } }, item.sheet.name),
        this.laws.length > 1 ? element("button", { type: "button", "aria-label": `Remove ${item.sheet.name}`, onclick: () => this.remove(i) }, "×") : null)));
      this.parameters.show(law.sheet.parameters, law.values, (i, value) => { law.values[i] = value; law.prepare(); this.redrawCurves(); });
      this.resetButton.hidden = !law.sheet.parameters.length;
      this.about.replaceChildren(...aboutLaw(law.sheet));
      this.curves(false);
      this.showPoint();
      this.host.dataset.shown = this.laws.map((item) => item.sheet.name).join(" ");
    }

    curves(keepAxes) {
      const pressures = this.pressures ?? airmuscle.usualPressures(this.laws);
      if (document.activeElement !== this.pressureField) this.pressureField.value = pressures.map((p) => airmuscle.shortText(p / units.pressure.factor)).join("; ");
      this.chart.own = this.ownPoints.points;
      this.chart.show(this.laws, this.active, pressures, keepAxes);
      this.ownPoints.show(this.laws);
      this.moreCurves.show(this.laws, this.active, pressures, this.chart.span, this.chart.top * units.force.factor);
    }

    readPressures() {
      const values = this.pressureField.value.split(/[;\s]+/).filter(Boolean).map(airmuscle.readNumber);
      const valid = values.length <= 20 && values.every((v) => v > 0 && v * units.pressure.factor <= 1e8);
      airmuscle.complain(this.pressureMessage, valid ? "" : `Write at most 20 pressures from 0 to ${units.text("pressure", 1e8)}, separated by semicolons; the chart shows the isobars before.`, this.pressureField);
      if (!valid) return;
      this.pressures = values.length ? values.map((v) => v * units.pressure.factor) : null;
      this.curves(false);
      this.showPoint();
    }

    reset() {
      this.active.values.set(this.active.sheet.values);
      this.active.prepare();
      this.parameters.reset();
      this.curves(false);
      this.showPoint();
    }

    dragged({ contraction, force }) {
      if (this.solved !== "contraction") this.point.contraction = contraction;
      if (this.solved !== "force") this.point.force = force;
      this.redrawPoint();
    }

    key(event) {
      const step = event.shiftKey ? 10 : 1, move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!move) return;
      event.preventDefault();
      if (this.solved === "contraction" && move[0]) this.point.pressure = Math.max(0, this.point.pressure + move[0] * step * 2e3);
      else if (this.solved === "force" && move[1]) this.point.pressure = Math.max(0, this.point.pressure + move[1] * step * 2e3);
      else {
        this.point.contraction += move[0] * step * 0.001;
        this.point.force = Math.max(0, this.point.force + move[1] * step * this.chart.top * units.force.factor / 400);
      }
      this.showPoint();
    }

    showPoint(typing) {
      const law = this.active;
      this.point[this.solved] = law.solve(this.solved, this.point);
      this.panel.show(law, this.point, this.solved, typing);
      this.chart.setPoint(this.point);
      this.drawing.show(law, this.point.contraction, this.point.force);
      this.stateChanged();
    }

    /* Identifiers of what a saved page needs. */
    sheets() { return this.laws.map((law) => law.sheet.id); }

    svg() { return airmuscle.svgText(this.chart.figure(this.laws.map((law) => law.sheet.name + (law.isChanged ? " (changed)" : "")).join(", "))); }
  }

  function aboutLaw(sheet) {
    const rows = [element("p", {}, element("strong", {}, sheet.title)), element("p", {}, `${sheet.law}: ${sheet.formula} Numbers: ${sheet.provenance}.`)];
    if (sheet.warning) rows.push(element("p.message", {}, sheet.warning));
    const near = sheet.approximation;
    if (near) rows.push(element("p.message", {}, `${sheet.law} has no closed form. The page shows a polynomial of degree ${near.degree} on its validity range; estimated maximum error ${airmuscle.shortText(near.max_error)} N, root mean square error ${airmuscle.shortText(near.rms_error)} N. airmuscle evaluate ${sheet.name} gives the exact values.`));
    if (sheet.note) rows.push(element("p.soft", {}, sheet.note));
    rows.push(...permitted(sheet.ratings));
    rows.push(element("ul", {}, ...sheet.references.map((text) => element("li", {}, text))));
    return rows;
  }

  /* What the maker of a muscle permits. */
  function permitted(ratings) {
    const limits = [["max_pressure", "pressure", "pressure up to"], ["max_force", "force", "force up to"], ["max_contraction", "contraction", "contraction up to"], ["max_prestretch", "contraction", "stretch up to"]];
    const texts = limits.filter(([key]) => Number.isFinite(ratings[key])).map(([key, quantity, words]) => `${words} ${units.text(quantity, ratings[key])}`);
    return texts.length ? [element("p", {}, `Permitted by the maker: ${texts.join(", ")}.`)] : [];
  }

  Object.assign(airmuscle, { MuscleTab });
})();
