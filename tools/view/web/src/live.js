import { get, last, on } from "./box.js";
import { channelOf, meanOf, settleDecimals, text } from "./channels.js";
import { h, say, show } from "./dom.js";
import { state as stateOf } from "./icons.js";
import { facts } from "./live_facts.js";
import { chart, dark, Edge, HEIGHT, Slots } from "./strip_chart.js";
import { touchDetail, WINDOW } from "./touch_detail.js";

const SPANS = [5, 20, 60];
const STANDS_MM = 0.005; // an axis that moves less between two states stands still
const still = matchMedia("(prefers-reduced-motion: reduce)");

export function live(main) {
  let slots = null, channels = [], charts = [], span = 20, paused = false, armed = false, frozen = null, shownAt = 0, settledAt = 0, touchOf = 0;
  let zero = 0, changed = false; // the time at the right edge, s; are there other samples than those drawn?
  const edge = new Edge();
  const positions = h("div", { class: "readouts positions" }), told = facts();
  const columns = h("div", { class: "charts" }), touch = h("section", { class: "panel hidden", "aria-label": "Newest touch" });
  const status = h("p", { class: "small", role: "status" });
  const pause = h("button", { "aria-pressed": "false", onclick: () => hold(!paused) }, "Pause (space)");
  const freeze = h("button", { "aria-pressed": "false", onclick: () => arm(!armed) }, "Freeze at trigger (f)");
  const choose = h("select", { "aria-label": "Length of the charts", onchange: (event) => { span = Number(event.target.value); changed = true; } },
    SPANS.map((one) => h("option", { value: one, selected: one === span }, `${one} s`)));
  show(main, h("h2", { class: "hidden" }, "Live"), positions, told.element, h("div", { class: "bar" }, pause, freeze, choose, status), columns, touch);

  function hold(yes) {
    paused = yes;
    frozen = null;
    changed = true;
    if (paused && slots) { // what is looked at stays, and what comes meanwhile is kept for later
      const kept = { times: [...slots.times], low: slots.low.map((one) => [...one]), high: slots.high.map((one) => [...one]) };
      for (const plot of charts) plot.take(kept, false);
    }
    pause.setAttribute("aria-pressed", paused);
    say(status, paused ? "Paused. Times are s before now. Drag to look closer, double click to see all." : "");
  }
  function arm(yes) {
    armed = yes;
    freeze.setAttribute("aria-pressed", armed);
    say(status, armed ? "Waiting for a trigger." : "");
  }

  function strip(channel, number) {
    channel.output = h("output", { class: "value", "aria-live": "off" }, "–");
    channel.heading = h("b");
    const holder = h("div", { class: "chart" }, h("div", { class: "top" }, channel.heading, channel.output));
    return { holder, make: () => chart(holder, channel, number, () => zero, (at) => { channel.at = at; }) };
  }
  // Told more than once: the charts go on where the channels stay.
  let known = "";
  function prepare(descriptor) {
    const names = JSON.stringify(descriptor.channels);
    if (names === known) return;
    known = names;
    channels = descriptor.channels.map(channelOf);
    slots = new Slots(channels.length);
    for (const one of charts) one.destroy();
    const drawn = [channels.filter((one) => one.deflection), channels.filter((one) => one.name.startsWith("position"))].map((some) => some.map(strip));
    show(columns, drawn.map((some) => h("div", null, some.map((one) => one.holder))));
    charts = drawn.flat().map((one) => one.make());
    show(positions, channels.filter((one) => one.name.startsWith("position")).map((channel) => {
      channel.big = h("output", { class: "value", "aria-live": "off" }, "–");
      channel.note = h("small");
      return h("section", { class: "tile" }, h("h3", null, channel.letter), channel.big, channel.note);
    }));
    for (const channel of channels) name(channel);
  }
  function name(channel) {
    if (channel.heading === undefined) return;
    say(channel.heading, channel.deflection ? `Deflection ${channel.letter}, ${channel.unit}` : `${channel.letter}, ${channel.unit}, ${channel.machine ? "machine" : "as counted"}`);
  }

  function numbers(now) {
    if (!slots || slots.times.length === 0) return;
    const settle = now - settledAt > 1000;
    if (settle) settledAt = now;
    for (const channel of channels) {
      if (!channel.output) continue;
      if (settle) settleDecimals(channel, slots);
      const value = meanOf(channel, slots), at = channel.at, shown = (one) => text(one * channel.shown.factor + channel.shown.offset, channel.decimals);
      say(channel.output, at ? `${shown(at.low)} … ${shown(at.high)} at ${at.time_s.toFixed(2)} s` : value === null ? "–" : text(value, channel.decimals));
      if (channel.big && !channel.machine && value !== null) say(channel.big, text(value, channel.decimals));
    }
  }

  // One picture of the screen. Samples are handed over when there are others; only the axis moves in between.
  function draw(now) {
    frame = requestAnimationFrame(draw);
    if (slots === null || slots.times.length === 0) return;
    if (now - shownAt > 200) { numbers(now); shownAt = now; }
    if (paused) return;
    const before = zero;
    zero = edge.follow(now * 1e-3, slots.times.at(-1), !still.matches);
    if (zero === before && !changed) return;
    for (const plot of charts) {
      plot.batch(() => {
        if (changed) plot.take(slots, false);
        plot.setScale("x", { min: zero - span, max: zero });
      });
    }
    changed = false;
  }

  async function freezeAt(trigger) {
    armed = false;
    freeze.setAttribute("aria-pressed", "false");
    await new Promise((done) => { setTimeout(done, 700); });
    const at = trigger.at_ns;
    const window_ = await get("window", { from_ns: Math.round(at - 4e8), to_ns: Math.round(at + 5e8), columns: 1800 });
    frozen = trigger;
    zero = 0;
    const times = window_.times_ns.map((t) => (t - at) * 1e-9);
    for (const plot of charts) plot.take({ ...window_, times }, true);
    say(status, `Frozen at trigger ${trigger.number}. Times are s after its stamp. ${window_.samples_per_column === 1 ? "Every sample is drawn." : `The extremes of ${window_.samples_per_column} samples a column.`}`);
    show(pause, "Live again (space)");
    paused = true;
  }

  // The newest touch in detail, once it is over. Of touches in quick order one at a time.
  let looking = false;
  async function look(trigger) {
    if (looking) return;
    looking = true;
    try {
      await new Promise((done) => { setTimeout(done, WINDOW.after_ns * 1e-6 + 150); });
      const window_ = await get("window", { from_ns: Math.round(trigger.at_ns - WINDOW.before_ns), to_ns: Math.round(trigger.at_ns + WINDOW.after_ns), columns: WINDOW.columns });
      const some = channels.filter((one) => one.deflection);
      if (some.length > 0 && window_.times_ns.length > 0 && !paused) touchDetail(touch, window_, some, trigger);
    } catch { /* a lost link is told elsewhere */ } finally { looking = false; }
  }

  // Samples hold what the encoders count; where an axis is referenced, the box knows its machine position. What both differ by is
  // learned while the axis stands still.
  function place(channel, axis, counted) {
    const was = channel.machine;
    channel.machine = axis?.referenced === true;
    if (channel.machine) {
      say(channel.big, axis.position_mm.toFixed(channel.decimals));
      const stands = Math.abs(counted - channel.counted_before) < STANDS_MM, off = axis.position_mm - counted - channel.shown.offset;
      if (stands && Math.abs(off) > STANDS_MM) { channel.shown.offset += off; changed = true; }
    } else if (was) { channel.shown.offset = 0; changed = true; }
    channel.counted_before = counted;
    if (was === channel.machine) return;
    show(channel.note, stateOf(channel.machine ? "yes" : "check", channel.machine ? "machine mm, referenced" : `${channel.unit} as counted, not referenced`));
    name(channel);
  }

  function tell(one) {
    told.tell(one);
    const c = one.corrections;
    channels.filter((channel) => channel.name.startsWith("position")).forEach((channel, k) => {
      if (c) place(channel, c.axes[k], one.values?.[channel.index]);
      else if (channel.machine === undefined) say(channel.note, `${channel.unit}, as counted`); // a recording has none, and a box may fail to answer once
    });
  }

  let frame = 0;
  const offs = [
    on("descriptor", prepare),
    on("samples", (batch) => { if (slots && batch.low.length === channels.length) { slots.add(batch); changed = true; } }),
    on("state", tell),
    on("link", ({ up }) => { main.classList.toggle("stale", !up); if (!paused && !armed) say(status, up ? "" : "The link is lost: these are the last values."); }),
    () => main.classList.remove("stale"),
    on("trigger", (trigger) => {
      told.trigger(trigger);
      if (armed) freezeAt(trigger).catch((error) => say(status, error.message));
      if (trigger.number !== touchOf) { touchOf = trigger.number; look(trigger); }
    }),
  ];
  const keys = (event) => {
    if (event.target.closest("input, select, textarea, button") && event.key === " ") return;
    if (event.key === " ") { event.preventDefault(); pause.click(); }
    if (event.key === "f") freeze.click();
  };
  const unpause = () => { if (!paused) show(pause, "Pause (space)"); };
  pause.addEventListener("click", unpause);
  const fit = () => { for (const plot of charts) plot.setSize({ width: Math.max(260, plot.root.parentElement.clientWidth - 20), height: HEIGHT }); };
  addEventListener("keydown", keys);
  addEventListener("resize", fit);
  const recolour = () => { for (const plot of charts) plot.redraw(false); };
  dark.addEventListener("change", recolour);
  if (last.trigger === undefined) told.trigger(null);
  fit();
  frame = requestAnimationFrame(draw);
  // For the tests of the frame rate and of memory.
  window.probeboxLive = {
    slots: () => slots?.times.length ?? 0, isFrozen: () => frozen !== null, edge: () => zero, seen: () => slots?.seen ?? 0, newest: () => slots?.times.at(-1) ?? 0,
    points: () => charts.map((plot) => plot.series[0].idxs?.[1] - plot.series[0].idxs?.[0] + 1), highest: (channel) => Math.max(...slots.high[channel]),
  };
  return () => {
    cancelAnimationFrame(frame);
    for (const off of offs) off();
    removeEventListener("keydown", keys);
    removeEventListener("resize", fit);
    dark.removeEventListener("change", recolour);
    for (const plot of charts) plot.destroy();
  };
}
