// Signs of the four answers, told apart by their shapes and not by colour alone.
import { h, s } from "./dom.js";

const SHAPES = {
  yes: () => [s("circle", { cx: 12, cy: 12, r: 11 }), s("path", { class: "mark", d: "M6.5 12.5l3.8 3.8 7.2-8" })],
  check: () => [s("path", { d: "M12 1.2 23.4 21.6a1 1 0 0 1-.9 1.4h-21a1 1 0 0 1-.9-1.4z" }), s("path", { class: "mark", d: "M12 8.5v6.5M12 19v.1" })],
  stop: () => [s("path", { d: "M7.5 1h9L23 7.5v9L16.500 23h-9L1 16.500v-9z" }), s("path", { class: "mark", d: "M8 8l8 8M16 8l-8 8" })],
  unknown: () => [s("rect", { x: 1, y: 1, width: 22, height: 22, rx: 4 }), s("path", { class: "mark", d: "M6 12h12" })],
};

export const icon = (name) => s("svg", { viewBox: "0 0 24 24", class: "icon", "aria-hidden": "true" }, SHAPES[name]());

// A sign with its word.
export const state = (name, word) => h("span", { class: `state ${name}` }, icon(name), word);

// How a decisive value stands to its limit, in a word.
const KEEPING = { kept: ["yes", "Within limit"], "not proven": ["check", "Not proven"], exceeded: ["stop", "Beyond limit"], "no limit": ["unknown", "No limit stated"] };
export const keeping = (decisive) => KEEPING[decisive?.keeping ?? "no limit"];
