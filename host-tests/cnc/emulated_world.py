"""Descriptions of an emulated machine whose errors nobody knows, for a control that leads it."""
import os
import random
import re
import shutil

PORT = 7630


def put(text, section, key, value):
    """The text with that value of a key in [section], in place of the one that it has there."""
    lines = text.splitlines()
    header = lines.index("[%s]" % section)
    for k in range(header + 1, len(lines)):
        if lines[k].startswith("["):
            break
        if re.match(r"%s\s*=" % re.escape(key), lines[k]):
            del lines[k]
            break
    lines.insert(header + 1, "%s = %s" % (key, value))
    return "\n".join(lines) + "\n"


def tool_of(text, number, **values):
    """The same of the [[tool]] of that number."""
    head, found, tail = text.partition("[[tool]]\nnumber = %d\n" % number)
    assert found, "no tool %d" % number
    for key, value in values.items():
        tail = re.sub(r"(?m)^%s = .*$" % key, "%s = %r" % (key, value), tail, count=1)
    return head + found + tail


class World:
    """Draws the errors; `truth` has what tests may compare with, mm, rad, ms."""

    def __init__(self, board, folder, seed, b_turns="head"):
        self.b_turns = b_turns
        shutil.copytree(board, folder)
        self.folder, draw = folder, random.Random(seed)

        def within(most):
            return draw.uniform(-most, most)

        self.tau_ms = [draw.uniform(2, 9) for _ in range(3)]
        self.tau_probe_ms = draw.uniform(0.1, 1)
        self.axis_mm = [330.15 + within(0.06), 199.96 + within(0.06)]
        self.axis_tilt = [within(3e-4), within(3e-4)]
        self.spindle_tilt = [within(2e-4), within(2e-4)]
        # As well as machine.toml states where the stylus hangs.
        self.stylus_mm = [0.021 + draw.gauss(0, 0.0005), -0.013 + draw.gauss(0, 0.0005), 150 + draw.gauss(0, 0.0005)]
        self.tool_mm = [0.012 + within(0.02), 0.008 + within(0.02), 120.035 + within(0.05)]
        self.setter_mm = [120 + within(0.03), 200 + within(0.03), -165 + within(0.03)]
        self.screw_noise_um = 0.02
        self._world(draw, within)
        self._machine()

    def path(self, name):
        return os.path.join(self.folder, name)

    def _edit(self, name, change):
        text = change(open(self.path(name)).read())
        open(self.path(name), "w").write(text)

    def _world(self, draw, within):
        def change(text):
            for section, key, value in [
                    ("delays", "tau_machine_s", [1e-3 * tau for tau in self.tau_ms]), ("delays", "tau_probe_s", 1e-3 * self.tau_probe_ms),
                    ("part_spindle", "point_mm", self.axis_mm + [-300]), ("part_spindle", "tilt_x_rad", self.axis_tilt[0]),
                    ("part_spindle", "tilt_y_rad", self.axis_tilt[1]), ("probe_spindle", "tilt_x_rad", self.spindle_tilt[0]),
                    ("probe_spindle", "tilt_y_rad", self.spindle_tilt[1]), ("probe_spindle", "stylus_offset_x_mm", self.stylus_mm[0]),
                    ("probe_spindle", "stylus_offset_y_mm", self.stylus_mm[1]), ("probe_spindle", "stylus_length_mm", self.stylus_mm[2]),
                    ("swivel_head", "pivot_mm", [0.012 + within(0.04), 0, 60.031 + within(0.04)]), ("swivel_head", "lean_x_rad", within(2e-4)),
                    ("swivel_head", "lean_z_rad", within(2e-4)), ("tool_setter", "centre_mm", self.setter_mm)]:
                text = put(text, section, key, value)
            for axis in "XYZ":
                for key, value in [("warm_um", draw.uniform(20, 55)), ("time_constant_s", draw.uniform(700, 1200)),
                                   ("face_once_um", draw.uniform(0.2, 0.5)), ("face_twice_um", draw.uniform(0.05, 0.1)),
                                   ("noise_um", self.screw_noise_um), ("sensor_time_constant_s", 0.02)]:
                    text = put(text, "screw." + axis, key, value)
            text = tool_of(text, 4, offset_x_mm=self.tool_mm[0], offset_y_mm=self.tool_mm[1], length_mm=self.tool_mm[2], radius_mm=5 + within(0.02))
            return text + '\n[outside_control]\nport = %d\nb_turns = "%s"\n' % (PORT, self.b_turns)

        self._edit("world.toml", change)

    def _machine(self):
        def change(text):
            swivels = self.b_turns == "head"
            text = put(text, "corrections", "sources", '["screw", "swivel", "centreline"]' if swivels else '["screw", "centreline"]')
            for axis in "XYZ":  # the sensors follow their faces up to this speed
                text = put(text, "screw." + axis, "threshold_rpm", 238)
            if not swivels:
                text = put(put(text, "rotary_table", "chain", '["B", "C"]'), "rotary_table", "between", '"linear"')
            text += '\n[rotary_axis.B]\nangle_from = "controller"\nstale_s = 0\n'
            return text + '[swivel]\naxis = "B"\n' if swivels else text

        self._edit("machine.toml", change)
