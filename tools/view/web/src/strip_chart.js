// Strip charts: the minimum and the maximum of every slot of time, moving evenly under a fixed time axis.
import uPlot from "uplot";
import { Envelope } from "./envelope.js";

const KEPT = 6000; // slots of 10 ms: a minute
const SERIES = ["--series1", "--series2", "--series3"];

// Colours are looked up once for each scheme: a chart needs them 60 times a second.
export const dark = matchMedia("(prefers-color-scheme: dark)");
const palette = new Map();
dark.addEventListener("change", () => palette.clear());
function colour(name) {
  if (!palette.has(name)) palette.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return palette.get(name);
}

// The minimum and maximum of every channel in slots of 10 ms, the newest at the end. Lost samples leave a gap.
export class Slots {
  constructor(channels) {
    this.times = [];
    this.low = Array.from({ length: channels }, () => []);
    this.high = Array.from({ length: channels }, () => []);
    this.next = null;
    this.seen = 0;
  }
  add(batch) {
    this.seen += batch.slots.length;
    if (this.next !== null && batch.slots[0] < this.next) this.clear(); // the box was restarted, or is told again
    batch.slots.forEach((slot, k) => {
      if (this.next !== null && slot > this.next) this.push(this.next * batch.slot_ns * 1e-9, () => null, () => null);
      this.push(slot * batch.slot_ns * 1e-9, (c) => batch.low[c][k], (c) => batch.high[c][k]);
      this.next = slot + 1;
    });
    const over = this.times.length - KEPT;
    if (over > 0) for (const column of this.columns()) column.splice(0, over);
  }
  push(time, low, high) {
    this.times.push(time);
    this.low.forEach((column, c) => column.push(low(c)));
    this.high.forEach((column, c) => column.push(high(c)));
  }
  columns() { return [this.times, ...this.low, ...this.high]; }
  clear() { this.next = null; for (const column of this.columns()) column.length = 0; }
}

// The time at the right edge. Slots come in pieces of 50 ms; the edge follows a tenth of a second behind the newest one, at
// an even pace, so that a chart moves with every picture of the screen.
export class Edge {
  constructor() { this.at = null; this.before = 0; }
  // now_s: of the page. newest_s: of the newest slot. even: false where somebody wants no motion.
  follow(now_s, newest_s, even) {
    const passed = now_s - this.before, behind = newest_s - this.at;
    this.before = now_s;
    if (!even || this.at === null || Math.abs(behind) > 0.5) this.at = newest_s;
    else this.at = Math.min(newest_s, this.at + passed * Math.max(0.5, 1 + 2 * (behind - 0.1)));
    return this.at;
  }
}

// A chart of some channels: each a band from its minimum to its maximum. zero: the time that its axis counts from.
export function chart(holder, title, channels, unit, zero) {
  const series = [{ label: "Time", value: (_, t) => (t === null ? "–" : `${(t - zero()).toFixed(3)} s`) }];
  const strokes = channels.map((_, k) => () => colour(SERIES[k % SERIES.length]));
  channels.forEach((channel, k) => {
    for (const what of ["max", "min"]) series.push({ label: `${channel.label} ${what}`, stroke: strokes[k], paths: () => null, points: { show: false } });
  });
  const envelope = new Envelope();
  const axis = { stroke: () => colour("--soft"), grid: { stroke: () => colour("--grid") }, ticks: { stroke: () => colour("--grid") } };
  // The marks stand still while the samples pass.
  const splits = (_, __, low, high, step) => {
    const marks = [];
    for (let k = Math.ceil((low - zero()) / step - 1e-6); k * step <= high - zero() + 1e-6 * step; ++k) marks.push(zero() + k * step);
    return marks;
  };
  const values = (_, marks) => marks.map((mark) => String(Number((mark - zero()).toFixed(6))));
  const plot = new uPlot({
    title, width: Math.max(280, holder.clientWidth), height: 230, series, hooks: { draw: [(plot) => envelope.draw(plot, strokes.map((stroke) => stroke()))] },
    scales: { x: { time: false }, y: { range: (_, low, high) => { const room = Math.max((high - low) * 0.1, 1e-6); return [low - room, high + room]; } } },
    axes: [{ ...axis, label: "s before now", labelSize: 22, labelFont: "12px sans-serif", splits, values }, { ...axis, label: unit, size: 72, labelSize: 18, labelFont: "12px sans-serif" }],
    legend: { live: true, markers: { stroke: (_, k) => `var(${SERIES[((k - 1) >> 1) % SERIES.length]})` } }, // as the scheme of the page is
     cursor: { sync: { key: "probebox" }, drag: { x: true, y: false } },
  }, series.map(() => []), holder);
  plot.some = channels;
  // times, low and high as Slots or a window have them.
  plot.take = ({ times, low, high }, reset) => plot.setData([times, ...channels.flatMap(({ index }) => [high[index], low[index]])], reset);
  return plot;
}
