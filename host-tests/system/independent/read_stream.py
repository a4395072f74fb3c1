"""A host of its own, written from protocol/MESSAGES.md alone: reads a real daemon over TCP in profiles raw and fast at
once, keeps the ledger, hangs up in the middle and resumes; and what `probebox pack` made of a scan, value by value.
`read_stream.py PROBEBOXD PROBEBOX`; status 0 when all holds."""
import math
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

import frames
from block import Block
from connection import port_of
from frames import Answer, Descriptor, Heartbeat, Trigger

PATIENCE_S = 120


class Host:
    """One link, and the account of its stream."""

    def __init__(self, port, profile, boot_id=bytes(16), resume_from=None, triggers_from=0):
        self.samples_per_tick = None
        self.profile, self.resume_from, self.triggers_from, self.last_boot_id = profile, resume_from, triggers_from, boot_id
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        self.sequence = 0
        self.buffer = b""
        self.short = frames.Restorer()
        self.boot_id = None
        self.descriptors = {}
        self.next_frame = self.next_sample = None
        self.samples = {}  # by index: the values of all channels
        self.triggers = {}  # by number
        self.next_trigger, self.lost_triggers = None, 0
        self.answers, self.last_request = {}, 0
        self.received = self.declared_lost = self.heartbeats = 0
        self.started = self.ended = False
        self.last_credit = 0.0
        self.socket.sendall(b"\0")
        self.send(frames.HELLO, frames.hello(boot_id))

    def send(self, kind, payload, stream=0):
        self.socket.sendall(frames.frame(kind, payload, self.sequence, stream))
        self.sequence += 1

    def round(self):
        """What there is, understood; and a sign of life."""
        data = self.socket.recv(65536)
        assert data, "the box hung up"
        *whole, self.buffer = (self.buffer + data).split(b"\0")
        for coded in whole:
            if coded:
                received = frames.read_frame(coded)
                assert received, "a damaged frame over TCP"
                self.understand(received)
        if time.monotonic() - self.last_credit > 0.2:
            self.last_credit = time.monotonic()
            self.send(frames.CREDIT, frames.credit(frames.NO_LIMIT))

    def understand(self, f):
        assert f.major == frames.MAJOR
        if f.kind == frames.WELCOME:
            self.boot_id = welcome_boot_id(f.payload)
            self.next_frame = f.sequence
        assert f.sequence == self.next_frame, "a frame is missing"
        self.next_frame = (f.sequence + 1) % 2**32
        f = self.short.restore(f)
        assert f, "a short frame refers to one that did not come"
        if f.kind == frames.DESCRIPTOR:
            self.descriptors[frames.crc32c(f.payload)] = Descriptor(f.payload)
        elif f.kind == frames.TEST_PATTERN:
            assert f.payload == bytes((167 * k + 13) % 256 for k in range(256))
            self.send(frames.START, frames.start(self.profile, frames.RECORD, self.resume_from, self.triggers_from))
        elif f.kind == frames.SAMPLES:
            self.take_block(Block(f.payload, self.descriptors[f.hash].channels))
        elif f.kind == frames.GAP:
            first, count = struct.unpack_from("<qQ", f.payload)
            self.reach(first, count)
            self.declared_lost += count
        elif f.kind == frames.TRIGGER:
            trigger = Trigger(f.payload)
            self.reach_trigger(trigger.number, 1)
            self.triggers[trigger.number] = trigger
        elif f.kind == frames.TRIGGER_GAP:
            first, count = struct.unpack_from("<II", f.payload)
            self.reach_trigger(first, count)
            self.lost_triggers += count
        elif f.kind == frames.ANSWER:
            answer = Answer(f.payload)
            self.answers[answer.id] = answer
        elif f.kind == frames.HEARTBEAT:
            self.balance(Heartbeat(f.payload))

    def take_block(self, block):
        assert block.profile == self.profile
        self.samples_per_tick = block.samples_per_tick
        self.reach(block.first, block.count)
        self.received += block.count
        for k, values in enumerate(zip(*block.columns)):
            self.samples[block.first + k] = (values, block.time_ns(k))

    def reach(self, first, count):
        assert self.next_sample in (None, first), f"sample {self.next_sample} is missing and not declared lost"
        self.next_sample = first + count

    def reach_trigger(self, first, count):
        assert self.next_trigger in (None, first), f"trigger {self.next_trigger} is missing and not declared lost"
        self.next_trigger = first + count

    def ask(self, operation, body):
        self.last_request += 1
        self.send(frames.REQUEST, frames.request(self.last_request, operation, body))

    def answer(self):
        """To what was asked last, None while there is none."""
        return self.answers.get(self.last_request)

    def balance(self, beat):
        if beat.stream_number == 0:
            return
        self.started = self.started or beat.streaming
        self.ended = self.started and not beat.streaming
        assert beat.produced == beat.sent + beat.lost_at_source + beat.lost_in_queue == beat.position - beat.start
        assert self.received == beat.sent and self.declared_lost == beat.lost_at_source + beat.lost_in_queue
        assert beat.produced == 0 or beat.position == self.next_sample
        assert beat.next_trigger - beat.first_trigger == beat.sent_triggers + beat.lost_triggers
        assert len(self.triggers) == beat.sent_triggers and self.lost_triggers == beat.lost_triggers
        assert self.next_trigger in (None, beat.next_trigger)
        assert not beat.streaming or beat.first_trigger > 0, "triggers were asked for"
        self.heartbeats += 1

    def stop(self):
        self.send(frames.STOP, b"\1")
        until(lambda: self.round() or self.ended)
        self.socket.close()


def welcome_boot_id(payload):
    c = frames.Cursor(payload)
    c.take("BHI"), c.text()
    return c.bytes(16)


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it did not come"


def both(hosts, samples):
    until(lambda: [h.round() for h in hosts] and all(h.received >= samples for h in hosts))


def connected(port, *more, **named):
    """The daemon takes a moment to listen."""
    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            return Host(port, *more, **named)
        except ConnectionRefusedError:
            assert time.monotonic() < end, "the box does not listen"
            time.sleep(0.05)


def compare(raw, fast):
    """The same values and times in both profiles; samples whose blocks closed under another map differ in time only."""
    common = raw.samples.keys() & fast.samples.keys()
    assert len(common) > 1000, "the two streams have hardly a sample in common"
    for index in common:
        assert raw.samples[index] == fast.samples[index], f"sample {index} differs between the profiles"
    times = [raw.samples[index][1] for index in sorted(raw.samples)]
    assert all(a < b for a, b in zip(times, times[1:])), "time does not rise"
    channels = list(zip(*(values for values, _ in fast.samples.values())))
    assert sum(len(set(channel)) > 100 for channel in channels) >= 3, "nothing moves"


def touch(hosts, triggers):
    """A calibration begins once the box knows when and where it is, and every host hears of its touches."""

    def asked(operation, body=b""):
        hosts[0].ask(operation, body)
        until(lambda: [h.round() for h in hosts] and hosts[0].answer())
        return hosts[0].answer()

    until(lambda: frames.is_referenced(asked(frames.PROCEDURE_STATUS).body))
    body = frames.start_procedure("delay-multi-speed")
    until(lambda: asked(frames.START_PROCEDURE, body).code != frames.WRONG_STATE)
    assert hosts[0].answer().code == frames.OK, hosts[0].answer().text
    until(lambda: [h.round() for h in hosts] and all(len(h.triggers) >= triggers for h in hosts))


def check_triggers(one, other):
    """The same to both; each between the times of the samples of its tick and of the next one."""
    common = one.triggers.keys() & other.triggers.keys()
    assert common and one.lost_triggers == other.lost_triggers == 0
    placed = 0
    for number in common:
        a, b = one.triggers[number], other.triggers[number]
        assert vars(a) == vars(b), f"trigger {number} differs between the profiles"
        assert a.clock_state == 1 and None not in a.position_mm, f"trigger {number} has no place"
        ends = [one.samples.get((a.tick + k) * one.samples_per_tick) for k in (0, 1)]
        if None in ends:
            continue
        (_, begin), (_, end) = ends
        at = begin + (end - begin) * a.phase_q32 / 2**32
        assert abs(at - a.at_ns) < 20_000, f"trigger {number}: {at} by its tick, stamped {a.at_ns}"
        placed += 1
    assert placed > 0, "no trigger is among the samples"


def resume(port, before):
    """The link was cut: what was missed meanwhile comes, without a hole."""
    last = before.next_sample
    host = connected(
        port, before.profile, boot_id=before.boot_id, resume_from=last, triggers_from=before.next_trigger
    )
    both([host], 2000)
    until(lambda: host.round() or len(host.triggers) >= 2)
    host.stop()
    assert min(host.triggers) == before.next_trigger and host.lost_triggers == 0, "a trigger is gone"
    first = min(host.samples)
    assert host.boot_id == before.boot_id and first <= last, "what was missed is gone"
    assert host.declared_lost == 0
    for index in before.samples.keys() & host.samples.keys():
        assert before.samples[index] == host.samples[index], f"sample {index} came back changed"
    return host


def run(probeboxd, folder):
    command = [probeboxd, "--board", "sim", "--state", os.path.join(folder, "state"), "--link", "tcp:127.0.0.1:0"]
    log = open(os.path.join(folder, "log"), "w")
    daemon = subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, "PROBEBOX_RENDEZVOUS": folder})
    try:
        port = port_of(daemon, folder)
        raw, fast = connected(port, frames.RAW), connected(port, frames.FAST)
        both([raw, fast], 4000)
        touch([raw, fast], 3)
        raw.stop()
        compare(raw, fast)
        check_triggers(raw, fast)
        fast.socket.close()  # without a word, and with data on their way
        time.sleep(2)
        again = resume(port, fast)
        print(
            f"raw {raw.received} + {raw.declared_lost} lost, fast {fast.received} + {fast.declared_lost}, resumed "
            f"{again.received}; {len(raw.triggers)} triggers, {len(again.triggers)} after the link was lost: exact at {raw.heartbeats + fast.heartbeats + again.heartbeats} heartbeats"
        )
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(PATIENCE_S)


def scan(count):
    """What stands still, steps, wanders, jumps now and then, and goes around in a circle with noise: every predictor."""
    random.seed(7)
    wander = 0
    for k in range(count):
        wander += random.randint(-3, 3)
        jump = 2**40 if random.random() < 0.01 else 0
        noise = random.gauss(0, 30)
        yield k, 4, 250 * k, wander, wander + jump, round(3e5 * math.cos(k / 60) + noise), round(2e8 + 2e7 * math.sin(k / 60))


def check_pack(probebox, folder):
    rows = list(scan(3000))
    table, packed = os.path.join(folder, "scan.csv"), os.path.join(folder, "scan.pbx")
    with open(table, "w") as out:
        out.write("sample,flags,line_nm,wander_nm,jumps_nm,circle_nm,far_nm\n")
        out.writelines(",".join(map(str, row)) + "\n" for row in rows)
    seen = set()
    for profile in ("raw", "fast"):
        for batch in (64, 256, 700):
            subprocess.run([probebox, "pack", "--force", "--profile", profile, "--frame", str(batch), table, packed], check=True,
                           stdout=subprocess.DEVNULL)
            values, orders = read_recording(packed)
            seen |= orders
            assert values == rows, f"{profile}, {batch} a frame"
    assert {0, 1, 2, 3, 4, 0x80, 0x81, 0x84} <= seen, f"few codings were tried: {seen}"


def read_recording(path):
    with open(path, "rb") as file:
        received = [frames.read_frame(coded) for coded in file.read().split(b"\0") if coded]
    descriptors = {frames.crc32c(f.payload): Descriptor(f.payload) for f in received if f.kind == frames.DESCRIPTOR}
    rows, orders = [], set()
    for f in received:
        if f.kind == frames.SAMPLES:
            block = Block(f.payload, descriptors[f.hash].channels)
            orders |= {order for order, _ in block.codings}
            rows += [(block.first + k, *values) for k, values in enumerate(zip(*block.columns))]
    return rows, orders


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-reader-") as scratch:
        check_pack(sys.argv[2], scratch)
        run(sys.argv[1], scratch)
