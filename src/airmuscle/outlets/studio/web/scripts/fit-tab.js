/* Tab Fit: from measurement files to a muscle, or from episodes to an arm. The server reads and fits; the page may be closed meanwhile. */
"use strict";

(() => {
  const { element, source, fitSource, say, problemOf } = airmuscle;
  const PAUSE = 800;
  const SHOWN = ["resting_length", "outliers", "braid_radius", "braid_angle"];
  const LONG = ["known"];  /* fields whose text may have several lines */
  const empty = (names) => ({ columns: {}, files: {}, rules: [], entry: "", leave_out: "", hysteresis: false, record: "", mapping: "", ...Object.fromEntries(names.map((name) => [name, ""])) });

  class FitTab {
    constructor(host, stateChanged) {
      Object.assign(this, { host, stateChanged, set: "", names: [], sheet: null, task: "", settings: empty([]), texts: [], problems: new Map() });
      this.fields = {};
      this.places = {};
    }

    text(name, label, attributes = {}) {
      const made = LONG.includes(name) ? element("textarea.short", { id: `fit-${name}`, rows: 2, spellcheck: false, ...attributes }) : element("input", { type: "text", id: `fit-${name}`, autocomplete: "off", ...attributes });
      made.addEventListener("change", () => { this.settings[name] = made.value.trim(); this.read(); });
      return this.labelled(name, label, made);
    }

    /* A box, whose text is "" unless it is marked. */
    box(name, label, mark) {
      const made = element("input", { type: "checkbox", id: `fit-${name}`, value: mark });
      made.addEventListener("change", () => { this.settings[name] = made.checked ? mark : ""; this.read(); });
      this.fields[name] = made;
      this.places[name] = element("div", { role: "alert" });
      return element("div.field", {}, element("label.row", { for: made.id }, made, label), this.places[name]);
    }

    choice(name, label, options) {
      const made = element("select", { id: `fit-${name}` }, ...options.map(([value, text]) => element("option", { value }, text)));
      made.addEventListener("change", () => { this.settings[name] = made.value; this.read(); });
      return this.labelled(name, label, made);
    }

    /* A field as the program declares it. */
    declared(name) {
      const { label, example, offered, mark } = this.form[name];
      if (mark) return this.box(name, label, mark);
      return offered.length ? this.choice(name, label, offered) : this.text(name, label, example ? { placeholder: example } : {});
    }

    labelled(name, label, made) {
      const hint = this.form[name]?.hint;
      this.fields[name] = made;
      this.places[name] = element("div", { role: "alert" });
      return element("div.field", {}, element("label", { for: made.id }, label), made, hint ? element("p.small.soft", {}, hint) : null, this.places[name]);
    }

    build(library) {
      this.texts = library.forms.fit.map((field) => field.name).filter((name) => name !== "leave_out");
      this.form = Object.fromEntries([...library.forms.fit, ...library.forms.arm].map((field) => [field.name, field]));
      this.given = [...this.texts, ...library.forms.arm.map((field) => field.name), "record", "mapping", "entry", "leave_out"];
      this.settings = empty(this.given);
      const card = (title, ...children) => element("section.card", {}, element("h2", {}, title), ...children);
      const hosts = { files: element("ul.files"), columns: element("div"), data: element("div") };
      this.message = element("div", { role: "alert" });
      this.places.files = element("div", { role: "alert" });
      this.places.fit = element("div", { role: "alert" });
      this.fields.hysteresis = element("input", { type: "checkbox", id: "fit-hysteresis" });
      this.fields.hysteresis.addEventListener("change", () => { this.settings.hysteresis = this.fields.hysteresis.checked; this.stateChanged(); });
      this.startButton = element("button.primary", { type: "button", disabled: true, onclick: () => this.start_() }, "Fit and compare all laws");
      this.cancelButton = element("button", { type: "button", hidden: true, onclick: () => this.cancel() }, "Cancel");
      this.bar = element("progress", { max: 1, value: 0, hidden: true, "aria-label": "Progress of the fit" });
      this.progressText = element("p.small", { role: "status" });
      const laws = [["", "none"], ...library.laws.map((law) => [law.name, `${law.name} – ${law.title}`])];
      this.dataCard = card("Measured rows", this.declared("outliers"), hosts.data);
      this.columnsCard = card("Columns", element("p.small.soft", {}, "What each column was read as. Correct the quantity or the unit where it is wrong."), hosts.columns);
      this.resultHost = element("div.stack");
      this.found = element("div");
      this.foundCard = card("What the record contains", this.found);
      this.further = element("details", {}, element("summary", {}, "More on the files"),
        ...this.texts.filter((name) => !SHOWN.includes(name)).map((name) => this.declared(name)));
      this.host.append(element("div.columns", {},
        element("div.stack", {},
          card("Files", this.choice("record", "They are a record of", [["", "a muscle at a test rig"], ["arm", "an arm: episodes of its angles and pressures"]]), airmuscle.dropArea((files) => this.upload(files)), this.message, this.places.files, hosts.files),
          this.muscleCard = card("Muscle", this.declared("resting_length"), this.declared("braid_radius"), this.declared("braid_angle"), this.choice("entry", "Also compare an entry of the library", laws), this.further),
          this.mappingCard = card("Mapping", element("p.small.soft", {}, "What the columns of the episodes are, as in a mapping file (TOML). It is proposed from their names and sizes: check it."), this.mappingField()),
          card("Fit", this.ofMuscle = element("div", {}, this.declared("leave_out"), element("label.row", { for: "fit-hysteresis" }, this.fields.hysteresis, "Friction from both branches (takes longer)")),
            this.ofArm = element("div", {}, ...library.forms.arm.map((field) => this.declared(field.name))),
            this.places.fit, element("div.row", {}, this.startButton, this.cancelButton), this.bar, this.progressText)),
        element("div.stack", {}, this.foundCard, this.columnsCard, this.dataCard, this.resultHost)));
      this.list = new airmuscle.FileList(hosts.files, { remove: (name) => this.remove(name), stated: (name, key, value) => { this.settings.files[name] = { ...this.settings.files[name], [key]: value }; this.read(); } });
      this.columns = new airmuscle.ColumnTable(hosts.columns, (key, value) => { if (value) this.settings.columns[key] = value; else delete this.settings.columns[key]; this.read(); });
      this.data = new airmuscle.FitData(hosts.data, () => { this.settings.rules = this.data.rules; this.read(300); });
      this.places.rules = this.data.problem;
      this.columnsCard.hidden = this.dataCard.hidden = true;
      this.showRecord();
    }

    mappingField() {
      const made = element("textarea", { id: "fit-mapping", rows: 18, spellcheck: false, "aria-label": "Mapping (TOML)" });
      made.addEventListener("change", () => { this.settings.mapping = made.value.trim() ? made.value : ""; this.read(); });
      this.fields.mapping = made;
      this.places.mapping = element("div", { role: "alert" });
      return element("div.field", {}, made, this.places.mapping);
    }

    get arm() { return this.settings.record === "arm"; }

    /* The cards of a muscle, or of an arm. */
    showRecord() {
      for (const part of [this.muscleCard, this.ofMuscle]) part.hidden = this.arm;
      for (const part of [this.mappingCard, this.ofArm]) part.hidden = !this.arm;
      this.foundCard.hidden = !this.arm || !this.sheet?.lines?.length;
      this.fields.record.value = this.settings.record;
      this.startButton.textContent = this.arm ? "Identify the arm" : "Fit and compare all laws";
    }

    async start(library, state) {
      this.build(library);
      if (state && typeof state === "object" && typeof state.set === "string" && state.set) {
        this.restore(state);
        await this.read(0);
        if (this.task) this.follow();
      }
      this.host.dataset.shown = "ready";
    }

    restore(state) {
      const given = state.settings ?? {}, table = (value) => (value && typeof value === "object" && !Array.isArray(value) ? value : {});
      const rules = (Array.isArray(given.rules) ? given.rules : []).filter((rule) => Array.isArray(rule?.recordings) && (Array.isArray(rule.rows) || (rule.ranges && typeof rule.ranges === "object")));
      this.settings = { ...empty(this.given), columns: table(given.columns), files: table(given.files), rules, hysteresis: given.hysteresis === true };
      for (const name of this.given) if (typeof given[name] === "string") this.settings[name] = given[name];
      Object.assign(this, { set: state.set, task: typeof state.task === "string" ? state.task : "", names: [] });
      for (const name of this.given) this.fields[name][this.form[name]?.mark ? "checked" : "value"] = this.form[name]?.mark ? Boolean(this.settings[name]) : this.settings[name];
      this.fields.hysteresis.checked = this.settings.hysteresis;
      this.further.open = this.texts.some((name) => !SHOWN.includes(name) && this.settings[name]);
      this.data.rules = this.settings.rules;
    }

    state() { return this.set ? { set: this.set, task: this.task, settings: this.settings } : {}; }
    sheets() { return []; }

    complain(text) { this.message.replaceChildren(...(text ? [element("p.message.error", {}, text)] : [])); }

    async upload(files) {
      this.complain("");
      const failed = [];
      for (const file of files) {
        const known = this.names.includes(file.name);
        this.host.setAttribute("aria-busy", "true");
        try {
          const answer = await fitSource.upload(this.set, file);
          this.set = answer.set;
          this.names = answer.files;
          if (known) say(`${file.name} was replaced.`);
        } catch (error) {
          failed.push(error.message);
          if (error.status === 404) { this.set = ""; this.names = []; }
        }
      }
      this.host.removeAttribute("aria-busy");
      if (airmuscle.areEpisodes(this.names)) this.settings.record = "arm";
      this.complain(failed.join(" "));
      if (this.set) await this.read(0);
    }

    async remove(name) {
      try { this.names = (await fitSource.remove(this.set, name)).files; } catch (error) { this.complain(error.message); return; }
      delete this.settings.files[name];
      await this.read(0);
    }

    /* What was understood, after a pause; of several requests only the last one takes effect. */
    read(pause = 0) {
      this.stateChanged();
      clearTimeout(this.reading);
      const request = this.request = {};
      return new Promise((resolve) => { this.reading = setTimeout(() => this.readNow(request).then(resolve), pause); });
    }

    async readNow(request) {
      if (!this.set) return;
      this.host.setAttribute("aria-busy", "true");
      this.startButton.disabled = true;
      let sheet = null, problems = [];
      try {
        sheet = await fitSource.read(this.set, this.settings);
        problems = sheet.problems;
      } catch (error) {
        problems = [{ field: error.field ?? "", text: error.message }];
        if (error.status === 404) this.forget();
      }
      if (request !== this.request) return;
      this.host.removeAttribute("aria-busy");
      if (sheet) { this.sheet = sheet; this.names = sheet.files.map((file) => file.name); }
      this.showProblems(problems);
      this.list.show(this.names, this.sheet, this.arm ? null : this.settings.files, this.problems);
      this.showRecord();
      if (this.arm && this.sheet?.lines) {
        airmuscle.showInspection(this.found, this.sheet.lines);
        if (document.activeElement !== this.fields.mapping || !this.settings.mapping) this.fields.mapping.value = this.sheet.mapping;
      }
      const known = Boolean(this.sheet?.files.some((file) => file.columns.length));
      this.columnsCard.hidden = !known;
      this.dataCard.hidden = !this.sheet?.recordings.length;
      if (known) this.columns.show(this.sheet, this.settings.columns, this.problems);
      if (this.sheet?.recordings.length) this.data.show(this.sheet);
      const lengths = [...new Set((this.sheet?.recordings ?? []).map((r) => r.constants.resting_length).filter(Boolean))];
      this.fields.resting_length.placeholder = lengths.length ? `${lengths.slice(0, 3).join(", ")} (stated in the files)` : "300 mm";
      this.ready = Boolean(sheet?.ready);
      this.startButton.disabled = !this.ready || this.running;
      this.host.dataset.read = String(Number(this.host.dataset.read ?? 0) + 1);
    }

    forget() { Object.assign(this, { set: "", names: [], sheet: null, task: "" }); this.stateChanged(); }

    /* Each problem at its field; those of no field are shown at the top. */
    showProblems(problems) {
      this.problems = new Map();
      for (const { field, text } of problems) this.problems.set(field, [...(this.problems.get(field) ?? []), text]);
      for (const [name, place] of Object.entries(this.places)) {
        const made = problemOf(this.problems.get(name));
        place.replaceChildren(...(made ? [made] : []));
        this.fields[name]?.setAttribute("aria-invalid", String(Boolean(made)));
        if (made && this.further.contains(place)) this.further.open = true;
      }
      const own = (field) => field in this.places || field === "columns" || field.startsWith("column:") || (field.startsWith("file:") && this.names.includes(field.slice(5)));
      const rest = problems.filter(({ field }) => !own(field)), lost = (this.sheet ? [] : problems.filter(({ field }) => field.startsWith("column")));
      if (rest.length || lost.length) this.complain([...rest, ...lost].map(({ text }) => text).join(" "));
    }

    async start_() {
      this.showProblems([]);
      if (this.arm) this.settings.mapping = this.fields.mapping.value;  /* as it is seen, also where it was proposed */
      this.startButton.disabled = true;
      try { this.task = (await fitSource.start(this.set, this.settings)).task; } catch (error) {
        this.showProblems([{ field: error.field || "fit", text: error.message }]);
        this.startButton.disabled = false;
        return;
      }
      this.resultHost.replaceChildren();
      this.stateChanged(true);  /* the address leads back to the fit, also if the page is closed now */
      await this.follow();
    }

    async cancel() {
      try { await fitSource.cancel(this.task); } catch (error) { say(error.message); }
    }

    /* Progress of the task until it has ended. */
    async follow() {
      const task = this.task;
      let lost = 0;
      this.running = true;
      this.startButton.disabled = true;
      this.cancelButton.hidden = this.bar.hidden = false;
      delete this.host.dataset.task;
      while (task === this.task) {
        let status;
        try { status = await fitSource.status(task); lost = 0; } catch (error) {
          if (error.status !== 0 || (lost += 1) > 5) { this.ended(error.message, "", error.status === 404 ? "lost" : "failed"); if (error.status === 404) this.task = ""; this.stateChanged(); return; }
          status = null;
        }
        if (status && !["waiting", "running"].includes(status.state)) { await this.finish(task, status); return; }
        if (status) {
          if (status.state === "running") this.bar.value = status.fraction; else this.bar.removeAttribute("value");
          this.progressText.textContent = status.state === "waiting" ? (status.before ? `waiting; ${status.before} other fit${status.before > 1 ? "s" : ""} before this one` : "waiting for a free process") : `${Math.round(100 * status.fraction)} %: ${status.text || "start"}. The page may be closed; its address leads back here.`;
        }
        await new Promise((resolve) => { setTimeout(resolve, PAUSE); });
      }
    }

    async finish(task, status) {
      if (status.state === "cancelled") { this.ended("", "The fit was cancelled.", "cancelled"); return; }
      if (status.state === "failed") { this.ended(status.error, "", "failed", status.field); return; }
      try {
        const result = await fitSource.result(task);
        if (result.arm) airmuscle.showArm(this.resultHost, task, result); else airmuscle.showResult(this.resultHost, task, result);
        this.ended("", "The fit is complete.", "done");
      } catch (error) { this.ended(error.message, "", "failed"); }
    }

    ended(error, text, state, field) {
      this.running = false;
      this.cancelButton.hidden = this.bar.hidden = true;
      this.progressText.textContent = text;
      this.startButton.disabled = !this.ready;
      this.host.dataset.task = state;
      if (error) this.showProblems([{ field: field || "fit", text: error }]);
    }
  }

  if (!source.embedded) Object.assign(airmuscle, { FitTab });
})();
