"""A joint that follows the box as a controller does: the kit's gate decides (tools/linuxcnc/probebox_gate), the last valid
correction is added to the command, and it stays where the gate is closed."""
import importlib.machinery
import importlib.util
import os
import struct
import sys
import time
import types

PATIENCE_S = 120
BEAT_S = 0.1  # of the heartbeat in register 4: the box's own time, which stamps each read
LATE_S = 0.05  # of records that come late and together, behind a computer that was busy elsewhere: one beat at least
SERVED_S = 0.02  # a value is served for up to this long before the next one is made
ROUNDING_NM = 2
COUNT_NM = 100  # of the registers that the gate reads
BLOCK = 122  # registers from 0 on, one read
NOBODY = (0, 0, 0)


def kit_gate():
    """The decisions of the kit's component, without LinuxCNC."""
    sys.modules.setdefault("hal", types.ModuleType("hal"))
    here = os.path.dirname(os.path.abspath(__file__))
    path = os.path.join(here, "..", "..", "..", "tools", "linuxcnc", "probebox_gate")
    loader = importlib.machinery.SourceFileLoader("probebox_gate", path)
    gate = importlib.util.module_from_spec(importlib.util.spec_from_loader("probebox_gate", loader))
    loader.exec_module(gate)
    return gate.Gate()


def doubles(block, first, code, order):
    """Three 32-bit values from register `first` on; order 1: the low word of each comes first (register 128)."""
    words = struct.unpack_from(">6H", block, 2 * first)
    if order:
        words = [words[k ^ 1] for k in range(6)]
    return struct.unpack(">3" + code, struct.pack(">6H", *words))


class Read:
    """Registers 0 to 121 of one instant."""

    def __init__(self, block, order=0):
        self.registers = struct.unpack(f">{BLOCK}H", block)
        self.valid = bool(self.registers[2] & 1)
        self.degraded = bool(self.registers[2] & 32)
        self.sequence, self.beat, self.mask = self.registers[3], self.registers[4], self.registers[12]
        self.value_nm, self.real_mm = doubles(block, 32, "i", order), doubles(block, 16, "f", order)
        self.inhibited, self.settled, self.boots = (self.registers[k] for k in (47, 48, 50))
        self.clock = self.registers[112]

    def formats_agree(self):
        counts = struct.unpack(">hhh", struct.pack(">3H", *self.registers[5:8]))
        return all(
            abs(counts[k] * COUNT_NM - self.value_nm[k]) <= COUNT_NM // 2 + 1
            and self.registers[8 + k] == counts[k] + 32768
            and abs(self.real_mm[k] * 1e6 - self.value_nm[k]) <= 1
            for k in range(3)
        )


class Joint:
    """Every read is judged: within one beat and the beats between two reads the joint goes no farther than the limit of
    rate allows. Times are the box's own, so a computer that is busy elsewhere makes no difference."""

    def __init__(self, master, rate_nm_s):
        self.master, self.rate_nm_s = master, rate_nm_s
        self.gate = kit_gate()
        self.order = 0  # of words, as the controller has chosen it
        self.at_nm = NOBODY  # nanometres, of what the box serves while the gate is open
        self.at_counts = NOBODY  # of the gate
        self.is_open = False
        self.last = None
        self.beats = 0  # since the joint began to look
        self.from_beat, self.from_nm = 0, NOBODY  # where it stood when the present beat began
        self.moves = 0  # reads that moved it
        self.furthest_nm = 0

    def look(self):
        read = Read(self.master.registers(0, BLOCK), self.order)
        assert read.formats_agree(), f"torn: {read.registers}"
        self.pass_time(read)
        counts, self.is_open, _, _ = self.gate.look(read.registers, time.monotonic())
        if counts is not None:
            self.move(read.value_nm, counts)
        self.last = read
        return read

    def pass_time(self, read):
        restarted = self.last is None or read.boots != self.last.boots
        passed = read.beat if restarted else (read.beat - self.last.beat) % 65536
        # It was there at the last read: the box served so, or was frozen there.
        was_there = self.is_open or self.last is None or (not self.last.valid and self.last.value_nm == self.at_nm)
        if passed and was_there:
            self.from_beat, self.from_nm = self.beats, self.at_nm
        self.beats += passed

    def move(self, to_nm, counts):
        beats = self.beats - self.from_beat
        most = self.rate_nm_s * (BEAT_S * (beats + 1) + LATE_S * beats + SERVED_S) + ROUNDING_NM
        for axis in range(3):
            way = abs(to_nm[axis] - self.from_nm[axis])
            assert way <= most, f"joint {axis} steps from {self.from_nm} to {to_nm} nm, where {most:.0f} are allowed"
            assert abs(counts[axis] * COUNT_NM - to_nm[axis]) <= COUNT_NM // 2 + 1, "the gate lets another value through"
        self.moves += to_nm != self.at_nm
        self.at_nm, self.at_counts = to_nm, tuple(counts)
        self.furthest_nm = max(self.furthest_nm, *map(abs, to_nm))

    def until(self, condition, what):
        """Looks until a read fulfils the condition, and returns it."""
        end = time.monotonic() + PATIENCE_S
        while True:
            read = self.look()
            if condition(read):
                return read
            assert time.monotonic() < end, f"{what} did not come: {read.registers}, the joint is at {self.at_nm} nm"
            time.sleep(0.003)

    def for_beats(self, count, meanwhile=lambda read: None):
        """Looks for so long in the box's time."""
        end = self.beats + count
        while self.beats < end:
            meanwhile(self.look())
            time.sleep(0.003)
