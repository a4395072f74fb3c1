"""`probebox interference` against known distances, and against alternating projections between convex solids.

Usage: interference.py PROBEBOX. Status 77 where it was built without FCL.
"""
import json
import math
import pathlib
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time

TOOL = {"number": 4, "holder_radius_mm": 20, "holder_length_mm": 62, "radius_mm": 6, "length_mm": 58, "cutting_mm": 30}
SKIPPED = 77


def toml(value):
    if isinstance(value, str):
        return json.dumps(value)
    return "[" + ", ".join(map(str, value)) + "]" if isinstance(value, (list, tuple)) else str(value)


def cell(solids, tool=None, rotary=(), **more):
    tables = [("[cell]", {"name": "test", **more})] + [("[[rotary_axis]]", a) for a in rotary] + [("[[solid]]", s) for s in solids] + [("[[tool]]", {**TOOL, **(tool or {})})]
    return "\n".join(head + "\n" + "".join(f"{k} = {toml(v)}\n" for k, v in table.items()) for head, table in tables)


def run(probebox, folder, description, program, *more):
    (folder / "cell.toml").write_text(description)
    (folder / "part.ngc").write_text(program)
    done = subprocess.run([probebox, "--json", "interference", "--cell", str(folder / "cell.toml"), "--tool", "4", "--gcode",
                           str(folder / "part.ngc"), *more], capture_output=True, text=True)
    if "built without FCL" in done.stdout + done.stderr:
        print("Skipped: probebox was built without FCL (apt-get install libfcl-dev)")
        sys.exit(SKIPPED)
    return done.returncode, json.loads(done.stdout.splitlines()[0]) if done.stdout else {}, done.stderr


def at(tip, **angles):
    """A program that only stands there."""
    return "G90 G21\n" + 2 * (f"G0 X{tip[0]} Y{tip[1]} Z{tip[2]}" + "".join(f" {letter}{value}" for letter, value in angles.items()) + "\n")


# Solids as projections: the nearest point of the solid to any point, in its own axes.
def box_point(p, half):
    return [max(-h, min(h, c)) for c, h in zip(p, half)]


def cylinder_point(p, radius, half):
    r = math.hypot(p[0], p[1])
    scale = min(1, radius / r) if r > 0 else 1
    return [p[0] * scale, p[1] * scale, max(-half, min(half, p[2]))]


def sphere_point(p, radius):
    r = math.sqrt(sum(c * c for c in p))
    return list(p) if r <= radius else [c * radius / r for c in p]


def turned(p, degrees, back=False):
    """About X, then Y, then Z; or undone."""
    order = [0, 1, 2]
    for axis in reversed(order) if back else order:
        a = math.radians(degrees[axis]) * (-1 if back else 1)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        p = list(p)
        p[i], p[j] = math.cos(a) * p[i] - math.sin(a) * p[j], math.sin(a) * p[i] + math.cos(a) * p[j]
    return p


def point_of(solid, p):
    turn = solid.get("turn_deg", [0, 0, 0])
    own = turned([c - o for c, o in zip(p, solid["at_mm"])], turn, back=True)
    if solid["shape"] == "box":
        near = box_point(own, [s / 2 for s in solid["size_mm"]])
    elif solid["shape"] == "cylinder":
        near = cylinder_point(own, solid["radius_mm"], solid["height_mm"] / 2)
    else:
        near = sphere_point(own, solid["radius_mm"])
    return [c + o for c, o in zip(turned(near, turn), solid["at_mm"])]


def parts(tip, tool):
    long = tool.get("assembled_length_mm", tool["length_mm"])
    dx, dy = (-w for w in tool.get("W1_mm", [0, 0]))  # W1 counts from the tip to the axis
    pieces = [("cutter", tool["radius_mm"], 0, tool["cutting_mm"]), ("shank", tool["radius_mm"], tool["cutting_mm"], long),
              ("holder", tool["holder_radius_mm"], long, long + tool["holder_length_mm"])]
    return [(name, {"shape": "cylinder", "radius_mm": r, "height_mm": b - a, "at_mm": [tip[0] + dx, tip[1] + dy, tip[2] + (a + b) / 2]})
            for name, r, a, b in pieces]


def distance(one, other):
    """Between two convex solids: the nearest points project onto each other."""
    p = list(other["at_mm"])
    last = None
    for _ in range(40_000):
        q = point_of(one, p)
        p = point_of(other, q)
        now = math.dist(p, q)
        if last is not None and last - now < 1e-13 * (1 + now):
            break
        last = now
    return now


def about(p, axis, degrees):
    """p turned about an axis of a cell, by Rodrigues."""
    length = math.sqrt(sum(c * c for c in axis["direction"]))
    k = [c / length for c in axis["direction"]]
    v = [c - o for c, o in zip(p, axis["through_mm"])]
    a = math.radians(degrees)
    cross = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]]
    along = sum(x * y for x, y in zip(k, v)) * (1 - math.cos(a))
    return [o + x * math.cos(a) + y * math.sin(a) + z * along for o, x, y, z in zip(axis["through_mm"], v, cross, k)]


def carried(solid, chain):
    """A solid that axes carry, each with its angle, from the base outwards."""
    def nearest_point(p):
        for axis, degrees in chain:
            p = about(p, axis, -degrees)
        p = point_of(solid, p)
        for axis, degrees in reversed(chain):
            p = about(p, axis, degrees)
        return p
    return nearest_point


def turned_distance(one, other, start):
    """As distance(), of solids that are given by their nearest points."""
    p, last = start, math.inf
    for _ in range(40_000):
        q = one(p)
        p = other(q)
        now = math.dist(p, q)
        if last - now < 1e-13 * (1 + now):
            break
        last = now
    return now


def nearest(tip, tool, solids):
    return min((distance(part, solid), name, solid["name"]) for name, part in parts(tip, tool) for solid in solids)


BOX = {"name": "jaw", "part": "fixture", "shape": "box", "size_mm": [20, 100, 60], "at_mm": [60, 0, -30]}


def check_known(probebox, folder):
    """Distances that can be read off the drawing."""
    ball = {"name": "datum", "part": "fixture", "shape": "sphere", "radius_mm": 12.5, "at_mm": [0, 0, -80]}
    post = {"name": "post", "part": "machine", "shape": "cylinder", "radius_mm": 10, "height_mm": 200, "at_mm": [-70, 0, 0]}
    # Tip, solids, distance, part, solid. The holder is 58 above the tip and 20 wide, the jaw 50 away and 0 high.
    known = [((0, 0, -40), [BOX], math.hypot(30, 18), "holder", "jaw"), ((0, 0, -59), [BOX], 30, "holder", "jaw"),
             ((60, 0, 7.25), [BOX], 7.25, "cutter", "jaw"), ((0, 0, -60), [ball], 7.5, "cutter", "datum"),
             ((0, 0, 0), [post], 40, "holder", "post"), ((0, 0, 150), [BOX], math.hypot(44, 150), "cutter", "jaw")]
    for tip, solids, mm, part, name in known:
        status, told, _ = run(probebox, folder, cell(solids), at(tip))
        near = told["nearest"]
        assert status == 0 and not told["hits"], (tip, told)
        assert abs(near["distance_mm"] - mm) < 1e-4, (tip, near, mm)
        assert near["tool_part"] == part and near["solid"] == name, (tip, near)
        assert abs(math.dist(near["on_tool_mm"], near["on_solid_mm"]) - mm) < 1e-3, (tip, near)
    status, told, _ = run(probebox, folder, cell([post]), at((-48, 0, -50)))
    assert status == 1 and told["nearest"]["distance_mm"] == 0 and told["nearest"]["tool_part"] == "holder", told


def check_random(probebox, folder):
    random.seed(5)
    worst = 0
    for k in range(40):
        shape = ["box", "cylinder", "sphere"][k % 3]
        solids = [{"name": "a", "part": "machine", "shape": shape, "at_mm": [random.uniform(-80, 80) for _ in range(3)],
                   **({"size_mm": [random.uniform(10, 60) for _ in range(3)]} if shape == "box" else {"radius_mm": random.uniform(5, 30)}),
                   **({"height_mm": random.uniform(10, 80)} if shape == "cylinder" else {}),
                   **({"turn_deg": [random.uniform(-90, 90) for _ in range(3)]} if shape != "sphere" else {})}]
        tool = {"assembled_length_mm": round(random.uniform(50, 60), 4), "W1_mm": [round(random.uniform(-1, 1), 4), 0.25]}
        tip = [round(random.uniform(-90, 90), 3) for _ in range(3)]
        expected, part, _ = nearest(tip, {**TOOL, **tool}, solids)
        status, told, _ = run(probebox, folder, cell(solids, tool), at(tip))
        near = told["nearest"]
        if expected < 1e-6:
            assert status == 1 and near["distance_mm"] == 0, (k, near, expected)
            continue
        off = abs(near["distance_mm"] - expected)
        assert status == 0 and off < 2e-3, (k, solids, tip, near, expected, part)
        worst = max(worst, off)
    return worst


def check_path(probebox, folder):
    """The smallest distance of a path, and a thin fin that no step may jump over."""
    ball = {"name": "datum", "part": "fixture", "shape": "sphere", "radius_mm": 12.5, "at_mm": [10, 20, -20]}
    program = "G21 G90\nG0 X-100 Y45 Z0\nG0 X100 Y45 Z0\nG2 X100 Y-60 I0 J-52.5\n"
    tips = [(-100 + k * 0.1, 45, 0) for k in range(2001)]
    expected = min(nearest(tip, TOOL, [ball]) for tip in tips[900:1300:4])
    _, told, _ = run(probebox, folder, cell([ball]), program)
    assert abs(told["nearest"]["distance_mm"] - expected[0]) < 0.01 and told["nearest"]["line"] == 3, (told["nearest"], expected)
    assert abs(told["path_mm"] - (200 + math.pi * 52.5)) < 0.1, told["path_mm"]
    fin = {"name": "fin", "part": "fixture", "shape": "box", "size_mm": [0.2, 100, 30], "at_mm": [3.3, 0, -5]}
    status, told, _ = run(probebox, folder, cell([fin]), "G0 X-100 Y0 Z0\nG0 X100\n")
    assert status == 1 and {(h["solid"], h["tool_part"], h["line"]) for h in told["hits"]} == {("fin", "cutter", 2)}, told["hits"]
    status, told, _ = run(probebox, folder, cell([BOX], least_mm=5), at((60, 0, 4)))
    assert status == 1 and abs(told["hits"][0]["distance_mm"] - 4) < 1e-4, "nearer than the cell allows"


def check_turned(probebox, folder):
    """Tables and heads: distances from the drawing, then chains of axes in any direction."""
    table = {"letter": "C", "carries": "solids", "through_mm": [0, 0, 0]}
    jaw = {**BOX, "moves_with": "C"}
    # The near face of the jaw is 50 away from C, and the holder that stands beside it is 20 wide.
    for degrees, tip, mm in ((0, (0, 0, -59), 30), (90, (0, 0, -59), 30), (90, (0, 40, -59), 0), (-90, (0, -20, -59), 10), (180, (-25, 0, -59), 5)):
        status, told, said = run(probebox, folder, cell([jaw], rotary=[table]), at(tip, C=degrees))
        assert status == (1 if mm == 0 else 0) and abs(told["nearest"]["distance_mm"] - mm) < 1e-4, (degrees, told, said)
        assert told["nearest"]["angles_deg"] == [0, 0, degrees], told["nearest"]
    # A head that swivels about Y, 60 above the gauge line: at 90 degrees the tool lies along X, and its tip is 180 from the pivot.
    head = {"letter": "B", "carries": "tool", "through_mm": [0, 0, 60]}
    wall = {"name": "wall", "part": "machine", "shape": "box", "size_mm": [10, 300, 300], "at_mm": [-195, 0, 180]}
    status, told, _ = run(probebox, folder, cell([wall], rotary=[head]), at((0, 0, 0), B=90))
    assert abs(told["nearest"]["distance_mm"] - 10) < 1e-4 and told["nearest"]["tool_part"] == "cutter", told["nearest"]
    random.seed(11)
    worst = 0
    for k in range(30):
        place = lambda reach: [round(random.uniform(-reach, reach), 3) for _ in range(3)]
        axes = [{"letter": letter, "carries": carries, "through_mm": place(60), "direction": place(1)} for letter, carries in zip("BCA", ("solids", "solids", "tool"))]
        if k % 2:
            axes[2]["carries"] = "solids"
        angles = {axis["letter"]: round(random.uniform(-180, 180), 3) for axis in axes}
        solid = {"name": "a", "part": "machine", "shape": "box", "size_mm": [round(random.uniform(10, 60), 3) for _ in range(3)], "at_mm": place(90), "turn_deg": place(90), "moves_with": "C"}
        tip = place(120)
        gauge = TOOL["length_mm"] + TOOL["holder_length_mm"]
        lifted = [{**axis, "through_mm": [t + c for t, c in zip(tip, [axis["through_mm"][0], axis["through_mm"][1], axis["through_mm"][2] + gauge])]} for axis in axes]
        swivels = [(axis, angles[axis["letter"]]) for axis in lifted if axis["carries"] == "tool"]
        turns = [(axis, angles[axis["letter"]]) for axis in axes[:2]]
        expected = min(turned_distance(carried(part, swivels), carried(solid, turns), list(tip)) for _, part in parts(tip, TOOL))
        status, told, said = run(probebox, folder, cell([solid], rotary=axes), at(tip, **angles))
        if expected < 1e-6:
            assert status == 1 and told["nearest"]["distance_mm"] == 0, (k, told, expected)
            continue
        off = abs(told["nearest"]["distance_mm"] - expected)
        assert status == 0 and off < 2e-3, (k, axes, angles, solid, tip, told["nearest"], expected, said)
        worst = max(worst, off)
    return worst


def check_turning(probebox, folder):
    """What a turn passes by, with the same distance before and behind: a ball on an arm, and a thin blade."""
    table = {"letter": "C", "carries": "solids", "through_mm": [100, 0, 0], "direction": [0, 0, -1]}
    ball = {"name": "ball", "part": "fixture", "shape": "sphere", "radius_mm": 12.5, "at_mm": [-40, 0, 20], "moves_with": "C"}
    program = "G21 G90\nG0 X-60 Y0 Z0 C-90\nG0 C90\n"
    # The ball's middle goes round (100, 0) at 140: past the cutter, which is 160 from there, at 20 - 12.5 - 6.
    status, told, said = run(probebox, folder, cell([ball], rotary=[table]), program)
    near = told["nearest"]
    assert status == 0 and abs(near["distance_mm"] - 1.5) < 2e-3 and abs(near["angles_deg"][2]) < 1.5, (near, said)
    status, told, _ = run(probebox, folder, cell([{**ball, "radius_mm": 14.2}], rotary=[table]), program)
    assert status == 1 and told["hits"][0]["solid"] == "ball" and told["hits"][0]["line"] == 3, told
    blade = {"name": "blade", "part": "fixture", "shape": "box", "size_mm": [140, 0.2, 30], "at_mm": [30, 0, 0], "moves_with": "C"}
    status, told, _ = run(probebox, folder, cell([blade], rotary=[table]), program.replace("X-60", "X-30"))
    assert status == 1 and told["hits"][0]["solid"] == "blade", told
    # A workpiece that turns is not cut: the edges may touch it in feed, its shank may not.
    block = {**BLOCK, "moves_with": "C"}
    feed = "G21 G90\nG0 X-20 Y0 Z10\nG1 Z-5 F200\nG1 C1\nG1 C0\n"
    status, told, _ = run(probebox, folder, cell([block], rotary=[table]), feed)
    assert status == 0 and told["removed_mm3"] == 0, told
    status, told, _ = run(probebox, folder, cell([block], {"cutting_mm": 4}, rotary=[table]), feed)
    assert status == 1 and {hit["tool_part"] for hit in told["hits"]} == {"shank"}, told
    for description, words in ((cell([jaw_of("A")], rotary=[table]), "moves_with"), (cell([BOX], rotary=[table, table]), "is used twice"), (cell([BOX], rotary=[{**table, "direction": [0, 0, 0]}]), "has no length"),
                               (cell([jaw_of("C")], rotary=[{**table, "carries": "tool"}]), "moves_with"), (cell([BOX], rotary=[{**table, "carries": "all"}]), "carries")):
        status, _, said = run(probebox, folder, description, at((0, 0, 0)))
        assert status == 2 and words in said, (words, status, said)
    for text, words in (("G0 X0 Y0 Z0\nG1 B10\n", "line 2: a word B"), ("G0 X0 Y0 Z0\nG2 X10 I5 C10\n", "line 2: an arc while"), ("G0 X0 Y0 Z0\nG43.4 H1\n", "line 2: G43.4")):
        status, _, said = run(probebox, folder, cell([BOX], rotary=[table]), text)
        assert status == 2 and words in said, (words, status, said)


def jaw_of(letter):
    return {**BOX, "moves_with": letter}


BLOCK = {"name": "block", "part": "workpiece", "shape": "box", "size_mm": [80, 60, 50], "at_mm": [0, 0, -25]}


def check_cutting(probebox, folder):
    slot = "G21 G90\nG0 X-20 Y0 Z10\nG1 Z-5 F200\nG1 X20\nG0 Z10\n"
    status, told, _ = run(probebox, folder, cell([BLOCK]), slot)
    volume = 5 * (40 * 12 + math.pi * 36)
    assert status == 0 and abs(told["removed_mm3"] / volume - 1) < 0.03, (status, told["removed_mm3"], volume)
    status, told, _ = run(probebox, folder, cell([BLOCK]), slot.replace("G1 Z-5 F200", "G0 Z-5"))
    assert status == 1 and told["hits"][0]["tool_part"] == "cutter" and told["hits"][0]["line"] == 3, told["hits"]
    assert abs(told["hits"][-1]["overlap_mm"]) <= 5.01
    # In the slot that is there already rapid is free.
    again = slot + "G0 X20 Z10\nG0 X10 Z10\nG0 Z-4.9\n"
    status, told, _ = run(probebox, folder, cell([BLOCK]), again)
    assert status == 0, told["hits"]
    # Deeper than its edges: the shank touches what stands beside it.
    status, told, _ = run(probebox, folder, cell([BLOCK], {"cutting_mm": 4}), slot + "G1 X30 F200\nG1 X20 Y20 Z-5\n")
    assert status == 1 and {h["tool_part"] for h in told["hits"]} == {"shank"}, told["hits"]


def check_measured(probebox, folder):
    """The holder hits with the measured length, and does not with the one in store."""
    wall = {"name": "wall", "part": "fixture", "shape": "box", "size_mm": [20, 100, 50], "at_mm": [28, 0, -25]}
    tool = {"assembled_length_mm": 57.4}
    program = "G21 G90\nG0 X0 Y0 Z20\nG0 Z-57.7\n"
    status, told, _ = run(probebox, folder, cell([wall], tool), program)
    assert status == 1 and told["hits"][0]["tool_part"] == "holder" and told["hits"][0]["solid"] == "wall" and told["measured_lengths"]
    status, told, _ = run(probebox, folder, cell([wall], tool), program, "--stored")
    assert status == 0 and abs(told["nearest"]["distance_mm"] - 0.3) < 1e-3, told["nearest"]


def cube(path, text):
    corners = [(x, y, z) for x in (-10, 10) for y in (-50, 50) for z in (-30, 30)]
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    if text:
        lines = ["solid jaw"]
        for face in faces:
            lines += ["facet normal 0 0 0", "outer loop", *("vertex %g %g %g" % corners[k] for k in face), "endloop", "endfacet"]
        path.write_text("\n".join(lines + ["endsolid jaw\n"]))
    else:
        path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *(c for k in face for c in corners[k]), 0) for face in faces))


def check_stl(probebox, folder):
    mesh = {"name": "jaw", "part": "fixture", "shape": "stl", "file": "jaw.stl", "at_mm": [60, 0, -30]}
    for text in (False, True):
        cube(folder / "jaw.stl", text)
        for tip in ((0, 0, -40), (60, 0, 7.25), (0, 70, -70)):
            expected, part, _ = nearest(tip, TOOL, [BOX])
            _, told, _ = run(probebox, folder, cell([mesh]), at(tip))
            assert abs(told["nearest"]["distance_mm"] - expected) < 2e-3 and told["nearest"]["tool_part"] == part, (tip, told, expected)
    (folder / "jaw.stl").write_text("solid nothing\nendsolid\n")
    status, _, said = run(probebox, folder, cell([mesh]), at((0, 0, 0)))
    assert status == 2 and "no STL file" in said, said
    for corners, words in (([math.nan] * 9, "no STL file"), ([0] * 8 + [1e30], "more than 100 m")):
        (folder / "jaw.stl").write_bytes(bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 0, *corners, 0))
        status, _, said = run(probebox, folder, cell([mesh]), at((0, 0, 0)))
        assert status == 2 and words in said, said
    status, _, said = run(probebox, folder, cell([{**mesh, "file": "/proc/self/mem"}]), at((0, 0, 0)))
    assert status == 2 and "cannot be read (Input/output error)" in said, said


def check_text_stl(probebox, folder):
    """A text that is cut off has lost solid parts, wherever it was cut."""
    mesh = {"name": "jaw", "part": "fixture", "shape": "stl", "file": "jaw.stl", "at_mm": [60, 0, -30]}
    cube(folder / "jaw.stl", True)
    whole = (folder / "jaw.stl").read_text()
    for text in (whole, whole.replace("\n", "\r\n"), whole + whole.replace("jaw", "my other solid")):
        (folder / "jaw.stl").write_text(text)
        status, _, said = run(probebox, folder, cell([mesh]), at((0, 0, -40)))
        assert status == 0, said
    last = whole.rindex("facet normal")
    cuts = [whole[:last], whole[:last + 40], whole[:whole.rindex("endloop")], whole[:whole.rindex("endfacet")], whole[:whole.rindex("endsolid")], whole + whole[:last]]
    wrong = [(text, "ends before endsolid") for text in cuts]
    wrong += [(whole.replace("endfacet", "", 1), "no STL file"), (whole.replace("vertex", "corner", 1), "no STL file"), (whole.replace("50", "1e300", 1), "more than 100 m"),
              (whole.replace("\n", " "), "no STL file")]
    for text, words in wrong:
        (folder / "jaw.stl").write_text(text)
        status, _, said = run(probebox, folder, cell([mesh]), at((0, 0, -40)))
        assert status == 2 and words in said, (text[-200:], words, said)


def check_interrupted(probebox, folder):
    """Ctrl-C in the middle of a move ends it without a verdict."""
    (folder / "cell.toml").write_text(cell([{**BOX, "name": f"rail {k}", "size_mm": [40_000, 10, 10]} for k in range(100)]))
    (folder / "part.ngc").write_text("G0 X-19000 Y100 Z0\nG0 X19000\n")
    for number in (signal.SIGINT, signal.SIGTERM):
        command = subprocess.Popen([probebox, "interference", "--cell", str(folder / "cell.toml"), "--tool", "4", "--gcode", str(folder / "part.ngc"), "--step", "0.01"],
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        status = pathlib.Path(f"/proc/{command.pid}/status")
        while command.poll() is None and not any(line.startswith("SigCgt:") and int(line[7:], 16) >> (signal.SIGINT - 1) & 1 for line in status.read_text().splitlines()):
            time.sleep(0.01)
        time.sleep(0.5)
        command.send_signal(number)
        try:
            said, _ = command.communicate(timeout=20)
        finally:
            command.kill()
        assert command.returncode == 130 and "hit" not in said, (command.returncode, said)


def check_refusals(probebox, folder):
    refused = {"G0 X0 Y0 Z0\nG81 X1 Z-5 R2\n": "line 2: G81", "G0 X0 Y0 Z0\nG1 A10\n": "line 2: a word A", "G0 X0 Y0 Z0\nG1 X#1\n": "line 2",
               "X1\n": "line 1", "G0 X0 Y0 Z0\nG1 XINF\n": "line 2: 'XINF'", "G0 X0 Y0 Z0\nG1 Znan\n": "line 2: 'ZNAN'",
               "G0 X0 Y0 Z0\nG1 X1E2\n": "line 2: 'E2'", "G0 X0 Y0 Z0\nG1 X1 X2\n": "line 2: a second word X", "G0 X0 Y0 Z0\nG1 X9999999999\n": "line 2: 'X9999999999' is further",
               "G0 X0 Y0 Z0\nM98 P100\n": "line 2: M98", "G0 X0 Y0 Z0\nM99\n": "line 2: M99", "G0 X0 Y0 Z0\nG2 X0 Y0 I5 P3\n": "line 2: an arc of several turns",
               "T4 M6\nG0 X0 Y0 Z0\nT7\nG0 X1\nM6\n": "line 5: tool 7 is taken, and tool 4 is checked", "G0 X0 Y0 Z0\nG2 X10 I2\n": "line 2: the end of the arc", "G0 X0\n": "nothing moves",
               # LinuxCNC refuses these; a Fanuc ends a comment at its first bracket, and moves.
               "G0 X0 Y0 Z0\nG0 X10 (move (fast) G1 Z-190 F100\nG0 X0\n": "line 2: a comment within a comment", "G0 X0 Y0 Z0\nG0 X10 (never closed G1 Z-190 F100\n": "line 2: a comment without end",
               "G0 X0 Y0 Z0\nG0 X10 (one) two)\n": "line 2: a ) that ends no comment"}
    for program, words in refused.items():
        status, _, said = run(probebox, folder, cell([BOX]), program)
        assert status == 2 and words in said, (program, status, said)
    status, told, said = run(probebox, folder, cell([BOX]), "G17 G21 G40 G54 G90 G94 G61.1 (one) (two; three)\nT4 M6 ; four (five\nG43 H4\nG0 X0 Y0 Z0\nX1\nM30\n")
    assert status == 0 and told["moves"] == 1, (status, told, said)
    good_cell, good_program = str(folder / "cell.toml"), str(folder / "part.ngc")
    for files, words in (((str(folder), good_program), "it is a folder"), ((good_cell, str(folder)), "it is a folder"), (("/proc/self/mem", good_program), "Input/output error"),
                         ((good_cell, "/proc/self/mem"), "Input/output error"), ((good_cell, "nowhere.ngc"), "No such file")):
        done = subprocess.run([probebox, "interference", "--cell", files[0], "--tool", "4", "--gcode", files[1]], capture_output=True, text=True)
        assert done.returncode == 2 and words in done.stderr, done
    for description, words in ((cell([BOX, BOX]), "is used twice"), (cell([{**BOX, "shape": "cone"}]), "cone"), (cell([BOX]).replace("number = 4", "number = 5"), "no [[tool]]"),
                               (cell([{**BOX, "colour": "red"}]), "colour"), (cell([BOX], {"cutting_mm": 59}), "cutting_mm")):
        status, _, said = run(probebox, folder, description, at((0, 0, 0)))
        assert status == 2 and words in said, (words, status, said)


def main(probebox):
    with tempfile.TemporaryDirectory(prefix="probebox-interference-") as scratch:
        folder = pathlib.Path(scratch)
        check_known(probebox, folder)
        worst = check_random(probebox, folder)
        turned_worst = check_turned(probebox, folder)
        for one in (check_turning, check_path, check_cutting, check_measured, check_stl, check_text_stl, check_interrupted, check_refusals):
            one(probebox, folder)
        print(f"40 random poses agree within {worst * 1e3:.3f} um, 30 with rotary axes within {turned_worst * 1e3:.3f} um")


if __name__ == "__main__":
    main(*sys.argv[1:])
