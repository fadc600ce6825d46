/* Tab Size: muscles of the catalogue for a lift, a joint or a gripper, ranked by the server, with the chart of one of them. */
"use strict";

(() => {
  const { element, chapterTable, complain, source, say, download, shortText, Chart } = airmuscle;
  const COLUMNS = ["muscle", "number", "nominal length [mm]", "pressure, short [bar]", "contraction, short [%]", "reserve [%]"];

  const KINDS = ["lift", "joint", "gripper"];

  class SizeTab {
    constructor(host, stateChanged) {
      Object.assign(this, { host, stateChanged, kind: "lift", chosen: 0, fields: {} });
    }

    build(form) {
      const card = (title, order, ...children) => element(`section.card${order}`, {}, element("h2", {}, title), ...children);
      const field = ({ name, label, filled, hint }) => {
        const input = this.fields[name] = element("input", { type: "text", id: `size-${name}`, value: filled, autocomplete: "off", "aria-describedby": hint ? `size-${name}-hint` : null });
        input.addEventListener("input", () => this.stateChanged());
        return element("div.quantity", {}, element("label", { for: `size-${name}` }, label), input, hint ? element("span.small.soft", { id: `size-${name}-hint` }, hint) : null);
      };
      this.kinds = KINDS.map((kind) => element("button", { type: "button", onclick: () => this.setKind(kind) }, kind[0].toUpperCase() + kind.slice(1)));
      this.groups = Object.fromEntries(KINDS.map((kind) => [kind, element("div.stack.tight", {}, ...form[kind].map(field))]));
      const { label, offered } = form.all.find(({ name }) => name === "sort");
      this.sort = element("select", { id: "size-sort" }, ...offered.map(([value, text]) => element("option", { value }, text)));
      this.sort.addEventListener("change", () => this.stateChanged());
      this.message = element("p", { role: "alert" });
      this.go = element("button.primary", { type: "submit" }, "Find muscles");
      this.form = element("form", { novalidate: true }, element("div.row", { role: "group", "aria-label": "Task" }, ...this.kinds), ...Object.values(this.groups), element("div.stack.tight", {}, ...form.all.filter(({ name }) => name !== "sort").map(field), element("div.quantity", {}, element("label", { for: "size-sort" }, label), this.sort)), element("div.row", {}, this.go), this.message);
      this.form.addEventListener("submit", (event) => { event.preventDefault(); this.find(); });
      this.summary = element("p");
      this.table = element("div");
      this.further = element("div");
      this.unsuitable = element("div");
      this.caption = element("p.small");
      const chart = element("div"), button = (text, action) => element("button", { type: "button", onclick: () => this.sheet && action() }, text);
      this.scenario = button("Scenario (TOML)", () => this.saveScenario());
      this.host.append(element("div.columns", {},
        element("div.stack", {}, card("Requirement", ".first", this.form)),
        this.results = element("div.stack.second", { hidden: true },
          card("Muscles, best first", ".early", this.summary, this.table, this.further, element("div.row", {}, element("span.small.soft", {}, "Download"), button("CSV", () => download("sizing.csv", this.sheet.csv, "text/csv")))),
          card("Working points", ".early", this.caption, chart, element("div.row", {}, element("span.small.soft", {}, "Download"), this.scenario)),
          card("Unsuitable muscles", ".late", this.unsuitable))));
      this.chart = new Chart(chart, { label: "Force over contraction of one muscle, with its capacity, the load and both working points", x: "contraction [%]", y: "force [N]", height: (width) => Math.round(Math.min(460, Math.max(280, 0.56 * width))), overlay: (...drawing) => this.overlay(...drawing) });
      this.setKind("lift");
    }

    async start(library, state) {
      this.wanted = state ?? {};
      this.declared = library.forms.size;
      if (!this.declared) { this.host.replaceChildren(element("p.message", {}, "This page contains no sizing.")); return; }
      this.build(this.declared);
      for (const [name, value] of Object.entries(this.wanted.fields ?? {})) if (this.fields[name] && typeof value === "string") this.fields[name].value = value.slice(0, 60);
      if ([...this.sort.options].some(({ value }) => value === this.wanted.sort)) this.sort.value = this.wanted.sort;
      this.setKind(KINDS.includes(this.wanted.kind) ? this.wanted.kind : "lift");
      this.chosen = Number.isInteger(this.wanted.chosen) ? this.wanted.chosen : 0;
      this.pending = true;
      if (!source.embedded) return;
      this.go.disabled = true;
      this.message.textContent = "A saved page shows the sizing that was on the screen; airmuscle studio finds others.";
    }

    visible(seen) {
      if (!seen || !this.pending) return;
      this.pending = false;
      this.find(this.chosen);
    }

    setKind(kind) {
      this.kind = kind;
      this.kinds.forEach((button, i) => button.setAttribute("aria-pressed", String(kind === KINDS[i])));
      for (const [name, group] of Object.entries(this.groups)) group.hidden = name !== kind;
      this.stateChanged();
    }

    request() {
      const names = [...this.declared[this.kind], ...this.declared.all].map(({ name }) => name).filter((name) => this.fields[name]);
      return JSON.stringify({ ...Object.fromEntries(names.map((name) => [name, this.fields[name].value])), sort: this.sort.value });
    }

    async find(chosen = 0) {
      const request = this.asked = {};
      if (!source.embedded) complain(this.message, "");
      this.host.setAttribute("aria-busy", "true");
      this.go.textContent = "Searching …";
      try {
        const sheet = source.embedded ? source.embedded.sheets.find((s) => s.tab === "size") : await source.sizing(this.request());
        if (request === this.asked) this.show(sheet, chosen);
      } catch (error) { if (request === this.asked) { complain(this.message, error.message); this.results.hidden = true; this.sheet = null; } }
      if (request !== this.asked) return;
      this.host.removeAttribute("aria-busy");
      this.go.textContent = "Find muscles";
    }

    show(sheet, chosen) {
      this.sheet = sheet;
      this.results.hidden = false;
      const { products, choices, unsuitable, ...others } = sheet.tables, table = chapterTable({ ...choices, rows: choices.rows.slice(0, sheet.choices.length) }, { columns: COLUMNS, choose: (i) => this.choose(i) });
      table.classList.add("choices");
      this.rows = [...table.querySelectorAll("tbody tr")];
      this.summary.textContent = sheet.paragraphs.join(" ");
      this.table.replaceChildren(chapterTable(products), element("p.small.soft", {}, products.note), element("h3", {}, "End points"), table);
      this.further.replaceChildren(...Object.values(others).map((each) => element("details", {}, element("summary", {}, each.title), chapterTable(each), each.note ? element("p.small.soft", {}, each.note) : null)));
      this.unsuitable.replaceChildren(unsuitable ? chapterTable(unsuitable) : element("p.small", {}, "None."));
      this.choose(Math.min(Math.max(0, chosen), sheet.choices.length - 1));
      this.host.dataset.shown = `${sheet.title}, ${sheet.request.sort}`;
    }

    choose(index) {
      this.chosen = index;
      const choice = this.sheet.choices[index], { chart } = choice;
      this.rows.forEach((line, i) => { line.classList.toggle("active", i === index); line.querySelector("button").setAttribute("aria-pressed", String(i === index)); });
      const [first, last] = chart.points, range = (a, b, factor, unit) => { const [from, to] = [a, b].map((v) => shortText(Math.abs(v) < 1e-6 ? 0 : v * factor, 3)); return from === to ? `${to} ${unit}` : `${from} to ${to} ${unit}`; };
      this.caption.replaceChildren(element("strong", {}, `${choice.label}: `), `${this.sheet.title}. One muscle works at ${range(first.pressure, last.pressure, 1e-5, "bar")}, ${range(first.contraction, last.contraction, 100, "%")}, ${range(first.force, last.force, 1, "N")}.`);
      this.scenario.disabled = !choice.scenario;
      this.scenario.title = choice.reason;
      this.draw(chart);
      this.stateChanged();
    }

    draw(chart) {
      const percent = chart.contractions.map((c) => 100 * c), on = (rows) => percent.map((x) => at(rows.contractions.map((c) => 100 * c), rows.forces, x));
      const top = 1.12 * Math.max(...chart.capacity.forces, ...chart.points.map((p) => p.force), ...(chart.load ? chart.load.forces.map((f) => f * chart.load.factor) : [])), low = Math.min(...percent.filter((c, i) => c >= 100 * chart.capacity.contractions[0] - 3));
      const clip = (rows) => rows.map((f) => (f === null || f > 3 * top || f < -0.2 * top ? null : f));
      const curves = chart.forces.map((values, k) => ({ values: clip(values), colour: "soft", dash: [], width: 1.1, label: `${shortText(chart.pressures[k] / 1e5)} bar` }));
      curves.push({ values: on(chart.capacity), colour: "ink", dash: [], width: 2.4, label: "capacity" });
      this.shown = chart;
      this.curves = curves;
      const right = Math.max(100 * chart.capacity.contractions.at(-1), ...chart.points.map((p) => 100 * p.contraction)) + 1.5;
      this.chart.show(curves, percent, { x: [low, right], y: [0, top] });
    }

    overlay(chart, ctx, box) {
      const { shown } = this;
      if (!shown) return;
      const line = (rows, factor, dash) => { ctx.setLineDash(dash); ctx.strokeStyle = chart.colours.c2; ctx.lineWidth = dash.length ? 1.6 : 2.6; ctx.beginPath(); rows.contractions.forEach((c, i) => ctx.lineTo(chart.px(100 * c), chart.py(factor * rows.forces[i]))); ctx.stroke(); ctx.setLineDash([]); };
      const placed = [];
      shown.pressures.forEach((p, k) => {
        const values = this.curves[k].values, i = values.findIndex((f, n) => f !== null && f < 0.97 * chart.ranges.y[1] && f > 0 && 100 * shown.contractions[n] >= chart.ranges.x[0]);
        if (i < 0 || !(p > 0)) return;
        const x = Math.max(box.left + 4, chart.px(100 * shown.contractions[i]) + 4), y = Math.max(box.top + 14, chart.py(values[i]) - 4);
        if (placed.some((other) => Math.abs(other.x - x) < 46 && Math.abs(other.y - y) < 15)) return;
        placed.push({ x, y });
        chart.write(ctx, `${shortText(p / 1e5)} bar`, x, y, chart.colours.soft);
      });
      if (shown.load) { line(shown.load, 1, []); line(shown.load, shown.load.factor, [7, 5]); }
      const { contractions, forces } = shown.capacity, near = Math.floor(0.25 * forces.length);
      chart.write(ctx, "capacity", chart.px(100 * contractions[near]) + 8, chart.py(forces[near]) - 8, chart.colours.ink);
      if (shown.load) { const { contractions: c, forces: f, factor } = shown.load; chart.write(ctx, "load", chart.px(100 * c[8]), chart.py(f[8]) + 18, chart.colours.ink); chart.write(ctx, `load × ${shortText(factor, 3)}`, chart.px(100 * c[8]), chart.py(factor * f[8]) - 8, chart.colours.ink); }
      shown.points.forEach((p, k) => {
        const x = chart.px(100 * p.contraction), y = chart.py(p.force), right = x > box.left + 0.7 * box.width;
        ctx.beginPath(); if (k) ctx.rect(x - 6, y - 6, 12, 12); else ctx.arc(x, y, 7, 0, 2 * Math.PI);
        ctx.fillStyle = chart.colours.card; ctx.fill(); ctx.lineWidth = 3; ctx.strokeStyle = chart.colours.c2; ctx.stroke();
        const name = shown.load ? ["start", "end"][k] : ["extended", "contracted"][k];
        chart.write(ctx, box.width < 420 ? name : `${name}: ${shortText(p.pressure / 1e5, 3)} bar`, x + (right ? -12 : 12), y - 12, chart.colours.ink, right ? "right" : "left");
      });
    }

    saveScenario() {
      const choice = this.sheet.choices[this.chosen];
      if (choice.scenario) download(`${choice.name}.toml`, choice.scenario, "application/toml"); else say(choice.reason);
    }

    state() {
      return { kind: this.kind, fields: Object.fromEntries(Object.entries(this.fields).map(([name, input]) => [name, input.value])), sort: this.sort?.value, chosen: this.chosen };
    }

    sheets() { return this.sheet ? [this.sheet.id] : []; }
  }

  /* Linear interpolation; null outside. */
  function at(grid, values, x) {
    if (x < grid[0] - 1e-9 || x > grid.at(-1) + 1e-9) return null;
    for (let i = 1; i < grid.length; i++) if (x <= grid[i] + 1e-9) return values[i - 1] + (x - grid[i - 1]) / (grid[i] - grid[i - 1]) * (values[i] - values[i - 1]);
    return null;
  }

  Object.assign(airmuscle, { SizeTab });
})();
