#!/usr/bin/python3
"""The kit begins in the machine's own frame in mm alone: with a shift, another joint or a machine that counts in inches nothing moves.

frame_test.py BINARIES KIT BOARD
"""
import os
import shutil
import subprocess
import sys

import machine_room
from machine_room import eventually

HERE = os.path.dirname(os.path.abspath(__file__))
X_MM, TO_MM = 10.0, 11.0  # home of mill.ini, and where begins.ngc goes
LINE = "modbus:/dev/ttyS2,baud=19200,parity=even"


def without_a_box(room, measure):
    """Nobody answers on this line: probebox_begin asks for nothing."""
    room.edit(measure, (LINE, "modbus:%s,baud=19200,parity=even" % room.cable("line").ports[1]))
    shutil.copy(os.path.join(HERE, "begins.ngc"), room.kit)


def as_ready(room, ini):
    import linuxcnc
    room.start_linuxcnc(ini)
    room.machine_on()
    room.home()
    room.errors = linuxcnc.error_channel()


def halcmd(room, *words):
    subprocess.run(["halcmd"] + list(words), env=room.environment, check=True)


def command(room, line):
    import linuxcnc
    room.command.mode(linuxcnc.MODE_MDI)
    room.command.wait_complete(machine_room.PATIENCE_S)
    room.command.mdi(line)
    room.command.wait_complete(machine_room.PATIENCE_S)


def said(room):
    """What LinuxCNC has shown since it was last asked."""
    texts = []
    while True:
        one = room.errors.poll()
        if not one:
            return " ".join(texts)
        texts.append(str(one[1]))


def begins(room):
    """Runs begins.ngc; what was said."""
    import linuxcnc
    said(room)
    room.command.mode(linuxcnc.MODE_AUTO)
    room.command.wait_complete(machine_room.PATIENCE_S)
    room.command.program_open(os.path.join(room.kit, "begins.ngc"))
    room.command.wait_complete(machine_room.PATIENCE_S)
    room.command.auto(linuxcnc.AUTO_RUN, 0)
    room.command.wait_complete(machine_room.PATIENCE_S)
    eventually(lambda: room.polled().interp_state == linuxcnc.INTERP_IDLE, "the end of the program")
    return said(room)


def refuses(room, what, *words):
    before = [room.pin("joint.%d.pos-cmd" % k) for k in range(3)]
    text = begins(room)
    after = [room.pin("joint.%d.pos-cmd" % k) for k in range(3)]
    assert before == after, (what, "moved", before, after, text)
    assert all(word in text for word in words), (what, text)
    print("%s: %s" % (what, text), flush=True)


def goes(room, what):
    text = begins(room)
    assert abs(room.pin("joint.0.pos-cmd") - TO_MM) < 1e-6, (what, room.pin("joint.0.pos-cmd"), text)
    command(room, "G53 G0 X%g" % X_MM)


def mill(room):
    room.edit("mill.ini", ("HALFILE = probebox.hal", "HALFILE = probebox_measure.hal"))
    without_a_box(room, "probebox_measure.hal")
    as_ready(room, "mill.ini")
    goes(room, "a machine as it is homed")
    for shift in ("G92 Z0", "G52 Z-7", "G92 B5"):
        command(room, shift)
        refuses(room, shift, "G92.1")
        command(room, "G92.1")
    command(room, "G52 X0 Y0 Z0")
    goes(room, "a G52 that shifts nothing")
    halcmd(room, "unlinkp", "probebox.position-z")
    halcmd(room, "setp", "probebox.position-z", "%.6f" % (room.pin("joint.2.pos-fb") / 25.4))
    refuses(room, "a joint in inches", "inches", "probebox.position-x -y -z")


def lathe(room):
    room.edit("probebox_places.ngc", ("#<_pb_rotary> = 7 ", "#<_pb_rotary> = 4 "))
    without_a_box(room, "probebox_measure_turn.hal")
    as_ready(room, "turn.ini")
    command(room, "G53 G0 X%g" % X_MM)
    command(room, "G7")
    goes(room, "a lathe that has diameters")


def inches(room, *more):
    """LinuxCNC ends before anything of the kit is at work."""
    room.edit("mill.ini", ("LINEAR_UNITS = mm", "LINEAR_UNITS = inch"), *more)
    without_a_box(room, "probebox_measure.hal")
    process = room.start("linuxcnc", ["linuxcnc", "-r", "mill.ini"], cwd=room.kit)
    eventually(lambda: process.poll() is not None, "a LinuxCNC that refuses inches")
    del room.processes["linuxcnc"]
    assert process.returncode != 0 and "LINEAR_UNITS = inch" in room.log("linuxcnc"), room.log("linuxcnc")


def inches_that_measure(room):
    inches(room, ("HALFILE = probebox.hal", "HALFILE = probebox_measure.hal"))


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    for test in (mill, lathe, inches, inches_that_measure):
        machine_room.run(test, binaries, kit)
    print("ok")
