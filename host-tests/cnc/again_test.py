#!/usr/bin/python3
"""A lathe of X and Z checks itself between parts: LinuxCNC calls probebox_check before each of them. A check that fails waits for a person; then one is made of every
two parts. again_test.py BINARIES KIT BOARD"""
import os
import sys

import circle_test
import emulated_world
import machine_room
import residuals
import xz_test

BALL_Z_MM = 120
MOVED_MM = 0.05  # by which the axis is elsewhere than it was accepted: beyond the limit of 0.02 mm


def test(room, board):
    world = xz_test.Lathe(board, room.path("board"))
    accepted_mm = world.axis_at(BALL_Z_MM) - MOVED_MM
    world._edit("machine.toml", lambda text: emulated_world.put(text, "periodic_check", "accepted_x_mm", accepted_mm))
    circle_test.ready(room, world, "xz.ini", xz_test.as_integrator)
    looked = []

    def look(_):
        log = residuals.Log(open(os.path.join(room.kit, "circle.log")).read())
        looked.append(int(log.lines["check"][0][1]))
        accepted = room.probebox("accept", str(looked[-1]), "--by", "Ada", "--although-it-differs")
        assert accepted.returncode == 0, accepted.stderr

    log = circle_test.run_program(room, "again.ngc", look)
    assert "end" in log.lines, log.lines
    circle_test.all_done(room, log)
    values = [int(value) for value, _ in log.lines["check"]]
    results = [int(result) for _, result in log.lines["check"]]
    print("checks", values, results)
    assert values == [1, 0, 0, 0, 0], values
    assert looked == results[:1], looked
    # Failed and made again; none before the second part, one before the third.
    assert results[0] < results[1] == results[2] < results[3] == results[4], results


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
