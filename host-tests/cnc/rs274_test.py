#!/usr/bin/python3
"""LinuxCNC's own interpreter reads programs of `probebox gcode --dialect linuxcnc`: every block is understood, and it goes where the program
says. rs274_test.py BINARIES"""
import os
import re
import subprocess
import sys
import tempfile

INI = "[EMC]\nVERSION=1.1\n[RS274NGC]\nPARAMETER_FILE=p.var\n[EMCIO]\nTOOL_TABLE=tool.tbl\n[TRAJ]\nCOORDINATES=XYZABC\nLINEAR_UNITS=mm\n"
PLACE = ["--sphere", "25", "--stylus", "6", "--gap", "26", "--setter", "16", "--tool-diameter", "10", "--safe-z", "120"]
RUNS = {
    "delay-multi-speed": [],
    "delay-plates": [],
    "delay-in-out": ["--speed", "20"],
    "centreline": ["--angles", "5", "--ball", "40,0,20", "--c-axis", "0.5,0.25,0"],
    "tool-setter": ["--tool", "4"],
    "table-pivot": ["--tilts=-20,0,20", "--ball", "40,0,20", "--table-axis", "0,0,-50"],
}


def numbers(text):
    return [float(word) for word in re.findall(r"-?\d+\.\d+", text)]


def feeds_of(interpreted):
    return [numbers(line)[:3] for line in interpreted if " STRAIGHT_FEED(" in line]


def moves_of(program):
    moves = []
    for line in program.splitlines():
        found = re.match(r"G1(?: X(\S+) Y(\S+))? Z(\S+) F", line)
        if found:
            before = moves[-1] if moves else [0.0, 0.0]
            moves.append([float(found[1] or before[0]), float(found[2] or before[1]), float(found[3])])
    return moves


def check(binaries, folder, method, options):
    program = os.path.join(folder, method + ".ngc")
    done = subprocess.run([os.path.join(binaries, "probebox"), "gcode", method, "--dialect", "linuxcnc", "-o", program] + PLACE + options,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    read = subprocess.run(["rs274", "-g", "-i", "rs.ini", "-t", "tool.tbl", "-v", "p.var", program], cwd=folder, capture_output=True,
                          text=True, timeout=120, env=dict(os.environ, HOME=folder))  # where it keeps its tool table
    interpreted = read.stdout.splitlines()
    text = open(program).read()
    assert any("PROGRAM_END()" in line for line in interpreted), method + ": " + read.stdout[-500:] + read.stderr[-500:]
    here = None
    for line in interpreted:
        if " STRAIGHT_TRAVERSE(" in line:
            assert numbers(line)[:3] == here, "a rapid of a linear axis: " + line
        if " STRAIGHT_FEED(" in line:
            here = numbers(line)[:3]
    wanted, reached = moves_of(text), feeds_of(interpreted)
    assert len(wanted) == len(reached) and len(wanted) > 10, (method, len(wanted), len(reached))
    for one, other in zip(wanted, reached):
        assert max(abs(a - b) for a, b in zip(one, other)) < 1e-3, (method, one, other)
    marks = [line for line in interpreted if ' LOG("' in line]
    assert len(marks) == text.count("(LOG,") and len(marks) % 2 == 0 and marks, method
    stops = sum("PROGRAM_STOP()" in line for line in interpreted)
    assert stops == 2, (method, stops)
    print("%-20s %4d moves, %3d marks" % (method, len(reached), len(marks)))


def main():
    with tempfile.TemporaryDirectory() as folder:
        open(os.path.join(folder, "rs.ini"), "w").write(INI)
        open(os.path.join(folder, "tool.tbl"), "w").write("T1 P1 Z150 D6\nT2 P2 Z200 D6\nT4 P4 Z120 D10\n")
        for method, options in RUNS.items():
            check(sys.argv[1], folder, method, options)
    print("ok")


main()
