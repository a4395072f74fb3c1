"""What is left of the errors of an emulated machine, from what circle.ngc has logged, with the standard deviations of both measurements.

The same quantities as in host-tests/scenario/circle, where the control and its touches are emulated too.
"""
import json
import math

ASSUMED_MM = (330.0, 200.0)  # turning axis, machine.toml
SPHERE_MM = (120.0, 80.0, -150.0)
PIVOT_MM, STYLUS_MM, TOOL_MM = 60.0, 150.0, 120.0  # as the control has them
SCREWS = ((820.0, 160.0), (640.0, 140.0), (700.0, -120.0))  # length, and bearing from position 0 against the axis
CYCLE_MM = 0.001  # of 1 ms, at 1 mm/s
# G38 takes the position of a cycle, up to one behind the contact; another one goes by in probebox-probe.
LATE_MM, TOUCH_MM = 1.5 * CYCLE_MM, CYCLE_MM / math.sqrt(12)
STOP_RAD, HEAD_STOP_RAD = 5e-6, 1e-6  # of A and C, and of B
ARM_MM = 30.0
XYZ = range(3)


class Log:
    """Lines by their first word; numbers behind it."""

    def __init__(self, text):
        self.lines = {}
        for line in text.splitlines():
            name, *values = line.split() or [""]
            self.lines.setdefault(name, []).append([float(value) for value in values])

    def one(self, name, *keys):
        found = [line[len(keys):] for line in self.lines[name] if line[:len(keys)] == list(keys)]
        assert len(found) == 1, (name, keys, found)
        return found[0]

    def ball(self, number, name="ball"):
        """The mean of both readings, A at 0 and 180 degrees."""
        return [(a + b) / 2 for a, b in zip(self.one(name, number, 0), self.one(name, number, 1))]

    def axis_adds(self, number, z_mm):
        """What the box adds for the turning axis at this height."""
        x, y, slope_x, slope_y, at = self.one("axis", number)
        return [x + 1e-6 * slope_x * (z_mm - at) - ASSUMED_MM[0], y + 1e-6 * slope_y * (z_mm - at) - ASSUMED_MM[1], 0.0]


class Results:
    """Standard deviations that no register shows, as a person at the PC sees them."""

    def __init__(self, room):
        self.room = room

    def sd(self, subject, key):
        for line in self.room.probebox("--json", "results", subject).stdout.splitlines():
            one = json.loads(line)
            if one["state"] == "active":
                count = sum(name.startswith(key + "[") for name in one["sd"])
                return [one["sd"]["%s[%d]" % (key, k)] for k in range(count)]
        raise AssertionError("nothing in force about " + subject)


class Residual:
    def __init__(self, of, value, sd, before):
        self.of, self.value, self.sd, self.before = of, value, sd, before


def of_delay(log, world):
    found = []
    for i in XYZ:
        (first, sd_first), (again, sd_again) = ((log.one("tau", k)[i], log.one("tau-sd", k)[i]) for k in (1, 2))
        found.append(Residual("delay", again - first, math.hypot(sd_first, sd_again), first))
        found.append(Residual("delay, true", first - (world.tau_ms[i] - world.tau_probe_ms), sd_first, first))
    return found


def level(i, length_mm):
    return (PIVOT_MM + length_mm) * HEAD_STOP_RAD if i == 0 else 0.0


def tip(b_deg):
    """Of the probe, from where it is with the head level."""
    arm, b = PIVOT_MM + STYLUS_MM, math.radians(b_deg)
    return [-arm * math.sin(b), 0.0, arm * (1 - math.cos(b))]


def mean_tip(world):
    """Of the probe at A = 0 and 180 degrees: what the lean of the spindle leaves."""
    along = [world.spindle_tilt[0], world.spindle_tilt[1], 1.0]
    hangs = [world.stylus_mm[0], world.stylus_mm[1], -world.stylus_mm[2]]
    share = sum(a * b for a, b in zip(along, hangs)) / sum(a * a for a in along)
    return [share * a for a in along[:2]] + [share + STYLUS_MM]


def of_touches(log, world, results):
    extension_mm = [1e-3 * math.hypot(max(results.sd("screw-" + axis, "sector_table_um")), world.screw_noise_um) for axis in "xyz"]

    def screw(i, position_mm):
        length_mm, bearing_mm = SCREWS[i]
        return abs(position_mm + bearing_mm) / length_mm * extension_mm[i]

    across, along = TOUCH_MM / math.sqrt(2), TOUCH_MM
    found = []

    one, other = log.ball(1), log.ball(2)
    at_mm = log.one("axis-z")[0]
    for i in range(2):
        axis_sd = 1e-6 * math.hypot(log.one("axis-sd-nm")[i], log.one("slope-sd-urad")[i] * (one[2] - at_mm))
        stops = ARM_MM * STOP_RAD / math.sqrt(2) if i == 1 else 0.0
        sd = math.hypot(axis_sd, screw(i, ASSUMED_MM[i]), across / 2, stops, level(i, STYLUS_MM))
        left = (one[i] + other[i]) / 2 - ASSUMED_MM[i]
        found.append(Residual("centreline", left, sd, left + log.ball(1, "added")[i]))

    sphere, shift, hangs = log.ball(3), log.axis_adds(3, SPHERE_MM[2]), mean_tip(world)
    for i in XYZ:
        again = along if i == 2 else across / math.sqrt(2)  # from above both readings fall into the same cycle
        late = LATE_MM if i == 2 else 0.0
        left = sphere[i] + shift[i] + hangs[i] + late - SPHERE_MM[i]
        found.append(Residual("screw", left, math.hypot(screw(i, SPHERE_MM[i]), again, level(i, STYLUS_MM)),
                              left + log.ball(3, "added")[i] - shift[i]))

    swung = tip(45)
    swivelled, shift_there = log.ball(4), log.axis_adds(4, SPHERE_MM[2] - swung[2])
    sd_swivel = results.sd("swivel-b", "error_at_queries_mm")
    for i in XYZ:
        stops = math.hypot(level(i, STYLUS_MM), 0.0 if i == 1 else level(0, STYLUS_MM) / math.sqrt(2))
        between = extension_mm[i] * abs(swung[i]) / SCREWS[i][0]
        sd = math.hypot(sd_swivel[i], along * math.sqrt(2) if i == 2 else across, stops, between)
        left = swivelled[i] + swung[i] + shift_there[i] - sphere[i] - shift[i]
        added = log.ball(4, "added")[i] - shift_there[i] - log.ball(3, "added")[i] + shift[i]
        found.append(Residual("swivel", left, sd, left + added))

    setter, drawing = log.one("setter"), (0.012, 0.008, 120.035)
    shift = log.axis_adds(5, world.setter_mm[2] - STYLUS_MM + TOOL_MM)
    for i in XYZ:
        again = math.hypot(along if i == 2 else across, level(i, TOOL_MM))
        late = LATE_MM if i == 2 else 0.0
        left = setter[i] + shift[i] + late - world.setter_mm[i] + (world.stylus_mm[2] if i == 2 else 0.0)
        sd = math.hypot(1e-5 * log.one("tool-sd", i)[0], again, screw(i, world.setter_mm[i]))
        found.append(Residual("tool", left, sd, world.tool_mm[i] - drawing[i]))
    return found


def judge(found, limit):
    """Each within so many of its standard deviations; and each error was there, many times as large, before it was corrected."""
    largest = {}
    for one in found:
        print("%-12s left %+9.6f, sd %8.6f, %+5.1f of them; it was %+9.6f" % (one.of, one.value, one.sd, one.value / one.sd, one.before))
        largest[one.of] = max(largest.get(one.of, 0.0), abs(one.before) / one.sd)
    for one in found:
        assert one.sd > 0 and abs(one.value) <= limit * one.sd, "%s: %g is left, sd %g" % (one.of, one.value, one.sd)
    for of, times in largest.items():
        assert times > 10, "%s: the error was %.1f standard deviations only" % (of, times)
