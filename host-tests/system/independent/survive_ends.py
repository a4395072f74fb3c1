"""A box that is killed, and one whose line was unplugged, goes on as the controller left it. Written from
protocol/MODBUS.md. `survive_ends.py PROBEBOXD PROBEBOX`; status 0 when all holds."""
import os
import random
import signal
import sys
import tempfile
import time

from box import PATIENCE_S, Box, config, until
from joint import BEAT_S, BLOCK, SERVED_S, Read

def word_order_survives(box):
    box.start()
    m = box.master
    assert m.values(128, "H") == 0
    m.write(128, 1)
    box.kill()  # at once after the answer
    box.start()
    assert m.values(128, "H") == 1, "in the first answer"
    high_last = m.values(116, "HH")
    assert high_last[1] == 0, f"samples of a box that has just started, low word first: {high_last}"
    m.write(128, 0)


def inhibit_survives(box):
    m = box.master
    m.write(138, 1)
    box.kill()
    box.start()
    assert m.values(138, "H") == 1 and m.values(47, "H") == 1, "in the first answers"
    held = box.command("inhibit")["inhibits"]
    assert [each["connection"] for each in held] == [box.connection], held
    held = box.command("inhibit", "on", "--by", "Ada")["inhibits"]
    assert len(held) == 2 and held[1]["by"] == "Ada" and held[1]["since_utc"], held
    m.write(138, 0)
    assert m.values(138, "H") == 0 and m.values(47, "H") == 1, "Ada's cut is still on"
    held = box.command("inhibit", "off", "--by", "Ada")["inhibits"]
    assert not held, held
    until(lambda: m.values(47, "H") == 0)
    m.write(138, 1)
    held = box.command("inhibit", "off", "--by", "Ada")["inhibits"]
    assert len(held) == 1, "nobody ends another one's cut by the way"
    held = box.command("inhibit", "off", "--connection", box.connection, "--by", "Ada")["inhibits"]
    assert not held and m.values(138, "H") == 0, held
    with open(os.path.join(box.folder, "log")) as log:
        assert any(box.connection in line and "cleared by Ada" in line for line in log)


RATE_NM_S = 2000
NOISE_NM = 2  # of rounding


def config_of_long_ramps(folder):
    """Screws that are warm within seconds, on a machine whose corrections may move by 2 um/s."""
    return config(
        folder,
        machine={"correction_rate_mm_s": RATE_NM_S * 1e-6, "rate_um_s": 1000},
        world={"time_constant_s": 3},
    )


class Follower:
    """What a controller sees of the corrections: it holds the last value that was valid. Until the box is started again,
    its own time judges a step, so a computer that is busy elsewhere makes no difference."""

    def __init__(self, master):
        self.master = master
        self.held, self.sent = None, None

    def read(self):
        sent = time.monotonic()
        read = Read(self.master.registers(0, BLOCK))
        got = time.monotonic()
        if read.valid:
            if self.held:
                passed_s = got - self.sent + 0.05
                if read.boots == self.held.boots:
                    passed_s = BEAT_S * ((read.beat - self.held.beat) % 65536 + 1) + SERVED_S
                step = max(abs(a - b) for a, b in zip(read.value_nm, self.held.value_nm))
                most = RATE_NM_S * passed_s + NOISE_NM
                assert step <= most, f"{self.held.value_nm} -> {read.value_nm} nm within {passed_s:.3f} s"
            self.held, self.sent = read, sent
        return read.valid, read.value_nm


def served_survives(box, seed, is_cut):
    """Killed at any moment of a ramp; with is_cut the memory of the computer is gone too."""
    rng = random.Random(seed)
    follower = Follower(box.master)
    last, moved = None, 0
    for number in range(8 if "PROBEBOX_RUNS" in os.environ else 3):
        box.start()
        _, first = follower.read()
        if last and not is_cut:
            step = max(abs(a - b) for a, b in zip(first, last))
            assert step <= RATE_NM_S * 0.1, f"round {number}: {last} nm was served last, and {first} nm first"
        if last and max(map(abs, last)) > RATE_NM_S:
            assert any(first), "zeros that nobody has served"
        until(lambda: follower.read()[0])
        end = time.monotonic() + rng.uniform(0.1, 2.5)
        while time.monotonic() < end:
            _, last = follower.read()
        moved = max(moved, max(map(abs, last)))
        box.kill()
        if is_cut:
            os.remove(os.path.join(box.folder, "state", "served-last"))
    assert moved > 2 * RATE_NM_S, f"no ramp: {moved} nm"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-ends-") as scratch:
        the_box = Box(sys.argv[1], sys.argv[2], scratch)
        try:
            word_order_survives(the_box)
            print("the word order of a line survives a kill")
            inhibit_survives(the_box)
            print("inhibits survive a kill, each of its connection")
        finally:
            if the_box.daemon:
                the_box.daemon.send_signal(signal.SIGTERM)
                the_box.daemon.wait(PATIENCE_S)
    for cut in (False, True):
        with tempfile.TemporaryDirectory(prefix="probebox-ramps-") as scratch:
            ramping = Box(sys.argv[1], sys.argv[2], scratch, config_of_long_ramps(scratch))
            served_survives(ramping, 20261122, cut)
            print("a follower sees no step over " + ("cuts of the power" if cut else "kills"))
