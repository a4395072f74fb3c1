import { begin, last, on } from "./box.js";
import { calibrate } from "./calibrate.js";
import { h, say, show } from "./dom.js";
import { live } from "./live.js";
import { machine } from "./machine.js";
import { results } from "./results.js";
import { tools } from "./tools.js";

const TABS = [["machine", "Machine", machine], ["live", "Live", live], ["calibrate", "Calibrate", calibrate], ["results", "Results", results], ["tools", "Tools", tools]];
const main = document.getElementById("main");
let leave = () => {};
let here = "";

function open(name) {
  const found = TABS.find(([id]) => id === name) ?? TABS[0];
  if (here === found[0]) return;
  here = found[0];
  leave();
  for (const tab of document.querySelectorAll("[role=tab]")) {
    const chosen = tab.id === `tab-${found[0]}`;
    tab.setAttribute("aria-selected", chosen);
    tab.tabIndex = chosen ? 0 : -1;
  }
  main.setAttribute("role", "tabpanel");
  main.setAttribute("aria-labelledby", `tab-${found[0]}`);
  show(main);
  scrollTo(0, 0); // each page begins at its top
  leave = found[2](main) ?? (() => {});
}

const hash = () => location.hash.slice(1).split("/")[0];
show(document.getElementById("tabs"), TABS.map(([id, title], k) =>
  h("button", { role: "tab", id: `tab-${id}`, "aria-controls": "main", title: `Alt+${k + 1}`, onclick: () => { location.hash = id; } }, title)));
document.getElementById("tabs").addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const tabs = [...document.querySelectorAll("[role=tab]")];
  const next = tabs[(tabs.indexOf(document.activeElement) + step + tabs.length) % tabs.length];
  next.focus();
  next.click();
});
addEventListener("keydown", (event) => {
  const tab = event.altKey && TABS[Number(event.key) - 1];
  if (tab) { event.preventDefault(); location.hash = tab[0]; }
});
addEventListener("hashchange", () => open(hash()));
history.scrollRestoration = "manual";

const link = document.getElementById("link");
function tellLink() {
  const server = last.server ?? true;
  const up = last.link?.up ?? true;
  const state = last.state?.clock?.state;
  link.className = !server || !up ? "failed" : state === "locked" ? "pass" : "warned";
  say(link, !server ? "probebox view has ended" : !up ? `link lost: ${last.link.what}` : state ? `clock ${state}` : "connected");
}
for (const kind of ["server", "link", "state"]) on(kind, tellLink);
on("descriptor", (d) => { say(document.getElementById("box"), `${d.board} ${d.serial_number} · ${d.machine} · ${d.probe}`); document.title = `probebox ${d.serial_number}`; });
begin();
open(hash() || "machine");
