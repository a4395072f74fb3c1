#!/usr/bin/python3
"""The kit for LinuxCNC as a user gets it: offsets reach the joints through the gate, and nothing else moves them.

kit_test.py BINARIES KIT BOARD [--lathe]
"""
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import machine_room
from machine_room import eventually

COUNT_MM = 1e-4
SETTLED_MM = 2e-4
RATE_MM_S = 0.05  # of board/sim and probebox_offsets.hal
# A computer that pauses makes up for many servo cycles at once.
STEP_MM = 0.008


class Follower(threading.Thread):
    """Reads a pin all the time and keeps its extremes, and by how much it has gone farther than the limit of rate allows."""

    def __init__(self, room, pin):
        super().__init__(daemon=True)
        self.room, self.name_of_pin, self.stopped = room, pin, False
        self.least = self.most = room.pin(self.name_of_pin)
        self.worst_step = 0

    def run(self):
        before = before_s = None
        while not self.stopped:
            asked_s = time.monotonic()
            value = self.room.pin(self.name_of_pin)
            if before is not None:
                self.worst_step = max(self.worst_step, abs(value - before) - RATE_MM_S * (time.monotonic() - before_s))
            before, before_s = value, asked_s
            self.least, self.most = min(self.least, value), max(self.most, value)
            time.sleep(0.002)

    def end(self):
        self.stopped = True
        self.join()
        return self.least, self.most


def offset(room, axis):
    return room.pin("axis.%s.eoffset" % axis)


def follows(room, axes):
    """The offsets are what the box says, and one of them is not nothing."""
    counts = [room.pin("probebox.%s-counts" % axis) for axis in axes]
    near = all(abs(offset(room, axis) - count * COUNT_MM) < SETTLED_MM for axis, count in zip(axes, counts))
    return near and any(abs(count) > 20 for count in counts)


def gate(room):
    return room.pin("probebox-may-correct.out")


def stays(room, axis, for_s, what):
    before = offset(room, axis)
    follower = Follower(room, "axis.%s.eoffset" % axis)
    follower.start()
    time.sleep(for_s)
    least, most = follower.end()
    assert before - SETTLED_MM <= least and most <= before + SETTLED_MM, (what, before, least, most)


class NoStep:
    """In its scope the gate closes and opens, and the joint goes no faster than the limit of rate."""

    def __init__(self, room, axis, what):
        self.follower, self.what = Follower(room, "joint.%d.motor-pos-cmd" % "xyz".index(axis)), what

    def __enter__(self):
        self.follower.start()

    def __exit__(self, failed, *_):
        self.follower.end()
        if not failed:
            assert self.follower.worst_step < STEP_MM, ("the joint stepped", self.what, self.follower.worst_step)


def goes_far_unread(room, sources, what):
    """The box goes to another correction while nobody reads it."""
    before = room.corrections()["correction_mm"][0]
    assert room.probebox("corrections", "--sum", sources, "--count", "1").returncode == 0

    def is_there():
        now = room.corrections()
        return now["settled"] and abs(now["correction_mm"][0] - before) > 4 * STEP_MM

    eventually(is_there, what)


def component_of_gate():
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            words = open("/proc/%s/cmdline" % pid, "rb").read().split(b"\0")
        except OSError:
            continue
        if any(word.endswith(b"probebox_gate") for word in words[:2]):
            return int(pid)
    raise AssertionError("no probebox_gate runs")


def far_corrected(room, board):
    """A copy of the board with a correction along X that a joint would be seen to step by."""
    own = room.path("board")
    shutil.copytree(board, own)
    for file, old, new in (("machine.toml", "gain = -1.0 ", "gain = -3.0 "), ("world.toml", "warm_um = 60 ", "warm_um = 600 ")):
        text = open(os.path.join(own, file)).read()
        assert old in text, (file, old)
        open(os.path.join(own, file), "w").write(text.replace(old, new, 1))
    return own


def mill(room, board):
    board = far_corrected(room, board)
    cable = room.cable("line")
    box = (board, "--cnc", "modbus:%s,baud=115200,parity=none" % cable.ports[0])
    room.edit("probebox_mb2hal.ini", ("/dev/ttyS2", cable.ports[1]), ("SERIAL_BAUD=19200", "SERIAL_BAUD=115200"),
              ("SERIAL_PARITY=even", "SERIAL_PARITY=none"))
    room.start_box(*box)
    room.start_linuxcnc("mill.ini")
    eventually(lambda: room.pin("probebox.valid"), "a valid box")

    assert not gate(room) and offset(room, "x") == 0, "an offset before machine-on"
    room.machine_on()
    assert not gate(room) and offset(room, "x") == 0, "an offset before homing"
    room.home()
    eventually(lambda: gate(room) and follows(room, "xyz"), "offsets that follow the box")
    eventually(lambda: abs(room.pin("joint.0.motor-pos-cmd") - offset(room, "x")) < SETTLED_MM, "a joint at its offset")

    eventually(lambda: abs(room.corrections()["correction_mm"][0]) > 5 * STEP_MM, "a screw that is warm")
    for sources in ("none", "screw"):
        with NoStep(room, "x", "line"):
            cable.connected = False
            eventually(lambda: not gate(room) and not room.pin("probebox.valid"), "a gate that closes on a silent line")
            goes_far_unread(room, sources, "a correction that went far while the line was unplugged")
            stays(room, "x", 1, "silent line")
            cable.connected = True
            eventually(lambda: gate(room), "a gate that opens when the line is back")
            eventually(lambda: abs(offset(room, "x") - room.corrections()["correction_mm"][0]) < 10 * SETTLED_MM, "the joint at it")

    gate_pid = component_of_gate()
    with NoStep(room, "x", "component"):
        os.kill(gate_pid, signal.SIGSTOP)
        eventually(lambda: not gate(room), "a gate that closes when its component has stopped")
        stays(room, "x", 1, "stopped component")
        os.kill(gate_pid, signal.SIGCONT)
        eventually(lambda: gate(room), "a gate that opens when its component goes on")

    before = offset(room, "x")
    room.kill_box()
    eventually(lambda: not gate(room), "a gate that closes when the box was killed")
    stays(room, "x", 1, "killed box")
    follower = Follower(room, "axis.x.eoffset")
    follower.start()
    room.start_box(*box)
    eventually(lambda: gate(room) and follows(room, "xyz"), "offsets after a restart of the box")
    least, most = follower.end()
    # The emulated screws are cold again: the box goes from what it served last to nothing, and on as they warm up.
    low, high = min(before, 0, offset(room, "x")) - 5e-3, max(before, 0, offset(room, "x")) + 5e-3
    assert low <= least and most <= high, ("the joint went astray while the box was started anew", before, least, most)

    room.machine_off()
    eventually(lambda: room.pin("axis.x.eoffset-counts") == 0, "no counts while the machine is off")
    with NoStep(room, "x", "machine-on"):
        room.machine_on()
        eventually(lambda: gate(room) and follows(room, "xyz"), "offsets after machine-on")

    # A power cut of the box: what was read last is lost, and the disk knows only bounds.
    with NoStep(room, "x", "power cut"):
        room.kill_box()
        os.remove(room.path("state/served-last"))
        room.start_box(*box)
        eventually(lambda: gate(room) and follows(room, "xyz"), "offsets after a power cut of the box")


def lathe(room, board):
    cable = room.cable("line")
    room.edit("probebox_mb2hal.ini", ("/dev/ttyS2", cable.ports[1]), ("SERIAL_BAUD=19200", "SERIAL_BAUD=115200"),
              ("SERIAL_PARITY=even", "SERIAL_PARITY=none"))
    room.start_box(board, "--cnc", "modbus:%s,baud=115200,parity=none" % cable.ports[0])
    room.start_linuxcnc("lathe.ini")
    room.machine_on()
    room.home()
    eventually(lambda: gate(room) and follows(room, "xz"), "offsets that follow the box on a lathe")


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    test = lathe if "--lathe" in sys.argv else mill
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
