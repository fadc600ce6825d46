/* Requests of the tab Fit: files, what was understood, and tasks on the server. */
"use strict";

(() => {
  /* An error with the field that it concerns. */
  class FieldError extends Error {
    constructor(text, field, status) { super(text); this.field = field ?? ""; this.status = status; }
  }

  async function request(address, options) {
    let answer;
    try { answer = await fetch(address, options); } catch { throw new FieldError("The server does not answer. Start airmuscle studio again.", "", 0); }
    if (answer.ok) return answer.json();
    const content = await answer.json().catch(() => ({ error: answer.statusText }));
    throw new FieldError(content.error || answer.statusText, content.field, answer.status);
  }

  const post = (address, body, type = "application/json") => request(address, { method: "POST", headers: { "X-Airmuscle": "1", "Content-Type": type }, body });
  const task = (identifier, name = "") => `api/fit/task/${encodeURIComponent(identifier)}${name && `/${name}`}`;

  const fitSource = {
    upload: (set, file) => post(`api/fit/file?${new URLSearchParams({ ...(set ? { set } : {}), name: file.name })}`, file, "application/octet-stream"),
    remove: (set, name) => post("api/fit/remove", JSON.stringify({ set, name })),
    read: (set, settings) => post("api/fit/read", JSON.stringify({ set, settings })),
    start: (set, settings) => post("api/fit/start", JSON.stringify({ set, settings })),
    status: (identifier) => request(task(identifier)),
    cancel: (identifier) => post(`${task(identifier)}/cancel`, ""),
    result: (identifier) => request(task(identifier, "result.json")),
    address: task,
  };

  Object.assign(airmuscle, { fitSource });
})();
