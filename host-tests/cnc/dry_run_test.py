#!/usr/bin/python3
"""A dry run goes the whole way above everything: LinuxCNC's joints are watched while it does, and the probe. dry_run_test.py BINARIES KIT BOARD"""
import os
import sys
import threading
import time

import circle_test
import emulated_world
import machine_room

SAFE_Z_MM = -100.0  # probebox_places.ngc; tool 4 is shorter than the probe, and stands as high
CORRECTION_MM = 0.2


class Watch(threading.Thread):
    """Reads the joints, the probe and its mask all the time."""

    def __init__(self, room):
        super().__init__(daemon=True)
        self.room, self.stopped = room, False
        self.anew()

    def anew(self):
        self.lowest, self.highest, self.touched, self.masked, self.places = 1e9, -1e9, False, False, set()

    def run(self):
        while not self.stopped:
            x, y, z = (self.room.pin("joint.%d.pos-fb" % k) for k in range(3))
            self.lowest, self.highest = min(self.lowest, z), max(self.highest, z)
            self.touched = self.touched or self.room.pin("probe-signal-of-test")
            self.masked = self.masked or self.room.pin("motion.digital-out-00")
            self.places.add((round(x), round(y)))
            time.sleep(0.003)

    def is_dry(self, what, near):
        assert not self.touched and not self.masked, (what, "the probe touched, or was to", self.touched, self.masked)
        assert self.lowest > SAFE_Z_MM - CORRECTION_MM, (what, "a joint was below the safe height", self.lowest)
        assert self.highest > SAFE_Z_MM + 2, (what, "nothing was lifted", self.highest)
        assert any(abs(x - near[0]) < 8 and abs(y - near[1]) < 8 for x, y in self.places), (what, "it did not go there", near)
        print("%s: Z %.3f to %.3f mm, %d places" % (what, self.lowest, self.highest, len(self.places)), flush=True)


def results(room):
    return room.probebox("results").stdout


def test(room, board):
    import linuxcnc
    world = emulated_world.World(board, room.path("board"), 1)
    circle_test.ready(room, world)
    room.pin = lambda name, pin=room.pin: pin("streamer.0.pin.6") if name == "probe-signal-of-test" else pin(name)
    watch = Watch(room)
    watch.start()
    room.command.mode(linuxcnc.MODE_AUTO)
    room.command.wait_complete(machine_room.PATIENCE_S)
    room.command.program_open(os.path.join(room.kit, "dry_run.ngc"))
    room.command.wait_complete(machine_room.PATIENCE_S)
    before = results(room)
    room.command.auto(linuxcnc.AUTO_RUN, 0)
    machine_room.eventually(lambda: room.polled().interp_state == linuxcnc.INTERP_PAUSED, "the stop behind the dry run", 600)
    watch.is_dry("delay-per-axis", (120, 80))
    assert results(room) == before, "a dry run has left a result"

    watch.anew()
    room.command.auto(linuxcnc.AUTO_RESUME)
    log = os.path.join(room.kit, "circle.log")
    machine_room.eventually(lambda: "risen" in open(log).read(), "the run itself", 1200)
    assert watch.touched and watch.masked and watch.lowest < SAFE_Z_MM - 20, "the run itself touches"
    assert results(room) != before

    watch.anew()
    before = results(room)
    machine_room.eventually(lambda: "end" in open(log).read(), "the end of the program", 1200)
    watch.is_dry("tool-setter", (120, 200))
    watch.stopped = True
    watch.join()
    assert results(room) == before, "a dry run has left a result"
    assert room.pin("emulated-machine.crashes") == 0, "the machine collided"
    for line in open(log).read().splitlines():
        if line.startswith("run"):
            assert float(line.split()[2]) == 0, line


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
