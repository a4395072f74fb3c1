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

from master import ILLEGAL_ADDRESS, ILLEGAL_VALUE, READ_INPUT, Master, refusal

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
        assert m.values(0, "HH")[0] == 0x5042 and m.values(1, "H") >= 2
        check_life(m)
        check_formats(m)
        check_word_order(m)
        check_refusals(m)
        print(f"{m.values(116, 'I')} samples produced, {m.values(118, 'I')} lost at the source, sigma {m.values(114, 'I')} ns")
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(PATIENCE_S)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-master-") as scratch:
        run(sys.argv[1], scratch)
