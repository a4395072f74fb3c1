#!/usr/bin/python3
"""A lathe of X and Z measures: LinuxCNC, whose programs have diameters, leads the emulated lathe without a Y, and finds the delay, X of its turning axis
over Z and a turning tool by registers alone. xz_test.py BINARIES KIT BOARD"""
import os
import random
import re
import shutil
import subprocess
import sys

import circle_test
import emulated_world
import machine_room
import turn_test

SEED = 5
HOME_MM = (150, 0, 320)
POINT_Z_MM = 60
# What the control is told of its places: lines of probebox_places.ngc.
PLACES = {"_pb_home": 5, "_pb_has_y": 0, "_pb_rotary": 4, "_pb_orient": 0, "_pb_safe_z": 280, "_pb_park_x": 150, "_pb_park_y": 0, "_pb_park_z": 320,
          "_pb_sphere_x": 120, "_pb_sphere_y": 0, "_pb_sphere_z": 80, "_pb_axis_x": 0, "_pb_axis_y": 0, "_pb_setter_x": 160, "_pb_setter_y": 0,
          "_pb_setter_z": 0, "_pb_plates_x": 70, "_pb_plates_y": 0, "_pb_plates_z": 30}
NUMBERED = {1201: 60, 1204: 45, 1304: 0.001, 1011: 0.41, 1012: -0.23, 1013: 120, 1014: 0.15, 1015: 0.2, 1016: 200}


class Lathe:
    """The emulated lathe with other errors; `truth` of what tests compare with, mm."""

    def __init__(self, board, folder):
        shutil.copytree(board, folder)
        for name in ("machine.toml", "world.toml"):
            shutil.copy(os.path.join(board + "-lathe", name), folder)
        self.folder, draw = folder, random.Random(SEED)
        self.tau_ms = draw.uniform(2, 9)
        self.axis_x_mm, self.lean = 0.15 + draw.uniform(-0.1, 0.1), draw.uniform(-3e-4, 3e-4)
        self.tool_mm = (0.2 + draw.uniform(-0.1, 0.1), 44.8 + draw.uniform(-0.05, 0.05))
        self._edit("world.toml", self._world)
        self._edit("machine.toml", lambda text: emulated_world.put(text, "corrections", "sources", '["screw", "centreline"]'))

    def path(self, name):
        return os.path.join(self.folder, name)

    def _edit(self, name, change):
        text = change(open(self.path(name)).read())
        open(self.path(name), "w").write(text)

    def _world(self, text):
        for section, key, value in [("delays", "tau_machine_s", [1e-3 * self.tau_ms] * 3), ("part_spindle", "point_mm", [self.axis_x_mm, -0.13, POINT_Z_MM]),
                                    ("part_spindle", "tilt_x_rad", self.lean)]:
            text = emulated_world.put(text, section, key, value)
        text = emulated_world.tool_of(text, 4, offset_x_mm=self.tool_mm[0], length_mm=self.tool_mm[1])
        return text + "\n[outside_control]\nport = %d\n" % emulated_world.PORT

    def axis_at(self, z_mm):
        return self.axis_x_mm + self.lean * (z_mm - POINT_Z_MM)


def as_integrator(room, cable):
    """What somebody with this lathe edits in the kit."""
    subprocess.run([os.path.join(room.kit, "probebox_without_y")], check=True)
    room.edit("probebox_measure_xz.hal", ("modbus:/dev/ttyS2,baud=19200,parity=even", "modbus:%s,baud=115200,parity=none" % cable.ports[1]))
    places = open(os.path.join(room.kit, "probebox_places.ngc")).read()
    for name, value in {**PLACES, "_pb_dry": 0}.items():
        places, count = re.subn(r"(#<%s> = )\S+" % name, r"\g<1>%s" % value, places)
        assert count == 1, name
    for number, value in NUMBERED.items():
        places, count = re.subn(r"(?m)^(  #%d = )\S+" % number, r"\g<1>%s" % value, places)
        if count == 0:
            places = places.replace("  #<_pb_pivot_z>", "  #%d = %s\n  #<_pb_pivot_z>" % (number, value))
    open(os.path.join(room.kit, "probebox_places.ngc"), "w").write(places)
    homes = [("\nHOME = %d\nHOME_OFFSET = %d\n" % (was, was), "\nHOME = %d\nHOME_OFFSET = %d\n" % (now, now)) for was, now in ((10, HOME_MM[0]), (110, HOME_MM[2]))]
    room.edit("xz.ini", ("HALFILE = xz.hal", "HALFILE = emulated_machine.hal"), *homes, ("_ACCELERATION = 1000", "_ACCELERATION = 5000"),
              ("MIN_FERROR = 10", "MIN_FERROR = 2000"), ("\nFERROR = 50", "\nFERROR = 2000"))
    machine = open(os.path.join(room.kit, "emulated_machine.hal")).read()
    lines = [line for line in machine.splitlines() if not re.match(r"net (position|command)-[134] ", line)]
    machine = "\n".join(lines).replace("joint.2.", "joint.1.").replace("joint.5.", "joint.2.").replace("7630 120 80 -100", "7630 %d %d %d" % HOME_MM) + "\n"
    open(os.path.join(room.kit, "emulated_machine.hal"), "w").write(machine)
    with open(os.path.join(room.kit, "tool.tbl"), "w") as table:
        table.write("T1 P1 Z60 D6\nT4 P4 Z45 D1.6\n")


def judge(room, log, world):
    assert "after" in log.lines and log.one("after") == [1.0], "X is diameter again"
    axis_x, axis_y, z_mm = log.one("axis")
    slope_x, slope_y = log.one("slope")
    # Carried on from the two heights of the ball.
    turn_test.is_within("turning axis X at Z %.1f" % z_mm, axis_x, world.axis_at(z_mm), 0.0015)
    turn_test.is_within("slope of X over 100 mm of Z", 100 * slope_x, 100 * world.lean, 0.001)
    assert axis_y == slope_y == 0, "nothing tells Y"
    tool_x, tool_y, tool_z = log.one("tool")
    turn_test.is_within("tool 4 X", tool_x, world.tool_mm[0] - 0.2, 0.0008)
    turn_test.is_within("tool 4 Z", tool_z, -world.tool_mm[1] - 0.2, 0.0008)
    assert tool_y == 0, "nothing tells Y"


def test(room, board):
    world = Lathe(board, room.path("board"))
    circle_test.ready(room, world, "xz.ini", as_integrator)
    mounted = []

    def clamped(said):
        assert "BALL" in said, said
        mounted.append(int(said.split("MOUNT ")[1][0]))
        subprocess.run(["halcmd", "setp", "emulated-machine.mount", str(mounted[-1])], check=True)

    log = circle_test.run_program(room, "xz.ngc", clamped)
    assert "end" in log.lines, log.lines
    circle_test.all_done(room, log)
    assert mounted == [2, 1], mounted
    judge(room, log, world)


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
