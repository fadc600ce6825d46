/* Start of the page: tabs, theme, address, saved page. */
"use strict";

(() => {
  const { element, source, link, say, download } = airmuscle;
  const TABS = [
    ["muscle", "Muscle", airmuscle.MuscleTab], ["fit", "Fit", airmuscle.FitTab], ["plant", "Plant", airmuscle.PlantTab],
    ["joint", "Joint", airmuscle.JointTab], ["size", "Size", airmuscle.SizeTab],
  ].filter((row) => row[2]);
  const tabs = {}, main = document.getElementById("main"), list = document.getElementById("tabs");
  let shown = TABS[0][0], writing = 0;

  function readState() {
    const fragment = location.hash.slice(1);
    return (fragment && link.decode(fragment)) || source.embedded?.state || {};
  }

  function currentState() {
    return { tab: shown, ...Object.fromEntries(Object.entries(tabs).map(([name, { view }]) => [name, view.state()])) };
  }

  /* The address contains the state of the page. */
  function writeState() {
    const text = link.encode(currentState());
    try { history.replaceState(null, "", text.length < 60000 ? `#${text}` : "#"); } catch { /* a page opened as a file in some browsers */ }
  }

  /* Write the state into the address, at once or when it has not changed for a moment. */
  function stateChanged(atOnce = false) {
    clearTimeout(writing);
    if (atOnce === true) writeState(); else writing = setTimeout(writeState, 250);
  }

  function show(name, focus) {
    shown = name;
    for (const [other, { button, panel, view }] of Object.entries(tabs)) {
      const chosen = other === name;
      button.setAttribute("aria-selected", String(chosen));
      button.tabIndex = chosen ? 0 : -1;
      panel.hidden = !chosen;
      view.visible?.(chosen);
    }
    if (focus) tabs[name].button.focus();
    stateChanged();
  }

  function buildTabs() {
    for (const [name, title, View] of TABS) {
      const button = element("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => show(name) }, title);
      const panel = element("div", { role: "tabpanel", id: `panel-${name}`, "aria-labelledby": `tab-${name}` });
      list.append(button);
      main.append(panel);
      tabs[name] = { button, panel, view: new View(panel, stateChanged) };
    }
    list.addEventListener("keydown", (event) => {
      const names = Object.keys(tabs), step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step) show(names[(names.indexOf(shown) + step + names.length) % names.length], true);
    });
  }

  function setTheme(dark) {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    document.getElementById("theme").setAttribute("aria-pressed", String(dark));
    document.dispatchEvent(new Event("themechange"));
  }

  function stored(name) { try { return localStorage.getItem(name); } catch { return null; } }

  async function savePage() {
    const ids = [...new Set(Object.values(tabs).flatMap(({ view }) => view.sheets()))];
    download("airmuscle.html", await source.page(ids, currentState()), "text/html");
  }

  async function start() {
    const dark = stored("theme") ? stored("theme") === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    setTheme(dark);
    document.getElementById("theme").addEventListener("click", () => {
      const next = document.documentElement.dataset.theme !== "dark";
      try { localStorage.setItem("theme", next ? "dark" : "light"); } catch { /* not allowed for files */ }
      setTheme(next);
    });
    document.getElementById("copy-link").addEventListener("click", () => {
      const address = `${location.href.split("#")[0]}#${link.encode(currentState())}`;
      navigator.clipboard.writeText(address).then(() => say("The address was copied."), () => say("The browser does not allow copying; copy the address of the page."));
    });
    const save = document.getElementById("save-page");
    save.hidden = Boolean(source.embedded);
    save.addEventListener("click", () => savePage().catch((error) => say(error.message)));
    const state = readState(), library = await source.library();
    buildTabs();
    await Promise.all(Object.entries(tabs).map(([name, { view }]) => view.start(library, state[name])));
    show(tabs[state.tab] ? state.tab : TABS[0][0]);
    window.addEventListener("hashchange", () => { if (link.decode(location.hash.slice(1))) location.reload(); });
    document.querySelector(".skip").addEventListener("click", (event) => { event.preventDefault(); main.focus(); });
    document.documentElement.dataset.ready = "true";
  }

  start().catch((error) => main.append(element("p.message.error", {}, error.message)));
})();
