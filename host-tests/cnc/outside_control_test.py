#!/usr/bin/python3
"""A program leads the emulated machine by [outside_control] of world.toml. outside_control_test.py BINARIES KIT BOARD"""
import socket
import sys

import emulated_world
import machine_room

HOME_MM = [120.0, 80.0, -100.0]
CONTACT_Z_MM = -150 + 12.5 + 3  # on top of the datum sphere, but for what the stylus hangs off


class Leader:
    def __init__(self, timeout_s=60.0):
        self.socket = socket.create_connection(("127.0.0.1", emulated_world.PORT), 10)
        self.socket.settimeout(timeout_s)
        self.answers = self.socket.makefile("r")

    def send(self, *lines):
        self.socket.sendall("".join(line + "\n" for line in lines).encode())

    def ask(self, line):
        self.send(line)
        return self.answers.readline().strip()

    def close(self):
        self.answers.close()
        self.socket.close()


def line(number, z_mm, c_deg=0.0, tool=1):
    return "%d %.6f %.6f %.6f 0 0 %.4f %d" % (number, HOME_MM[0], HOME_MM[1], z_mm, c_deg, tool)


def test(room, board):
    world = emulated_world.World(board, room.path("board"), 1)
    room.start_box(world.folder)
    leader = Leader()
    assert leader.ask(line(7, HOME_MM[2])) == "7 0 0"
    for wrong, why in [("8 0 0 0 0 0 0 1", "the motors jump to 0.000 0.000 0.000 mm: begin where they stand, at 120.000 80.000 -100.000 mm"),
                       ("9 120 80 -100 0 0 0", "a line is a number"), ("10 120 80 -100 0 0 0 1 1 1", "a line is a number"), ("12 120 80 -100 0 0 0 1 x", "a line is a number"),
                       ("13 120 80 -100 0 0 0 1 9", "there is no mount 9"),
                       ("11 120 80 nought 0 0 0 1", "a line is a number"), ("", "a line is a number"),
                       (line(12, HOME_MM[2], tool=77), "there is no tool 77")]:
        answer = leader.ask(wrong)
        assert answer.startswith("? ") and why in answer, (wrong, answer)

    # Down onto the sphere, in one bunch: each cycle has its own answer.
    step_mm, cycles = 0.05, 700
    leader.send(*(line(k, HOME_MM[2] - step_mm * k) for k in range(1, cycles + 1)))
    touched = []
    for k in range(1, cycles + 1):
        number, touches, crashes = leader.answers.readline().split()
        assert int(number) == k and crashes == "0", (number, k, crashes)
        touched.append(touches == "1")
    first = touched.index(True)
    assert all(touched[first:]) and abs(HOME_MM[2] - step_mm * (first + 1) - CONTACT_Z_MM) < 0.1, first

    # Another one waits until this one has gone, and goes on from where the motors stand.
    other = Leader(timeout_s=1.0)
    other.send(line(1, HOME_MM[2] - step_mm * cycles))
    try:
        assert False, "two lead at once: " + other.answers.readline()
    except (TimeoutError, socket.timeout):
        pass
    other.close()
    leader.close()
    last = Leader()
    answer = last.ask(line(3, HOME_MM[2] - step_mm * cycles))
    assert answer == "3 1 0", answer
    assert last.ask(line(4, HOME_MM[2] - step_mm * cycles, c_deg=1)) == "4 1 1", "a turn in contact is a collision"
    last.close()


if __name__ == "__main__":
    binaries, kit, board = sys.argv[1:4]
    machine_room.run(lambda room: test(room, board), binaries, kit)
    print("ok")
