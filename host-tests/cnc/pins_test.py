#!/usr/bin/python3
"""Registers and pins of probebox_master are those of protocol/map.json. pins_test.py KIT MAP"""
import json
import os
import re
import sys

sys.dont_write_bytecode = True
from master_without_hal import component


def main():
    kit, map_file = sys.argv[1:]
    registers = {one["hal_pin"]: one for one in json.load(open(map_file))["registers"]}
    master = component(kit)
    for name, at, kind in master.STEP:
        one = registers["probebox.step-" + name]
        assert (one["address"], one["kind"], one["scale"]) == (at, kind, 1), one
        assert master.STEP_FIRST <= at and at + one["registers"] <= master.STEP_FIRST + master.STEP_COUNT, one
    made = {"probebox.step-" + name for name, _, _ in master.STEP}
    for program in sorted(os.listdir(kit)):
        if program.endswith(".ngc"):
            used = set(re.findall(r"_hal\[(probebox\.step-[a-z-]+)\]", open(os.path.join(kit, program)).read()))
            assert used <= made, (program, used - made)
    for pin, at in [("homing-commit", 137), ("pose-commit", 250), ("marker-commit", 157), ("request-commit", 837), ("request-answered", 838),
                    ("inhibit", 138), ("request-contacts", 830), ("calibration-result", 102)]:
        assert registers["probebox." + pin]["address"] == at, pin
    print("ok")


main()
