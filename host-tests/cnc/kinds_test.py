#!/usr/bin/python3
"""LinuxCNC scans the datum sphere of an emulated machine and touches it by the shank, as the box asks for by registers: the delay is what it is.
kinds_test.py BINARIES KIT BOARD"""
import sys

import circle_test
import emulated_world
import machine_room

SEED = 5


def test(room, board):
    world = emulated_world.World(board, room.path("board"), SEED)
    # A scan finds one delay of all axes.
    tau_ms = world.tau_ms[0]
    world._edit("world.toml", lambda text: emulated_world.put(text, "delays", "tau_machine_s", [1e-3 * tau_ms] * 3))
    circle_test.ready(room, world)
    log = circle_test.run_program(room, "kinds.ngc")
    assert "end" in log.lines, log.lines
    circle_test.all_done(room, log)
    for found, sd in zip(log.one("tau"), log.one("tau-sd-us")):
        truth, limit = tau_ms - world.tau_probe_ms, 4e-3 * sd
        print("delay: %.4f ms, is %.4f, limit %.4f" % (found, truth, limit))
        assert 0 < limit < 0.2 and abs(found - truth) < limit, (found, truth, limit)


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
