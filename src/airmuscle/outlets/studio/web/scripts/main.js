/* Start of the page: tabs, theme, address, saved page. */
"use strict";

(() => {
  const { element, source, link, say, download } = airmuscle;
  const TABS = [
    ["muscle", "Muscle", airmuscle.MuscleTab], ["fit", "Fit", airmuscle.FitTab], ["plant", "Plant", airmuscle.PlantTab],
    ["joint", "Joint", airmuscle.JointTab], ["size", "Size", airmuscle.SizeTab],
  ].filter((row) => row[2]);
  const tabs = {}, main = document.getElementById("main"), list = document.getElementById("tabs");
  let shown = TABS[0][0], writing = 0, ready = false;

  function readState() {
    const fragment = location.hash.slice(1);
    return (fragment && link.decode(fragment)) || source.embedded?.state || {};
  }

  function currentState() {
    return { tab: shown, ...Object.fromEntries(Object.entries(tabs).map(([name, { view }]) => [name, view.state()])) };
  }

  /* The address contains the state of the page. */
  function writeState() {
    const text = ready ? link.encode(currentState()) : "";
    if (ready) remember("replaceState", text.length < 60000 ? `#${text}` : "#");
  }

  /* An entry of the history is the tab, so that the button Back leads to the one before. */
  function remember(method, address) {
    try { history[method]({ tab: shown }, "", address); } catch { /* a page opened as a file in some browsers */ }
  }

  /* Write the state into the address, at once or when it has not changed for a moment. */
  function stateChanged(atOnce = false) {
    clearTimeout(writing);
    if (atOnce === true) writeState(); else writing = setTimeout(writeState, 250);
  }

  function choose(name, focus) {
    if (name !== shown) { shown = name; remember("pushState"); }
    show(name);
    if (focus) tabs[name].button.focus();
  }

  function show(name) {
    shown = name;
    for (const [other, { button, panel, view, started }] of Object.entries(tabs)) {
      const chosen = other === name;
      button.setAttribute("aria-selected", String(chosen));
      button.tabIndex = chosen ? 0 : -1;
      panel.hidden = !chosen;
      if (started) view.visible?.(chosen);
    }
    stateChanged();
  }

  function buildTabs() {
    for (const [name, title, View] of TABS) {
      const button = element("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => choose(name) }, title);
      const panel = element("div", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}`, "aria-busy": "true" });
      list.append(button);
      main.append(panel);
      tabs[name] = { button, panel, view: new View(panel, stateChanged) };
    }
    list.addEventListener("keydown", (event) => {
      const names = Object.keys(tabs), step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step) choose(names[(names.indexOf(shown) + step + names.length) % names.length], true);
    });
  }

  /* A view begins while another one may still be loading; the tab that was chosen meanwhile stays. */
  async function begin(name, library, state) {
    const tab = tabs[name];
    await tab.view.start(library, state);
    tab.panel.removeAttribute("aria-busy");
    tab.started = true;
    if (name === shown) tab.view.visible?.(true);
  }

  function setTheme(dark) {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    document.dispatchEvent(new Event("themechange"));
  }

  function startTheme() {
    let dark = stored("theme") ? stored("theme") === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    const button = document.getElementById("theme"), apply = () => { setTheme(dark); button.setAttribute("aria-pressed", String(dark)); };
    button.addEventListener("click", () => {
      dark = !dark;
      try { localStorage.setItem("theme", dark ? "dark" : "light"); } catch { /* not allowed for files */ }
      apply();
    });
    addEventListener("beforeprint", () => setTheme(false));  /* dark ink on white paper, in the charts as well */
    addEventListener("afterprint", apply);
    apply();
  }

  function stored(name) { try { return localStorage.getItem(name); } catch { return null; } }

  async function savePage() {
    const ids = [...new Set(Object.values(tabs).flatMap(({ view }) => view.sheets()))];
    download("airmuscle.html", await source.page(ids, currentState()), "text/html");
  }

  async function start() {
    startTheme();
    document.getElementById("copy-link").addEventListener("click", () => {
      const address = `${location.href.split("#")[0]}#${link.encode(currentState())}`;
      navigator.clipboard.writeText(address).then(() => say("The address was copied."), () => say("The browser does not allow copying; copy the address of the page."));
    });
    const save = document.getElementById("save-page");
    save.hidden = !source.hasServer;
    save.addEventListener("click", () => savePage().catch((error) => say(error.message)));
    document.querySelector(".skip").addEventListener("click", (event) => { event.preventDefault(); main.focus(); });
    const state = readState();
    buildTabs();
    show(tabs[state.tab] ? state.tab : TABS[0][0]);
    addEventListener("popstate", ({ state: entry }) => {
      if (tabs[entry?.tab]) show(entry.tab); else if (link.decode(location.hash.slice(1))) location.reload();
    });
    const library = await source.library();
    await Promise.all(Object.keys(tabs).map((name) => begin(name, library, state[name])));
    ready = true;
    writeState();
    document.documentElement.dataset.ready = "true";
  }

  start().catch((error) => main.replaceChildren(element("p.message.error", {}, error.message)));
})();
