/* Figure of a chart for a document: SVG with axes and labels, and PNG made of it. */
"use strict";

(() => {
  const WIDTH = 760, HEIGHT = 480, LEFT = 66, RIGHT = 20, TOP = 44, BOTTOM = 54;
  const INK = { c1: "#005f9e", c2: "#a83f00", c3: "#00674b", c4: "#8a2d73", c5: "#6b5200", c6: "#3d4f9f", ink: "#1c2330", soft: "#545e6f", line: "#d5dbe3" };
  const escape = (text) => String(text).replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", "\"": "&quot;" })[c]);

  /* figure: {title, x: {label, range}, y: {label, range}, curves: [{x, y, colour, dash, width, label}], marks: [{x, y, label}], shaded: [[x1, x2], ...]} */
  function svgText(figure) {
    const [x0, x1] = figure.x.range, [y0, y1] = figure.y.range;
    const px = (x) => LEFT + (x - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT);
    const py = (y) => HEIGHT - BOTTOM - (y - y0) / (y1 - y0) * (HEIGHT - TOP - BOTTOM);
    const parts = [
      `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${HEIGHT}" width="${WIDTH}" height="${HEIGHT}" font-family="'Source Sans 3','Segoe UI',Helvetica,'Liberation Sans',Arial,sans-serif" font-size="13">`,
      `<title>${escape(figure.title)}</title><rect width="${WIDTH}" height="${HEIGHT}" fill="#fff"/>`,
      `<clipPath id="plot"><rect x="${LEFT}" y="${TOP}" width="${WIDTH - LEFT - RIGHT}" height="${HEIGHT - TOP - BOTTOM}"/></clipPath>`,
      `<text x="${LEFT}" y="24" font-size="15" font-weight="600" fill="${INK.ink}">${escape(figure.title)}</text>`,
    ];
    for (const [a, b] of figure.shaded || []) {
      parts.push(`<rect x="${px(a)}" y="${TOP}" width="${px(b) - px(a)}" height="${HEIGHT - TOP - BOTTOM}" fill="#3c465a" opacity=".08"/>`);
    }
    for (const x of airmuscle.roundSteps(x0, x1, 8)) {
      parts.push(`<path d="M${px(x)} ${TOP}V${HEIGHT - BOTTOM}" stroke="${INK.line}"/><text x="${px(x)}" y="${HEIGHT - BOTTOM + 18}" text-anchor="middle" fill="${INK.ink}">${airmuscle.shortText(x)}</text>`);
    }
    for (const y of airmuscle.roundSteps(y0, y1, 7)) {
      parts.push(`<path d="M${LEFT} ${py(y)}H${WIDTH - RIGHT}" stroke="${INK.line}"/><text x="${LEFT - 8}" y="${py(y) + 4}" text-anchor="end" fill="${INK.ink}">${airmuscle.shortText(y)}</text>`);
    }
    parts.push("<g clip-path=\"url(#plot)\" fill=\"none\" stroke-linejoin=\"round\">");
    for (const curve of figure.curves) {
      const dash = curve.dash && curve.dash.length ? ` stroke-dasharray="${curve.dash.join(" ")}"` : "";
      parts.push(`<path d="${path(curve, px, py)}" stroke="${INK[curve.colour]}" stroke-width="${curve.width || 1.6}"${dash}/>`);
    }
    parts.push("</g>");
    for (const mark of figure.marks || []) {
      if (mark.dot) parts.push(`<circle cx="${px(mark.x)}" cy="${py(mark.y)}" r="5" fill="${INK.ink}" stroke="#fff" stroke-width="1.5"/>`);
      if (mark.label) parts.push(`<text x="${px(mark.x) + (mark.dot ? 9 : 4)}" y="${py(mark.y) - 5}" fill="${INK[mark.colour || "ink"]}" stroke="#fff" stroke-width="3" paint-order="stroke">${escape(mark.label)}</text>`);
    }
    parts.push(
      `<rect x="${LEFT}" y="${TOP}" width="${WIDTH - LEFT - RIGHT}" height="${HEIGHT - TOP - BOTTOM}" fill="none" stroke="${INK.soft}"/>`,
      `<text x="${(LEFT + WIDTH - RIGHT) / 2}" y="${HEIGHT - 14}" text-anchor="middle" fill="${INK.ink}">${escape(figure.x.label)}</text>`,
      `<text transform="translate(17 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle" fill="${INK.ink}">${escape(figure.y.label)}</text>`, "</svg>\n");
    return parts.join("\n");
  }

  function path(curve, px, py) {
    let text = "", pen = "M";
    for (let i = 0; i < curve.x.length; i++) {
      const y = curve.y[i];
      if (y === null || Number.isNaN(y)) { if (!curve.spanned) pen = "M"; continue; }
      text += `${pen}${px(curve.x[i]).toFixed(2)} ${py(y).toFixed(2)}`;
      pen = "L";
    }
    return text;
  }

  /* The SVG as PNG, twice its size. */
  async function pngOf(text) {
    const image = new Image();
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    canvas.width = 2 * WIDTH;
    canvas.height = 2 * HEIGHT;
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  }

  /* Columns as CSV; the headings contain the units. */
  function csvText(columns) {
    const quote = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll("\"", "\"\"")}"` : text);
    const lines = [columns.map((c) => quote(c.heading)).join(",")];
    for (let i = 0; i < columns[0].values.length; i++) {
      lines.push(columns.map((c) => (c.values[i] === null || Number.isNaN(c.values[i]) ? "" : airmuscle.pythonFloat(c.values[i]))).join(","));
    }
    return `${lines.join("\n")}\n`;
  }

  Object.assign(airmuscle, { svgText, pngOf, csvText });
})();
