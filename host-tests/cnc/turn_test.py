#!/usr/bin/python3
"""A lathe measures: LinuxCNC as a lathe with X (diameters) Y Z and C leads an emulated machine, and finds the delay, the turning axis and a turning tool
by registers alone. turn_test.py BINARIES KIT BOARD"""
import math
import os
import re
import sys

import circle_test
import emulated_world
import machine_room

FACES = (1, -1, 1)  # +X, -Y, +Z: a turning tool touches one face an axis
SCREWS_MM = 0.0005  # of the warm screws, whose faces nobody has calibrated here
BALL_ABOVE_POINT_MM = 140.0


def as_integrator(room, cable):
    circle_test.as_integrator(room, cable, "turn.ini", "turn.hal", "probebox_measure_turn.hal")
    room.edit("probebox_places.ngc", ("#<_pb_rotary> = 7 ", "#<_pb_rotary> = 4 "))
    room.edit("probebox_places.ngc", ("#<_pb_orient> = 1 ", "#<_pb_orient> = 0 "))
    room.edit("emulated_machine.hal", ("net position-3 streamer.0.pin.3 => joint.3.motor-pos-fb\n", ""), ("net position-4 streamer.0.pin.4 => joint.4.motor-pos-fb\n", ""),
              ("joint.5.motor-pos-fb", "joint.3.motor-pos-fb"), ("net command-3 joint.3.motor-pos-cmd => sampler.0.pin.3\n", ""),
              ("net command-4 joint.4.motor-pos-cmd => sampler.0.pin.4\n", ""), ("joint.5.motor-pos-cmd", "joint.3.motor-pos-cmd"))


def radius_of_tool(world):
    return float(re.search(r"(?s)number = 4\n.*?radius_mm = ([0-9.e-]+)", open(world.path("world.toml")).read())[1])


def is_within(what, found, truth, sd_mm):
    limit = 4 * math.hypot(sd_mm, SCREWS_MM)
    print("%s: %.4f mm, is %.4f, limit %.4f" % (what, found, truth, limit))
    assert sd_mm > 0 and abs(found - truth) < limit, (what, found, truth, limit)


def judge(log, world):
    sd = [1e-3 * value for value in log.one("axis-sd-um")]
    for i, found in enumerate(log.one("axis")):
        truth = world.axis_mm[i] + world.axis_tilt[i] * BALL_ABOVE_POINT_MM - world.stylus_mm[i]
        is_within("turning axis " + "XY"[i], found, truth, sd[i])
    radius = radius_of_tool(world)
    edge = [world.tool_mm[0] - radius * FACES[0], world.tool_mm[1] - radius * FACES[1], -world.tool_mm[2]]
    for i, found in enumerate(log.one("tool")):
        is_within("tool 4 " + "XYZ"[i], found, edge[i], 0.0008)


def test(room, board):
    world = emulated_world.World(board, room.path("board"), 3)
    world._edit("machine.toml", lambda text: emulated_world.put(text.replace(
        "length_mm = 120\n", 'length_mm = 120\nfaces = ["+X", "-Y", "+Z"]\n', 1), "tool_setter", "sd_half_width_mm", "0.0004"))
    circle_test.ready(room, world, "turn.ini", as_integrator)
    log = circle_test.run_program(room, "turn.ngc")
    circle_test.all_done(room, log)
    before = open(os.path.join(room.kit, "before.log")).read()
    assert before.split() == ["diameter", "1.000000"] and log.one("after") == [1.0], (before, "X is diameter before and behind")
    judge(log, world)


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
