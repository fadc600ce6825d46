/* Result of a fit: recommended law, ranking, equation, charts, friction and files. */
"use strict";

(() => {
  const { element, chapterTable, fitSource, Scatter, scaleOf, labelOf, shortText, GROUP_COLOURS, GROUP_DASHES } = airmuscle;
  const MATHML = "http://www.w3.org/1998/Math/MathML";
  const NAMES = { "report.html": "Report (HTML)", "muscle.toml": "Muscle (TOML)", "report.zip": "All files (ZIP)", "friction.html": "Report on friction (HTML)", "friction.toml": "Friction (TOML)" };

  /* A formula from the server: elements of MathML with their attributes of layout, and texts. */
  function formula(text) {
    const parsed = new DOMParser().parseFromString(text, "application/xml").documentElement;
    const copy = (node) => {
      if (node.nodeType === Node.TEXT_NODE) return document.createTextNode(node.data);
      if (node.nodeType !== Node.ELEMENT_NODE || node.namespaceURI !== MATHML) return document.createTextNode("");
      const made = document.createElementNS(MATHML, node.localName);
      for (const { name, value } of node.attributes) if (!/^(xmlns|style|href|on|xlink)/.test(name)) made.setAttribute(name, value);
      made.append(...[...node.childNodes].map(copy));
      return made;
    };
    return copy(parsed);
  }

  const card = (title, ...children) => element("section.card", {}, element("h2", {}, title), ...children);
  const notes = (texts) => texts.map((text) => element("p.message", {}, text));

  function rankingCard(result) {
    const parts = result.comparisons.flatMap((comparison) => [
      result.comparisons.length > 1 ? element("h3", {}, `For ${comparison.purpose}`) : element("p.small.soft", {}, `Each ${comparison.group} is left out in turn; the ranking is for ${comparison.purpose}. Errors are root mean squares of the force.`),
      chapterTable(comparison.tables.ranking, { chosen: result.recommended }), ...notes(comparison.notes),
      comparison.tables.excluded ? element("details", {}, element("summary", {}, `Why ${comparison.tables.excluded.rows.length} laws are not ranked`), chapterTable(comparison.tables.excluded)) : null]);
    return card("Ranking", ...parts.filter(Boolean));
  }

  function equationCard(result) {
    const parts = result.equations.flatMap((each) => [
      each.title ? element("h3", {}, each.title) : null,
      ...each.lines.map((line) => element("div.formula.scroll", { tabindex: "0", role: "group", "aria-label": "Equation" }, formula(line))), element("p.small.soft", {}, each.note),
      Object.keys(each.sources).length ? element("details", {}, element("summary.small", {}, "As text for other programs"), ...Object.entries(each.sources).flatMap(([name, text]) => [element("p.small", {}, name), element("pre", { tabindex: "0" }, text)])) : null]);
    const { parameters } = result.fit.tables, goodness = { title: "Goodness of fit", headings: ["quantity", "value"].map((text) => ({ text })), rows: result.fit.values };
    return card(`Equation of ${result.recommended}`, ...parts.filter(Boolean), element("details", {}, element("summary", {}, `Parameters (${parameters.rows.length})`), chapterTable(parameters)),
      element("details", {}, element("summary", {}, "Goodness of fit"), ...result.fit.paragraphs.map((text) => element("p.small", {}, text)), chapterTable(goodness)), ...notes(result.fit.notes));
  }

  function chartsCard(result) {
    const { parity } = result, [factor] = scaleOf(parity.quantity), group = parity.measured.map(() => 0);
    const hosts = [element("div"), element("div"), element("div")], over = element("select", { "aria-label": "Residuals over" }, ...["pressure", "contraction", "force"].map((name) => element("option", { value: name }, name)));
    const measured = parity.measured.map((v) => v * factor), modelled = parity.modelled.map((v) => v * factor), off = parity.censored;
    const parts = [element("h3", {}, "Modelled over measured"), hosts[0], element("div.row", {}, element("h3", {}, "Residual (model − measured) over"), over), hosts[1],
      off.some(Boolean) ? element("p.small.soft", {}, "Crosses: censored rows, such as those at zero force, which are bounds and not values.") : null,
      parity.step > 1 ? element("p.small.soft", {}, `One row in ${parity.step} is shown.`) : null];
    const later = [() => {
      const ends = airmuscle.rangeOf([...measured, ...modelled], 0.03);
      new Scatter(hosts[0], "Modelled over measured values", 300).show({ x: `measured ${labelOf(parity.quantity)}`, y: `modelled ${labelOf(parity.quantity)}`, points: { x: measured, y: modelled, group, off }, lines: [{ x: ends, y: ends, colour: "soft" }], ranges: { x: ends, y: ends } });
      const residuals = new Scatter(hosts[1], "Residuals", 260);
      const draw = () => {
        const [scale] = scaleOf(over.value), x = parity[over.value].map((v) => v * scale), ends = airmuscle.rangeOf(x);
        residuals.show({ x: `measured ${labelOf(over.value)}`, y: `residual of ${labelOf(parity.quantity)}`, points: { x, y: parity.residual.map((v) => v * factor), group, off }, lines: [{ x: ends, y: [0, 0], colour: "soft" }] });
      };
      over.addEventListener("change", draw);
      draw();
    }];
    if (result.bands) {
      const { constant, varying, curves } = result.bands, [fx] = scaleOf(varying), [fc, unit] = scaleOf(constant), scaled = (values, by) => values.map((v) => (v === null ? NaN : v * by));
      const cut = (values, c) => scaled(values, factor).map((v, i) => (parity.quantity === "force" && c.value[i] < 0 ? NaN : v));
      parts.push(element("h3", {}, "Fitted curves with 95 % bands"), element("p.small.soft", {}, `Dark: confidence band of the curve. Light: prediction band of one further measurement. The variance of the parameters is estimated ${result.bands.basis}.`), hosts[2],
        element("div.row.small", {}, ...curves.map((c, i) => element("span.row", {}, element(`span.swatch.${GROUP_COLOURS[i]}`), `${shortText(c.level * fc)} ${unit}`))));
      later.push(() => new Scatter(hosts[2], "Fitted curves with bands", 360).show({
        x: labelOf(varying), y: labelOf(parity.quantity), points: { x: parity[varying].map((v) => v * fx), y: measured, colour: "soft" },
        lines: curves.map((c, i) => ({ x: scaled(c.x, fx), y: cut(c.value, c), colour: GROUP_COLOURS[i], dash: GROUP_DASHES[i] })),
        bands: curves.flatMap((c, i) => [{ x: scaled(c.x, fx), low: cut(c.prediction_low, c), high: cut(c.prediction_high, c), colour: GROUP_COLOURS[i], light: true }, { x: scaled(c.x, fx), low: cut(c.low, c), high: cut(c.high, c), colour: GROUP_COLOURS[i] }]),
        ranges: { x: airmuscle.rangeOf(parity[varying].map((v) => v * fx)), y: airmuscle.rangeOf(measured, 0.08) },
      }));
    }
    return [card("Residuals and bands", ...parts.filter(Boolean)), later];
  }

  /* The paragraphs, tables and notes of a chapter. */
  const chapter = (part) => [...part.paragraphs.map((text) => element("p.small", {}, text)), ...Object.values(part.tables).flatMap((table) => [element("h4", {}, table.title), chapterTable(table)]), ...part.notes.map((text) => element("p.small", {}, text))];

  function frictionCard(friction) {
    if (!friction.loops.length) return [card("Friction from both branches", element("p", {}, friction.reason)), []];
    const later = [], parts = friction.loops.flatMap((loop) => {
      const host = element("div"), [fx] = scaleOf(loop.varied);
      later.push(() => new Scatter(host, loop.title, 240).show({ x: labelOf(loop.varied), y: "force [N]", points: { x: loop.x.map((v) => v * fx), y: loop.force, group: loop.direction.map((d) => (d < 0 ? 1 : 0)) } }));
      return [element("details", { open: friction.loops.length === 1 }, element("summary", {}, `${loop.title}: ${loop.justified ? "friction is justified" : "no friction is justified"}`), host,
        element("div.row.small", {}, element("span.row", {}, element("span.dot.c1"), "rising"), element("span.row", {}, element("span.dot.c2"), "falling")), ...chapter(loop))];
    });
    const joint = friction.joint ? [element("h3", {}, "All runs together"), ...chapter(friction.joint)] : [];
    return [card("Friction from both branches", ...parts, ...joint, ...(friction.remarks ?? []).map((text) => element("p.small", {}, text))), later];
  }

  /* The cards of a result in `host`. */
  function showResult(host, identifier, result) {
    const links = result.files.map((name) => element("a.button", { href: fitSource.address(identifier, name), download: name }, NAMES[name] ?? name));
    const [charts, later] = chartsCard(result), [friction, more] = result.hysteresis ? frictionCard(result.hysteresis) : [null, []];
    const text = element("div", {}, ...result.reason.split("\n").map((line) => element("p", {}, line)));
    host.replaceChildren(card("Result", element("p.headline", {}, "Recommended: ", element("strong", {}, result.recommended), ` with ${result.parameters} parameters, rms error ${shortText(result.error)} N on rows left out.`), text,
      element("p.small.soft", {}, `${result.rows} rows were used.`), element("div.row", {}, ...links), ...notes(result.notes)), rankingCard(result), equationCard(result), charts, ...(friction ? [friction] : []));
    for (const draw of [...later, ...more]) draw();
  }

  Object.assign(airmuscle, { showResult });
})();
