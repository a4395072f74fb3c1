// What rests on what, as a drawing: each result right of those that it was computed with.
import { s } from "./dom.js";

const WIDTH = 190, HEIGHT = 50, ACROSS = 250, DOWN = 66;

// The results that one rests on and those that rest on it, each with its column: 0 is the one itself.
function related(all, id) {
  const known = new Map(all.map((one) => [one.id, one])), column = new Map([[id, 0]]);
  const walk = (from, step, next) => {
    for (const other of next(from)) {
      if (!known.has(other) || column.has(other)) continue;
      column.set(other, column.get(from) + step);
      walk(other, step, next);
    }
  };
  walk(id, -1, (one) => (known.get(one)?.rests_on ?? []).map((other) => other.id));
  walk(id, 1, (one) => all.filter((other) => (other.rests_on ?? []).some((r) => r.id === one)).map((other) => other.id));
  return { known, column };
}

export function restsOn(all, id) {
  const { known, column } = related(all, id);
  if (column.size < 2) return null;
  const first = Math.min(...column.values()), rows = new Map(), place = new Map();
  for (const [one, at] of [...column].sort(([a], [b]) => a - b)) {
    const row = rows.get(at) ?? 0;
    rows.set(at, row + 1);
    place.set(one, [(at - first) * ACROSS + 1, row * DOWN + 1]);
  }
  const width = Math.max(...[...place.values()].map(([x]) => x)) + WIDTH + 2, height = Math.max(...[...place.values()].map(([, y]) => y)) + HEIGHT + 2;
  const arrow = (from, to) => {
    const [x1, y1] = place.get(from), [x2, y2] = place.get(to), a = [x1 + WIDTH, y1 + HEIGHT / 2], b = [x2, y2 + HEIGHT / 2];
    return s("path", { d: `M${a} C${a[0] + 30},${a[1]} ${b[0] - 30},${b[1]} ${b} m-7,-4 l7,4 l-7,4` });
  };
  return s("svg", { viewBox: `0 0 ${width} ${height}`, width, height, class: "rests", role: "img", style: "max-width:100%;height:auto", "aria-label": "What rests on what" },
    [...place.keys()].flatMap((one) => (known.get(one).rests_on ?? []).filter((other) => place.has(other.id)).map((other) => arrow(other.id, one))),
    [...place].map(([one, [x, y]]) => s("a", { href: `#results/${one}` }, s("g", { class: `${one === id ? "now" : ""} ${known.get(one).state === "retired" ? "retired" : ""}`, transform: `translate(${x} ${y})` },
      s("rect", { width: WIDTH, height: HEIGHT, rx: 7 }), s("text", { x: 12, y: 21 }, known.get(one).title.slice(0, 24)), s("text", { class: "soft", x: 12, y: 39 }, `No. ${one}, ${known.get(one).standing}`)))));
}
