// A step of a calibration as a picture: what is touched, from where the stylus comes, and how the rotary axes stand.
import { s } from "./dom.js";

// Isometric: X to the right and towards the reader, Y to the right and away, Z up.
const project = ([x, y, z]) => [0.8 * x + 0.6 * y, 0.35 * x - 0.45 * y - 0.85 * z];
const at = (v, k) => v.map((c) => c * k);
const plus = (a, b) => a.map((c, k) => c + b[k]);

function arrow(from, to, name, className) {
  const [x1, y1] = project(from), [x2, y2] = project(to);
  const angle = Math.atan2(y2 - y1, x2 - x1);
  const head = [-0.45, 0.45].map((turn) => `${x2 - 7 * Math.cos(angle + turn)},${y2 - 7 * Math.sin(angle + turn)}`);
  return s("g", { class: className }, s("line", { x1, y1, x2, y2 }), s("polygon", { points: `${x2},${y2} ${head.join(" ")}` }),
    name && s("text", { x: x2 + 8 * Math.cos(angle), y: y2 + 8 * Math.sin(angle) + 3, "text-anchor": "middle" }, name));
}

function feature(step) {
  if (["plates", "cube", "tool setter", "tool_setter"].includes(step.feature)) {
    const n = step.outward_normal;
    const side = Math.abs(n[2]) > 0.9 ? [1, 0, 0] : [-n[1], n[0], 0];
    const up = [n[1] * side[2] - n[2] * side[1], n[2] * side[0] - n[0] * side[2], n[0] * side[1] - n[1] * side[0]];
    const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([a, b]) => project(plus(plus(at(side, 32 * a), at(up, 32 * b)), at(n, 20))));
    return s("polygon", { class: "piece", points: corners.map((c) => c.join(",")).join(" ") });
  }
  return s("g", { class: "piece" }, s("circle", { cx: 0, cy: 0, r: 26 }), s("ellipse", { cx: 0, cy: 0, rx: 26, ry: 9, class: "thin" }));
}

function dial(angle, name, x) {
  const radians = (angle * Math.PI) / 180;
  return s("g", { class: "dial", transform: `translate(${x} 78)` }, s("circle", { r: 15 }), s("line", { x1: 0, y1: 0, x2: 15 * Math.sin(radians), y2: -15 * Math.cos(radians) }),
    s("text", { y: 30, "text-anchor": "middle" }, `${name} ${angle.toFixed(1)}°`));
}

export function stepPicture(step) {
  const n = step.outward_normal.some((c) => c !== 0) ? step.outward_normal : [0, 0, 1];
  const approach = step.approach_direction.some((c) => c !== 0) ? step.approach_direction : at(n, -1);
  const contact = at(n, 26);
  const start = plus(contact, at(approach, -62));
  const [cx, cy] = project(plus(contact, at(approach, -9)));
  const stem = plus(plus(contact, at(approach, -9)), [0, 0, 60]);
  const [sx, sy] = project(stem);
  const angles = step.rotary_angles_rad.map((rad) => (rad * 180) / Math.PI);
  const words = `${step.kind} of ${step.feature.replaceAll("_", " ")}, normal X ${n[0].toFixed(2)} Y ${n[1].toFixed(2)} Z ${n[2].toFixed(2)}`;
  return s("svg", { viewBox: "-120 -110 240 230", role: "img", "aria-label": words, class: "step" },
    feature(step), arrow([-78, -78, -40], [-44, -78, -40], "X", "frame"), arrow([-78, -78, -40], [-78, -44, -40], "Y", "frame"), arrow([-78, -78, -40], [-78, -78, -6], "Z", "frame"),
    step.kind !== "hold" && arrow(start, plus(contact, at(approach, -14)), "", "approach"),
    s("line", { class: "stem", x1: cx, y1: cy, x2: sx, y2: sy }), s("circle", { class: "tip", cx, cy, r: 8 }),
    angles.map((angle, k) => (angle !== 0 || k === 2) && dial(angle, "ABC"[k], -60 + 60 * k)));
}
