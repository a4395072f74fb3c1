// Channels of the stream as people read them: micrometres, and as many digits as the noise leaves.
const SLOTS = 100; // 1 s: the noise is that of the newest
const MEAN = 10; // slots, 0.1 s

// index: its column in the samples. shown: value * factor + offset is what is shown, in unit.
export function channelOf({ name, unit }, index) {
  const deflection = name.startsWith("deflection"), letter = name.replace(/^.*_/, "");
  const in_um = unit === "nm";
  return { index, name, deflection, letter: deflection ? letter : letter.toUpperCase(), unit: in_um ? "µm" : unit.replace(/^u(?=m|s|rad)/, "µ"), counted: unit,
    shown: { factor: in_um ? 1e-3 : 1, offset: 0 }, to_um: { nm: 1e-3, um: 1, mm: 1e3 }[unit] ?? 1, decimals: unit === "mm" ? 4 : 2, least: in_um ? 20 : unit === "mm" ? 1e-3 : 1e-6 };
}

const half = (slots, index, k) => (slots.high[index][k] - slots.low[index][k]) / 2;
const middle = (slots, index, k) => (slots.high[index][k] + slots.low[index][k]) / 2;

// The noise of the newest second, in the unit that is shown: half the spread within a slot, of the quiet ones, as motion is no noise.
export function noiseOf(channel, slots) {
  const spread = [];
  for (let k = Math.max(0, slots.times.length - SLOTS); k < slots.times.length; ++k) if (slots.high[channel.index][k] !== null) spread.push(half(slots, channel.index, k));
  spread.sort((a, b) => a - b);
  return spread.length === 0 ? null : spread[Math.floor(spread.length / 10)] * Math.abs(channel.shown.factor);
}

// So many decimals that the last one is as large as the noise; they change only where the noise does by a good deal.
export function settleDecimals(channel, slots) {
  const noise = noiseOf(channel, slots);
  if (!(noise > 0)) return;
  const exact = -Math.log10(noise), [least, most] = channel.unit === "mm" ? [3, 4] : [0, 3];
  if (Math.abs(exact - channel.decimals) > 0.8) channel.decimals = Math.max(least, Math.min(most, Math.round(exact)));
}

// The mean of the newest tenth of a second, in the unit that is shown; null where it was lost.
export function meanOf(channel, slots) {
  let sum = 0, count = 0;
  for (let k = Math.max(0, slots.times.length - MEAN); k < slots.times.length; ++k) {
    if (slots.high[channel.index][k] === null) continue;
    sum += middle(slots, channel.index, k);
    count += 1;
  }
  return count === 0 ? null : (sum / count) * channel.shown.factor + channel.shown.offset;
}

// Without "-0.0".
export function text(value, decimals) {
  const digits = value.toFixed(decimals);
  return /^-0\.?0*$/.test(digits) ? digits.slice(1) : digits;
}
