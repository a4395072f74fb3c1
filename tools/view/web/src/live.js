import { get, last, on } from "./box.js";
import { h, say, show } from "./dom.js";
import { chart, dark, Edge, Slots } from "./strip_chart.js";

const SPANS = [5, 20, 60];
const still = matchMedia("(prefers-reduced-motion: reduce)");

const bar = (value, scale) => {
  const part = Math.max(-1, Math.min(1, value / scale));
  return `left:${part < 0 ? 50 + 50 * part : 50}%;width:${Math.abs(part) * 50}%`;
};

const scaleFor = (peak) => { let scale = 1000; for (let k = 0; scale < peak && k < 60; ++k) scale *= k % 3 === 1 ? 2.5 : 2; return scale; };

function readouts() {
  const tiles = {};
  const tile = (key, title, wide) => {
    const value = h("output", { class: "value", "aria-live": "off" }, "–");
    const note = h("small", null, "");
    tiles[key] = { value, note, box: h("section", { class: wide ? "tile wide2" : "tile" }, h("h3", null, title), value, note) };
    return tiles[key].box;
  };
  return { tiles, tile };
}

export function live(main) {
  let slots = null, channels = [], charts = [], span = 20, paused = false, armed = false, frozen = null, peak = 0, shownAt = 0;
  let zero = 0, changed = false; // the time at the right edge, s; are there other samples than those drawn?
  const edge = new Edge();
  const positions = h("div", { class: "readouts positions" });
  const deflections = h("div", { class: "readouts" });
  const { tiles, tile } = readouts();
  const state = h("div", { class: "readouts" }, tile("clock", "Master clock"), tile("ledger", "Samples", true), tile("correction", "Correction, µm", true),
    tile("cut", "Cut"), tile("trigger", "Last trigger", true), tile("result", "In force"), tile("angles", "Angles, degrees", true));
  tiles.angles.box.classList.add("hidden");
  const holders = [h("div", { class: "chart" }), h("div", { class: "chart" })];
  const status = h("p", { class: "small", role: "status" });
  const pause = h("button", { "aria-pressed": "false", onclick: () => hold(!paused) }, "Pause (space)");
  const freeze = h("button", { "aria-pressed": "false", onclick: () => arm(!armed) }, "Freeze at trigger (f)");
  const choose = h("select", { "aria-label": "Length of the charts", onchange: (event) => { span = Number(event.target.value); changed = true; } },
    SPANS.map((one) => h("option", { value: one, selected: one === span }, `${one} s`)));
  show(main, h("h2", { class: "hidden" }, "Live"), positions, deflections, state,
    h("div", { class: "bar" }, pause, freeze, choose, status), holders);

  function hold(yes) {
    paused = yes;
    frozen = null;
    changed = true;
    if (paused && slots) { // what is looked at stays, and what comes meanwhile is kept for later
      const kept = { times: [...slots.times], low: slots.low.map((one) => [...one]), high: slots.high.map((one) => [...one]) };
      for (const plot of charts) plot.take(kept, false);
    }
    for (const plot of charts) plot.axes[0].label = "s before now";
    pause.setAttribute("aria-pressed", paused);
    say(status, paused ? "Paused. Drag to look closer, double click to see all; the cursor shows values." : "");
  }
  function arm(yes) {
    armed = yes;
    freeze.setAttribute("aria-pressed", armed);
    say(status, armed ? "Waiting for a trigger." : "");
  }

  // Told more than once: the charts go on where the channels stay.
  let known = "";
  function prepare(descriptor) {
    const names = JSON.stringify(descriptor.channels);
    if (names === known) return;
    known = names;
    channels = descriptor.channels.map((channel, index) => ({ ...channel, index, label: channel.name.replace(/^.*_/, "") }));
    slots = new Slots(channels.length);
    for (const one of charts) one.destroy();
    const of = (kind) => channels.filter((channel) => channel.name.startsWith(kind));
    const sets = [["Deflection", of("deflection")], ["Position", of("position")]];
    charts = sets.map(([title, some], k) => chart(holders[k], k === 0 ? title : `${title}, as the encoders count`, some, some[0]?.unit ?? "", () => zero));
    const big = (channel, box) => { channel.output = h("output", { class: "value", "aria-live": "off" }, "–"); box.append(h("section", { class: "tile" }, h("h3", null, channel.name.startsWith("deflection") ? `Deflection ${channel.label}` : channel.label.toUpperCase()), channel.output, (channel.note = h("small", null, channel.unit)), channel.track)); };
    show(positions); show(deflections);
    for (const channel of of("position")) big(channel, positions);
    for (const channel of of("deflection")) { channel.fill = h("span"); channel.track = h("div", { class: "track", "aria-hidden": "true" }, channel.fill); big(channel, deflections); }
  }

  function numbers() {
    if (!slots || slots.times.length === 0) return;
    peak = 0;
    for (const channel of channels) if (channel.fill) peak = Math.max(peak, ...slots.high[channel.index].slice(-1000).map(Math.abs), ...slots.low[channel.index].slice(-1000).map(Math.abs));
    const scale = scaleFor(peak);
    for (const channel of channels) {
      if (!channel.output) continue;
      if (channel.machine) continue; // of the machine, by the state
      const value = (slots.high[channel.index].at(-1) + slots.low[channel.index].at(-1)) / 2;
      say(channel.output, channel.unit === "mm" ? value.toFixed(4) : Math.round(value).toString());
      if (channel.fill) channel.fill.style.cssText = bar(value, scale);
    }
  }

  // One picture of the screen. Samples are handed over when there are others; only the axis moves in between.
  function draw(now) {
    frame = requestAnimationFrame(draw);
    if (slots === null || slots.times.length === 0 || paused) return;
    if (now - shownAt > 100) { numbers(); shownAt = now; }
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
    for (const plot of charts) {
      plot.axes[0].label = "s after the trigger";
      plot.take({ ...window_, times }, true);
    }
    say(status, `Frozen at trigger ${trigger.number}: 0 s is its stamp. ${window_.samples_per_column === 1 ? "Every sample is drawn." : `The extremes of ${window_.samples_per_column} samples a column.`}`);
    show(pause, "Live again (space)");
    paused = true;
  }

  function tell(one) {
    const c = one.corrections;
    // Samples hold what the encoders count; where an axis is referenced, the box knows its machine position.
    channels.filter((channel) => channel.name.startsWith("position")).forEach((channel, k) => {
      if (!c) { // a recording has none, and a box may fail to answer once: then what it said before still holds
        if (channel.machine === undefined) say(channel.note, `${channel.unit}, as counted`);
        return;
      }
      channel.machine = c.axes[k]?.referenced === true;
      say(channel.note, channel.machine ? `${channel.unit}, machine` : `${channel.unit}, not referenced`);
      if (channel.machine) say(channel.output, c.axes[k].position_mm.toFixed(4));
    });
    say(tiles.clock.value, one.clock?.state ?? "–");
    tiles.clock.box.dataset.state = one.clock?.state === "locked" ? "pass" : one.clock?.state === "holdover" ? "warned" : "failed";
    say(tiles.clock.note, one.clock ? `sigma ${Math.round(one.clock.sigma_ns)} ns` : "");
    const l = one.ledger;
    const lost = l.lost_at_source_samples + l.lost_in_queue_samples + l.lost_on_link_samples;
    say(tiles.ledger.value, `${l.received_samples.toLocaleString("en")} + ${lost.toLocaleString("en")} lost`);
    tiles.ledger.box.dataset.state = !l.balanced ? "failed" : lost > 0 ? "warned" : "pass";
    say(tiles.ledger.note, `${l.balanced ? "exact" : "does not balance"}${l.box_restarts > 0 ? " since the box was restarted, unknown before" : ""}: source ${l.lost_at_source_samples}, queue ${l.lost_in_queue_samples}, link ${l.lost_on_link_samples}`);
    if (c) {
      say(tiles.correction.value, c.correction_mm.map((mm, k) => `${"XYZ"[k]} ${(mm * 1e3).toFixed(1)}`).join("  "));
      tiles.correction.box.dataset.state = !c.valid ? "failed" : c.degraded ? "warned" : "pass";
      show(tiles.correction.note, c.sources.map((source) => h("span", { class: `chip ${{ good: "pass", held: "warned", invalid: source.summed ? "failed" : "off" }[source.health] ?? "off"}` }, `${source.source} ${source.health}`)));
      const turned = c.rotary_axes ?? [];
      tiles.angles.box.classList.toggle("hidden", turned.length === 0);
      tiles.angles.box.dataset.state = turned.some((axis) => axis.doubtful || axis.angle_deg === null) ? "warned" : "";
      say(tiles.angles.value, turned.map((axis) => `${axis.axis} ${axis.angle_deg === null ? "–" : axis.angle_deg.toFixed(4)}`).join("  "));
      say(tiles.angles.note, turned.filter((axis) => axis.doubtful || axis.angle_deg === null).map((axis) => `${axis.axis} ${axis.angle_deg === null ? "is not referenced" : "in doubt"}`).join("; "));
      const holders_ = one.status?.inhibits ?? [];
      say(tiles.cut.value, c.inhibited ? "on" : "none");
      tiles.cut.box.dataset.state = c.inhibited ? "warned" : "";
      say(tiles.cut.note, holders_.map((holder) => `${holder.connection} ${holder.by}`).join("; "));
    }
    say(tiles.result.value, String(one.active_results?.length ?? "–"));
    say(tiles.result.note, one.active_results?.length === 1 ? "result" : "results");
  }

  let frame = 0;
  const offs = [
    on("descriptor", prepare),
    on("samples", (batch) => { if (slots && batch.low.length === channels.length) { slots.add(batch); changed = true; } }),
    on("state", tell),
    on("link", ({ up }) => { main.classList.toggle("stale", !up); if (!paused && !armed) say(status, up ? "" : "The link is lost: these are the last values."); }),
    () => main.classList.remove("stale"),
    on("trigger", (trigger) => {
      say(tiles.trigger.value, `${trigger.number}`);
      say(tiles.trigger.note, `line ${trigger.line}: ` + trigger.position_mm.map((mm, k) => `${"XYZ"[k]} ${mm === null ? "–" : mm.toFixed(4)}`).join("  "));
      if (armed) freezeAt(trigger).catch((error) => say(status, error.message));
    }),
  ];
  const keys = (event) => {
    if (event.target.closest("input, select, textarea, button") && event.key === " ") return;
    if (event.key === " ") { event.preventDefault(); pause.click(); }
    if (event.key === "f") freeze.click();
  };
  const unpause = () => { if (!paused) show(pause, "Pause (space)"); };
  pause.addEventListener("click", unpause);
  const fit = () => { for (const [k, plot] of charts.entries()) plot.setSize({ width: Math.max(280, holders[k].clientWidth), height: 230 }); };
  addEventListener("keydown", keys);
  addEventListener("resize", fit);
  const recolour = () => { for (const plot of charts) plot.redraw(false); };
  dark.addEventListener("change", recolour);
  if (last.trigger === undefined) say(tiles.trigger.value, "none yet");
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
