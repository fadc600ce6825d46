/* Tab Plant: a scenario of the library or of the user, run in the page by its schedule or driven by hand. */
"use strict";

(() => {
  const { element, source, say, download, shortText, pythonFloat, PlantRun, oncePerFrame } = airmuscle;
  const FIRST = "lift-dmsp-20", SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 5], WINDOW = 10, MOST_LIVE = 600;

  class PlantTab {
    constructor(host, stateChanged) {
      this.host = host;
      this.stateChanged = stateChanged;
      this.mode = "schedule";
      this.speed = 1;
      this.build();
      this.rerun = oncePerFrame(() => this.compute());
    }

    build() {
      const card = (title, order, ...children) => element(`section.card${order}`, {}, element("h2", {}, title), ...children);
      const button = (text, action) => element("button", { type: "button", onclick: () => this.run && action() }, text);
      this.select = element("select", { "aria-label": "Plant of the library" });
      this.select.addEventListener("change", () => this.select.value && this.choose(this.select.value));
      this.message = element("p", { role: "alert" });
      this.own = airmuscle.textField("Scenario (TOML)", "Read this scenario", async (text) => { this.open(await source.ownText("plant", text)); say("The scenario was read."); });
      this.playButton = button("Play", () => this.togglePlay());
      this.liveButton = button("Drive by hand", () => this.setMode("live"));
      this.scheduleButton = button("Run the schedule", () => this.setMode("schedule"));
      this.speedSelect = element("select", { "aria-label": "Speed" }, ...SPEEDS.map((s) => element("option", { value: s, selected: s === 1 }, s === 1 ? "real time" : `${s} × time`)));
      this.speedSelect.addEventListener("change", () => { this.speed = Number(this.speedSelect.value); this.stateChanged(); });
      this.scrub = element("input", { type: "range", min: 0, max: 1000, value: 0, "aria-label": "Instant of the run" });
      this.scrub.addEventListener("input", () => { this.stop(); this.cursor = this.run.start + Number(this.scrub.value) / 1000 * this.duration; this.showInstant(); });
      this.clock = element("output", {}, "0 s");
      this.inputs = element("div");
      this.about = element("div.small");
      this.facts = element("p.small.soft");
      const drawingHost = element("div.drawing"), traceHost = element("div"), parameterHost = element("div");
      this.resetButton = button("Reset parameters", () => this.reset());
      const exports = element("div.row", {}, element("span.small.soft", {}, "Download"), button("CSV", () => download(`${this.sheet.name}.csv`, this.csv(), "text/csv")), button("TOML", () => download(`${this.sheet.name}.toml`, this.toml(), "application/toml")));
      this.host.append(element("div.columns", {},
        element("div.stack", {},
          card("Plant", "", element("div.row", {}, element("div.grow", {}, this.select)), this.message, element("details", { hidden: !source.hasServer }, element("summary", {}, "Own scenario"), this.own)),
          card("Valves", ".early", element("div.row", {}, this.scheduleButton, this.liveButton), this.inputs), card("Parameters", "", this.resetButton, parameterHost)),
        element("div.stack.second", {},
          card("Plant in motion", ".first", element("div.row", {}, this.playButton, this.speedSelect, exports), element("div.bar", {}, element("span.small.soft", {}, "Time"), this.scrub, this.clock), element("div.motion", {}, drawingHost, traceHost), this.facts),
          this.loopCard = card("Loop", ".late", this.loop = element("div.small.loop")), card("Source", ".late", this.about))));
      this.drawing = new airmuscle.PlantDrawing(drawingHost);
      this.traces = new airmuscle.Traces(traceHost);
      this.traces.again = () => this.showTraces();
      this.parameters = new airmuscle.ParameterPanel(parameterHost);
    }

    async start(library, state) {
      this.select.replaceChildren(...library.plants.map((plant) => element("option", { value: plant.name }, `${plant.name} – ${plant.title}`)));
      this.wanted = state ?? {};
      const opened = library.opened.find((sheet) => sheet.plant), first = this.wanted.name ?? (library.plants.some((p) => p.name === FIRST) ? FIRST : library.plants[0]?.name);
      if (opened) this.pending = () => source.loadProgram(opened);
      else if (this.wanted.text) this.pending = () => source.ownText("plant", this.wanted.text);
      else if (first) this.pending = () => source.named("plant", first);
      else this.host.replaceChildren(element("p.message", {}, "This page contains no plant."));
    }

    /* A plant is loaded when its tab is first seen; a hidden tab does not move. */
    async visible(seen) {
      if (!seen) { this.stop(); return; }
      const load = this.pending;
      this.pending = null;
      if (load) await this.fetched(load, this.wanted);
    }

    choose(name) { return this.fetched(() => source.named("plant", name), {}); }

    async fetched(load, state) {
      const request = this.request = {};
      this.host.setAttribute("aria-busy", "true");
      this.complain("");
      try {
        const sheet = await load();
        if (request === this.request) this.open(sheet, state);
      } catch (error) { if (request === this.request) { this.complain(error.message); if (this.sheet) this.nameSelected(); } }
      if (request === this.request) this.host.removeAttribute("aria-busy");
    }

    complain(text) { airmuscle.complain(this.message, text); }

    open(sheet, state = {}) {
      this.stop();
      this.sheet = sheet;
      this.run = new PlantRun(sheet);
      this.duration = sheet.duration;
      this.schedule = null;
      this.mode = "schedule";
      for (const row of sheet.parameters) {
        const value = state.values?.[row.path], [low, high] = row.bounds;
        if (Number.isFinite(value) && value >= (low ?? -Infinity) && value <= (high ?? Infinity)) this.run.set(row, value);
      }
      if (state.schedule && validSchedule(state.schedule, sheet)) { this.schedule = state.schedule; this.duration = Math.min(MOST_LIVE, Math.max(0.1, Number(state.duration) || sheet.duration)); }
      this.nameSelected();
      this.parameters.show(sheet.parameters, sheet.parameters.map((row) => this.run.values[row.places[0]]), (i, value) => { this.run.set(sheet.parameters[i], value); this.changed(); }, (path) => groupName(path, sheet));
      this.about.replaceChildren(element("p", {}, element("strong", {}, sheet.title)), ...(sheet.warning ? [element("p.message", {}, sheet.warning)] : []), element("p.soft", {}, `Numbers: ${sheet.provenance}. ${sheet.note}`), element("ul", {}, ...sheet.references.map((r) => element("li", {}, r))));
      this.showLoop(sheet.loop);
      this.drawing.begin(this.run);
      this.traces.begin(sheet, state.shown);
      this.buildInputs();
      this.setMode("schedule");
      this.host.dataset.shown = sheet.name;
    }

    /* Margins, Bode and Nyquist plot of the controller of the scenario, which Python computed. */
    showLoop(loop) {
      this.loopCard.hidden = !loop;
      if (!loop) return;
      this.loop.replaceChildren(element("p", {}, loop.text),
        element("table", {}, ...loop.rows.map(([name, value, unit]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, `${value} ${unit}`)))),
        ...loop.figures.map((src, i) => element("img", { src, alt: i ? "Nyquist plot of the open loop" : "Bode plot of the open loop" })));
    }

    /* The list names what is shown: an entry of the library, or the own scenario. */
    nameSelected() {
      this.ownOption?.remove();
      this.ownOption = this.sheet.own_text ? element("option", { value: "" }, `own scenario – ${this.sheet.title}`) : null;
      if (this.ownOption) this.select.prepend(this.ownOption);
      this.select.value = this.sheet.own_text ? "" : this.sheet.name;
    }

    buildInputs() {
      const first = this.run.program.run.segments.values[0] ?? [];
      this.sliders = this.sheet.inputs.map((input, index) => {
        const low = input.minimum ?? 0, high = input.maximum ?? (input.unit === "Pa" ? 6e5 : 1), factor = input.unit === "Pa" ? 1e5 : 1, unit = input.unit === "Pa" ? "bar" : input.unit;
        const slider = element("input", { type: "range", min: low, max: high, step: (high - low) / 200, value: first[index] ?? Math.max(low, 0), "aria-label": `Input ${input.name}` });
        const output = element("output", {}, ""), show = () => { output.textContent = `${shortText(Number(slider.value) / factor, 3)} ${unit}`; slider.setAttribute("aria-valuetext", output.textContent); };
        slider.addEventListener("input", () => { show(); if (this.mode !== "live") this.setMode("live"); this.live.drive(index, Number(slider.value)); this.play(); });
        const push = (value) => { slider.value = String(value); slider.dispatchEvent(new Event("input")); };
        show();
        return { slider, show, row: element("div.parameter", {}, element("div.bar", {}, element("span", {}, input.name), slider, output), element("div.row.small", {}, ...(low < 0 ? [low, 0, high] : [low, high]).map((v) => element("button", { type: "button", onclick: () => push(v) }, `${shortText(v / factor, 3)} ${unit}`)))) };
      });
      this.inputs.replaceChildren(...this.sliders.map((s) => s.row), element("p.small.soft", {}, `Moving a slider starts a run by hand; what you do becomes the schedule of the scenario${this.sheet.controlled ? ", in place of its controller" : ""}.`));
    }

    setMode(mode) {
      if (!this.run) return;
      this.stop();
      if (mode === "schedule" && this.mode === "live" && this.live?.time > this.run.start) { this.schedule = this.live.schedule; this.duration = Math.max(0.1, this.live.time - this.run.start); }
      this.mode = mode;
      this.scheduleButton.setAttribute("aria-pressed", String(mode === "schedule"));
      this.liveButton.setAttribute("aria-pressed", String(mode === "live"));
      if (mode === "live") { this.live = this.run.live(); this.sliders.forEach(({ slider }, i) => this.live.drive(i, Number(slider.value))); this.liveShown(); } else this.compute();
      this.scrub.disabled = mode === "live";
    }

    changed() { if (this.mode === "schedule") this.rerun(); else this.live.jump = true; this.stateChanged(); }

    get byController() { return this.sheet.controlled && !this.schedule; }

    segments() { return this.schedule ? this.run.segmentsOf(this.schedule, this.run.start + this.duration) : this.run.program.run.segments; }

    rowTime() { return Math.max(this.duration / 2000, 1e-4); }

    compute() {
      if (this.mode !== "schedule") return;
      const begin = performance.now();
      this.result = this.byController ? this.run.controlled(this.duration, this.rowTime()) : this.run.scheduled(this.segments(), this.rowTime());
      const taken = performance.now() - begin, { status, steps, time } = this.result;
      this.facts.textContent = `${shortText(this.duration)} s computed in ${shortText(taken, 2)} ms, ${steps} steps.`;
      if (this.byController) this.facts.textContent += " The commands are those of the controller of the scenario.";
      if (!this.run.initial.settled) this.facts.textContent += " No equilibrium was found with these parameters: the run begins at the original state.";
      if (status) this.facts.textContent += ` The run ended at ${shortText(time)} s: ${status === 2 ? "the step became too small" : "a value is not finite"}; the parameters are not possible together.`;
      this.cursor = this.cursor > this.run.start && this.cursor <= this.run.start + this.duration ? this.cursor : this.run.start;
      this.showTraces();
      this.showInstant();
    }

    get columns() { return this.mode === "live" ? this.live.columns : this.result.columns; }

    showTraces() {
      const now = this.mode === "live" ? this.live.time : this.run.start + this.duration;
      this.traces.show(this.columns, this.mode === "live" ? [Math.max(this.run.start, now - WINDOW), Math.max(now, this.run.start + WINDOW)] : [this.run.start, now]);
    }

    /* Drawing and cursor at the present instant. */
    showInstant() {
      const { columns } = this, last = columns.time.length - 1;
      const row = this.mode === "live" ? last : Math.max(0, Math.min(last, Math.round((this.cursor - this.run.start) / this.rowTime())));
      if (last < 0) return;
      this.drawing.show((name) => columns[name][row]);
      this.traces.setCursor(this.mode === "live" ? null : this.cursor);
      this.scrub.value = String(this.mode === "live" ? 1000 : (this.cursor - this.run.start) / this.duration * 1000);
      this.clock.textContent = `${columns.time[row].toFixed(2)} s`;
      this.scrub.setAttribute("aria-valuetext", this.clock.textContent);
    }

    liveShown() { this.showTraces(); this.showInstant(); this.facts.textContent = "Driven by hand; parameters may change during the run."; }

    togglePlay() { if (this.playing) this.stop(); else this.play(); }

    play() {
      if (this.playing || !this.run) return;
      this.playing = true;
      this.playButton.textContent = "Pause";
      if (this.mode === "schedule" && this.cursor >= this.run.start + this.duration) this.cursor = this.run.start;
      let before = performance.now();
      const frame = (now) => {
        if (!this.playing) return;
        const passed = Math.min(0.1, (now - before) / 1000) * this.speed;
        before = now;
        this.step(passed);
        if (this.playing) requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }

    step(passed) {
      if (this.mode === "schedule") {
        this.cursor = Math.min(this.run.start + this.duration, this.cursor + passed);
        this.showInstant();
        if (this.cursor >= this.run.start + this.duration) this.stop();
        return;
      }
      const status = passed > 0 ? this.live.advance(passed) : 0;
      this.liveShown();
      if (status) { this.stop(); this.facts.textContent = "The run ended: the parameters are not possible together. Reset them, or run the schedule."; }
      if (this.live.time - this.run.start >= MOST_LIVE) { this.stop(); this.facts.textContent = `A run by hand ends after ${MOST_LIVE} s.`; }
    }

    stop() { this.playing = false; this.playButton.textContent = "Play"; this.stateChanged(); }

    reset() {
      this.run.values.set(this.sheet.values);
      this.run.prepare();
      this.parameters.reset();
      this.changed();
    }

    csv() {
      const { columns } = this, units = new Map(this.sheet.columns.map((c) => [c.name, c]));
      return airmuscle.csvText(this.run.names.map((name) => {
        const column = units.get(name);
        return column ? { heading: `${name} [${column.unit || "1"}]`, values: columns[name].map((v) => v * column.factor) } : { heading: "time [s]", values: columns.time };
      }));
    }

    /* The scenario with the present parameters and schedule; the file of the user, if nothing changed. */
    toml() {
      const changed = this.run.values.some((v, i) => v !== this.sheet.values[i]), schedule = this.mode === "live" ? this.live.schedule : this.schedule;
      if (!changed && !schedule && this.sheet.own_text) return this.sheet.own_text;
      const quote = (text) => JSON.stringify(text), plant = airmuscle.fillTemplate(this.sheet.toml.plant, this.run.values);
      const rows = Object.entries(schedule ?? {}).filter(([, list]) => list.length).map(([name, list]) => `${quote(name)} = [${list.map(([t, v]) => `[${pythonFloat(t)}, ${pythonFloat(v)}]`).join(", ")}]\n`).join("");
      const duration = this.mode === "live" ? this.live.time - this.run.start : this.duration;
      const run = schedule ? this.sheet.toml.run.replace(/^duration = .*$/m, `duration = ${pythonFloat(Math.max(duration, 0.001))}`) : this.sheet.toml.run;
      return `# Written by airmuscle studio.${this.run.initial.settled ? "" : " The run in the page began at the equilibrium of the original parameters."}\ntitle = ${quote(this.sheet.title)}\n\n${plant}\n${schedule ? `[input]\n${rows}` : this.sheet.toml.input}\n${run}`;
    }

    state() {
      if (!this.sheet) return this.wanted ?? {};
      const values = Object.fromEntries(this.sheet.parameters.flatMap((row) => { const v = this.run.values[row.places[0]]; return v === row.value ? [] : [[row.path, v]]; }));
      const by = this.mode === "live" ? this.live.schedule : this.schedule, duration = this.mode === "live" ? this.live.time - this.run.start : this.duration;
      return { ...(this.sheet.own_text ? { text: this.sheet.own_text } : { name: this.sheet.name }), values, ...(by ? { schedule: by, duration } : {}), shown: [...this.traces.shown] };
    }

    sheets() { return this.sheet ? [this.sheet.id] : []; }
  }

  /* Part of the plant that a parameter belongs to: "mechanism", "circuit of left", "muscle right". */
  function groupName(path, sheet) {
    const [, part, index] = /^(\w+)(?:\[(\d+)\])?/.exec(path);
    if (index === undefined) return part;
    const name = sheet.muscles[Number(index)]?.name ?? index;
    return part === "muscle" ? `muscle ${name}` : `${part} of ${name}`;
  }

  /* Whether a schedule of an address fits the inputs. */
  function validSchedule(schedule, sheet) {
    return Object.entries(schedule).every(([name, rows]) => {
      const input = sheet.inputs.find((i) => i.name === name);
      return input && Array.isArray(rows) && rows.length < 10000 && rows.every((row) => Array.isArray(row) && row.length === 2 && row.every(Number.isFinite) && row[1] >= (input.minimum ?? -Infinity) && row[1] <= (input.maximum ?? Infinity));
    });
  }

  Object.assign(airmuscle, { PlantTab });
})();
