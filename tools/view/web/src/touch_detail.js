// The newest touch of the probe: how its stylus is deflected on the way in, in the dwell and on the way out, and the straight
// line through the way in, which meets zero at the contact.
import { h, s, show } from "./dom.js";

const BEFORE_NS = 3e8, AFTER_NS = 7e8, COLUMNS = 1200;
const STILL = 0.05; // of the depth: less is the stylus at rest
const WAY = [0.25, 0.85]; // of the depth: the part of a way that is straight

// Distance of the deflection from rest, in um, with its times in s after the trigger. Null where nothing was touched.
export function depthOf(window_, channels, at_ns) {
  const rest = channels.map(({ index }) => (window_.low[index][0] + window_.high[index][0]) / 2);
  const depth = window_.times_ns.map((_, k) => Math.hypot(...channels.map(({ index, to_um }, c) => to_um * ((window_.low[index][k] + window_.high[index][k]) / 2 - rest[c]))));
  return { times: window_.times_ns.map((t) => (t - at_ns) * 1e-9), depth };
}

// Where the ways begin and end, with the line through the way in by least squares. Null where the stylus was not deflected.
export function partsOf({ times, depth }) {
  const most = Math.max(...depth);
  if (!(most > 2) || times.length < 20) return null;
  const peak = depth.indexOf(most);
  let first = peak, last = peak;
  while (first > 0 && depth[first] > STILL * most) --first;
  while (last < depth.length - 1 && depth[last] > STILL * most) ++last;
  let top = first, end = last;
  while (top < peak && depth[top] < 0.97 * most) ++top;
  while (end > peak && depth[end] < 0.97 * most) --end;
  const way = [];
  for (let k = first; k <= top; ++k) if (depth[k] > WAY[0] * most && depth[k] < WAY[1] * most) way.push(k);
  return { most, first, top, end, last, line: lineThrough(way.map((k) => [times[k], depth[k]])) };
}

function lineThrough(points) {
  if (points.length < 3) return null;
  const n = points.length, t = points.reduce((sum, [x]) => sum + x, 0) / n, d = points.reduce((sum, [, y]) => sum + y, 0) / n;
  const across = points.reduce((sum, [x]) => sum + (x - t) ** 2, 0);
  if (across === 0) return null;
  const slope = points.reduce((sum, [x, y]) => sum + (x - t) * (y - d), 0) / across;
  const rms = Math.sqrt(points.reduce((sum, [x, y]) => sum + (y - d - slope * (x - t)) ** 2, 0) / Math.max(1, n - 2));
  return { slope, contact: t - d / slope, rms };
}

function drawn(touch, parts, width) {
  const height = 190, left = 48, right = width - 8, top = 12, bottom = height - 26;
  const { times, depth } = touch, from = times[Math.max(0, parts.first - 30)], to = times[Math.min(times.length - 1, parts.last + 30)];
  const x = (t) => left + ((right - left) * (t - from)) / (to - from), y = (d) => bottom - ((bottom - top) * d) / (1.08 * parts.most);
  const points = times.map((t, k) => [t, depth[k]]).filter(([t]) => t >= from && t <= to).map(([t, d]) => `${x(t).toFixed(1)},${y(d).toFixed(1)}`);
  const line = parts.line, word = (t1, t2, text) => s("text", { x: x((t1 + t2) / 2), y: height - 6, "text-anchor": "middle" }, text);
  return s("svg", { viewBox: `0 0 ${width} ${height}`, class: "touchpicture", role: "img", "aria-label": "Deflection over time in the newest touch" },
    s("rect", { class: "part", x: x(times[parts.top]), width: Math.max(1, x(times[parts.end]) - x(times[parts.top])), y: top, height: bottom - top }),
    [0, 0.5, 1].map((part) => [s("line", { class: "grid", x1: left, x2: right, y1: y(part * parts.most), y2: y(part * parts.most) }), s("text", { x: left - 5, y: y(part * parts.most) + 4, "text-anchor": "end" }, (part * parts.most).toFixed(0))]),
    s("text", { x: 2, y: 11 }, "µm"), s("polyline", { class: "trace", points: points.join(" ") }),
    line && s("line", { class: "fit", x1: x(Math.max(from, line.contact)), y1: y(0), x2: x(times[parts.top]), y2: y(line.slope * (times[parts.top] - line.contact)) }),
    from <= 0 && to >= 0 && s("line", { class: "stamp", x1: x(0), x2: x(0), y1: top, y2: bottom }),
    word(times[parts.first], times[parts.top], "in"), word(times[parts.top], times[parts.end], "dwell"), word(times[parts.end], times[parts.last], "out"));
}

const ms = (seconds) => `${(1e3 * seconds).toFixed(seconds < 0.1 ? 1 : 0)} ms`;

// holder: filled with the touch. channels: of the deflection, each with its index and um per unit.
export function touchDetail(holder, window_, channels, trigger) {
  const touch = depthOf(window_, channels, trigger.at_ns), parts = partsOf(touch);
  holder.classList.toggle("hidden", parts === null);
  if (parts === null) return;
  const { times } = touch, row = (word, value) => [h("dt", null, word), h("dd", null, value)];
  show(holder, h("h3", null, `Newest touch: trigger ${trigger.number}`), h("div", { class: "columns touch" }, h("div", null, drawn(touch, parts, Math.max(300, Math.min(1100, holder.clientWidth * 0.68 || 600)))),
    h("dl", null, row("in", ms(times[parts.top] - times[parts.first])), row("dwell", ms(times[parts.end] - times[parts.top])), row("out", ms(times[parts.last] - times[parts.end])), row("deepest", `${parts.most.toFixed(1)} µm`),
      parts.line && [row("speed on the way in", `${(parts.line.slope * 1e-3).toFixed(2)} mm/s`), row("off the line, rms", `${parts.line.rms.toFixed(2)} µm`), row("line meets zero", `${ms(parts.line.contact)} after the trigger`)])));
}

export const WINDOW = { before_ns: BEFORE_NS, after_ns: AFTER_NS, columns: COLUMNS };
