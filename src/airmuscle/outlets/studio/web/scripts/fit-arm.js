/* Episodes of an arm in the tab Fit: what the record contains, its mapping, and the result. */
"use strict";

(() => {
  const { element, chapterTable, fitSource } = airmuscle;
  const EPISODES = /\.(npz|jsonl?|zip|bag|db3|mcap)$/i;
  const NAMES = { "report.html": "Report (HTML)", "scenario.toml": "Arm (TOML)", "controlled.toml": "Arm with controllers (TOML)", "report.zip": "All files (ZIP)" };
  const card = (title, ...children) => element("section.card", {}, element("h2", {}, title), ...children);

  /* Whether files can be nothing but episodes, by their names. */
  const areEpisodes = (names) => names.length > 0 && names.every((name) => EPISODES.test(name));

  /* The files of dropped folders, with those that were dropped alone. */
  async function droppedFiles(transfer) {
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    if (!entries.some((entry) => entry.isDirectory)) return [...transfer.files];
    const read = async (entry) => {
      if (entry.isFile) return [await new Promise((resolve, reject) => { entry.file(resolve, reject); })];
      const reader = entry.createReader(), found = [];
      for (;;) {
        const part = await new Promise((resolve, reject) => { reader.readEntries(resolve, reject); });
        if (!part.length) break;
        for (const each of part) found.push(...await read(each));
      }
      return found;
    };
    return (await Promise.all(entries.map(read))).flat().filter((file) => !file.name.startsWith("."));
  }

  /* The findings of the inspection: one line each, remarks apart. */
  function showInspection(host, lines) {
    const remarks = lines.filter((line) => line.startsWith("remark: ")).map((line) => line.slice(8));
    host.replaceChildren(element("ul", {}, ...lines.filter((line) => !line.startsWith("remark: ")).map((line) => element("li", {}, line))),
      ...remarks.map((text) => element("p.message", {}, text)));
  }

  function showArm(host, identifier, result) {
    const { arm, figures, files } = result, { "joint-errors": errors, joints, ...others } = arm.tables;
    const links = files.filter((name) => NAMES[name]).map((name) => element("a.button", { href: fitSource.address(identifier, name), download: name }, NAMES[name]));
    const values = { title: "", headings: [{ text: "quantity" }, { text: "value", number: true }], rows: arm.values };
    host.replaceChildren(
      card("Result", ...arm.paragraphs.map((text) => element("p", {}, text)), element("div.row", {}, ...links)),
      card("Error of the free run", ...[errors, joints].filter(Boolean).flatMap((table) => [element("h3", {}, table.title), element("div.scroll", {}, chapterTable(table))]),
        ...figures.flatMap(({ src, caption }) => [element("img.figure", { src, alt: caption }), element("p.small.soft", {}, caption)])),
      card("Remarks", element("ul", {}, ...arm.notes.map((text) => element("li", {}, text)))),
      card("Parameters", element("details", {}, element("summary", {}, "Identified parameters with their standard errors"), ...Object.values(others).flatMap((table) => [element("h3", {}, table.title), element("div.scroll", {}, chapterTable(table))]), chapterTable(values))));
  }

  Object.assign(airmuscle, { areEpisodes, droppedFiles, showInspection, showArm });
})();
