// May I cut? The answer of the box's host (tools/probebox/text/machine_verdict.hpp); this page only shows it.
import { on, post } from "./box.js";
import { h, named, say, show } from "./dom.js";
import { icon, keeping, state } from "./icons.js";
import { trendFigure } from "./trend.js";

const since = (utc) => (/^\d{4}-/.test(utc ?? "") ? utc.replace("T", " ").slice(0, 16) : (utc ?? ""));

function gauge(decisive) {
  if (decisive?.ratio === null || decisive?.ratio === undefined) return null;
  const [kind] = keeping(decisive), most = Math.max(1.25, decisive.ratio * 1.05);
  const percent = Math.round(100 * decisive.ratio);
  return h("div", null, h("div", { class: `gauge ${kind}`, role: "img", "aria-label": `with U ${percent} percent of the limit` }, h("span", { style: `width:${(100 * decisive.ratio) / most}%` }), h("i", { style: `left:${100 / most}%` })),
    h("p", { class: "pair" }, h("span", null, `with U ${percent} % of the limit`), h("span", null, decisive.limit_text)));
}

function tile(one) {
  const [kind, word] = one.id === 0 ? ["check", "Not measured"] : one.overdue && one.may_cut === "check" ? ["check", "Due"] : one.may_cut === "check" && one.decisive?.keeping !== "not proven" ? ["check", "Check"] : keeping(one.decisive);
  const [what, number] = one.decisive ? named(one.decisive) : [];
  return h("section", { class: "tile", "data-state": one.may_cut, "aria-label": one.title },
    h("div", { class: "head" }, h("h3", null, one.id > 0 ? h("a", { href: `#results/${one.id}` }, one.title) : one.title), state(kind, word)),
    one.decisive && [h("p", null, what, h("span", { class: "value" }, number)), gauge(one.decisive) ?? h("p", { class: "small" }, one.decisive.limit_text)],
    one.trend.points.length > 1 && trendFigure(one.trend, { height: 130, chosen: one.id, caption: false }),
    one.remarks.map((remark) => h("p", { class: "remark" }, remark)),
    one.id > 0 && h("p", { class: "foot" }, h("span", null, one.age ? `stored ${one.age} ago` : `stored ${since(one.stored_utc) || "at an unknown time"}`), one.overdue ? h("b", null, one.due) : h("span", null, one.due)));
}

function inForce(tiles) {
  const standing = tiles.filter((one) => one.id > 0);
  if (standing.length === 0) return null;
  return h("section", { class: "panel full" }, h("h3", null, "In force"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "In force" }, h("table", { class: "stack" },
    h("thead", null, h("tr", null, ["Subject", "Value", "Since (UTC)", "Accepted by", "Measured by"].map((text) => h("th", { scope: "col" }, text)))),
    h("tbody", null, standing.map((one) => h("tr", null, h("td", null, h("a", { href: `#results/${one.id}` }, one.title)), h("td", null, one.decisive && named(one.decisive)), h("td", { class: "number" }, since(one.accepted_utc)), h("td", null, one.accepted_by), h("td", null, `${one.method}, result ${one.id}`)))))));
}

export function machine(main) {
  const answer = h("section", { class: "answer unknown", "aria-label": "May I cut?" });
  const below = h("div");
  const said = h("p", { role: "alert", class: "said" });
  const word = h("p", { class: "word" }), reason = h("p", { class: "reason" }), sign = h("span", { style: "display:contents" });
  const verify = h("button", { onclick: async () => {
    try { await post("start", { method: "periodic-check" }); location.hash = "calibrate"; } catch (error) { say(said, error.message); }
  } }, "Verify now");
  const told = h("div", { role: "status", style: "display:contents" }, word, reason);
  show(main, h("h2", { class: "hidden" }, "Machine"), answer, h("div", { class: "bar" }, verify, h("a", { href: "#calibrate" }, "Calibrate"), h("span", { class: "small" }, "Verify runs the periodic check; it changes nothing that is in force."), said), below);
  show(answer, sign, h("p", { class: "question" }, "May I cut?"), told);
  let more = null;
  function head(may_cut, what, why) {
    answer.className = `answer ${may_cut}`;
    show(sign, icon(may_cut));
    say(word, what);
    say(reason, why);
  }
  function unknown() {
    head("unknown", "Not known", "probebox view has ended, or this page does not reach it: what is below was true before.");
    more?.remove();
    more = null;
  }
  const offs = [on("machine", (verdict) => {
    head(verdict.may_cut, verdict.word, verdict.reason);
    more?.remove();
    more = h("div", { style: "display:contents" }, verdict.cut && h("p", { class: "cut" }, h("b", null, "A cut is on: "), verdict.cut),
      verdict.more.length > 0 && h("details", { open: more?.querySelector("details")?.open }, h("summary", null, verdict.more.length === 1 ? "One more thing" : `${verdict.more.length} more things`), h("ul", null, verdict.more.map((one) => h("li", null, one)))));
    answer.append(more);
    show(below, h("div", { class: "tiles" }, verdict.tiles.map(tile)), inForce(verdict.tiles));
  }), on("server", (up) => { if (!up) unknown(); })]; // once it is back, box.js asks for the verdict
  return () => { for (const off of offs) off(); };
}
