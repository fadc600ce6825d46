/* Elements of the page. Texts of files and users enter as text nodes only. */
"use strict";

(() => {
  /* element("button.primary", {type: "button", onclick: f}, "text", child, ...) */
  function element(kind, attributes = {}, ...children) {
    const [tag, ...classes] = kind.split("."), made = document.createElement(tag);
    if (classes.length) made.className = classes.join(" ");
    setAttributes(made, attributes);
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  }

  function setAttributes(made, attributes) {
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
      else if (value === true) made.setAttribute(name, "");
      else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
    }
    return made;
  }

  function svg(tag, attributes = {}, ...children) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    setAttributes(made, attributes);
    made.append(...children);
    return made;
  }

  const GREEK = {
    alpha: "α", beta: "β", gamma: "γ", delta: "δ", eps: "ε", epsilon: "ε", zeta: "ζ", eta: "η", theta: "θ", kappa: "κ", lambda: "λ", mu: "μ",
    nu: "ν", xi: "ξ", rho: "ρ", sigma: "σ", tau: "τ", phi: "φ", chi: "χ", psi: "ψ", omega: "ω", Delta: "Δ", Phi: "Φ", Psi: "Ψ", Omega: "Ω",
  };

  /* A symbol as it is printed: theta_0 becomes θ with the index 0. */
  function symbolNode(text) {
    const [name, ...index] = text.split("_"), greek = (word) => GREEK[word] ?? word;
    return element("span.symbol", {}, greek(name), index.length ? element("sub", {}, index.map(greek).join(" ")) : null);
  }

  /* Shows what is wrong in `place`, or nothing; the field that it concerns is marked. */
  function complain(place, text, field) {
    place.textContent = text;
    place.className = text ? "message error" : "";
    if (field) field.setAttribute("aria-invalid", String(Boolean(text)));
  }

  /* What is wrong with the text of a field in which a number in a unit is expected. */
  function noNumber(text, unit) {
    const wanted = `a number${unit ? ` in ${unit}, without the unit` : ""}`;
    return text.trim() ? `“${text.trim().slice(0, 40)}” is no number; write ${wanted}.` : `The field is empty; write ${wanted}.`;
  }

  let clearing = 0;
  function say(text) {
    const status = document.getElementById("status");
    status.textContent = text;
    clearTimeout(clearing);
    clearing = setTimeout(() => { status.textContent = ""; }, 6000);
  }

  function download(name, content, type) {
    const blob = content instanceof Blob ? content : new Blob([content], { type });
    const address = URL.createObjectURL(blob), link = element("a", { href: address, download: name });
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }

  /* Colour of the theme: "ink", "c1", ... */
  function colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); }

  /* Calls `draw` once per frame, however often it was requested. */
  function oncePerFrame(draw) {
    let requested = false;
    return () => {
      if (requested) return;
      requested = true;
      requestAnimationFrame(() => { requested = false; draw(); });
    };
  }

  /* A field in which a file may be dropped, chosen or pasted as text. */
  function textField(label, button, receive, { what = "TOML file", accept = ".toml,text/plain", example = label } = {}) {
    const area = element("textarea", { "aria-label": label, spellcheck: "false", placeholder: example });
    const choose = element("input", { type: "file", accept, "aria-label": `${label}: choose a file` });
    const message = element("p", { role: "alert" });
    const send = async (text) => {
      complain(message, "");
      try { await receive(text); area.value = text; } catch (error) { complain(message, error.message); }
    };
    choose.addEventListener("change", async () => { if (choose.files.length) { await readFile(choose.files[0], area, send); choose.value = ""; } });
    const drop = element("div.drop", {}, element("p.small", {}, `Drop a ${what} here, choose one, or paste its text below.`), choose);
    drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", async (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      if (event.dataTransfer.files.length) await readFile(event.dataTransfer.files[0], area, send);
    });
    return element("div.stack", {}, drop, area, element("div.row", {}, element("button", { type: "button", onclick: () => send(area.value) }, button)), message);
  }

  async function readFile(file, area, send) {
    if (file.size > 65536) { await send("").catch(() => {}); say(`${file.name} has ${Math.ceil(file.size / 1024)} kB; at most 64 kB are allowed.`); return; }
    area.value = await file.text();
    await send(area.value);
  }

  /* A table of a chapter. `columns` are the texts of the headings that are shown, by default all; with `choose(i)` the first cell of each row is a button; `chosen` is the text of the first cell of a row that is marked. */
  function chapterTable(table, { columns = null, choose = null, chosen = null, label = "" } = {}) {
    const shown = table.headings.map((heading, i) => ({ ...heading, i })).filter(({ text }) => !columns || columns.includes(text));
    const cell = (row, { text, number, i }, k, n) => element(number ? "td.number" : "td", {}, k === 0 && choose ? element("button.name", { type: "button", onclick: () => choose(n) }, row[i]) : text === "symbol" ? symbolNode(row[i]) : row[i]);
    const rows = table.rows.map((row, n) => element(row[shown[0].i] === chosen ? "tr.chosen-row" : "tr", {}, ...shown.map((heading, k) => cell(row, heading, k, n))));
    return element("div.scroll", { tabindex: "0", role: "group", "aria-label": label || table.title }, element("table", {}, element("thead", {}, element("tr", {}, ...shown.map(({ text, number }) => element(number ? "th.number" : "th", { scope: "col" }, text)))), element("tbody", {}, ...rows)));
  }

  Object.assign(airmuscle, { element, symbolNode, chapterTable, svg, complain, noNumber, say, download, colour, oncePerFrame, textField });
})();
