// The image as a device on USB: enumeration as Linux does it, malformed requests, a host that stops to read, settings, an
// update. node usb.mjs MODULES IMAGE FLASH
import assert from 'node:assert/strict';
import { Chip, load, readFile } from './chip.mjs';

const [modules, image, flash] = process.argv.slice(2);
const emulator = await load(modules);
const millisecond = 125_000;
const vendor = { identity: 1, pins: 2, counters: 3, settings: 4, bootLoader: 5 };
const read = (chip, request, length = 64) => chip.request(0xc0, request, 0, 0, length);
const header = ({ bytes }) => ({ version: bytes[4], run: bytes[5], count: bytes.readUInt16LE(6), first: bytes.readUInt32LE(8),
  faults: bytes.readUInt16LE(18), steps: bytes.readUInt32LE(20) });
const counters = (chip) => {
  const bytes = read(chip, vendor.counters);
  return { dropped: bytes.readUInt32LE(4), refusal: bytes[bytes.length - 1] };
};
const settings = (steps, samples, sync, nm) => {
  const bytes = Buffer.alloc(22);
  bytes.writeUInt32LE(steps, 0);
  bytes.writeUInt16LE(samples, 4);
  bytes.writeUInt32LE(sync, 6);
  for (let i = 0; i < 3; ++i) bytes.writeInt32LE(nm, 10 + 4 * i);
  return bytes;
};

const tests = {
  'it enumerates, also from the flash by its own boot loader'() {
    for (const program of [readFile(image), { flash: readFile(flash) }]) {
      const chip = new Chip(emulator, program);
      const found = chip.enumerate();
      assert.equal(found.address, 7);
      assert.equal(found.device.length, 18);
      assert.deepEqual(found.first, found.device);
      assert.equal(found.qualifier, 'stall');
      assert.deepEqual([...found.configuration.subarray(9 + 5, 9 + 8)], [0xff, 0x50, 0x02]);
      assert.deepEqual([...found.configuration.subarray(18, 25)], [7, 5, 0x81, 2, 64, 0, 0]);
      assert.equal(found.strings[3].length, 2 + 2 * 16);
      chip.run(20 * millisecond);
      assert.ok(chip.transfers.length >= 2);
      for (const transfer of chip.transfers) assert.equal(header(transfer).version, 3);
    }
  },

  'malformed requests are refused, and it lives on'() {
    const chip = new Chip(emulator, readFile(image));
    chip.enumerate();
    let state = 12345;
    const random = (below) => (state = (state * 1103515245 + 12345) & 0x7fffffff) % below;
    const malformed = [[0x80, 6, 0x0300 | 9, 0x409, 255], [0x80, 6, 0x2100, 0, 9], [0, 5, 300, 0, 0], [0, 9, 5, 0, 0], [1, 11, 1, 0, 0],
      [1, 11, 0, 3, 0], [0xa1, 1, 0, 0, 8], [0x20, 9, 0, 0, 0], [0xc0, 99, 0, 0, 8], [0x40, 5, 0, 0, 0], [0x40, 4, 0, 0, 7], [0x02, 3, 0, 0x85, 0]];
    for (const request of malformed) assert.equal(chip.request(...request), 'stall', request.join(' '));
    for (let i = 0; i < 100; ++i) {
      const [type, request] = [random(256), random(16)];
      // Addresses and configurations would be taken, and an update; data that never come are a host that went away.
      if (![5, 9].includes(request)) chip.request(type, request, random(65536), random(3), random(70));
    }
    assert.equal(chip.request(0x00, 9, 1, 0, 0).length, 0);
    assert.equal(read(chip, vendor.identity).length, 9);
    const before = chip.transfers.length;
    chip.run(20 * millisecond);
    assert.ok(chip.transfers.length > before);
  },

  'samples that nobody reads are dropped and counted, and their fault stays until it was read'() {
    const chip = new Chip(emulator, readFile(image));
    chip.enumerate();
    chip.run(10 * millisecond);
    chip.read(false);
    chip.run(80 * millisecond);
    const { dropped } = counters(chip);
    assert.ok(dropped >= 40 && dropped % 10 === 0, `${dropped} dropped`);
    const before = chip.transfers.length;
    chip.read(true);
    chip.run(60 * millisecond);
    const headers = chip.transfers.slice(before).map(header);
    let gaps = 0;
    for (let i = 1; i < headers.length; ++i) gaps += headers[i].first - headers[i - 1].first - headers[i - 1].count;
    assert.equal(gaps, counters(chip).dropped);
    assert.ok(headers.some(({ faults }) => faults & (1 << 3)));
    assert.equal(headers.at(-1).faults & (1 << 3), 0);
  },

  'a new host begins with new samples, and counts go on'() {
    const chip = new Chip(emulator, readFile(image));
    chip.enumerate();
    chip.read(false);
    chip.run(30 * millisecond);
    chip.held = null;
    chip.read(true);
    chip.partial = [];
    const taken = chip.conversions.length;
    chip.request(0x01, 11, 0, 0, 0);
    const before = chip.transfers.length;
    chip.run(12 * millisecond);
    assert.ok(header(chip.transfers[before]).first + 10 >= taken);
  },

  'settings are checked, refused with a code, and used'() {
    const chip = new Chip(emulator, readFile(image));
    chip.enumerate();
    const set = (bytes) => chip.request(0x40, vendor.settings, 0, 0, bytes.length, bytes);
    chip.run(12 * millisecond);
    const { run } = header(chip.transfers.at(-1));
    for (const [bytes, code] of [[settings(100, 10, 0, 1000), 2], [settings(10422, 0, 0, 1000), 3], [settings(10422, 33, 0, 1000), 3],
      [settings(10422, 10, 5, 1000), 4], [settings(10422, 10, 0, 0), 5]]) {
      assert.equal(set(bytes), 'stall');
      assert.equal(counters(chip).refusal, code);
    }
    assert.equal(read(chip, vendor.settings).readUInt32LE(0), 10422);
    assert.equal(set(settings(2084, 32, 0, -500_000)).length, 0);
    chip.deflection = () => [16384, 0, -16384];
    const from = chip.conversions.length;
    chip.run(12 * millisecond);
    const periods = chip.conversions.slice(from + 2).map((cycle, i) => cycle - chip.conversions[from + 1 + i]);
    assert.ok(periods.length > 100 && periods.every((period) => period === 2084 * 6));
    const last = chip.transfers.at(-1);
    assert.deepEqual({ ...header(last), first: 0, faults: 0 }, { version: 3, run: (run + 1) & 255, count: 32, first: 0, faults: 0, steps: 2084 });
    assert.equal(last.bytes.readInt32LE(24), -250_000);
    assert.equal(counters(chip).refusal, 0);
  },

  'an update goes through the boot loader of the chip'() {
    const chip = new Chip(emulator, readFile(image));
    chip.enumerate();
    // The boot ROM's table, its search and its function, as an emulated one: each is a place where the processor stops.
    const rom = new DataView(chip.mcu.bootrom.buffer);
    rom.setUint16(0x14, 0x100, true);
    rom.setUint16(0x18, 0x200 | 1, true);
    rom.setUint16(0x200, 0x4801, true);  // ldr r0, [pc, #4]
    rom.setUint16(0x202, 0x4770, true);  // bx lr
    rom.setUint32(0x208, 0x300 | 1, true);
    rom.setUint16(0x300, 0xe7fe, true);  // b .
    assert.equal(chip.request(0x40, vendor.bootLoader, 0xb007, 0, 0).length, 0);
    chip.run(40 * millisecond);
    assert.equal(chip.mcu.core.PC & ~1, 0x300);
  },
};

for (const [name, test] of Object.entries(tests)) {
  test();
  console.log(`ok: ${name}`);
}
