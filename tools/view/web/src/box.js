// The server of this page: questions, and the events that it sends.
export class Refused extends Error {
  constructor(name, what) {
    super(what);
    this.name = name;
  }
}

async function read(response) {
  const text = await response.text();
  if (response.ok) return text === "" ? null : JSON.parse(text);
  let told = { error: "failed", what: text || response.statusText };
  try { told = JSON.parse(text); } catch { /* plain text */ }
  throw new Refused(told.error, told.what);
}

export const get = async (path, parameters = {}) => read(await fetch(`/api/${path}?${new URLSearchParams(parameters)}`));
export const post = async (path, body = {}) =>
  read(await fetch(`/api/${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }));

const listeners = new Map();
export const last = {};

export function on(kind, listener) {
  if (!listeners.has(kind)) listeners.set(kind, new Set());
  listeners.get(kind).add(listener);
  if (last[kind] !== undefined && kind !== "samples") listener(last[kind]);
  return () => listeners.get(kind).delete(listener);
}

const told = {}; // how often, by kind
function tell(kind, value) {
  told[kind] = (told[kind] ?? 0) + 1;
  last[kind] = value;
  for (const listener of listeners.get(kind) ?? []) listener(value);
}

// What is told only when it changes, anew: its event may have been lost. An event that comes meanwhile is newer.
async function repair(kind, path) {
  const before = told[kind];
  try {
    const value = await get(path);
    if (value !== null && last.server && told[kind] === before) tell(kind, value);
  } catch {
    setTimeout(() => { if (last.server && told[kind] === before) repair(kind, path); }, 1000);
  }
}

export function begin() {
  const events = new EventSource("/api/events");
  for (const kind of ["samples", "state", "trigger", "link", "descriptor", "machine"])
    events.addEventListener(kind, (event) => tell(kind, JSON.parse(event.data)));
  events.onopen = () => {
    tell("server", true);
    for (const [kind, path] of [["machine", "machine"], ["link", "link"], ["descriptor", "about"]]) repair(kind, path);
  };
  events.onerror = () => tell("server", false);
}
