"""A Modbus RTU master, written from protocol/MODBUS.md alone."""
import os
import select
import struct

READ, READ_INPUT, WRITE_ONE, WRITE_MANY = 3, 4, 6, 16
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


class Refused(Exception):
    pass


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)


class Master:
    def __init__(self, line):
        self.line = line

    def ask(self, request, answer_size, unit=1):
        """The answer without unit and checksum; asked again when nothing comes, as masters do."""
        whole = bytes([unit]) + request
        for attempt in range(60):
            os.write(self.line, whole + crc16(whole))
            answer = self.receive(answer_size + 3)
            if answer:
                # It may be the answer to the request before, and this one's is still to come: the last one counts.
                while attempt and (newer := self.receive(answer_size + 3)):
                    answer = newer
                assert answer[:1] == whole[:1] and crc16(answer[:-2]) == answer[-2:], answer.hex()
                if answer[1] == request[0] | 0x80:
                    raise Refused(answer[2])
                assert answer[1] == request[0] and len(answer) == answer_size + 3
                return answer[1:-2]
        raise AssertionError("the box does not answer")

    def send(self, frame):
        os.write(self.line, frame + crc16(frame))

    def receive(self, size):
        """A refusal is 5 bytes long; the line is silent behind an answer."""
        answer = b""
        while len(answer) < size and select.select([self.line], [], [], 2.0)[0]:
            answer += os.read(self.line, size - len(answer))
            if len(answer) == 5 and answer[1] & 0x80:
                break
        return answer

    def is_silent_for(self, unit):
        request = bytes([unit]) + struct.pack(">BHH", READ, 0, 1)
        os.write(self.line, request + crc16(request))
        return not self.receive(7)

    def registers(self, first, count, function=READ):
        answer = self.ask(struct.pack(">BHH", function, first, count), 2 + 2 * count)
        assert answer[1] == 2 * count
        return answer[2:]

    def values(self, first, code, function=READ):
        """Registers as struct knows them, high word first: H and h one each, I, i and f two."""
        data = self.registers(first, struct.calcsize(">" + code) // 2, function)
        values = struct.unpack(">" + code, data)
        return values[0] if len(values) == 1 else values

    def write(self, address, value):
        request = struct.pack(">BHH", WRITE_ONE, address, value)
        assert self.ask(request, 5) == request

    def write_many(self, first, data):
        request = struct.pack(">BHHB", WRITE_MANY, first, len(data) // 2, len(data)) + data
        assert self.ask(request, 5) == request[:5]


def refusal(act):
    try:
        act()
    except Refused as refused:
        return refused.args[0]
    return None
