"""Nothing that happens to a box moves a joint: each fault is a test that looks at the joint of a controller which reads a
real daemon's registers. `joint_stays.py PROBEBOXD PROBEBOX FAULT`; status 0 when all holds."""
import json
import os
import random
import sys
import tempfile
import time

from box import PATIENCE_S, Box, config, until
from joint import NOBODY, Joint

RATE_NM_S = 4000  # limit of rate of every axis
SCALE = 5  # the machine's time runs faster: ramps of seconds need not be waited for
# board/sim at its place after homing, X 120, Y 80, Z -100 mm: warm screws longer by 60, 45 and 30 um move the nut by
# these parts of it, X and Y away from the bearing at their low end, Z from the one at its high end (metrology.md, D1).
WARM_NM = (-60e3 * (160 + 120) / 820, -45e3 * (140 + 80) / 640, 30e3 * (120 + 100) / 700)
NEAR_NM = 150  # noise of sensors and encoders
CLOCK_LOCKED = 1
HOLD_S = 2  # T_hold


class Machine:
    def __init__(self, probeboxd, probebox, folder, time_constant_s=0.5, faults=(), **machine):
        described = config(
            folder,
            faults,
            machine={"correction_rate_mm_s": RATE_NM_S * 1e-6, "rate_um_s": 1000, **machine},
            world={"time_constant_s": time_constant_s},
        )
        self.box = Box(probeboxd, probebox, folder, described, ["--time-scale", str(SCALE)])
        self.joint = Joint(self.box.master, RATE_NM_S)

    def start(self):
        self.box.start()
        return self.joint.look()

    def to_ramp(self, at_nm=4000):
        """Until the joint is in the middle of its way; at its end, on a computer that is busy elsewhere."""
        self.joint.until(lambda read: read.valid and abs(read.value_nm[0]) > at_nm, "a ramp")

    def to_rest(self, expected_nm=WARM_NM):
        """Until the correction has arrived where it belongs and stays there for a second, and the joint with it: behind a
        start the emulated screws are cold again, and the correction leaves the place that it comes back to."""
        near = lambda value_nm: all(abs(a - b) < NEAR_NM for a, b in zip(value_nm, expected_nm))
        while True:
            self.joint.until(lambda read: read.valid and near(read.value_nm), f"rest at {expected_nm}")
            since = self.joint.beats
            while near(self.joint.look().value_nm):
                if self.joint.beats - since >= 10:
                    assert near(self.joint.at_nm), self.joint.at_nm
                    return
                time.sleep(0.003)


    def comes_back(self):
        """Behind an end: the box serves what the joint follows, without `valid` until all is known, and goes on from there.
        Who looks for the first time when it is valid already finds it as far from there as its own time allows."""
        stands = self.joint.at_nm
        self.start()
        while not self.joint.last.valid:
            served = self.joint.last.value_nm
            assert served == stands == self.joint.at_nm, f"the joint stands at {stands} nm, and {served} are served"
            self.joint.look()


def start(m):
    """A box that has never run: the joint stays at nothing until `valid`, and then begins there."""
    m.comes_back()
    m.to_rest()
    assert m.joint.moves > 1


def kill(m):
    """kill -9 in mid ramp, at once after a read, and when the box has gone on for a while that nobody saw."""
    m.start()
    for at_nm, unseen_s in ((4000, 0), (8000, 0.3)):
        m.to_ramp(at_nm)
        time.sleep(unseen_s)
        m.box.master.write(138, 0)  # says something that has no correction in its answer
        m.box.kill()
        m.comes_back()
    m.to_rest()


def restart(m):
    """systemctl restart, in mid ramp and at rest."""
    m.start()
    m.to_ramp()
    time.sleep(0.3)
    m.box.stop()
    m.comes_back()
    m.to_rest()
    m.box.stop()
    m.comes_back()
    m.to_rest()


def unplugged(m):
    """The adapter is pulled out in mid ramp while the controller asks, and comes back: the box has gone on meanwhile."""
    m.start()
    m.to_ramp()
    os.write(m.box.master.line, bytes([1, 3, 0, 0]))  # half a request
    m.box.unplug()
    stands, at_beat = m.joint.at_nm, m.joint.beats
    until(lambda: "opening it again" in m.box.log())
    m.box.plug_in()
    back = m.joint.look()
    assert m.joint.beats - at_beat < 2**15 and back.boots == 1, "the same box"
    m.to_rest()
    assert m.joint.at_nm != stands


def frozen_clock(m):
    """The master clock's line is silent while the joint is on its way: the correction needs no clock, and goes on."""
    m.start()
    m.joint.until(lambda read: read.valid and read.clock == CLOCK_LOCKED, "a clock")
    lost = m.joint.until(lambda read: read.clock != CLOCK_LOCKED, "a clock that is lost")
    beats, moves = m.joint.beats, m.joint.moves
    while m.joint.look().clock != CLOCK_LOCKED:
        assert m.joint.last.valid and not m.joint.last.degraded, m.joint.last.registers
    assert m.joint.beats > beats, "the heartbeat runs"
    on_its_way = abs(lost.value_nm[0] - WARM_NM[0]) > 2000
    assert m.joint.moves > moves or not on_its_way, "it went on without the clock"
    m.to_rest()


def silent_probe(m):
    """The probe says nothing, as in every cut: it is no input of what is summed."""
    m.start()
    m.to_rest()
    assert m.joint.is_open and not m.joint.last.degraded


def source_lost(m):
    """The sensors of the screws fall silent while they warm up: the value is held with `degraded`, then frozen without
    `valid`, and goes on from there."""
    m.start()
    m.joint.until(lambda read: read.valid and read.degraded, "a value that is held")
    held, from_beat, last_beat = m.joint.at_nm, m.joint.beats, m.joint.beats
    assert max(map(abs, held)) > RATE_NM_S, "there is something to lose"
    while m.joint.look().valid and m.joint.last.degraded:
        last_beat = m.joint.beats
        # What was on its way still arrives.
        assert all(abs(a - b) < NEAR_NM for a, b in zip(m.joint.at_nm, held)), (held, m.joint.at_nm)
    assert last_beat - from_beat <= 10 * HOLD_S + 2, "held for T_hold and no longer"
    assert not m.joint.last.valid
    frozen = m.joint.at_nm
    assert all(abs(a - b) < NEAR_NM for a, b in zip(frozen, held)), (held, frozen)
    while not m.joint.look().valid:
        assert not m.joint.is_open and m.joint.last.degraded
        assert m.joint.last.value_nm == m.joint.at_nm == frozen, (m.joint.last.value_nm, frozen)
    m.to_rest()


def accepted_in_a_cut(m):
    """A result that would move the joint is accepted while the controller cuts: nothing until the cut is over, then a ramp."""
    m.start()
    m.to_rest()
    proposed = m.box.command("propose", cold_screw_case(m.box.folder), "--as-this-machine", "--by", "Ada")
    m.box.master.write(138, 1)
    accepted = m.box.command("accept", str(proposed["result_id"]), "--by", "Ada")
    assert accepted["waiting_for_cut"], accepted
    stands = m.joint.at_nm

    def nothing_happens(read):
        assert read.inhibited and read.valid
        assert all(abs(a - b) < NEAR_NM for a, b in zip(m.joint.at_nm, stands)), (stands, m.joint.at_nm)

    m.joint.for_beats(30, nothing_happens)
    moves = m.joint.moves
    m.box.master.write(138, 0)
    m.joint.until(lambda read: not read.inhibited, "the end of the cut")
    m.to_rest((WARM_NM[0] * (60 - COLD_UM) / 60, *WARM_NM[1:]))
    assert m.joint.moves > moves


def mask_changed(m):
    """Sources are switched off, and on again in mid ramp."""
    m.start()
    m.to_rest()
    m.box.command("corrections", "--sum", "none")
    m.joint.until(lambda read: read.mask == 0 and abs(read.value_nm[0]) < 15000, "the way back")
    m.box.command("corrections", "--sum", "screw")
    m.to_rest()
    m.box.command("corrections", "--sum", "none")
    m.to_rest(NOBODY)
    assert m.joint.at_nm == NOBODY


def word_order_changed(m):
    """Another order of words in mid ramp, again and again: from the answer on every 32-bit value has it, and the 16-bit
    values of the same read agree with them."""
    m.start()
    m.to_ramp(2000)
    for order in (1, 0, 1):
        m.box.master.write(128, order)
        m.joint.order = order
        m.joint.for_beats(4)
    m.to_rest()


COLD_UM = 15  # what the sensor of X reads, says the case, while the screw is cold


def cold_screw_case(folder):
    """A case of `screw-reference`: the correction of X becomes smaller by this much of the extension."""
    case = os.path.join(folder, "cold")
    os.mkdir(case)
    with open(os.path.join(case, "config.json"), "w") as file:
        json.dump({"method": "screw-reference", "axis": "X", "sd_face_um": 0.001}, file)
    rng = random.Random(1)
    with open(os.path.join(case, "at_rest.csv"), "w") as file:
        file.write("t_s,phi_rad,sensor_um\n")
        for k in range(1200):
            file.write(f"{k / 20},0.7,{COLD_UM + rng.gauss(0, 0.02)}\n")
    return case


def again(kind, lasts_s):
    """The machine's time runs on while a busy computer does not let the joint look: who misses one sees the next."""
    return [(kind, at_s, lasts_s) for at_s in range(5, 200, 10)]


FAULTS = {
    "daemon_start": (start, {}),
    "kill": (kill, {}),
    "restart": (restart, {}),
    "unplugged_line": (unplugged, {}),
    "frozen_clock": (frozen_clock, {"faults": again("sync-silent", 2), "time_constant_s": 4}),
    "silent_probe": (silent_probe, {"faults": [("probe-silent", 2, 1e5)], "time_constant_s": 2}),
    "source_lost": (source_lost, {"faults": again("screw-sensors-silent", 5), "time_constant_s": 4, "hold_s": HOLD_S}),
    "result_accepted_in_a_cut": (accepted_in_a_cut, {}),
    "mask_changed": (mask_changed, {}),
    "word_order_changed": (word_order_changed, {}),
}

if __name__ == "__main__":
    test, described = FAULTS[sys.argv[3]]
    with tempfile.TemporaryDirectory(prefix="probebox-joint-") as scratch:
        machine = Machine(sys.argv[1], sys.argv[2], scratch, **described)
        try:
            test(machine)
        except AssertionError:
            print(machine.box.log())
            raise
        finally:
            if machine.box.daemon:
                machine.box.daemon.kill()
                machine.box.daemon.wait(PATIENCE_S)
        print(f"{machine.joint.moves} moves of the joint, {machine.joint.furthest_nm} nm at most, none too fast")
