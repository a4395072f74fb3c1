// Plays signals to the image and writes what was on the pins and what came back, a line each, for compare.cpp:
//   S cycle a b c silent   a conversion began; what the converter answers
//   C cycle counter count  the true count changed
//   I cycle counter        A and B of a counter changed at once
//   Z cycle counter        an index pulse began
//   E cycle line level     an edge of a line
//   W cycle counter level  the alarm of a line receiver
//   P cycle bytes          a transfer of the bulk endpoint ended
// node scenario.mjs MODULES IMAGE OUT MILLISECONDS SEED [RATE]   RATE: counts a second of counter 0, more than it holds
import fs from 'node:fs';
import { Chip, load, pins, readFile } from './chip.mjs';

const [modules, image, out, milliseconds, seed, rate] = process.argv.slice(2);
const chip = new Chip(await load(modules), readFile(image));
const lines = [];
const cycles = Number(milliseconds) * 125_000;

let state = BigInt(seed) + 88172645463325252n;  // xorshift
const random = (below) => {
  state ^= (state << 13n) & 0xffffffffffffffffn;
  state ^= state >> 7n;
  state ^= (state << 17n) & 0xffffffffffffffffn;
  return Number(state % BigInt(below));
};

chip.enumerate();
const begin = chip.cycle + 1000;
const end = begin + cycles;
const script = [];
const plan = (cycle, act) => script.push({ cycle: Math.round(cycle), act });

// Steps of an encoder: each piece has a rate in counts a second and a direction.
const phases = [0, 1, 3, 2];  // of A | B << 1
const phase = [0, 0, 0, 0];
const count = [0, 0, 0, 0];
const show = (k) => {
  const ab = phases[phase[k] & 3];
  chip.set(pins.encoder[k], ab & 1);
  chip.set(pins.encoder[k] + 1, ab >> 1);
};
const step = (k, by) => () => {
  phase[k] += by;
  count[k] += by;
  show(k);
  lines.push(`C ${chip.cycle} ${k} ${count[k]}`);
};
function drive(k, pieces) {  // [rate, milliseconds or undefined for the rest]
  let at = begin;
  for (const [rate, ms] of pieces) {
    const until = Math.min(end, at + ms * 125_000);
    const period = 125e6 / Math.abs(rate);
    for (at += period; at < until; at += period) plan(at, step(k, Math.sign(rate)));
    at = until + 200;
  }
}
const repeated = (pieces) => Array.from({ length: 1000 }, (_, i) => pieces[i % pieces.length]);
if (rate) {
  plan(begin, () => lines.push(`I ${chip.cycle} 0`));
  drive(0, [[Number(rate), Number(milliseconds)]]);
} else drive(0, repeated([[1e6, 3], [-1e6, 2], [200e3, 4], [-2e6, 1.2]]));
drive(1, repeated([[5e6, 1.5], [-5e6, 1.1], [3.3e6, 2]]));
drive(2, repeated([[20e3, 7], [-20e3, 6]]));
drive(3, [[400e3, 0.4 * Number(milliseconds)]]);

for (let at = begin + 40_000; at < end; at += 350_000 + random(100_000)) {
  const k = 2;
  plan(at, () => { chip.set(pins.index[k], 1); lines.push(`Z ${chip.cycle} ${k}`); });
  plan(at + 2000, () => chip.set(pins.index[k], 0));
}
// A and B of counter 3 at once, then an alarm of its line receiver.
plan(begin + 0.5 * cycles, () => { phase[3] += 2; show(3); lines.push(`I ${chip.cycle} 3`); });
plan(begin + 0.7 * cycles, () => { chip.set(pins.wires[3], 1); lines.push(`W ${chip.cycle} 3 1`); });
plan(begin + 0.75 * cycles, () => { chip.set(pins.wires[3], 0); lines.push(`W ${chip.cycle} 3 0`); });

const levels = [0, 0, 0, 0, 0];
const toggle = (line) => () => {
  levels[line] ^= 1;
  chip.set(pins.lines[line], levels[line]);
  lines.push(`E ${chip.cycle} ${line} ${levels[line]}`);
};
for (let at = begin + 10_000; at < end; at += 62_501) plan(at, toggle(0));  // 1 kHz sync
for (const line of [1, 2, 3]) for (let at = begin + random(300_000); at < end; at += 2000 + random(400_000)) plan(at, toggle(line));

chip.deflection = (n) => [(n * 37) % 32000, -((n * 11) % 32000), n % 2 ? 32767 : -4];
plan(begin + 0.85 * cycles, () => { chip.silent = true; });
plan(begin + 0.9 * cycles, () => { chip.silent = false; });
chip.mcu.gpio[pins.convert].addListener((value) => {
  if (value === 1) lines.push(`S ${chip.cycle} ${chip.values.join(' ')} ${chip.silent ? 1 : 0}`);
});
for (const cycle of chip.conversions) lines.push(`S ${cycle} 0 0 0 0`);

script.sort((a, b) => a.cycle - b.cycle);
chip.script = script;
chip.run(end - chip.cycle + 2_000_000);
for (const { cycle, bytes } of chip.transfers) lines.push(`P ${cycle} ${bytes.toString('hex')}`);
fs.writeFileSync(out, lines.join('\n') + '\n');
console.log(`${chip.conversions.length} samples, ${chip.transfers.length} packets; longest pass ${chip.passes.longest} cycles of ${chip.passes.count} passes`);
