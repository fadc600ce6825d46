/* Files of a fit and their columns: what was understood, and corrections by hand. */
"use strict";

(() => {
  const { element, shortText } = airmuscle;
  const QUANTITIES = ["time", "pressure", "contraction", "length", "shortening", "elongation", "force", "position", "branch", "volume", "temperature", "speed", "angle", "resting_length", "ambient"];
  const MOST = 12;  /* files of an arm that are listed */
  const SPECIAL = { resting_length: "resting length (constant)", ambient: "ambient pressure (constant)" };

  const problemOf = (texts) => (texts?.length ? element("p.message.error", {}, texts.join(" ")) : null);

  /* Area in which files are dropped or chosen. */
  function dropArea(receive) {
    const choose = element("input", { type: "file", multiple: true, "aria-label": "Measurement files" });
    choose.addEventListener("change", async () => { const files = [...choose.files]; choose.value = ""; await receive(files); });
    const drop = element("div.drop", {}, element("p", {}, "Drop measurement files here, or choose them:"), choose,
      element("p.small.soft", {}, "A muscle: CSV, Excel, MAT, TDMS, MDF, Parquet, HDF5 and others with pressure, length or contraction, and force. An arm: its episodes, a folder, a ZIP archive or one file (NPZ, CSV, JSON, HDF5, Parquet). They stay on the machine of the server."));
    for (const name of ["dragenter", "dragover"]) drop.addEventListener(name, (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", async (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      await receive(await airmuscle.droppedFiles(event.dataTransfer));
    });
    return drop;
  }

  class FileList {
    constructor(host, { remove, stated }) { Object.assign(this, { host, remove, stated }); }

    /* names: of the files on the server; sheet: what was understood, or null; facts: what the user states for each file, null for episodes */
    show(names, sheet, facts, problems) {
      const kept = document.activeElement?.dataset?.fact;
      const shown = facts ? names : names.slice(0, MOST), further = names.length - shown.length;
      this.host.replaceChildren(...shown.map((name) => this.item(name, sheet, facts?.[name] ?? {}, problems.get(`file:${name}`), facts !== null)));
      if (further) this.host.append(element("li.file.small.soft", {}, `and ${further} more`));
      if (kept) [...this.host.querySelectorAll("[data-fact]")].find((field) => field.dataset.fact === kept)?.focus();
    }

    item(name, sheet, facts, problems, muscle) {
      const read = sheet?.recordings.filter((r) => r.file === name) ?? [];
      const field = (key, label, example) => {
        const made = element("input", { type: "text", value: facts[key] ?? "", placeholder: example, "aria-label": `${label} of ${name}`, "data-fact": `${name} ${key}`, autocomplete: "off" });
        made.addEventListener("change", () => this.stated(name, key, made.value.trim()));
        return element("label.small", {}, label, made);
      };
      const own = element("details", { open: Object.values(facts).some(Boolean) || Boolean(problems) }, element("summary.small", {}, "Facts of this file alone"),
        element("div.facts-of-file", {}, field("resting_length", "Resting length", "300 mm"), field("length", "Held length", "285 mm"), field("specimen", "Specimen", "A")));
      return element("li.file", {},
        element("div.row", {}, element("strong.grow", {}, name), element("button", { type: "button", "aria-label": `Remove ${name}`, onclick: () => this.remove(name) }, "×")),
        ...read.map((recording) => this.recording(recording, read.length > 1)), problemOf(problems), muscle ? own : null);
    }

    recording(recording, several) {
      const kinds = [...new Set((recording.runs ?? []).map((run) => run.kind))].join(", "), count = recording.run_count ?? 0;
      const parts = [`${recording.rows} rows`, count ? `${count} run${count > 1 ? "s" : ""} (${kinds})` : "", recording.branches ? `${recording.branches} branches` : "",
        recording.sampling ? `${shortText(recording.sampling.rate)} rows per second` : "no time", ...Object.entries(recording.constants).map(([key, value]) => `${key.replaceAll("_", " ")} ${value}`)].filter(Boolean);
      const serious = (recording.findings ?? []).filter((f) => f.serious), notes = [...(recording.findings ?? []).filter((f) => !f.serious).map((f) => f.text), ...recording.notes];
      return element("div.small", {}, element("p", {}, several ? `${recording.origin}: ` : "", parts.join(" · ")),
        ...serious.map((f) => element("p.message.error", {}, f.text)),
        notes.length ? element("details", {}, element("summary", {}, `${notes.length} note${notes.length > 1 ? "s" : ""}`), element("ul", {}, ...notes.map((text) => element("li", {}, text)))) : null);
    }
  }

  /* Columns of all files by their key; the same heading in several files is one row. */
  function columnsOf(sheet) {
    const found = new Map();
    for (const file of sheet.files) for (const column of file.columns) {
      const row = found.get(column.key) ?? { ...column, files: 0, low: Infinity, high: -Infinity };
      row.files += 1;
      for (const recording of sheet.recordings.filter((r) => r.file === file.name)) {
        const range = recording.ranges[column.quantity || column.heading];
        row.constant ??= recording.constants[column.quantity];
        if (range) { row.low = Math.min(row.low, range[0]); row.high = Math.max(row.high, range[1]); }
      }
      found.set(column.key, row);
    }
    return [...found.values()];
  }

  class ColumnTable {
    constructor(host, corrected) { Object.assign(this, { host, corrected }); }

    show(sheet, corrections, problems) {
      const kept = document.activeElement?.dataset?.column, columns = columnsOf(sheet), count = sheet.files.length;
      const body = columns.flatMap((column) => {
        const texts = problems.get(`column:${column.key}`), label = column.heading || `column ${column.key}`;
        const select = element("select", { "aria-label": `Quantity of ${label}`, "data-column": `${column.key} quantity`, "aria-invalid": texts ? "true" : null });
        const known = column.used ? column.quantity : "-", options = [["", "no known quantity"], ["-", "not used"], ...QUANTITIES.map((q) => [q, SPECIAL[q] ?? q])];
        if (known && !options.some(([value]) => value === known)) options.push([known, known]);
        select.replaceChildren(...options.map(([value, text]) => element("option", { value, selected: value === known }, text)));
        const unit = element("input", { type: "text", value: column.used ? column.unit : "", size: 7, disabled: !column.used || !column.quantity, "aria-label": `Unit of ${label}`, "data-column": `${column.key} unit`, "aria-invalid": texts ? "true" : null, autocomplete: "off" });
        const changed = () => this.corrected(column.key, select.value === "" ? null : { quantity: select.value === "-" ? "" : select.value, unit: unit.value.trim() });
        select.addEventListener("change", () => { if (select.value !== column.quantity) unit.value = ""; changed(); });
        unit.addEventListener("change", changed);
        const range = Number.isFinite(column.low) ? `${shortText(column.low)} to ${shortText(column.high)} ${column.shown_unit === "-" ? "" : column.shown_unit}` : column.constant ?? "–";
        const heading = element("td", {}, element("strong", {}, label), count > 1 && column.files < count ? element("span.soft", {}, ` in ${column.files} of ${count} files`) : null,
          column.key in corrections ? element("button.link", { type: "button", onclick: () => this.corrected(column.key, null) }, "as in the file") : null);
        return [element("tr", {}, heading, element("td", {}, select), element("td", {}, unit), element("td.number", {}, range)), texts ? element("tr", {}, element("td", { colspan: 4 }, problemOf(texts))) : null].filter(Boolean);
      });
      const table = element("table.columns-table", {}, element("thead", {}, element("tr", {}, ...["Column in the file", "Quantity", "Unit", "Range"].map((text) => element("th", { scope: "col" }, text)))), element("tbody", {}, ...body));
      this.host.replaceChildren(...[problemOf(problems.get("columns")), element("div.scroll", {}, table), ...sheet.remarks.map((text) => element("p.message", {}, text))].filter(Boolean));
      if (kept) [...this.host.querySelectorAll("[data-column]")].find((field) => field.dataset.column === kept)?.focus();
    }
  }

  Object.assign(airmuscle, { dropArea, FileList, ColumnTable, problemOf });
})();
