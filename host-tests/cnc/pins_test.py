#!/usr/bin/python3
"""Registers and pins of probebox_master are those of protocol/map.json. pins_test.py KIT MAP"""
import importlib.machinery
import importlib.util
import json
import os
import re
import sys
import types

sys.dont_write_bytecode = True


def component(kit):
    sys.modules["hal"] = types.ModuleType("hal")
    loader = importlib.machinery.SourceFileLoader("probebox_master", os.path.join(kit, "probebox_master"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("probebox_master", loader))
    loader.exec_module(module)
    return module


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
    for pin, at in [("homing-commit", 137), ("pose-commit", 250), ("marker-commit", 157), ("wish-commit", 837), ("wish-answered", 838),
                    ("inhibit", 138), ("wish-contacts", 830), ("calibration-result", 102)]:
        assert registers["probebox." + pin]["address"] == at, pin
    print("ok")


main()
