#!/usr/bin/python3
"""The kit for LinuxCNC as a user gets it: offsets reach the joints through the gate, and nothing else moves them.

kit_test.py BINARIES KIT BOARD [--lathe]
"""
import os
import signal
import subprocess
import sys
import threading
import time

import machine_room
from machine_room import eventually

COUNT_MM = 1e-4
SETTLED_MM = 2e-4


class Follower(threading.Thread):
    """Reads an offset all the time and keeps its extremes."""

    def __init__(self, room, axis):
        super().__init__(daemon=True)
        self.room, self.name_of_pin, self.stopped = room, "axis.%s.eoffset" % axis, False
        self.least = self.most = room.pin(self.name_of_pin)

    def run(self):
        while not self.stopped:
            value = self.room.pin(self.name_of_pin)
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
    follower = Follower(room, axis)
    follower.start()
    time.sleep(for_s)
    least, most = follower.end()
    assert before - SETTLED_MM <= least and most <= before + SETTLED_MM, (what, before, least, most)


def component_of_gate():
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            words = open("/proc/%s/cmdline" % pid, "rb").read().split(b"\0")
        except OSError:
            continue
        if any(word.endswith(b"probebox_gate") for word in words[:2]):
            return int(pid)
    raise AssertionError("no probebox_gate runs")


def mill(room, board):
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

    cable.connected = False
    eventually(lambda: not gate(room) and not room.pin("probebox.valid"), "a gate that closes on a silent line")
    stays(room, "x", 2, "silent line")
    cable.connected = True
    eventually(lambda: gate(room), "a gate that opens when the line is back")

    gate_pid = component_of_gate()
    os.kill(gate_pid, signal.SIGSTOP)
    eventually(lambda: not gate(room), "a gate that closes when its component has stopped")
    stays(room, "x", 1, "stopped component")
    os.kill(gate_pid, signal.SIGCONT)
    eventually(lambda: gate(room), "a gate that opens when its component goes on")

    before = offset(room, "x")
    room.kill_box()
    eventually(lambda: not gate(room), "a gate that closes when the box was killed")
    stays(room, "x", 1, "killed box")
    follower = Follower(room, "x")
    follower.start()
    room.start_box(*box)
    eventually(lambda: gate(room) and follows(room, "xyz"), "offsets after a restart of the box")
    least, most = follower.end()
    # The emulated screws are cold again: the box goes from what it served last to nothing, and on as they warm up.
    low, high = min(before, 0, offset(room, "x")) - 1e-3, max(before, 0, offset(room, "x")) + 1e-3
    assert low <= least and most <= high, ("the joint went astray while the box was started anew", before, least, most)

    room.machine_off()
    eventually(lambda: room.pin("axis.x.eoffset-counts") == 0, "no counts while the machine is off")
    room.machine_on()
    eventually(lambda: gate(room) and follows(room, "xyz"), "offsets after machine-on")


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
