// The front end's image in rp2040js, with signals on its pins, a converter on its SPI and a host on its USB.
import fs from 'node:fs';
import { pathToFileURL } from 'node:url';

const cycleNanos = 8;  // 125 MHz
export const pins = {  // protocol/receiver/front_end.hpp
  encoder: [0, 2, 4, 6], index: [8, 9, 10, 11], wires: [12, 27, 28, 23], lines: [13, 14, 15, 16, 17],
  busy: 19, select: 21, syncOut: 22, convert: 26,
};

export async function load(modules) {
  const from = (path) => import(pathToFileURL(`${modules}/rp2040js/dist/esm/${path}`).href);
  return { ...(await from('index.js')), ...(await from('clock/simulation-clock.js')) };
}

export class Chip {
  // emulator: from load(). image: bytes for 0x20000000, or { boot2, flash } to begin as the boot ROM does.
  constructor(emulator, image, { log = false } = {}) {
    this.clock = new emulator.SimulationClock();
    this.mcu = new emulator.RP2040(this.clock);
    this.mcu.logger = log
      ? { debug() {}, info() {}, warn: (a, b) => console.error('warn', a, b), error: (a, b) => console.error('error', a, b) }
      : { debug() {}, info() {}, warn() {}, error() {} };
    // The emulator runs a PIO by a timer of its own, a thousand steps at once: here it is stepped by its cycles.
    for (const pio of this.mcu.pio) pio.run = () => {};
    this.cycle = 0;
    this.events = [];  // {cycle, act}, in order: what the chip itself causes
    this.script = [];  // {cycle, act}, in order: what was planned before
    this.next = 0;     // of the script
    this.conversions = [];  // cycle of each
    this.silent = false;  // the converter does not answer
    this.deflection = () => [0, 0, 0];  // by the number of the conversion
    this.transfers = [];  // bytes of the bulk endpoint, by transfer
    this.partial = [];
    if (image.flash) {
      this.mcu.flash.set(image.flash);
      const boot = image.flash.subarray(0, 256);
      this.mcu.sram.set(boot, 0x41f00);
      this.mcu.core.SP = 0x20041f00;
      this.mcu.core.PC = 0x20041f00;
      this.mcu.core.LR = 0xffffffff;
    } else {
      this.mcu.sram.set(image, 0);
      const words = new DataView(image.buffer, image.byteOffset);
      this.mcu.core.SP = words.getUint32(0, true);
      this.mcu.core.PC = words.getUint32(4, true) & ~1;
    }
    this.keepInReset();
    this.wireConverter();
    this.wireUsb();
    this.watchPasses();
  }

  // After the boot ROM all but the flash's pins are in reset, as the emulator's are not: what is used must be released before.
  keepInReset() {
    const bits = { 0x50000: 2, 0x40014: 5, 0x4001c: 8, 0x50200: 10, 0x50300: 11, 0x40028: 12, 0x4002c: 13, 0x4003c: 16, 0x40054: 21, 0x50110: 24 };
    const resets = this.mcu.peripherals[0x4000c];
    resets.reset = 0x1ffffff & ~((1 << 6) | (1 << 9));
    for (const [base, bit] of Object.entries(bits)) {
      const peripheral = this.mcu.peripherals[base];
      for (const name of ['readUint32', 'writeUint32']) {
        const access = peripheral[name].bind(peripheral);
        peripheral[name] = (...values) => {
          if (resets.reset & (1 << bit)) throw new Error(`peripheral ${Number(base).toString(16)} is used in reset`);
          return access(...values);
        };
      }
    }
  }

  // Each pass of the program's loop feeds the watchdog.
  watchPasses() {
    const watchdog = this.mcu.peripherals[0x40058];
    const write = watchdog.writeUint32.bind(watchdog);
    this.passes = { count: 0, longest: 0, last: 0 };
    watchdog.writeUint32 = (offset, value) => {
      if (offset === 4) {
        if (this.passes.count++ > 0) this.passes.longest = Math.max(this.passes.longest, this.cycle - this.passes.last);
        this.passes.last = this.cycle;
      }
      write(offset, value);
    };
  }

  set(pin, level) {
    this.mcu.gpio[pin].setInputValue(!!level);
  }
  level(pin) {
    return this.mcu.gpio[pin].value === 1;  // GPIOPinState.High
  }
  at(cycle, act) {
    let i = this.events.length;
    while (i > 0 && this.events[i - 1].cycle > cycle) --i;
    this.events.splice(i, 0, { cycle, act });
  }

  wireConverter() {
    this.mcu.gpio[pins.convert].addListener((value) => {
      if (value !== 1) return;
      this.conversions.push(this.cycle);
      this.values = this.deflection(this.conversions.length - 1);
      this.word = 0;
      if (this.silent) return;
      this.set(pins.busy, 1);
      this.at(this.cycle + 500, () => this.set(pins.busy, 0));  // 4 us
    });
    const spi = this.mcu.spi[0];
    spi.onTransmit = () => {
      const value = this.level(pins.select) || this.silent ? 0 : this.values[this.word++] ?? 0;
      this.at(this.cycle + 160, () => spi.completeTransmit(value & 0xffff));  // 16 bits at 12.5 MHz
    };
  }

  wireUsb() {
    const usb = this.mcu.usbCtrl;
    this.enabled = false;
    this.control = null;  // of the request in progress
    usb.onUSBEnabled = () => { this.enabled = true; };
    usb.onEndpointWrite = (endpoint, bytes) => {
      if (endpoint === 1) {
        this.partial.push(...bytes);
        if (bytes.length === 64) return;
        this.transfers.push({ cycle: this.cycle, bytes: Buffer.from(this.partial) });
        this.partial = [];
      } else if (this.control) {
        this.control.sent = Buffer.from(bytes);
      }
    };
    usb.onEndpointRead = (endpoint) => {
      if (endpoint === 0 && this.control) this.control.asked = true;
    };
    // A host that does not read leaves a buffer where it is.
    const updated = usb.DPRAMUpdated.bind(usb);
    this.reads = true;
    usb.DPRAMUpdated = (offset, value) => {
      if (offset === 0x88 && !this.reads && value & (1 << 10)) { this.held = () => updated(offset, value); return; }
      updated(offset, value);
    };
  }
  read(on) {
    this.reads = on;
    if (on && this.held) { const held = this.held; this.held = null; held(); }
  }

  run(cycles) {
    const until = this.cycle + cycles;
    const [pio0, pio1] = this.mcu.pio;
    while (this.cycle < until) {
      const spent = this.mcu.core.executeInstruction();
      this.clock.tick(spent * cycleNanos);
      for (let i = 0; i < spent; ++i) {
        ++this.cycle;
        while (this.next < this.script.length && this.script[this.next].cycle <= this.cycle) this.script[this.next++].act();
        while (this.events.length > 0 && this.events[0].cycle <= this.cycle) this.events.shift().act();
        if (!pio0.stopped) pio0.step();
        if (!pio1.stopped) pio1.step();
      }
    }
  }
  runUntil(done, most = 5_000_000) {
    for (const end = this.cycle + most; this.cycle < end && !done();) this.run(100);
    return done();
  }

  // A control request as a host makes it. Returns its bytes, or 'stall', or nothing where it is not answered.
  request(type, request, value, index, length, data) {
    const usb = this.mcu.usbCtrl;
    const stalled = () => (this.mcu.usbDPRAMView.getUint32(0x80, true) & (1 << 11)) !== 0;
    this.mcu.usbDPRAMView.setUint32(0x80, 0, true);
    this.control = { sent: null, asked: false };
    usb.sendSetupPacket(new Uint8Array([type, request, value & 255, value >> 8, index & 255, index >> 8, length & 255, length >> 8]));
    if (data) {
      this.runUntil(() => this.control.asked || stalled());
      if (stalled()) return 'stall';
      this.control.asked = false;
      usb.endpointReadDone(0, new Uint8Array(data));
    }
    this.runUntil(() => this.control.sent || stalled(), 1_000_000);
    if (stalled()) return 'stall';
    const answer = this.control.sent;
    if (answer && type & 0x80) {
      this.runUntil(() => this.control.asked, 100_000);
      usb.endpointReadDone(0, new Uint8Array(0));
    }
    this.run(5000);
    this.control = null;
    return answer ?? undefined;
  }

  // As Linux does it: reset, the first eight bytes, reset, address, descriptors, strings, configuration.
  enumerate() {
    const usb = this.mcu.usbCtrl;
    if (!this.runUntil(() => this.enabled && this.mcu.usbCtrl.sieCtrl & (1 << 16))) throw new Error('it does not connect');
    const reset = () => { usb.resetDevice(); this.run(1_300_000); };
    const found = {};
    reset();
    found.first = this.request(0x80, 6, 0x0100, 0, 64);
    reset();
    this.request(0x00, 5, 7, 0, 0);
    found.address = usb.addrEndp;
    found.device = this.request(0x80, 6, 0x0100, 0, 18);
    found.qualifier = this.request(0x80, 6, 0x0600, 0, 10);
    found.head = this.request(0x80, 6, 0x0200, 0, 9);
    found.configuration = this.request(0x80, 6, 0x0200, 0, found.head.readUInt16LE(2));
    found.strings = [0, 2, 1, 3].map((i) => this.request(0x80, 6, 0x0300 | i, i ? 0x0409 : 0, 255));
    this.request(0x00, 9, 1, 0, 0);
    this.request(0x01, 11, 0, 0, 0);
    return found;
  }
}

export function readFile(path) {
  return new Uint8Array(fs.readFileSync(path));
}
