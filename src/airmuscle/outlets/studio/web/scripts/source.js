/* Source of sheets: the server, or what is embedded in a self-contained page. */
"use strict";

(() => {
  const place = document.getElementById("embedded");
  const embedded = place ? JSON.parse(place.textContent) : null;

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

  /* The program of a sheet enters the table of programs as a script of this server. */
  function loadProgram(sheet) {
    if (airmusclePrograms[sheet.id]) return Promise.resolve(sheet);
    return new Promise((resolve, reject) => {
      const script = airmuscle.element("script", { src: `program/${sheet.id}.js` });
      script.addEventListener("load", () => resolve(sheet));
      script.addEventListener("error", () => reject(new Error("The program of this model could not be loaded; reload the page.")));
      document.head.append(script);
    });
  }

  const source = {
    embedded,

    async library() {
      if (!embedded) return (await request("api/library")).json();
      const rows = (kind) => embedded.sheets.filter((s) => kindOf(s) === kind).map((s) => ({ name: s.name, title: s.title, provenance: s.provenance }));
      return { laws: rows("law"), plants: rows("plant"), joints: rows("joint"), opened: [], forms: { size: embedded.sheets.find((s) => s.tab === "size")?.form } };
    },

    async named(kind, name) {
      if (!embedded) return loadProgram(await (await request(`api/${kind}/${encodeURIComponent(name)}`, { headers: OWN })).json());
      const sheet = embedded.sheets.find((s) => s.name === name && kindOf(s) === kind);
      if (!sheet) throw new Error(`This page does not contain ${name}.`);
      return sheet;
    },

    async ownText(kind, text) {
      if (!embedded) return loadProgram(await (await post(`api/${kind}`, text)).json());
      const sheet = embedded.sheets.find((s) => s.own_text === text && kindOf(s) === kind);
      if (!sheet) throw new Error("A saved page has no server that could read a file; start airmuscle studio.");
      return sheet;
    },

    loadProgram,

    async sizing(text) { return (await post("api/size", text)).json(); },

    async page(sheets, state) { return (await post("api/page", JSON.stringify({ sheets, state }))).blob(); },
  };

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
