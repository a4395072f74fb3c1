#!/usr/bin/python3
"""probebox_tools takes what is in force into a tool table and leaves everything else as it was. tool_table_test.py KIT"""
import os
import subprocess
import sys
import tempfile

ANSWERS = {
    4: '{"state":"active","standing":"not in force here","result":{"tool_offset_mm[0]":7,"tool_offset_mm[1]":7,"tool_offset_mm[2]":7}}\n'
       '{"state":"retired","standing":"retired","result":{"tool_offset_mm[0]":9,"tool_offset_mm[1]":9,"tool_offset_mm[2]":9}}\n'
       '{"state":"active","standing":"in force","result":{"tool_offset_mm[0]":0.012,"tool_offset_mm[1]":-0.008,"tool_offset_mm[2]":-120.035}}',
    5: '{"state":"active","standing":"not in force here","result":{"tool_offset_mm[0]":7,"tool_offset_mm[1]":7,"tool_offset_mm[2]":7}}',
    6: '{"state":"active","result":{"tool_offset_mm[0]":0,"tool_offset_mm[1]":0,"tool_offset_mm[2]":-80}}',
    7: '{"state":"proposed","result":{"tool_offset_mm[0]":1,"tool_offset_mm[1]":1,"tool_offset_mm[2]":1}}',
    8: '{"state":"active","standing":"in force","result":{"tool_offset_x_mm":-0.2,"tool_offset_z_mm":-45.1,"setter_x_mm":160}}',
}
TABLE = """T1 P1 Z+150.000000 D6.000000 ;probe
T4 P4 X+1.0 Z+99.0 D10.000000 ;end mill; sharp
T9 P9 D3
T8 P8 X+1 Z+1 D0.4 ;turning tool
"""


def main():
    with tempfile.TemporaryDirectory() as folder:
        command = os.path.join(folder, "probebox")
        with open(command, "w") as out:
            out.write("#!/bin/sh\ncase \"$*\" in\n")
            for number, answer in ANSWERS.items():
                out.write("*tool-%d) printf '%%s\\n' '%s';;\n" % (number, answer))
            out.write("*) exit 1;;\nesac\n")
        os.chmod(command, 0o755)
        table = os.path.join(folder, "tool.tbl")
        with open(table, "w") as out:
            out.write(TABLE)
        done = subprocess.run([os.path.join(sys.argv[1], "probebox_tools"), "--probebox", command, table, "4", "5", "6", "7", "8", "9"],
                              capture_output=True, text=True)
        lines = open(table).read().splitlines()
        assert done.returncode == 1, "three of the tools have nothing in force: " + done.stdout + done.stderr
        assert lines[0] == "T1 P1 Z+150.000000 D6.000000 ;probe", lines
        assert lines[1] == "T4 P4 D10.000000 X-0.012000 Y+0.008000 Z+120.035000 ;end mill; sharp", lines
        assert lines[2] == "T9 P9 D3", lines
        assert lines[3] == "T8 P8 D0.4 X+0.200000 Z+45.100000 ;turning tool", lines
        assert lines[4] == "T6 P6 X+0.000000 Y+0.000000 Z+80.000000 ;probebox", lines
        assert len(lines) == 5 and "T5: no result in force" in done.stdout, (lines, done.stdout)
        assert open(table + ".before").read() == TABLE
        missing = os.path.join(folder, "nope.tbl")
        done = subprocess.run([os.path.join(sys.argv[1], "probebox_tools"), "--probebox", command, missing, "4"], capture_output=True, text=True)
        assert done.returncode == 1 and "nope.tbl is not there" in done.stderr and not os.path.exists(missing), done.stderr
    print("ok")


main()
