/* Data of the files as a chart: rows are left out, or kept alone, by dragging, by clicking and by numbers. */
"use strict";

(() => {
  const { element, Scatter, scaleOf, labelOf, rangeOf, shortText, readNumber, GROUP_COLOURS } = airmuscle;
  const REACH = 9;
  const CLICK = 4;

  const isInside = (rule, recording, k, row) => (rule.rows ? row >= rule.rows[0] && row < rule.rows[1]
    : Object.entries(rule.ranges).every(([name, [low, high]]) => { const v = recording.points[name]?.[k]; return v >= low && v <= high; }));

  /* Whether a shown row is used: the rules of the server, for the points of the chart. */
  function isUsed(rules, recording, k, row) {
    return !recording.left_out.includes(row) && rules.every((rule) => (rule.recordings.length && !rule.recordings.includes(recording.origin)) || isInside(rule, recording, k, row) === rule.keep);
  }

  function ruleText(rule) {
    const where = rule.recordings.length === 1 ? `, ${rule.recordings[0]}` : "";
    if (rule.rows) return `${rule.keep ? "kept only" : "left out"}: ${rule.rows[1] - rule.rows[0] === 1 ? `row ${rule.rows[0] + 1}` : `rows ${rule.rows[0] + 1} to ${rule.rows[1]}`}${where}`;
    const parts = Object.entries(rule.ranges).map(([name, [low, high]]) => `${name} ${shortText(low * scaleOf(name)[0])} to ${shortText(high * scaleOf(name)[0])} ${scaleOf(name)[1]}`);
    return `${rule.keep ? "kept only" : "left out"}: ${parts.join(", ")}${where}`;
  }

  class FitData {
    constructor(host, changed) {
      this.changed = changed;
      this.rules = [];
      this.axes = { x: "contraction", y: "force" };
      const select = (name, label) => {
        const made = element("select", { "aria-label": label });
        made.addEventListener("change", () => { this.axes[name] = made.value; this.draw(); });
        return made;
      };
      this.xSelect = select("x", "Horizontal axis");
      this.ySelect = select("y", "Vertical axis");
      this.file = element("select", { "aria-label": "Recordings in the chart" });
      this.file.addEventListener("change", () => this.draw());
      this.mode = element("select", { "aria-label": "Effect of a selection" }, element("option", { value: "out" }, "leave out"), element("option", { value: "keep" }, "keep only"));
      this.chartHost = element("div", { tabindex: "0", role: "group", "aria-label": "Measured rows; drag to select rows, click to leave one out" });
      this.legend = element("div.row.small.soft");
      this.low = element("input", { type: "text", inputmode: "decimal", "aria-label": "Selection from" });
      this.high = element("input", { type: "text", inputmode: "decimal", "aria-label": "Selection to" });
      this.unit = element("span");
      this.list = element("ul.rules");
      this.problem = element("p", { role: "alert" });
      this.runs = element("details");
      this.outliers = element("div.row.small");
      host.append(
        element("div.row.small", {}, element("span", {}, "Show"), this.ySelect, element("span", {}, "over"), this.xSelect, element("span", {}, "of"), this.file),
        this.chartHost, this.legend,
        element("div.row.small", {}, element("span", {}, "Drag in the chart, or give limits, to"), this.mode, this.low, element("span", {}, "to"), this.high, this.unit,
          element("button", { type: "button", onclick: () => this.byNumbers() }, "Apply")),
        element("p.small.soft", {}, "A click on a point leaves out its row, or takes it back."),
        this.problem, this.outliers, this.list, this.runs);
      this.scatter = new Scatter(this.chartHost, "Measured rows", (width) => Math.min(420, Math.max(240, 0.55 * width)));
      this.chartHost.addEventListener("pointerdown", (event) => this.begin(event));
    }

    show(sheet) {
      this.sheet = sheet;
      const names = ["contraction", "length", "pressure", "force", "time"].filter((name) => sheet.recordings.some((r) => r.points[name]));
      for (const [axis, made] of [["x", this.xSelect], ["y", this.ySelect]]) {
        made.replaceChildren(...names.map((name) => element("option", { value: name }, name)));
        if (!names.includes(this.axes[axis])) this.axes[axis] = axis === "x" ? names.find((n) => n !== "force") ?? names[0] : names.find((n) => n === "force") ?? names.at(-1);
        made.value = this.axes[axis];
      }
      if (!this.chosenAxes && sheet.recordings.length) { this.axes.x = this.xSelect.value = usualAxis(sheet, names); this.chosenAxes = true; }
      const before = this.file.value, origins = sheet.recordings.map((r) => r.origin);
      this.file.replaceChildren(element("option", { value: "" }, origins.length === 1 ? origins[0] : `all ${origins.length} recordings`), ...(origins.length > 1 ? origins.map((o) => element("option", { value: o }, o)) : []));
      this.file.value = origins.includes(before) && origins.length > 1 ? before : "";
      this.showRuns();
      this.draw();
    }

    /* Points of the chart with their rows. */
    collect() {
      const points = { x: [], y: [], group: [], off: [], rows: [] }, [fx] = scaleOf(this.axes.x), [fy] = scaleOf(this.axes.y);
      const shown = this.sheet.recordings.filter((r) => !this.file.value || r.origin === this.file.value), single = shown.length === 1;
      shown.forEach((recording, g) => {
        const x = recording.points[this.axes.x], y = recording.points[this.axes.y];
        if (!x || !y) return;
        const runs = (recording.runs ?? []);
        let r = 0;
        for (let k = 0; k < x.length; k++) {
          const row = k * this.sheet.step;
          while (r < runs.length - 1 && row >= runs[r].rows[1]) r++;
          points.x.push(x[k] * fx);
          points.y.push(y[k] * fy);
          points.group.push(single ? r : g);
          points.off.push(!isUsed(this.rules, recording, k, row));
          points.rows.push([recording.origin, row]);
        }
      });
      const labels = single ? (shown[0]?.runs ?? []).map((run) => run.level || run.kind) : shown.map((r) => r.origin);
      return { points, labels };
    }

    draw() {
      if (!this.sheet) return;
      const { points, labels } = this.collect();
      this.points = points;
      this.unit.textContent = `${scaleOf(this.axes.x)[1]} (${this.axes.x})`;
      this.scatter.show({ x: labelOf(this.axes.x), y: labelOf(this.axes.y), points });
      const used = points.off.filter((off) => !off).length;
      this.legend.replaceChildren(...[
        ...(labels.length > 1 ? labels.slice(0, 6).map((label, g) => element("span.row", {}, element(`span.dot.${GROUP_COLOURS[g]}`), label)) : []),
        labels.length > 6 ? element("span", {}, `and ${labels.length - 6} more, in the same colours`) : null,
        element("span", {}, `${used} of ${points.x.length} shown rows are used${this.sheet.step > 1 ? `; one row in ${this.sheet.step} is shown` : ""}.`)].filter(Boolean));
      this.list.replaceChildren(...this.rules.map((rule, i) => element("li", {}, element("span", {}, ruleText(rule)),
        element("button", { type: "button", "aria-label": `Remove: ${ruleText(rule)}`, onclick: () => { this.rules.splice(i, 1); this.ruled(); } }, "×"))));
      if (this.rules.length > 1) this.list.append(element("li", {}, element("button", { type: "button", onclick: () => { this.rules = []; this.ruled(); } }, "Use all rows")));
    }

    ruled() { this.showRuns(); this.draw(); this.changed(); }

    add(rule) {
      if (this.rules.length >= 200) { airmuscle.say("At most 200 selections are possible; remove some."); return; }
      this.rules.push(rule);
      this.ruled();
    }

    get origins() { return this.file.value ? [this.file.value] : this.sheet.recordings.map((r) => r.origin).length === 1 ? [this.sheet.recordings[0].origin] : []; }

    byNumbers() {
      const [factor] = scaleOf(this.axes.x), low = readNumber(this.low.value), high = readNumber(this.high.value), valid = low <= high;
      for (const field of [this.low, this.high]) field.setAttribute("aria-invalid", String(!valid));
      if (!valid) { airmuscle.say(`Give two numbers, the smaller one first, in ${scaleOf(this.axes.x)[1]}.`); return; }
      this.add({ recordings: this.origins, ranges: { [this.axes.x]: [low / factor, high / factor] }, keep: this.mode.value === "keep" });
    }

    begin(event) {
      if (!this.points || event.button) return;
      event.preventDefault();
      this.chartHost.setPointerCapture(event.pointerId);
      const chart = this.scatter.chart, from = chart.valuesAt(event), start = [event.clientX, event.clientY], content = this.scatter.content;
      const rectangle = (to) => ({ x: [from.x, to.x].sort((a, b) => a - b), y: this.axes.x === "time" ? null : [from.y, to.y].sort((a, b) => a - b) });
      const move = (e) => { content.rectangle = rectangle(chart.valuesAt(e)); this.scatter.redraw(); };
      const end = (e) => {
        for (const [name, listener] of [["pointermove", move], ["pointerup", end], ["pointercancel", end]]) this.chartHost.removeEventListener(name, listener);
        content.rectangle = null;
        if (e.type === "pointercancel") { this.scatter.redraw(); return; }
        if (Math.hypot(e.clientX - start[0], e.clientY - start[1]) < CLICK) this.toggle(chart, from); else this.select(rectangle(chart.valuesAt(e)));
      };
      for (const [name, listener] of [["pointermove", move], ["pointerup", end], ["pointercancel", end]]) this.chartHost.addEventListener(name, listener);
    }

    select({ x, y }) {
      const [fx] = scaleOf(this.axes.x), [fy] = scaleOf(this.axes.y), ranges = { [this.axes.x]: x.map((v) => v / fx) };
      if (y && this.axes.y !== this.axes.x) ranges[this.axes.y] = y.map((v) => v / fy);
      this.add({ recordings: this.origins, ranges, keep: this.mode.value === "keep" });
    }

    /* Leave out the row of the nearest point, or take it back. */
    toggle(chart, at) {
      let best = -1, least = REACH;
      for (let i = 0; i < this.points.x.length; i++) {
        const distance = Math.hypot(chart.px(this.points.x[i]) - chart.px(at.x), chart.py(this.points.y[i]) - chart.py(at.y));
        if (distance < least) { least = distance; best = i; }
      }
      if (best < 0) { this.scatter.redraw(); return; }
      const [origin, row] = this.points.rows[best], same = this.rules.findIndex((r) => !r.keep && r.rows && r.rows[0] === row && r.rows[1] === row + 1 && r.recordings[0] === origin);
      if (same >= 0) { this.rules.splice(same, 1); this.ruled(); } else this.add({ recordings: [origin], rows: [row, row + 1], keep: false });
    }

    showRuns() {
      const rows = this.sheet.recordings.flatMap((recording) => (recording.runs ?? []).map((run) => {
        const same = (r) => !r.keep && r.rows && r.rows[0] === run.rows[0] && r.rows[1] === run.rows[1] && r.recordings[0] === recording.origin;
        const box = element("input", { type: "checkbox", checked: !this.rules.some(same), "aria-label": `Use ${run.kind} ${run.level}, ${recording.origin}, rows ${run.rows[0] + 1} to ${run.rows[1]}` });
        box.addEventListener("change", () => { if (box.checked) { this.rules = this.rules.filter((r) => !same(r)); this.ruled(); } else this.add({ recordings: [recording.origin], rows: run.rows, keep: false }); });
        return element("tr", {}, element("td", {}, box), element("td", {}, recording.origin), element("td", {}, `${run.kind}${run.level ? ` at ${run.level}` : ""}`), element("td", {}, `${run.rows[0] + 1} to ${run.rows[1]}`));
      }));
      const open = this.runs.open, total = this.sheet.recordings.reduce((n, r) => n + (r.run_count ?? 0), 0);
      this.runs.replaceChildren(element("summary", {}, `Runs (${total})`), element("div.scroll", {}, element("table", {}, element("thead", {}, element("tr", {}, ...["Use", "Recording", "Run", "Rows"].map((t) => element("th", { scope: "col" }, t)))), element("tbody", {}, ...rows))));
      this.runs.open = open;
      const count = this.sheet.recordings.reduce((n, r) => n + (r.outliers ?? 0), 0);
      this.outliers.textContent = count ? `${count} row${count > 1 ? "s" : ""} with suspected outliers: readings that contradict their neighbours in time.` : "";
    }
  }

  /* Pressure for isometric runs, otherwise the contraction. */
  function usualAxis(sheet, names) {
    const kinds = sheet.recordings.flatMap((r) => (r.runs ?? []).map((run) => run.kind)), isometric = kinds.filter((k) => k === "isometric").length > kinds.length / 2;
    return isometric && names.includes("pressure") ? "pressure" : names.includes("contraction") ? "contraction" : names.includes("length") ? "length" : names[0];
  }

  Object.assign(airmuscle, { FitData, rangeOf });
})();
