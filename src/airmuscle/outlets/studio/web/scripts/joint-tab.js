/* Tab Joint: a joint of two muscles under a control law, with its gains, tasks, frequency response and reachable region. */
"use strict";

(() => {
  const { element, source, download, shortText, oncePerFrame, JointStatics, JointLinear, PrintedLaw } = airmuscle;
  const FIRST = "joint-dmsp-20-proportional", SPEEDS = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2], SAMPLE_TIMES = [1, 2, 5, 10, 20], DEGREE = Math.PI / 180;
  const CONTROLLERS = [["pid", "PID of the angle"], ["cascade", "Cascade of angle and speed"], ["stiffness", "Angle and stiffness"]];

  class JointTab {
    constructor(host, stateChanged) {
      Object.assign(this, { host, stateChanged, speed: 0.25, cursor: 0, share: 1, sampleTime: 5e-3, controller: "pid", ahead: true });
      this.build();
      this.rerun = oncePerFrame(() => { if (this.sheet) this.compute(); });
    }

    build() {
      const card = (title, order, ...children) => element(`section.card${order}`, {}, element("h2", {}, title), ...children);
      const button = (text, action) => element("button", { type: "button", onclick: () => this.sheet && action() }, text);
      const select = (label, rows, changed) => { const made = element("select", { "aria-label": label }, ...rows.map(([value, text]) => element("option", { value }, text))); made.addEventListener("change", () => changed(made.value)); return made; };
      this.select = select("Joint of the library", [], (name) => this.fetched(() => source.named("joint", name), {}));
      this.message = element("p", { role: "alert" });
      this.controllerSelect = select("Controller", CONTROLLERS, (key) => { this.controller = key; this.lawChanged(); });
      this.aheadBox = element("input", { type: "checkbox", checked: true });
      this.aheadBox.addEventListener("change", () => { this.ahead = this.aheadBox.checked; this.lawChanged(); });
      this.sampleSelect = select("Sample time", SAMPLE_TIMES.map((ms) => [ms, `${ms} ms`]), (ms) => { this.sampleTime = Number(ms) / 1000; this.rerun(); this.stateChanged(); });
      this.taskSelect = select("Task", [], () => { this.cursor = 0; this.rerun(); this.stateChanged(); });
      this.shareSlider = element("input", { type: "range", min: 0, max: 150, step: 5, "aria-label": "Size of motion and disturbance" });
      this.shareText = element("output");
      this.shareSlider.addEventListener("input", () => { this.share = Number(this.shareSlider.value) / 100; this.showShare(); this.rerun(); this.stateChanged(); });
      this.gains = element("div");
      this.facts = element("dl.facts");
      this.note = element("p.small.soft");
      this.pointText = element("dl.facts");
      this.bodeText = element("p.small");
      this.about = element("div.small");
      this.playButton = button("Play", () => (this.playing ? this.stop() : this.play()));
      this.speedSelect = select("Speed", SPEEDS.map((s) => [s, s === 1 ? "real time" : `${s} × time`]), (s) => { this.speed = Number(s); });
      this.scrub = element("input", { type: "range", min: 0, max: 1000, value: 0, "aria-label": "Instant of the run" });
      this.scrub.addEventListener("input", () => { this.stop(); this.cursor = Number(this.scrub.value) / 1000 * this.duration; this.showInstant(); });
      this.clock = element("output", {}, "0 s");
      const drawing = element("div.drawing"), traces = element("div"), bode = element("div"), region = element("div"), parameters = element("div");
      const exports = element("div.row", {}, element("span.small.soft", {}, "Download"), button("CSV", () => download(`${this.sheet.name}-${this.law.row.key}.csv`, this.csv(), "text/csv")));
      this.host.append(element("div.columns", {},
        element("div.stack", {},
          card("Joint", "", element("div.row", {}, element("div.grow", {}, this.select)), this.message),
          card("Controller", ".early", element("div.row", {}, element("div.grow", {}, this.controllerSelect)), element("label.row", {}, this.aheadBox, "Feed-forward"), this.gains, element("div.row", {}, button("Reset gains", () => this.resetGains()), element("span.small.soft", {}, "Sample time"), this.sampleSelect), this.note),
          card("Parameters of the joint", "", element("p.small.soft", {}, "Of the simulated joint; the control laws and the reachable region keep those of the file."), button("Reset parameters", () => this.resetParameters()), parameters)),
        element("div.stack.second", {},
          card("Joint in motion", ".first", element("div.row", {}, element("div.grow", {}, this.taskSelect), element("label.bar.share", {}, element("span.small.soft", {}, "Size"), this.shareSlider, this.shareText)),
            element("div.row", {}, this.playButton, this.speedSelect, exports), element("div.bar", {}, element("span.small.soft", {}, "Time"), this.scrub, this.clock), element("div.motion", {}, element("div", {}, drawing, this.facts), traces)),
          card("Frequency response", ".early", this.bodeText, bode),
          card("Angle and stiffness", ".early", element("div.motion", {}, this.pointText, region)),
          card("Source", ".late", this.about))));
      this.speedSelect.value = "0.25";
      this.drawing = new airmuscle.JointDrawing(drawing);
      this.traces = new airmuscle.JointTraces(traces);
      this.bode = new airmuscle.BodeCharts(bode);
      this.region = new airmuscle.RegionChart(region, (angle, stiffness) => { this.wish = [angle, stiffness]; this.movePoint(); });
      this.movePoint = oncePerFrame(() => { this.point = this.statics.workingPoint(...this.wish); this.compute(); this.stateChanged(); });
      this.parameters = new airmuscle.ParameterPanel(parameters);
    }

    async start(library, state) {
      const joints = library.joints ?? [];
      this.select.replaceChildren(...joints.map((joint) => element("option", { value: joint.name }, `${joint.name} – ${joint.title}`)));
      this.wanted = state ?? {};
      const name = this.wanted.name ?? (joints.some((j) => j.name === FIRST) ? FIRST : joints[0]?.name);
      if (name && joints.length) this.pending = () => source.named("joint", name);
      else this.host.replaceChildren(element("p.message", {}, "This page contains no joint."));
    }

    async visible(seen) {
      if (!seen) { this.stop(); return; }
      const load = this.pending;
      this.pending = null;
      if (load) await this.fetched(load, this.wanted);
    }

    async fetched(load, state) {
      const request = this.request = {};
      this.stop();
      this.host.setAttribute("aria-busy", "true");
      this.complain("");
      try {
        const sheet = await load();
        if (request === this.request) this.open(sheet, state);
      } catch (error) { if (request === this.request) { this.complain(error.message); if (this.sheet) this.select.value = this.sheet.name; } }
      if (request === this.request) this.host.removeAttribute("aria-busy");
    }

    complain(text) { airmuscle.complain(this.message, text); }

    open(sheet, state) {
      this.sheet = sheet;
      this.run = new airmuscle.PlantRun(sheet);
      this.statics = new JointStatics(this.run);
      this.linear = new JointLinear(this.statics);
      this.laws = Object.fromEntries(sheet.controllers.map((row) => [row.key, new PrintedLaw(sheet, row)]));
      this.readState(state);
      this.select.value = sheet.name;
      this.taskSelect.replaceChildren(...sheet.tasks.map((task) => element("option", { value: task.name }, task.name)));
      this.taskSelect.value = sheet.tasks.some((task) => task.name === state.task) ? state.task : "step";
      const [least, greatest] = this.statics.limits(0) ?? [0, 0], { angle = 0, stiffness = 0.5 * (least + greatest) } = state.point ?? {};
      this.point = this.statics.workingPoint(Number.isFinite(angle) ? angle : 0, Number.isFinite(stiffness) ? stiffness : 0.5 * (least + greatest));
      this.rows = sheet.parameters.filter((row) => row.path.startsWith("mechanism"));
      this.parameters.show(this.rows, this.rows.map((row) => this.run.values[row.places[0]]), (i, value) => { this.run.set(this.rows[i], value); this.rerun(); this.stateChanged(); });
      this.about.replaceChildren(element("p", {}, element("strong", {}, sheet.title)), ...(sheet.warning ? [element("p.message", {}, sheet.warning)] : []), element("p.soft", {}, `Numbers: ${sheet.provenance}. ${sheet.note} All gains and tasks are chosen.`), element("ul", {}, ...sheet.references.map((r) => element("li", {}, r))));
      this.traces.begin(sheet);
      this.region.begin(sheet);
      this.lawChanged();
      this.host.dataset.shown = sheet.name;
    }

    /* What an address or a saved page states; what does not fit is left out. */
    readState(state) {
      if (CONTROLLERS.some(([key]) => key === state.controller)) this.controller = state.controller;
      if (typeof state.ahead === "boolean") this.ahead = state.ahead;
      if (SAMPLE_TIMES.includes(Math.round(state.sampleTime * 1000))) this.sampleTime = state.sampleTime;
      if (state.share >= 0 && state.share <= 1.5) this.share = state.share;
      const fits = (value, [low, high]) => Number.isFinite(value) && value >= (low ?? -Infinity) && value <= (high ?? Infinity);
      for (const [key, gains] of Object.entries(state.gains ?? {})) for (const row of this.laws[key]?.row.gains ?? []) if (fits(gains?.[row.path], row.bounds)) this.laws[key].set(row.path, gains[row.path]);
      for (const row of this.sheet.parameters) if (fits(state.values?.[row.path], row.bounds)) this.run.set(row, state.values[row.path]);
      this.controllerSelect.value = this.controller;
      this.aheadBox.checked = this.ahead;
      this.sampleSelect.value = String(Math.round(this.sampleTime * 1000));
      this.shareSlider.value = String(Math.round(100 * this.share));
      this.showShare();
    }

    showShare() { this.shareText.textContent = `${Math.round(100 * this.share)} %`; this.shareSlider.setAttribute("aria-valuetext", this.shareText.textContent); }

    get law() { return this.laws[this.controller === "stiffness" ? "stiffness" : `${this.controller}${this.ahead ? "-ahead" : ""}`]; }

    get task() { return this.sheet.tasks.find((task) => task.name === this.taskSelect.value); }

    get duration() { return this.task.duration; }

    /* Another controller: gains that both have keep their values with feed-forward on and off. */
    lawChanged() {
      if (!this.sheet) return;
      const { law } = this;
      this.gains.replaceChildren(...law.row.gains.map((row) => airmuscle.gainRow(row, law.get(row.path), (value) => this.setGain(row, value))));
      const kind = this.sheet.regulated ? "The pressure regulators of the joint control the pressures." : `Pressures are controlled with the gain K_p${this.sheet.switching ? ", the on/off valves by sigma-delta modulation of the commands" : ""}.`;
      this.note.textContent = `${kind} ${this.controller === "stiffness" ? "Feed-forward: the torque of the wanted acceleration; that of the weight is part of the law." : "Feed-forward: the pressures of both muscles for the wanted motion, from the statics of the joint."}`;
      this.compute();
      this.stateChanged();
    }

    setGain(row, value) {
      const symbol = (other) => other.symbol === row.symbol && this.law.row.key.replace("-ahead", "") === this.controller;
      for (const key of [this.controller, `${this.controller}-ahead`]) { const same = this.laws[key]?.row.gains.find(symbol); if (same) this.laws[key].set(same.path, value); }
      this.rerun();
      this.stateChanged();
    }

    resetGains() {
      for (const law of Object.values(this.laws)) { law.values.set(law.row.values); law.prepare(); }
      this.lawChanged();
    }

    resetParameters() {
      this.run.values.set(this.sheet.values);
      this.run.prepare();
      this.parameters.reset();
      this.rerun();
      this.stateChanged();
    }

    /* The whole run, its charts, and the frequency response. */
    compute() {
      const { law, task, point, statics, run, sampleTime } = this, begin = performance.now();
      if (law.row.bias) law.set(law.row.bias, 0.5 * (point.first - point.second));
      const { state } = statics.rest(point.angle, point.first, point.second), setpoints = this.signals(law.row.setpoints.includes("first_ahead"));
      const torque = task.torque.map(([t, value]) => [t, this.share * value]);
      this.result = airmuscle.runLoop(run, law, { duration: task.duration, sampleTime, state, setpoints, torque, torqueInput: "external_torque" });
      const { columns, status, time } = this.result, [one, two] = this.sheet.muscles;
      columns.stiffness = columns.time.map((_, i) => statics.at(columns.angle[i], columns[`${one.prefix}pressure`][i], columns[`${two.prefix}pressure`][i]).stiffness);
      columns["wanted stiffness"] = columns.time.map((_, i) => setpoints.stiffness[Math.min(i, setpoints.stiffness.length - 1)]);
      columns["setpoint.angle"] = columns.time.map((_, i) => setpoints.angle[Math.min(i, setpoints.angle.length - 1)]);
      this.showBode();
      this.taken = performance.now() - begin;
      if (this.cursor > task.duration) this.cursor = 0;
      this.showFacts(status, time);
      this.traces.show(columns);
      this.region.setPoint(point, columns);
      this.showPoint();
      this.showInstant();
      this.host.dataset.runs = String(Number(this.host.dataset.runs ?? 0) + 1);
    }

    /* Set points of the task; they do not depend on the gains. */
    signals(pressures) {
      const { task, point, share, sampleTime, ahead, statics } = this, key = JSON.stringify([this.sheet.id, task.name, point, share, sampleTime, ahead, pressures]);
      if (this.signalKey !== key) {
        const times = airmuscle.loopInstants(0, task.duration, sampleTime);
        this.signalKey = key;
        this.kept = airmuscle.taskSignals(statics, task, point, share, times.slice(0, -1), { ahead, pressures });
      }
      return this.kept;
    }

    showBode() {
      const frequencies = airmuscle.BodeCharts.frequencies(this.sampleTime), loop = this.linear.openLoop(this.law, this.point, this.sampleTime), response = airmuscle.bode(frequencies, this.linear.response(loop, frequencies, this.sampleTime));
      this.bode.show(frequencies, response);
      const { crossover, phaseMargin, phaseCrossover, gainMargin } = response, part = (value, text) => (Number.isFinite(value) ? text : "");
      this.bodeText.replaceChildren(element("strong", {}, "Open loop of the angle. "), part(crossover, `Crossover at ${shortText(crossover, 3)} Hz with a phase margin of ${shortText(phaseMargin, 3)}°. `), part(phaseCrossover, `Gain margin ${shortText(gainMargin, 3)} dB at ${shortText(phaseCrossover, 3)} Hz. `), element("span.soft", {}, "Linearised at the working point with valves opened by 10 % (chosen) in the direction of a rising angle, sampled and held."));
    }

    showFacts(status, time) {
      const { columns } = this.result, errors = columns.time.flatMap((t, i) => (t >= this.task.begin ? [(columns.angle[i] - columns["setpoint.angle"][i]) / DEGREE] : [])), rms = Math.sqrt(errors.reduce((s, e) => s + e * e, 0) / Math.max(1, errors.length));
      const rows = [["rms error", `${shortText(rms, 3)}°`], ["maximum error", `${shortText(Math.max(...errors.map(Math.abs)), 3)}°`], ["computed in", `${shortText(this.taken, 2)} ms, ${this.result.steps} steps`]];
      if (status) rows.push(["ended", `at ${shortText(time)} s: ${status === 2 ? "the step became too small" : "a value is not finite"}`]);
      this.facts.replaceChildren(...rows.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
    }

    showPoint() {
      const { point } = this, at = this.statics.at(point.angle, point.first, point.second), [one, two] = this.sheet.muscles;
      const rows = [["angle", `${shortText(point.angle / DEGREE, 3)}°`], ["stiffness, valves open", `${shortText(at.stiffness, 3)} N m/rad`], ["stiffness, valves closed", `${shortText(at.shut_valves, 3)} N m/rad`], [one.name, `${shortText(point.first / 1e5, 3)} bar`], [two.name, `${shortText(point.second / 1e5, 3)} bar`], ["torque of the weight", `${shortText(at.load, 3)} N m`]];
      this.pointText.replaceChildren(...rows.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
    }

    showInstant() {
      const { columns } = this.result, last = columns.time.length - 1;
      if (last < 0) return;
      const row = Math.max(0, Math.min(last, Math.round(this.cursor / this.sampleTime)));
      this.drawing.show(this.run, (name) => columns[name][row], columns["setpoint.angle"][row]);
      this.traces.setCursor(this.cursor);
      this.scrub.value = String(this.cursor / this.duration * 1000);
      this.clock.textContent = `${columns.time[row].toFixed(2)} s`;
      this.scrub.setAttribute("aria-valuetext", this.clock.textContent);
    }

    play() {
      if (this.playing || !this.result) return;
      this.playing = true;
      this.playButton.textContent = "Pause";
      if (this.cursor >= this.duration) this.cursor = 0;
      let before = performance.now();
      const frame = (now) => {
        if (!this.playing) return;
        this.cursor = Math.min(this.duration, this.cursor + Math.min(0.1, (now - before) / 1000) * this.speed);
        before = now;
        this.showInstant();
        if (this.cursor >= this.duration) this.stop(); else requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }

    stop() { this.playing = false; this.playButton.textContent = "Play"; }

    csv() {
      const { columns } = this.result, units = new Map(this.sheet.columns.map((c) => [c.name, c.unit === "deg" || c.unit === "kPa" ? { unit: c.unit, factor: c.factor } : c]));
      return airmuscle.csvText(Object.keys(columns).map((name) => {
        const known = units.get(name), unit = known ? known.unit || "1" : { time: "s", stiffness: "N m/rad", "wanted stiffness": "N m/rad" }[name] ?? "SI";
        return { heading: `${name} [${unit}]`, values: known ? columns[name].map((v) => v * known.factor) : columns[name] };
      }));
    }

    state() {
      if (!this.sheet) return this.wanted ?? {};
      const gains = {};
      for (const [key, law] of Object.entries(this.laws)) for (const row of law.row.gains) { const v = law.get(row.path); if (v !== law.row.values[law.row.paths.indexOf(row.path)]) (gains[key] ??= {})[row.path] = v; }
      const values = Object.fromEntries(this.rows.flatMap((row) => { const v = this.run.values[row.places[0]]; return v === row.value ? [] : [[row.path, v]]; }));
      const { angle, stiffness } = this.point;
      return { name: this.sheet.name, controller: this.controller, ahead: this.ahead, task: this.taskSelect.value, share: this.share, sampleTime: this.sampleTime, point: { angle, stiffness }, gains, values };
    }

    sheets() { return this.sheet ? [this.sheet.id] : []; }
  }

  Object.assign(airmuscle, { JointTab });
})();
