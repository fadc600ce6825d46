/* Source of sheets: the server, what is embedded in a self-contained page, or a folder of static files. */
"use strict";

(() => {
  const place = document.getElementById("embedded");
  const embedded = place ? JSON.parse(place.textContent) : null;
  const site = typeof airmuscleSite === "undefined" ? null : airmuscleSite;

  /* "law", "plant", or the tab to which a sheet belongs */
  const kindOf = (sheet) => sheet.tab ?? (sheet.plant ? "plant" : "law");

  async function request(address, options) {
    let answer;
    try { answer = await fetch(address, options); } catch { throw new Error("The server does not answer. Start airmuscle studio again."); }
    if (answer.ok) return answer;
    if (answer.status === 401) throw new Error("This page belongs to a server that has ended. Open the address that airmuscle studio printed.");
    const content = await answer.json().catch(() => ({ error: answer.statusText }));
    throw new Error(content.error || answer.statusText);
  }

  const OWN = { "X-Airmuscle": "1" };  // what a page of another origin cannot send
  const post = (address, body) => request(address, { method: "POST", headers: { ...OWN, "Content-Type": "text/plain; charset=utf-8" }, body });

  /* A script beside the page, which enters the table of programs. */
  function loadScript(address, message) {
    return new Promise((resolve, reject) => {
      const script = airmuscle.element("script", { src: address });
      script.addEventListener("load", resolve);
      script.addEventListener("error", () => reject(new Error(message)));
      document.head.append(script);
    });
  }

  const refuseText = () => Promise.reject(new Error("This page has no server that could read a file; start airmuscle studio, or name the file: airmuscle site DIR FILE.toml."));

  /* The server of airmuscle studio */
  const server = {
    embedded: null, hasServer: true,

    async library() { return (await request("api/library")).json(); },

    async named(kind, name) { return server.loadProgram(await (await request(`api/${kind}/${encodeURIComponent(name)}`, { headers: OWN })).json()); },

    async ownText(kind, text) { return server.loadProgram(await (await post(`api/${kind}`, text)).json()); },

    async loadProgram(sheet) {
      if (!airmusclePrograms[sheet.id]) await loadScript(`program/${sheet.id}.js`, "The program of this model could not be loaded; reload the page.");
      return sheet;
    },

    async sizing(text) { return (await post("api/size", text)).json(); },

    async page(sheets, state) { return (await post("api/page", JSON.stringify({ sheets, state }))).blob(); },
  };

  /* A saved page, which contains its sheets */
  const saved = {
    embedded, hasServer: false,

    async library() {
      const rows = (kind) => embedded.sheets.filter((s) => kindOf(s) === kind).map((s) => ({ name: s.name, title: s.title, provenance: s.provenance }));
      return { laws: rows("law"), plants: rows("plant"), joints: rows("joint"), opened: [], forms: { size: embedded.sheets.find((s) => s.tab === "size")?.form } };
    },

    async named(kind, name) {
      const sheet = embedded.sheets.find((s) => s.name === name && kindOf(s) === kind);
      if (!sheet) throw new Error(`This page does not contain ${name}.`);
      return sheet;
    },

    async ownText(kind, text) { return embedded.sheets.find((s) => s.own_text === text && kindOf(s) === kind) ?? refuseText(); },

    async loadProgram(sheet) { return sheet; },
  };

  /* A folder of static files: each sheet is a script, because a page opened from disk may not read other files */
  const folder = {
    embedded: null, hasServer: false,

    async library() { return { ...site.library, opened: [], forms: {} }; },

    async named(kind, name) {
      const row = site.library[`${kind}s`].find((entry) => entry.name === name);
      if (!row) throw new Error(`This page does not contain ${name}.`);
      if (!site.sheets[row.file]) await loadScript(row.file, `The file ${row.file} is missing beside this page; copy the whole folder.`);
      return site.sheets[row.file];
    },

    ownText: refuseText,

    async loadProgram(sheet) { return sheet; },
  };

  const source = embedded ? saved : site ? folder : server;

  /* State of the page in its address, as base64url of JSON. */
  const link = {
    encode(state) {
      const bytes = new TextEncoder().encode(JSON.stringify(state));
      return btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
    },
    decode(text) {
      try {
        const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
        const state = JSON.parse(new TextDecoder().decode(bytes));
        return state && typeof state === "object" ? state : null;
      } catch { return null; }
    },
  };

  Object.assign(airmuscle, { source, link });
})();
