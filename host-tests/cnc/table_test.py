#!/usr/bin/python3
"""LinuxCNC turns C until a ball touches, tilts a table, and has its plate put into another mount, as the box asks for by registers.
table_test.py BINARIES KIT BOARD"""
import math
import subprocess
import sys

import circle_test
import emulated_world
import machine_room
import turn_test

SEED = 11
TURNED_DEG, LIFTED_MM = 15, 30  # the plate in its second mount
PART_MM = (330.0, 200.0, -300.0)  # where the control takes the balls' holder to be
BALLS_MM = ((30, 0, 140), (-15, 26, 100), (-15, -26, 60))
STYLUS_MM = 150.0
TABLE_MM = (200.037, -260.021)  # Y and Z of its axis, which lies along X


def second_mount():
    """Lines of probebox_places.ngc."""
    cosine, sine = math.cos(math.radians(TURNED_DEG)), math.sin(math.radians(TURNED_DEG))
    for number, (x, y, z) in enumerate(BALLS_MM, 1):
        places = (PART_MM[0] + cosine * x - sine * y, PART_MM[1] + sine * x + cosine * y, PART_MM[2] + z + LIFTED_MM)
        for axis, place in enumerate(places):
            yield "  #%d = %.3f\n" % (1004 + 10 * number + axis, place)


def as_integrator(room, cable):
    circle_test.as_integrator(room, cable)
    room.edit("probebox_places.ngc", ("#<_pb_table_word> = 0 ", "#<_pb_table_word> = 2 "), ("  #<_pb_pivot_z>", "".join(second_mount()) + "  #<_pb_pivot_z>"))


def judge(log, world):
    sd_mm = [1e-3 * value for value in log.one("axis-sd-um")]
    for i, found in enumerate(log.one("axis")):
        # From the spindle, which leans: its axis is that much beside the reference at the height of the stylus' ball.
        truth = world.axis_mm[i] + world.axis_tilt[i] * turn_test.BALL_ABOVE_POINT_MM + world.spindle_tilt[i] * STYLUS_MM
        turn_test.is_within("turning axis " + "XY"[i], found, truth, sd_mm[i])
    sd_mm = [1e-3 * value for value in log.one("pivot-sd-um")]
    truths = TABLE_MM[0] - world.stylus_mm[1], TABLE_MM[1] + world.stylus_mm[2] - STYLUS_MM
    for name, found, truth, sd in zip("YZ", log.one("pivot"), truths, sd_mm):
        turn_test.is_within("table " + name, found, truth, sd)


def test(room, board):
    world = emulated_world.World(board, room.path("board"), SEED, b_turns="table")
    mount = "\n[[part_spindle.further_mount]]\nturn_deg = [0, 0, %d]\nshift_mm = [0, 0, %d]\n" % (TURNED_DEG, LIFTED_MM)
    world._edit("world.toml", lambda text: text + mount)
    circle_test.ready(room, world, integrate=as_integrator)
    mounted = []

    def put_in(said):
        mounted.append(int(said.split("MOUNT ")[1][0]))
        subprocess.run(["halcmd", "setp", "emulated-machine.mount", str(mounted[-1])], check=True)

    log = circle_test.run_program(room, "table.ngc", put_in)
    assert "end" in log.lines, log.lines
    circle_test.all_done(room, log)
    assert mounted == [2, 1], mounted
    assert "in force" in room.probebox("results", "rotary-b").stdout
    judge(log, world)


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
