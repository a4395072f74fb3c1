// Strip charts, one a channel: the minimum and the maximum of every slot of time, moving evenly under a fixed time axis.
import uPlot from "uplot";
import { Envelope } from "./envelope.js";

const KEPT = 6000; // slots of 10 ms: a minute
const SERIES = ["--series1", "--series2", "--series3"];
export const HEIGHT = 128; // px of a chart

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

// A chart of one channel: a band from its minimum to its maximum. channel.shown: from its value to the one that is shown,
// { factor, offset }. zero: the time that the axis counts from. tell: called with what the cursor points at, or null.
export function chart(holder, channel, colourNumber, zero, tell) {
  const stroke = () => colour(SERIES[colourNumber % SERIES.length]);
  const series = [{}, ...["max", "min"].map(() => ({ stroke, paths: () => null, points: { show: false } }))];
  const envelope = new Envelope();
  const axis = { stroke: () => colour("--soft"), grid: { stroke: () => colour("--grid") }, ticks: { show: false }, font: "12px sans-serif" };
  // The marks of time stand still while the samples pass; those of values are whole in the unit that is shown.
  const marksOfTime = (_, __, low, high, step) => {
    const marks = [];
    for (let k = Math.ceil((low - zero()) / step - 1e-6); k * step <= high - zero() + 1e-6 * step; ++k) marks.push(zero() + k * step);
    return marks;
  };
  const marksOfValue = (_, __, low, high, step) => {
    const { factor, offset } = channel.shown, marks = [];
    for (let k = Math.ceil((low * factor + offset) / (step * factor) - 1e-6); k * step * factor <= high * factor + offset + 1e-6 * step; ++k) marks.push((k * step * factor - offset) / factor);
    return marks;
  };
  const decimals = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const valueTexts = (_, marks, __, ___, step) => marks.map((mark) => (mark * channel.shown.factor + channel.shown.offset).toFixed(decimals(step * channel.shown.factor)));
  const point = (plot) => {
    const at = plot.cursor.idx, [times, high, low] = plot.data;
    tell(at === null || at === undefined || high[at] === null || high[at] === undefined ? null : { time_s: times[at] - zero(), low: low[at], high: high[at] });
  };
  const plot = new uPlot({
    width: Math.max(260, holder.clientWidth), height: HEIGHT, series, legend: { show: false }, padding: [6, 8, 0, 0],
    hooks: { draw: [(plot) => envelope.draw(plot, [stroke()])], setCursor: [point] },
    scales: { x: { time: false }, y: { range: (_, low, high) => { const room = Math.max((high - low) * 0.1, channel.least); return [low - room, high + room]; } } },
    axes: [{ ...axis, size: 26, splits: marksOfTime, values: (_, marks) => marks.map((mark) => { const text = String(Number((mark - zero()).toFixed(6))); return mark === marks.at(-1) ? `${text} s` : text; }) },
      { ...axis, size: 66, space: 28, splits: marksOfValue, values: valueTexts }],
    cursor: { sync: { key: "probebox" }, drag: { x: true, y: false } },
  }, series.map(() => []), holder);
  // times, low and high as Slots or a window have them.
  plot.take = ({ times, low, high }, reset) => plot.setData([times, high[channel.index], low[channel.index]], reset);
  return plot;
}
