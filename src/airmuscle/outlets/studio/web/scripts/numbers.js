/* Numbers: texts that a person reads, and texts that are read back as the same number. */
"use strict";
const airmuscle = { };
const airmusclePrograms = { };

(() => {
  /* At most four significant digits; en dash for a number that does not exist, true minus sign. */
  function shortText(value, digits = 4) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    let text;
    if (size >= 1e6 || size < 1e-4) text = value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
    else {
      text = value.toPrecision(digits);
      if (text.includes("e")) text = String(Number(text));
      if (text.includes(".")) text = text.replace(/\.?0+$/, "");
    }
    return text.replace(/^-/, "−");
  }

  /* A float as Python writes it, with all digits: 1e-07, 5.0, 1e+16. */
  function pythonFloat(value) {
    if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
    const sign = value < 0 || Object.is(value, -0) ? "-" : "";
    const [mantissa, power] = Math.abs(value).toExponential().split("e");
    const digits = mantissa.replace(".", ""), exponent = Number(power);
    if (exponent < -4 || exponent >= 16) {
      const fraction = digits.length > 1 ? `.${digits.slice(1)}` : "";
      const size = String(Math.abs(exponent)).padStart(2, "0");
      return `${sign}${digits[0]}${fraction}e${exponent < 0 ? "-" : "+"}${size}`;
    }
    if (exponent < 0) return `${sign}0.${"0".repeat(-exponent - 1)}${digits}`;
    const padded = digits.padEnd(exponent + 1, "0");
    return `${sign}${padded.slice(0, exponent + 1)}.${padded.slice(exponent + 1) || "0"}`;
  }

  /* What a user types: a decimal comma and a minus sign are accepted; NaN for anything else. */
  function readNumber(text) {
    const plain = String(text).trim().replace("−", "-").replace(/^([-+]?\d*),(\d+)/, "$1.$2");
    return /^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$/.test(plain) ? Number(plain) : NaN;
  }

  /* Round numbers from low to high, about `count` of them. */
  function roundSteps(low, high, count) {
    if (!(high > low)) return [low];
    const raw = (high - low) / count, size = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((f) => f * size).find((s) => s >= raw * 0.999);
    const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
    return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
  }

  function fillTemplate(template, values) {
    return template.map((item) => (typeof item === "number" ? pythonFloat(values[item]) : item)).join("");
  }

  Object.assign(airmuscle, { shortText, pythonFloat, readNumber, roundSteps, fillTemplate });
})();
