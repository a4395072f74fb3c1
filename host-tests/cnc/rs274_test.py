#!/usr/bin/python3
"""LinuxCNC's own interpreter reads programs of `probebox gcode --dialect linuxcnc`: every block is understood, and it goes where the program
says. rs274_test.py BINARIES"""
import os
import re
import subprocess
import sys
import tempfile

INI = "[EMC]\nVERSION=1.1\n[RS274NGC]\nPARAMETER_FILE=p.var\n[EMCIO]\nTOOL_TABLE=tool.tbl\n[TRAJ]\nCOORDINATES=XYZABC\nLINEAR_UNITS=mm\n"
TOOL = ["--probe-tools", "1"]
STYLUS, SPHERE, BALL = ["--stylus", "6"], ["--sphere", "25"], ["--ball", "40,0,20"]
RUNS = {
    "delay-multi-speed": STYLUS + SPHERE + TOOL,
    "delay-plates": STYLUS + ["--gap", "26"] + TOOL,
    "delay-cylinder": STYLUS + ["--bore", "30"] + TOOL,
    "delay-cube": STYLUS + ["--cube", "20,24,18"] + TOOL,
    "delay-in-out": ["--speed", "20"] + STYLUS + SPHERE + TOOL,
    "delay-contour": ["--speed", "5", "--sphere", "50"] + STYLUS + TOOL,  # renews the mask of the probe
    "centreline": ["--angles", "5", "--c-axis", "0.5,0.25,0"] + STYLUS + SPHERE + BALL + TOOL,
    "tool-setter": ["--tool", "4", "--setter", "16", "--tool-diameter", "10"] + STYLUS + TOOL,
    "table-pivot": ["--tilts=-20,0,20", "--table-axis", "0,0,-50"] + STYLUS + SPHERE + BALL + TOOL,
    "a-axis-alignment": ["--probe-tools", "1,2"] + STYLUS + SPHERE + BALL,
}
BACK_OFF_MM = 0.3  # rs274 ends a G38 a little before its place


def numbers(text):
    return [float(word) for word in re.findall(r"-?\d+\.\d+", text)]


def moves_of(program):
    """X, Y, Z of each block that moves linear axes at a feed; None for an axis that it does not name, or moves on from a contact."""
    moves, relative = [], False
    for line in program.splitlines():
        if line in ("G90", "G91"):
            relative = line == "G91"
        if re.match(r"G1 [XZ]|G38\.[23] |G[23] X", line):
            words = {} if relative else dict(re.findall(r"([XYZ])(-?[\d.]+)", line))
            moves.append([float(words[axis]) if axis in words else None for axis in "XYZ"])
    return moves


def end_of(line):
    values = numbers(line)
    return [values[0], values[1], values[5]] if " ARC_FEED(" in line else values[:3]


def written(binaries, folder, method, options):
    program = os.path.join(folder, method + ".ngc")
    done = subprocess.run([os.path.join(binaries, "probebox"), "gcode", method, "--dialect", "linuxcnc", "-o", program, "--force", "--safe-z",
                           "120", "--machine-z", "500"] + options, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def interpreted(folder, program):
    return subprocess.run(["rs274", "-g", "-i", "rs.ini", "-t", "tool.tbl", "-v", "p.var", program], cwd=folder, capture_output=True,
                          text=True, timeout=120, env=dict(os.environ, HOME=folder))  # where it keeps its tool table


def check(binaries, folder, method, options):
    program = written(binaries, folder, method, options)
    read = interpreted(folder, program)
    lines = read.stdout.splitlines()
    text = open(program).read()
    assert any("PROGRAM_END()" in line for line in lines), method + ": " + read.stdout[-500:] + read.stderr[-500:]
    here, has_offset, wanted, count = None, False, moves_of(text), 0
    for line in lines:
        if "CHANGE_TOOL(" in line:
            has_offset = False
        if "USE_TOOL_LENGTH_OFFSET(" in line:
            has_offset = numbers(line)[2] > 0
        if " STRAIGHT_TRAVERSE(" in line:
            x, y, z = end_of(line)
            assert here is None or (max(abs(x - here[0]), abs(y - here[1])) < BACK_OFF_MM and z > here[2] - BACK_OFF_MM), \
                "a rapid that is neither of rotary axes nor up: " + line
            here = here and [x, y, z]
        if " STRAIGHT_FEED(" in line or " STRAIGHT_PROBE(" in line or " ARC_FEED(" in line:
            here = end_of(line)
            for value, given in zip(here, wanted[count]):
                assert given is None or abs(value - given) < 1e-3, (method, line, wanted[count])
            assert has_offset or wanted[count][2] is None, "Z moves without a length offset: " + line
            count += 1
    assert count == len(wanted) and count > 10, (method, count, len(wanted))
    marks = [line for line in lines if ' LOG("' in line]
    assert len(marks) == text.count("(LOG,") and len(marks) % 2 == 0 and marks, method
    stops = sum("PROGRAM_STOP()" in line for line in lines)
    assert stops == 2, (method, stops)
    print("%-20s %4d moves, %3d marks" % (method, count, len(marks)))


def check_alarm(binaries, folder):
    """Without a tool to call, and without a length offset, nothing moves."""
    read = interpreted(folder, written(binaries, folder, "delay-multi-speed", STYLUS + SPHERE))
    assert read.returncode != 0 and "NO LENGTH OFFSET ACTIVE" in read.stdout + read.stderr, read.stderr
    assert "STRAIGHT_" not in read.stdout, read.stdout


def main():
    with tempfile.TemporaryDirectory() as folder:
        open(os.path.join(folder, "rs.ini"), "w").write(INI)
        open(os.path.join(folder, "tool.tbl"), "w").write("T1 P1 Z4 D6\nT2 P2 Z5 D6\nT4 P4 Z3 D10\n")
        for method, options in RUNS.items():
            check(sys.argv[1], folder, method, options)
        check_alarm(sys.argv[1], folder)
    print("ok")


main()
