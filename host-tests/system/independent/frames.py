"""Frames and messages as protocol/MESSAGES.md says, and nothing else: no code of the project is used here."""
import struct

MAJOR, MINOR = 1, 0
HELLO, WELCOME, DESCRIPTOR, TEST_PATTERN, START, STOP, CREDIT, SAMPLES, GAP, HEARTBEAT = range(0x01, 0x0B)
REQUEST, ANSWER, REFUSAL, TRIGGER, TRIGGER_GAP, HEARTBEAT_CHANGE, SHORT_SAMPLES, SAMPLES_HEAD = range(0x0B, 0x13)
RAW, FAST = 0, 1
LIVE, RECORD = 0, 1
NO_LIMIT = 2**64 - 1
HEADER = struct.Struct("<BBBBHII")


def _crc_table():
    table = []
    for n in range(256):
        for _ in range(8):
            n = (n >> 1) ^ (0x82F63B78 if n & 1 else 0)
        table.append(n)
    return table


_CRC = _crc_table()


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ _CRC[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def cobs_encode(data):
    out = bytearray()
    for group in data.split(b"\0"):
        while len(group) >= 254:
            out += b"\xff" + group[:254]
            group = group[254:]
        out += bytes([len(group) + 1]) + group
    return bytes(out)


def cobs_decode(data):
    """None when it is no COBS."""
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        if code == 0 or at + code > len(data):
            return None
        out += data[at + 1 : at + code]
        at += code
        if code < 255 and at < len(data):
            out.append(0)
    return bytes(out)


def frame(kind, payload, sequence, stream=0):
    bare = HEADER.pack(MAJOR, kind, 0, stream, len(payload), sequence, 0) + payload
    return cobs_encode(bare + struct.pack("<I", crc32c(bare))) + b"\0"


class Frame:
    def __init__(self, bare):
        self.major, self.kind, _, self.stream, length, self.sequence, self.hash = HEADER.unpack_from(bare)
        self.payload = bare[HEADER.size : HEADER.size + length]


def read_frame(coded):
    """A good frame, or None."""
    bare = cobs_decode(coded)
    if bare is None or len(bare) < HEADER.size + 4:
        return None
    length = HEADER.unpack_from(bare)[4]
    if len(bare) != HEADER.size + length + 4 or struct.unpack_from("<I", bare, len(bare) - 4)[0] != crc32c(bare[:-4]):
        return None
    return Frame(bare)


class Restorer:
    """Makes short frames whole again."""

    BEAT = "Q?IqqQQQQQQI*QQQQQQQ*BIQ*QQQQQQ*IIII"  # stars stand where structures inside begin and end
    HEAD = struct.Struct("<BqHHqqqIBIB")  # the size of the channel list behind it is twice the last one

    def __init__(self):
        self.beat, self.head = (None, None), (None, None, None)

    def restore(self, f):
        """The frame as it was, or None where what it refers to has not come."""
        if f.kind == HEARTBEAT:
            self.beat = (crc32c(f.payload), f.payload)
        elif f.kind in (SAMPLES, SAMPLES_HEAD):
            head = f.payload[: self.HEAD.size + 2 * f.payload[self.HEAD.size - 1]]
            self.head = (crc32c(struct.pack("<I", f.hash) + head), f.hash, head)
        elif f.kind == HEARTBEAT_CHANGE:
            f.kind = HEARTBEAT
            return self._restore_beat(f)
        elif f.kind == SHORT_SAMPLES:
            f.kind = SAMPLES
            return self._restore_block(f)
        return f

    def _restore_beat(self, f):
        c = Cursor(f.payload)
        known, base = self.beat
        crc = c.take("I")
        if crc not in (0, known):
            return None
        groups = self.BEAT.split("*")  # plain, link, plain, edges, plain
        numbers = [0] * sum(map(len, groups))
        if crc:
            old = Cursor(base)
            numbers = []
            for k, codes in enumerate(groups):
                if k % 2 == 1:
                    assert old.take("H") == struct.calcsize("<" + codes)
                numbers += old.take(codes)
        numbers = c.changed(numbers, "".join(groups))
        f.payload = b""
        for k, codes in enumerate(groups):
            group = struct.pack("<" + codes, *numbers[: len(codes)])
            f.payload += (struct.pack("<H", len(group)) if k % 2 == 1 else b"") + group
            numbers = numbers[len(codes) :]
        if crc == 0:
            self.beat = (crc32c(c.data), f.payload)
        return f

    def _restore_block(self, f):
        c = Cursor(f.payload)
        known, f.hash, head = self.head
        if c.take("I") != known:
            return None
        profile, *old, channels = self.HEAD.unpack_from(head)
        new = c.changed(old, "qHHqqqIBI")
        ticks, period_q32_ns = new[3] - old[3], old[5]
        new[4] += ticks * period_q32_ns >> 32
        codings = [head[self.HEAD.size + 2 * k :][:2] for k in range(channels)]
        bits = c.bytes((channels + 7) // 8)
        for k in range(channels):
            if bits[k // 8] >> k % 8 & 1:
                codings[k] = c.bytes(2)
        f.payload = self.HEAD.pack(profile, *new, channels) + b"".join(codings) + f.payload[c.at :]
        return f


class Cursor:
    """Fields one after the other. What a later version adds at the end is not looked at."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, code):
        values = struct.unpack_from("<" + code, self.data, self.at)
        self.at += struct.calcsize("<" + code)
        return values[0] if len(values) == 1 else values

    def bytes(self, count):
        if self.at + count > len(self.data):
            raise ValueError("cut off")
        self.at += count
        return self.data[self.at - count : self.at]

    def varint(self):
        value = shift = 0
        while True:
            byte = self.take("B")
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def changed(self, numbers, codes):
        """The numbers with what has changed since."""
        bits = self.bytes(self.take("B"))
        new = []
        for k, (number, code) in enumerate(zip(numbers, codes)):
            if bits[k // 8] >> k % 8 & 1:
                value = self.varint()
                number += (value >> 1) ^ -(value & 1)
            new.append(bool(number) if code == "?" else number)
        return new

    def sized(self):
        return self.bytes(self.take("H"))

    def text(self):
        return self.sized().decode()


class Channel:
    def __init__(self, data):
        c = Cursor(data)
        self.name, self.unit = c.text(), c.text()
        self.scale, self.bytes, self.is_signed = c.take("d"), c.take("B"), c.take("?")


class Descriptor:
    def __init__(self, payload):
        c = Cursor(payload)
        self.board, self.serial_number, self.firmware_version, self.machine, self.probe = (c.text() for _ in range(5))
        self.tick_period_ns, self.samples_per_tick = c.take("q"), c.take("H")
        self.channels = [Channel(c.sized()) for _ in range(c.take("H"))]


class Heartbeat:
    def __init__(self, payload):
        c = Cursor(payload)
        self.uptime_ms, self.streaming, self.stream_number = c.take("Q"), c.take("?"), c.take("I")
        self.start, self.position = c.take("q"), c.take("q")
        self.produced, self.lost_at_source, self.lost_in_queue, self.sent = (c.take("Q") for _ in range(4))
        c.take("QQI"), c.sized(), c.take("BIQ"), c.sized()  # queue, link, clock, deadlines, edges
        self.first_trigger, self.next_trigger, self.sent_triggers, self.lost_triggers = (c.take("I") for _ in range(4))


class Trigger:
    def __init__(self, payload):
        c = Cursor(payload)
        self.number, self.line, self.line_sequence, self.at_ns, self.tick = c.take("IBIqq")
        self.phase_q32, self.sigma_ns, self.clock_state, has_position = c.take("IIBB")
        position, self.correction_mm = c.take("3d"), c.take("3d")
        self.position_mm = [mm if has_position >> k & 1 else None for k, mm in enumerate(position)]
        self.correction_valid, self.correction_degraded, self.sequence = c.take("??H")


def hello(boot_id):
    return b"PBX1" + struct.pack("<BHH", MAJOR, 0, MINOR) + boot_id


def start(profile, policy, resume_from=None, triggers_from=0):
    samples = struct.pack("<BBBQ?q", 1, profile, policy, NO_LIMIT, resume_from is not None, resume_from or 0)
    return samples + struct.pack("<?I", True, triggers_from)  # and triggers; 0: from the next one on


START_PROCEDURE, PROCEDURE_STATUS = 3, 4
OK, WRONG_STATE = 0, 7


def request(number, operation, body):
    return struct.pack("<IHH", number, operation, len(body)) + body


class Answer:
    def __init__(self, payload):
        c = Cursor(payload)
        self.id, self.operation, self.code = c.take("IHH")
        self.text, self.body = c.text(), c.sized()


def is_referenced(procedure_status):
    c = Cursor(procedure_status)
    c.take("I"), c.text(), c.take("BII"), c.text(), c.text(), c.take("Q")  # up to the result
    return c.take("?")


def start_procedure(method):
    return struct.pack("<H", len(method)) + method.encode()


def credit(total):
    return struct.pack("<Q", total)
