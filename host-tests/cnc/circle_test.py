#!/usr/bin/python3
"""The circle: LinuxCNC leads an emulated machine whose errors nobody knows, calibrates it by registers alone, takes the results over, and
measures again with its own probing cycle. What is left of each error is within a few standard deviations of both measurements.

circle_test.py BINARIES KIT BOARD [--short] [--seed N]      short: the delay of each axis alone
"""
import argparse
import os
import shutil
import time

import emulated_world
import machine_room
import residuals

HERE = os.path.dirname(os.path.abspath(__file__))
HOME_MM = (120, 80, -100)
PATIENCE_S = 3600.0  # of the whole program: steps that a busy computer spoils are repeated


def as_integrator(room, cable, ini="mill.ini", hal="mill.hal", measure="probebox_measure.hal"):
    """What somebody with this machine edits in the kit."""
    room.edit(measure, ("modbus:/dev/ttyS2,baud=19200,parity=even", "modbus:%s,baud=115200,parity=none" % cable.ports[1]))
    # Nobody is there to start a program again behind its dry run.
    room.edit("probebox_places.ngc", ("#<_pb_dry> = 1 ", "#<_pb_dry> = 0 "))
    homes = [("\nHOME = %d\nHOME_OFFSET = %d\n" % (was, was), "\nHOME = %d\nHOME_OFFSET = %d\n" % (now, now))
             for was, now in zip((10, -20, 110), HOME_MM)]
    corrections = [] if "HALFILE = " + measure in open(os.path.join(room.kit, ini)).read() else [("HALFILE = probebox.hal", "HALFILE = " + measure)]
    room.edit(ini, ("HALFILE = " + hal, "HALFILE = emulated_machine.hal"), *corrections, *homes,
              ("_ACCELERATION = 1000", "_ACCELERATION = 5000"),
              # Feedback is as late as this computer is busy.
              ("MIN_FERROR = 10", "MIN_FERROR = 2000"), ("\nFERROR = 50", "\nFERROR = 2000"))
    with open(os.path.join(room.kit, "tool.tbl"), "w") as table:
        table.write("T1 P1 Z150 D6\nT2 P2 Z200 D6\nT4 P4 Z120 D10\n")


def ready(room, world, ini="mill.ini", integrate=as_integrator):
    """A box at the machine of this world, and LinuxCNC that leads it over a line, homed."""
    for name in os.listdir(HERE):
        if name.endswith(".ngc") or name.startswith("emulated_machine"):
            shutil.copy(os.path.join(HERE, name), room.kit)
    cable = room.cable("line")
    integrate(room, cable)
    room.start_box(world.folder, "--cnc", "modbus:%s,baud=115200,parity=none" % cable.ports[0])
    room.start_linuxcnc(ini)
    room.machine_on()
    room.home()


def all_done(room, log):
    """The machine met nothing, and every run of the program was accepted."""
    assert room.pin("emulated-machine.crashes") == 0, "the machine collided"
    for method, value, refusal, fault in log.lines["run"]:
        assert value == 0, "method %d ended with %d, refusal %d, fault %d" % (method, value, refusal, fault)


def run_program(room, name, at_stop=None):
    """Runs a program of the kit to its end, and returns what it has logged. At M0 at_stop is told what was said before, and it goes on."""
    import linuxcnc
    log, shown = os.path.join(room.kit, "circle.log"), 0
    errors = linuxcnc.error_channel()
    for action in (lambda: room.command.mode(linuxcnc.MODE_AUTO), lambda: room.command.program_open(os.path.join(room.kit, name))):
        action()
        room.command.wait_complete(machine_room.PATIENCE_S)
    # Not waited for: that would keep all threads of this program from running, and the cable with them.
    room.command.auto(linuxcnc.AUTO_RUN, 0)
    machine_room.eventually(lambda: os.path.exists(log), "a program that has begun")
    end, said = time.monotonic() + PATIENCE_S, None

    def heard():
        nonlocal said
        message = errors.poll()
        if message and at_stop and message[0] not in (linuxcnc.OPERATOR_ERROR, linuxcnc.NML_ERROR):
            said = message[1]
        else:
            assert not message, message

    while room.polled().interp_state != linuxcnc.INTERP_IDLE:
        assert time.monotonic() < end, "the program does not end"
        heard()
        if said and room.polled().interp_state == linuxcnc.INTERP_PAUSED:
            at_stop(said)
            said = None
            room.command.auto(linuxcnc.AUTO_RESUME)
        lines = open(log).read().splitlines()
        for line in lines[shown:]:
            print(time.strftime("%H:%M:%S"), line, flush=True)
        shown = len(lines)
        time.sleep(0.5)
    heard()
    return residuals.Log(open(log).read())


def circle(room, board, short, seed):
    world = emulated_world.World(board, room.path("board"), seed)
    ready(room, world)
    log = run_program(room, "circle_short.ngc" if short else "circle.ngc")
    assert "end" in log.lines and "missed" not in log.lines, log.lines
    all_done(room, log)
    found = residuals.of_delay(log, world)
    if not short:
        found += residuals.of_touches(log, world, residuals.Results(room))
    # No two runs are alike, and an sd may be right within a fifth: an honest box is beyond six once in a million runs. What was there before
    # is hundreds of them.
    residuals.judge(found, 6)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("binaries")
    parser.add_argument("kit")
    parser.add_argument("board")
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    machine_room.run(lambda room: circle(room, given.board, given.short, given.seed), given.binaries, given.kit)
    print("ok")
