/* Search of the site: any form of each word counts, sections with more and rarer words come first, with an excerpt. */
"use strict";

(() => {
  const MOST = 30, AROUND = 90;
  const words = (text) => text.toLowerCase().match(/[\p{L}\p{N}]+/gu) ?? [];
  /* What the forms of a word have in common: displacements and displacement, fitted and fit. */
  const stem = (word) => (word.length < 5 ? word.replace(/s$/, "") : word.replace(/(ations?|ings?|ed|es|s|e)$/, "").replace(/(.)\1$/, "$1"));

  function search(query, sections) {
    const wanted = [...new Set(words(query).map(stem))];
    const rows = sections.map(([title, heading, address, text]) => {
      const in_text = words(text), in_head = words(`${title} ${heading}`);
      const counts = wanted.map((root) => in_text.filter((word) => word.startsWith(root)).length + 4 * in_head.filter((word) => word.startsWith(root)).length);
      return { title, heading, address, text, counts };
    });
    const rare = wanted.map((_, k) => Math.log((1 + rows.length) / (1 + rows.filter((row) => row.counts[k]).length)));
    for (const row of rows) {
      row.found = row.counts.filter(Boolean).length;
      row.score = row.counts.reduce((sum, count, k) => sum + rare[k] * (count ? 1 + Math.log(count) : 0), 0) * row.found;
    }
    return rows.filter((row) => row.found).sort((a, b) => b.score - a.score).slice(0, MOST).map((row) => ({ ...row, wanted }));
  }

  function excerpt({ text, wanted }) {
    const piece = document.createElement("p"), at = [...text.matchAll(/[\p{L}\p{N}]+/gu)].filter(([word]) => wanted.some((root) => word.toLowerCase().startsWith(root)));
    const first = at[0]?.index ?? 0, from = Math.max(0, first - AROUND), to = Math.min(text.length, first + 2 * AROUND);
    let place = from;
    if (from) piece.append("… ");
    for (const match of at.filter(({ index }) => index < to)) {
      const mark = document.createElement("mark");
      mark.textContent = match[0];
      piece.append(text.slice(place, match.index), mark);
      place = match.index + match[0].length;
    }
    piece.append(text.slice(place, Math.max(to, place)), to < text.length ? " …" : "");
    return piece;
  }

  function show(query) {
    const rows = search(query, window.bookSections), list = document.createElement("ul"), head = document.createElement("h1");
    head.textContent = rows.length ? `Search: ${query}` : `Nothing was found for: ${query}`;
    for (const row of rows) {
      const item = document.createElement("li"), link = document.createElement("a");
      link.href = row.address;
      link.textContent = row.heading === row.title ? row.title : `${row.title}: ${row.heading}`;
      item.append(link, excerpt(row));
      list.append(item);
    }
    const place = document.createElement("div"), host = document.getElementById("search-results");
    place.id = "sections-found";
    place.append(head, list);
    host.hidden = true;  /* what Sphinx finds, which needs all words */
    host.before(place);
  }

  function start() {
    const query = new URLSearchParams(location.search).get("q");
    if (!document.getElementById("search-results") || !query) return;
    const script = document.createElement("script");
    script.src = "_static/search_index.js";
    script.addEventListener("load", () => show(query));
    document.head.append(script);
  }

  if (typeof module !== "undefined") module.exports = { search };
  else start();
})();
