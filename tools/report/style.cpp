#include "tools/report/style.hpp"

namespace probebox::report {

// Every pair of text and ground has a contrast of at least 4.5 (WCAG 2.2, 1.4.3), lines of pictures at least 3.
std::string_view style() {
  return R"(
:root { color-scheme: light dark; --ink: #1a1a1a; --soft: #484848; --ground: #fff; --plot: #fff; --rule: #8a8a8a; --grid: #ddd;
  --series1: #1b4f8a; --series2: #b04a00; --series3: #2a7a2a; --series4: #666;
  --pass: #2a7a2a; --pass-ground: #eef7ee; --warned: #b07a00; --warned-ground: #fcf6e8; --failed: #a11;
  --failed-ground: #fbefef; --neutral: #5a6b7b; --neutral-ground: #f0f3f6; }
@media screen and (prefers-color-scheme: dark) { :root { --ink: #e8e8e8; --soft: #b8b8b8; --ground: #15181c; --plot: #1c2026;
  --rule: #7c858f; --grid: #343a42; --series1: #86b8f2; --series2: #ff9d57; --series3: #7fd07f; --series4: #a8a8a8;
  --pass: #5dbb5d; --pass-ground: #17281a; --warned: #e0a930; --warned-ground: #2b2513; --failed: #f07070;
  --failed-ground: #321a1c; --neutral: #8da2b5; --neutral-ground: #20272e; } }
@page { size: A4; margin: 14mm; }
* { box-sizing: border-box; }
body { font: 10.5pt/1.4 sans-serif; color: var(--ink); background: var(--ground); max-width: 200mm; margin: 1em auto; padding: 0 1em; }
h1 { font-size: 15pt; margin: 0; } h2 { font-size: 11.5pt; margin: 1.1em 0 .3em; break-after: avoid; }
article + article { border-top: 2px solid var(--rule); margin-top: 2em; padding-top: 1.5em; break-before: page; }
.verdict { border-left: 6px solid var(--neutral); background: var(--neutral-ground); padding: .6em .9em; margin: .7em 0; break-inside: avoid; }
.verdict p { font-size: 14pt; font-weight: 700; margin: 0 0 .2em; } .verdict li:first-child { font-weight: 600; }
.verdict.pass { border-color: var(--pass); background: var(--pass-ground); }
.verdict.warned { border-color: var(--warned); background: var(--warned-ground); }
.verdict.failed { border-color: var(--failed); background: var(--failed-ground); }
table { border-collapse: collapse; margin: .2em 0; max-width: 100%; break-inside: avoid; } table.matrix { break-inside: auto; }
td, th { padding: .15em .9em .15em 0; text-align: left; vertical-align: top; overflow-wrap: break-word; }
th { font-weight: 600; border-bottom: 1px solid var(--rule); overflow-wrap: normal; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; overflow-wrap: normal; } td.n { white-space: nowrap; }
td:first-child { white-space: nowrap; }
.matrix { font-size: 9.5pt; } .matrix td, .matrix th { padding: .12em .7em .12em 0; } .matrix small { color: var(--soft); font-size: 8pt; }
.matrix td.key { min-width: 0; color: var(--soft); text-align: right; padding-left: .6em; }
tr.sum td { border-top: 1px solid var(--rule); font-weight: 600; } ul { margin: .2em 0; padding-left: 1.2em; } li { overflow-wrap: break-word; }
.shares { width: 100%; } .shares td.share { width: 55%; padding-top: .3em; } .shares span { display: block; height: .8em; background: var(--series1); min-width: 1px; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.small { color: var(--soft); font-size: 9pt; overflow-wrap: break-word; } .wide { overflow-x: auto; }
.pictures { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 3mm; align-items: start; }
.pictures svg { width: 100%; height: auto; border: 1px solid var(--grid); break-inside: avoid; display: block; }
@media screen and (max-width: 620px) { td, th { padding-right: .4em; } td:first-child { white-space: normal; } .pictures { grid-template-columns: minmax(0, 1fr); } .matrix { font-size: 8pt; } .matrix td, .matrix th { padding-right: .3em; }
  .matrix small { display: block; } }
@media print { body { margin: 0; padding: 0; max-width: none; font-size: 9.5pt; line-height: 1.3; } tr { break-inside: avoid; } thead { display: table-header-group; }
  .verdict, svg { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
)";
}

}  // namespace probebox::report
