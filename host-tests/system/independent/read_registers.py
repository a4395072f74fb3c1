"""A master that knows protocol/MODBUS.md alone reads and writes a real daemon's registers over a pseudo terminal.
`read_registers.py PROBEBOXD`; status 0 when all holds."""
import os
import pty
import signal
import struct
import subprocess
import sys
import tempfile
import time
import tty

from master import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    READ,
    READ_INPUT,
    WRITE_MANY,
    WRITE_ONE,
    Master,
    crc16,
    refusal,
)

PATIENCE_S = 120


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.05)


def check_formats(m):
    """One read is of one instant: every form says the same."""
    block = m.registers(0, 38)
    of_axes = lambda first, code: struct.unpack_from(">" + 3 * code, block, 2 * first)
    tenths, biased, mm, nm = of_axes(5, "h"), of_axes(8, "H"), of_axes(16, "f"), of_axes(32, "i")
    for axis in range(3):
        assert biased[axis] == tenths[axis] + 32768
        assert abs(tenths[axis] * 100 - nm[axis]) <= 50 or abs(tenths[axis]) == 32767
        assert abs(mm[axis] * 1e6 - nm[axis]) <= 1
    assert m.registers(0, 3, READ_INPUT) == m.registers(0, 3)
    assert m.values(13, "H") == 0, "what is not listed reads 0"


def check_life(m):
    until(lambda: m.values(112, "H") == 1)  # locked
    assert m.values(2, "H") & 2
    beat, produced = m.values(4, "H"), m.values(116, "I")
    until(lambda: 0 < (m.values(4, "H") - beat) % 65536 < 32768)
    until(lambda: 1000 < (m.values(116, "I") - produced) % 2**32 < 2**31)
    assert 0 < m.values(114, "I") < 100_000, "sigma of the clock in ns"


def check_word_order(m):
    high, low = m.values(116, "HH")
    m.write(128, 1)
    assert m.values(128, "H") == 1
    swapped = m.values(116, "HH")
    assert 0 <= (swapped[1] * 65536 + swapped[0]) - (high * 65536 + low) < 10_000_000
    m.write_many(128, struct.pack(">H", 0))
    assert m.values(128, "H") == 0


def check_refusals(m):
    assert refusal(lambda: m.registers(60000, 10)) == ILLEGAL_ADDRESS
    assert refusal(lambda: m.write(5, 1)) == ILLEGAL_ADDRESS, "not marked write"
    assert refusal(lambda: m.write(128, 2)) == ILLEGAL_VALUE, "outside of its range"
    assert m.values(128, "H") == 0, "a refused write changes nothing"
    assert m.is_silent_for(unit=7), "another unit's request is none of the box's"


def check_homing(m):
    """Outside of its travel an axis is nowhere; nothing of the write remains."""
    until(lambda: m.values(43, "H") == 7)  # referenced, by the emulated controller
    before = m.registers(130, 8)
    for axis, position_mm in enumerate((10_000, -51, 51)):
        positions = [0, 0, 0]
        positions[axis] = position_mm * 10_000
        said = struct.pack(">iiiHH", *positions, 1 << axis, 7)
        assert refusal(lambda: m.write_many(130, said)) == ILLEGAL_VALUE, axis
        assert m.registers(130, 8) == before and m.values(43, "H") == 7, axis


def check_ranges_of_two_registers(m):
    for first, value in ((150, 3_600_001), (154, -3_600_001), (240, 36_000_001), (248, 20_000_001), (248, -1)):
        assert refusal(lambda: m.write_many(first, struct.pack(">i", value))) == ILLEGAL_VALUE, (first, value)
        assert m.values(first, "i") == 0, first


def check_functions(m):
    """What the box does not have is refused, of whatever length it is."""
    two_at_once = "17 0000 0001 0000 0001 02 0000"
    for request in ("14 07 06 0004 0001 0002", "18 04de", "2b 0d 0000", "41 01 02 03", "64", "11", two_at_once):
        assert refusal(lambda: m.ask(bytes.fromhex(request), 2)) == ILLEGAL_FUNCTION, request
    m.send(bytes.fromhex("01 2b 0e 01 00"))
    said = m.receive(200)
    assert b"probebox" in said and said[:3] == bytes.fromhex("01 2b 0e"), said


def check_frames(m):
    """Only a frame of its own is a request: not what stands inside another one."""
    write = struct.pack(">BBHH", 1, WRITE_ONE, 138, 1)
    inside = write + crc16(write)
    answer_of_7 = bytes([7, READ, len(inside) + 2]) + bytes(2) + inside
    damaged = struct.pack(">BBHHB", 1, WRITE_MANY, 144, 6, 12) + inside + bytes(4)
    for frame in (answer_of_7 + crc16(answer_of_7), damaged + b"!!"):
        for silence_s in (0, 0.06):
            os.write(m.line, frame)
            time.sleep(silence_s)
            assert m.values(0, "H") == 0x5042, "and the next request is answered"
            assert m.values(138, "H") == 0 and m.values(47, "H") == 0, frame.hex()
    os.write(m.line, inside[:5])  # a master that dies in mid request
    time.sleep(0.06)
    assert m.values(138, "H") == 0


def run(probeboxd, folder):
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    command = [probeboxd, "--board", "sim", "--state", os.path.join(folder, "state")]
    command += ["--link", "tcp:127.0.0.1:0", "--cnc", "modbus:" + os.ttyname(theirs)]
    log = open(os.path.join(folder, "log"), "w")
    daemon = subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, "PROBEBOX_RENDEZVOUS": folder})
    try:
        m = Master(ours)
        assert m.values(0, "HH")[0] == 0x5042 and m.values(1, "H") == 1
        check_life(m)
        check_formats(m)
        check_word_order(m)
        check_refusals(m)
        check_homing(m)
        check_ranges_of_two_registers(m)
        check_functions(m)
        check_frames(m)
        print(f"{m.values(116, 'I')} samples produced, {m.values(118, 'I')} lost at the source, sigma {m.values(114, 'I')} ns")
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(PATIENCE_S)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-master-") as scratch:
        run(sys.argv[1], scratch)
