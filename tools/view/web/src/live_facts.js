// What the box says of itself beside its samples: words first, numbers under them.
import { h, say, show } from "./dom.js";

const many = (count, what) => `${count.toLocaleString("en")} ${what}${count === 1 ? "" : "s"}`;
const duration = (ns) => (ns < 1000 ? `${Math.round(ns)} ns` : `${(ns / 1000).toPrecision(3)} µs`);
const CLOCK = { locked: ["pass", "Clock locked"], holdover: ["warned", "Clock on its own"], unlocked: ["failed", "Clock not locked"], ambiguous: ["failed", "Clock ambiguous"] };
const HEALTH = { good: "pass", held: "warned" };

// { element, tell(state), trigger(trigger or null) }
export function facts() {
  const tiles = {};
  const tile = (key, title) => {
    const value = h("output", { class: "value", "aria-live": "off" }, "–"), note = h("small");
    tiles[key] = { value, note, box: h("section", { class: "tile" }, h("h3", null, title), value, note) };
    return tiles[key].box;
  };
  const set = (key, state, value, note) => { tiles[key].box.dataset.state = state; say(tiles[key].value, value); if (note !== undefined) say(tiles[key].note, note); };
  const element = h("div", { class: "readouts facts" }, tile("clock", "Master clock"), tile("ledger", "Samples"), tile("correction", "Correction, µm"), tile("angles", "Angles, degrees"), tile("cut", "Cut"), tile("trigger", "Newest trigger"));
  tiles.angles.box.classList.add("hidden");

  function ledger(l) {
    const lost = l.lost_at_source_samples + l.lost_in_queue_samples + l.lost_on_link_samples;
    const where = [["source", l.lost_at_source_samples], ["queue", l.lost_in_queue_samples], ["link", l.lost_on_link_samples]].filter(([, count]) => count > 0).map(([at, count]) => `${count.toLocaleString("en")} at the ${at}`);
    const since = l.box_restarts > 0 ? " since the box was restarted; before it unknown" : "";
    set("ledger", !l.balanced ? "failed" : lost > 0 ? "warned" : "pass", !l.balanced ? "The count is not exact" : lost > 0 ? `${many(lost, "sample")} lost` : "None lost",
      `${l.received_samples.toLocaleString("en")} received + ${lost.toLocaleString("en")} lost${where.length > 0 ? ` (${where.join(", ")})` : ""}${l.balanced ? " = all" : ""}${since}`);
  }
  function corrections(c) {
    set("correction", !c.valid ? "failed" : c.degraded ? "warned" : "pass", c.correction_mm.map((mm, k) => `${"XYZ"[k]}\u00a0${(mm * 1e3).toFixed(1)}`).join("  "));
    show(tiles.correction.note, c.sources.map((source) => h("span", { class: `chip ${HEALTH[source.health] ?? (source.summed && source.health === "invalid" ? "failed" : "off")}` }, `${source.source} ${source.health}`)));
    const turned = c.rotary_axes ?? [], doubtful = turned.filter((axis) => axis.doubtful || axis.angle_deg === null);
    tiles.angles.box.classList.toggle("hidden", turned.length === 0);
    set("angles", doubtful.length > 0 ? "warned" : "", turned.map((axis) => `${axis.axis}\u00a0${axis.angle_deg === null ? "–" : axis.angle_deg.toFixed(4)}`).join("  "),
      doubtful.map((axis) => `${axis.axis} ${axis.angle_deg === null ? "is not referenced" : "in doubt"}`).join("; "));
  }
  function tell(one) {
    const [kind, words] = CLOCK[one.clock?.state] ?? ["failed", "–"];
    set("clock", kind, words, one.clock ? `a sample's time is known to ${duration(one.clock.sigma_ns)} (sd)` : "");
    ledger(one.ledger);
    if (!one.corrections) return;
    corrections(one.corrections);
    set("cut", one.corrections.inhibited ? "warned" : "", one.corrections.inhibited ? "A cut is on" : "No cut", (one.status?.inhibits ?? []).map((holder) => `${holder.connection} ${holder.by}`).join("; "));
  }
  function trigger(t) {
    if (t === null) return set("trigger", "", "None yet");
    set("trigger", "", `No. ${t.number}`, t.position_mm.map((mm, k) => `${"XYZ"[k]}\u00a0${mm === null ? "–" : mm.toFixed(4)}`).join("  "));
  }
  return { element, tell, trigger };
}
