// The last results about one subject over each other: value with U, mean and control limits, the limit that is required.
import { h, s } from "./dom.js";

const day = (utc) => (/^\d{4}-/.test(utc ?? "") ? utc.slice(0, 10) : "");

// Marks at 1, 2 or 5 times a power of ten, about `count` of them.
function marks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= raw);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Array.from({ length: last - first + 1 }, (_, k) => ({ at: (first + k) * step, text: ((first + k) * step).toFixed(digits) }));
}

// What the drawing has to hold. Limits far away would press the values into a line: they are then named and not drawn.
function extent(trend) {
  const reach = trend.points.flatMap((p) => [p.value - (p.expanded_k2 ?? 0), p.value + (p.expanded_k2 ?? 0)]);
  if (trend.control) reach.push(trend.control.low, trend.control.high);
  let low = Math.min(...reach), high = Math.max(...reach);
  const room = high - low || Math.abs(high) || 1;
  for (const limit of limitsOf(trend)) if (limit < high + 2 * room && limit > low - 2 * room) { low = Math.min(low, limit); high = Math.max(high, limit); }
  const air = 0.08 * (high - low || Math.abs(high) || 1);
  return [low - air, high + air];
}

// A limit of errors holds to either side of zero; that of other values is one of U, which the values do not show.
const limitsOf = (trend) => (trend.limit === null ? [] : trend.points.some((p) => p.value < 0) ? [trend.limit, -trend.limit] : [trend.limit]);

function picture(trend, width, { height, chosen }) {
  const [low, high] = extent(trend);
  const scale = marks(low, high, height > 150 ? 5 : 4);
  const left = 14 + 7.2 * Math.max(...scale.map((one) => one.text.length), 2), right = width - 62, top = 20, bottom = height - 22;
  const y = (v) => top + ((bottom - top) * (high - v)) / (high - low);
  const x = (k) => (trend.points.length === 1 ? (left + right) / 2 : left + 16 + (k * (right - left - 32)) / (trend.points.length - 1));
  const across = (v, name, word) => [s("line", { class: name, x1: left, x2: right, y1: y(v), y2: y(v) }), word && s("text", { x: right + 5, y: y(v) + 4, class: name === "limit" ? "limit" : null }, word)];
  const few = trend.points.length <= Math.max(2, Math.floor((right - left) / 60));
  const control = trend.control;
  return s("svg", { viewBox: `0 0 ${width} ${height}`, height, class: "trend", role: "img", "aria-label": `${trend.name}, ${trend.unit}: ${trend.points.map((p) => `result ${p.id}`).join(", ")}` },
    control && s("rect", { class: "band", x: left, width: right - left, y: y(control.high), height: Math.max(1, y(control.low) - y(control.high)) }),
    scale.map((one) => [s("line", { class: "grid", x1: left, x2: right, y1: y(one.at), y2: y(one.at) }), s("text", { x: left - 6, y: y(one.at) + 4, "text-anchor": "end" }, one.text)]),
    s("text", { x: 2, y: 12 }, trend.unit), s("line", { class: "axis", x1: left, x2: left, y1: top, y2: bottom }), s("line", { class: "axis", x1: left, x2: right, y1: bottom, y2: bottom }),
    control && [across(control.mean, "mean", "mean"), across(control.high, "control", Math.abs(y(control.high) - y(control.mean)) > 12 && "control"), across(control.low, "control", "")],
    limitsOf(trend).filter((limit) => limit >= low && limit <= high).map((limit) => across(limit, "limit", "limit")),
    trend.points.length > 1 && s("polyline", { class: "path", points: trend.points.map((p, k) => `${x(k)},${y(p.value)}`).join(" ") }),
    trend.points.map((p, k) => {
      const u = p.expanded_k2 ?? 0, now = p.id === chosen;
      return s("g", { class: now ? "point now" : "point" }, s("title", null, `Result ${p.id}${day(p.utc) && `, ${day(p.utc)}`}`), s("line", { x1: x(k), x2: x(k), y1: y(p.value - u), y2: y(p.value + u) }), s("circle", { cx: x(k), cy: y(p.value), r: now ? 6 : 4 }),
        (few || now || k === 0) && s("text", { x: x(k), y: bottom + 16, "text-anchor": "middle" }, `No. ${p.id}`));
    }));
}

// The width of the page counts: letters keep their size on a phone.
function fitted(draw) {
  const holder = h("div");
  let width = 0;
  new ResizeObserver(() => {
    const now = Math.floor(holder.clientWidth);
    if (now > 60 && now !== width) { width = now; holder.replaceChildren(draw(width)); }
  }).observe(holder);
  return holder;
}

export function trendFigure(trend, { height = 220, chosen = null, caption = true } = {}) {
  if (!trend || trend.points.length === 0) return null;
  const whole = trend.points.length === 1 ? "one result so far" : `the last ${trend.points.length} results`;
  const words = `${trend.name}, ${whole}; bars are U (k = 2)${trend.control ? "; shaded: mean and control limits, 2.66 mean moving ranges" : ""}`;
  return h("figure", null, caption && h("figcaption", null, words), fitted((width) => picture(trend, width, { height, chosen })));
}
