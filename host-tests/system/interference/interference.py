"""`probebox interference` against known distances, and against alternating projections between convex solids.

Usage: interference.py PROBEBOX. Status 77 where it was built without FCL.
"""
import json
import math
import pathlib
import random
import resource
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


def check_stl_kinds(probebox, folder):
    """Dialects of STL; a mesh that is not closed; one in another unit; and a tool that is wholly inside."""
    mesh = {"name": "jaw", "part": "fixture", "shape": "stl", "file": "jaw.stl", "at_mm": [60, 0, -30]}
    cube(folder / "jaw.stl", True)
    text = (folder / "jaw.stl").read_text()
    cube(folder / "jaw.stl", False)
    binary = (folder / "jaw.stl").read_bytes()
    for content in (binary + b"made by a tool", b"solid jaw".ljust(80) + binary[80:], b"\xef\xbb\xbf" + text.encode(), text.replace("\n", "\r").encode(), text.upper().encode(),
                    text.replace("endsolid", "end solid").encode(), text.replace("jaw", "vertex facet jaw").encode()):
        (folder / "jaw.stl").write_bytes(content)
        status, told, said = run(probebox, folder, cell([mesh]), at((60, 0, 7.25)))
        assert status == 0 and abs(told["nearest"]["distance_mm"] - 7.25) < 2e-3, (content[:40], told, said)
        assert told["meshes"] == [{"solid": "jaw", "size_mm": [20, 100, 60], "unit_stated": False}], told["meshes"]
    open_text = text[:text.rindex("facet normal")] + "endsolid jaw\n"
    for content, words in ((binary[:-1], "ends before its last triangle"), (text.encode("utf-16"), "UTF-16"), (open_text.encode(), "is not closed, 3 edges")):
        (folder / "jaw.stl").write_bytes(content)
        status, _, said = run(probebox, folder, cell([mesh]), at((60, 0, 7.25)))
        assert status == 2 and words in said, said
    for unit, mm in (("inch", 25.4), ("m", 1000.0)):
        count = len(binary[84:]) // 50
        scaled = b"".join(struct.pack("<12fH", *(v / mm for v in struct.unpack_from("<12f", binary, 84 + 50 * k)), 0) for k in range(count))
        (folder / "jaw.stl").write_bytes(binary[:84] + scaled)
        status, told, said = run(probebox, folder, cell([mesh]), at((60, 0, 7.25)))
        assert status == 2 and 'unit = "mm"' in said, (told, said)
        status, told, said = run(probebox, folder, cell([{**mesh, "unit": unit}]), at((60, 0, 7.25)))
        assert abs(told["nearest"]["distance_mm"] - 7.25) < 2e-3 and abs(told["meshes"][0]["size_mm"][1] - 100) < 1e-3, (told, said)
    # A room whose walls the tool does not touch, and the same as a shell of two surfaces with the tool in between.
    faces = lambda half: b"".join(struct.pack("<12fH", 0, 0, 0, *(c / abs(c) * half for c in struct.unpack_from("<9f", binary, 84 + 50 * k + 12)), 0) for k in range(12))
    turned = lambda content: b"".join(content[k:k + 12] + content[k + 24:k + 36] + content[k + 12:k + 24] + content[k + 36:k + 50] for k in range(0, len(content), 50))
    for content, tip, hits in ((faces(300), (0, 0, 0), 1), (turned(faces(300)), (0, 0, 0), 1), (faces(300) + turned(faces(200)), (0, 0, 0), 0), (faces(300), (0, 0, -200), 1), (faces(300), (400, 0, 0), 0), (faces(300) + faces(20), (0, 0, 30), 1)):
        (folder / "jaw.stl").write_bytes(bytes(80) + struct.pack("<I", len(content) // 50) + content)
        status, told, said = run(probebox, folder, cell([{**mesh, "at_mm": [0, 0, 0]}]), at(tip))
        assert status == hits and bool(told["hits"]) == bool(hits), (tip, told, said)


def check_thin(probebox, folder):
    """A tool that is thinner than a cell of the workpiece's heights hits it, and cuts it."""
    for radius in (0.05, 0.17, 0.3):
        rapid = "G21 G90\nG0 X-20.1 Y3.13 Z10\nG0 Z-5\n"
        status, told, _ = run(probebox, folder, cell([BLOCK], {"radius_mm": radius}), rapid)
        assert status == 1 and told["hits"][0]["tool_part"] == "cutter" and abs(told["hits"][-1]["overlap_mm"]) < 5.01, (radius, told)
        status, told, _ = run(probebox, folder, cell([BLOCK], {"radius_mm": radius}), rapid.replace("G0 Z-5", "G1 Z-5 F100\nG1 X20"))
        assert status == 0 and told["removed_mm3"] > 0.8 * 5 * 40 * 2 * radius, (radius, told)


def check_size(probebox, folder):
    """10 kB of program take no more memory than they need: an arc is one move."""
    (folder / "cell.toml").write_text(cell([]))
    (folder / "part.ngc").write_text("G0 X-90000 Y0 Z900\nG2\n" + 1400 * "I90000\n")
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
    done = subprocess.run([probebox, "--json", "interference", "--cell", str(folder / "cell.toml"), "--tool", "4", "--gcode", str(folder / "part.ngc")],
                          capture_output=True, text=True, preexec_fn=limit)
    assert done.returncode == 0 and json.loads(done.stdout)["moves"] == 1400, done


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


def cylinder_to_box(x, y, radius, low, high, box):
    """Distance of an upright cylinder from an upright box; where they overlap, minus the depth."""
    half = [size / 2 for size in box["size_mm"]]
    dx, dy = (abs(c - o) - h for c, o, h in zip((x, y), box["at_mm"], half))
    across = (math.hypot(max(dx, 0), max(dy, 0)) if max(dx, dy) > 0 else max(dx, dy)) - radius
    along = max(box["at_mm"][2] - half[2] - high, low - box["at_mm"][2] - half[2])
    return math.hypot(max(across, 0), max(along, 0)) if max(across, along) > 0 else max(across, along)


def tool_to_boxes(tip, boxes):
    long = TOOL["length_mm"]
    parts = ((TOOL["radius_mm"], 0, long), (TOOL["holder_radius_mm"], long, long + TOOL["holder_length_mm"]))
    return min(cylinder_to_box(tip[0], tip[1], radius, tip[2] + low, tip[2] + high, box) for radius, low, high in parts for box in boxes)


class Course:
    """A random program, and the places that its tip passes, by formulas of its own. Each block is made from a curve, not read."""

    def __init__(self, rng):
        self.rng, self.at, self.unit, self.relative, self.middles, self.plane = rng, [-60.0, 0.0, 60.0], 1.0, False, False, 2
        self.blocks, self.sweeps = ["G21 G90 G17 G91.1", "T4 M6", "G43 H4", "G0 X-60 Y0 Z60"], [[], [], [], []]

    def word(self, letter, mm):
        return f" {letter}{mm / self.unit:.7f}"

    def ends(self, to, axes):
        return "".join(self.word("XYZ"[k], to[k] - self.at[k] if self.relative else to[k]) for k in axes)

    def put(self, text, tips):
        self.blocks.append(text)
        self.sweeps.append(tips)

    def line(self, begin, end):
        n = max(1, math.ceil(math.dist(begin, end) / 0.3))
        return [[b + (e - b) * k / n for b, e in zip(begin, end)] for k in range(n + 1)]

    def modes(self):
        choice = self.rng.randrange(4)
        if choice == 0:
            self.unit = self.rng.choice((1.0, 25.4))
            self.put("G21" if self.unit == 1 else "G20", [])
        elif choice == 1:
            self.relative = self.rng.random() < 0.5
            self.put("G91" if self.relative else "G90", [])
        elif choice == 2:
            self.middles = self.rng.random() < 0.5
            self.put("G90.1" if self.middles else "G91.1", [])
        else:
            self.plane = self.rng.randrange(3)
            self.put(f"G{19 - self.plane}", [])

    def straight(self):
        axes = self.rng.sample(range(3), self.rng.randint(1, 3))
        to = list(self.at)
        for k in axes:
            to[k] = round(self.rng.uniform(-60, 60) if k < 2 else self.rng.uniform(-5, 70), 3)
        rapid = self.rng.random() < 0.5
        tips = self.line(self.at, to)
        if rapid:  # all axes at one speed, each until it is there
            place, left = list(self.at), [t - a for a, t in zip(self.at, to)]
            while any(left):
                step = min(abs(c) for c in left if c)
                go = [math.copysign(step, c) if c else 0 for c in left]
                after = [p + g for p, g in zip(place, go)]
                tips += self.line(place, after)
                place, left = after, [0 if abs(c) <= step else c - g for c, g in zip(left, go)]
        self.put(("G0" if rapid else "G1") + self.ends(to, axes) + ("" if rapid else " F500"), tips)
        self.at = to

    def arc(self):
        rng, first, second = self.rng, (self.plane + 1) % 3, (self.plane + 2) % 3
        radius, begin = rng.uniform(5, 40), rng.choice((rng.uniform(0, 360), 45 * rng.randrange(8)))
        turn = rng.choice((360, 90, 45, 180, 270, rng.uniform(5, 355)))
        whole, turns, sense = turn == 360, rng.choice((1, 1, 1, 2, 3)), rng.choice((-1, 1))
        rise = rng.choice((0, 0, rng.uniform(-10, 10)))
        middle = {first: self.at[first] - radius * math.cos(math.radians(begin)), second: self.at[second] - radius * math.sin(math.radians(begin))}
        place = lambda part: self.circle(middle, first, second, radius, begin + sense * part * (turn + 360 * (turns - 1)), self.at[self.plane] + part * rise)
        to = place(1)
        if whole:
            to[first], to[second] = self.at[first], self.at[second]
        text = ("G3" if sense > 0 else "G2") + self.ends(to, ([] if whole and rng.random() < 0.5 else [first, second]) + ([self.plane] if rise else []))
        if not whole and turns == 1 and turn != 180 and 20 < turn < 340 and rng.random() < 0.4:
            text += self.word("R", radius if turn < 180 else -radius)
        else:
            text += "".join(self.word("IJK"[k], middle[k] - (0 if self.middles else self.at[k])) for k in (first, second)) + (f" P{turns}" if turns > 1 else "")
        n = math.ceil(radius * math.radians(turn + 360 * (turns - 1)) / 0.3)
        self.put(text, [place(k / n) for k in range(n + 1)])
        self.at = to

    def circle(self, middle, first, second, radius, degrees, height):
        at = [0.0, 0.0, 0.0]
        at[first], at[second] = middle[first] + radius * math.cos(math.radians(degrees)), middle[second] + radius * math.sin(math.radians(degrees))
        at[self.plane] = height
        return at


def check_programs(probebox, folder):
    """Random programs in all planes, units and modes against a sweep along the curves from which they were written."""
    rng = random.Random(20)
    hits = 0
    for number in range(40):
        boxes = [{"name": f"box {k}", "part": "fixture", "shape": "box", "size_mm": [round(rng.uniform(10, 60), 1) for _ in range(3)],
                  "at_mm": [round(rng.uniform(-60, 60), 1), round(rng.uniform(-60, 60), 1), round(rng.uniform(-60, 30), 1)]} for k in range(2)]
        course = Course(rng)
        for _ in range(5):
            course.modes()
            rng.choice((course.straight, course.arc, course.arc))()
        status, told, said = run(probebox, folder, cell(boxes), "\n".join(course.blocks) + "\n")
        deepest = {k + 1: min(tool_to_boxes(tip, boxes) for tip in tips) for k, tips in enumerate(course.sweeps) if tips}
        program = "\n".join(course.blocks)
        assert status in (0, 1), (number, program, said)
        found = {hit["line"] for hit in told["hits"]}
        for line, mm in deepest.items():
            assert mm > -0.25 or line in found, (number, line, mm, program, told["hits"])
            assert mm < 0.15 or line not in found, (number, line, mm, program, told["hits"])
        least = min(deepest.values())
        if least > 0.15:
            assert abs(told["nearest"]["distance_mm"] - least) < 0.15, (number, least, told["nearest"], program)
        hits += least < -0.25
    assert hits > 5, hits


def check_circles(probebox, folder):
    """Whole circles and helices that begin in each of eight directions, in both senses and all planes: the far side is reached."""
    for normal, plane in ((2, "G17"), (1, "G18"), (0, "G19")):
        first, second = (normal + 1) % 3, (normal + 2) % 3
        for degrees in range(0, 360, 45):
            middle = [0.0, 0.0, 0.0]
            middle[first], middle[second] = 50 * math.cos(math.radians(degrees)), 50 * math.sin(math.radians(degrees))
            middle = [round(c, 6) + 0.0 for c in middle]
            far = [2 * c for c in middle]
            # Only the lowest points of the tool are low enough to meet a plate below the far side.
            plate = {"name": "plate", "part": "fixture", "shape": "box", "size_mm": [1, 1, 1], "at_mm": [far[0], far[1], far[2] - 1]}
            for code in ("G2", "G3"):
                offsets = f"{'IJK'[first]}{middle[first]} {'IJK'[second]}{middle[second]}"
                program = f"G21 G90 {plane}\nG0 X0 Y0 Z0\n{code} {offsets}\n{code} {offsets} {'XYZ'[normal]}8\n"
                _, told, said = run(probebox, folder, cell([plate]), program)
                around = 2 * math.pi * math.hypot(middle[first], middle[second])
                assert abs(told["path_mm"] - around - math.hypot(around, 8)) < 1e-3, (program, told, said)
                if normal == 2:
                    assert abs(told["nearest"]["distance_mm"] - 0.5) < 2e-3, (program, told)


CLAMP = {"name": "clamp", "part": "fixture", "shape": "box", "size_mm": [10, 10, 40], "at_mm": [60, 0, 20]}
TABLE = {"name": "table", "part": "machine", "shape": "box", "size_mm": [400, 400, 20], "at_mm": [0, 0, -60]}
HEAD = "G21 G90 G17\nT4 M6\nG54 G43 H4\nG0 X0 Y0 Z50\n"


def check_followed(probebox, folder):
    """Programs whose path is written in another way hit where those do that write it out with G0 and G1."""
    same = {
        "G0 Z5\nG4 X-60.\nG91\nG1 X60. F500\n": "G0 Z5\nG4 P1\nG91\nG1 X60. F500\n",
        # Rounding makes the end of a whole circle another place than its beginning.
        "G0 Y0.0002 Z5\nG3 X0 Y0 I30 F500\n": "G0 Z5\nG3 I30 F500\n",
        "G0 Z5\nG2 X60 R30 F500\n": "G0 Z5\nG2 X60 I30 F500\n",
        "G0 Z5\nG3 X60 Y0 R-31 F500\n": "G0 Z5\nG3 X60 I30 J-7.8102497 F500\n",
        "G81 X60 Z-5 R2 F100\nG80\n": "G0 X60\nG0 Z2\nG1 Z-5\nG0 Z50\n",
        "G99 G83 X0 Y0 Z-5 R45 Q1 F100\nX60\nG80\n": "G0 Z45\nG1 Z-5\nG0 Z45\nG0 X60\nG1 Z-5\nG0 Z45\n",
        "G91 G81 X30 Z-8 R-45 L2 F100\n": "G0 X30\nG0 Z5\nG1 Z-3\nG0 Z50\nG0 X60\nG0 Z5\nG1 Z-3\nG0 Z50\n",
        "G53 G0 X60\nG90 G28 Z0\n": "G0 X60\nG0 Z0\nG0 Z60\n",
        "G52 X50\nG0 Z5\nG1 X10 F100\n": "G0 Z5\nG1 X60 F100\n",
        "G92 X-60\nG0 Z5\nG1 X0 F100\n": "G0 Z5\nG1 X60 F100\n",
        "G10 L2 P1 X60\nG0 Z5\nG1 X0 F100\n": "G0 Z5\nG1 X60 F100\n",
        "G20\nG0 Z0.2\nG91\nG1 X2 F10\nG21\nX9.2\n": "G0 Z5.08\nG1 X60 F100\n",
    }
    for program, reference in same.items():
        status, told, said = run(probebox, folder, cell([CLAMP, TABLE]), HEAD + program)
        wanted, expected, _ = run(probebox, folder, cell([CLAMP, TABLE]), HEAD + reference)
        assert wanted == 1, reference
        pairs = lambda one: {(hit["solid"], hit["tool_part"]) for hit in one["hits"]}
        assert status == 1 and pairs(told) == pairs(expected), (program, said, told, expected)
    # A rapid goes straight, or first along the diagonal: the clamp that only one of them meets is hit.
    post = {**CLAMP, "size_mm": [20, 20, 40], "at_mm": [0, 5, 20]}
    status, told, _ = run(probebox, folder, cell([post]), "G0 X-100 Y-100 Z5\nG0 X100 Y0\n")
    assert status == 1 and told["hits"][0]["line"] == 2, told
    assert run(probebox, folder, cell([post]), "G0 X-100 Y-100 Z5\nG1 X100 Y0\n")[0] == 0


POSTS = {
    "fusion": "%\nO1001 (PART)\n(T4 D=10. CR=0. - FLAT END MILL)\nN10 G90 G94 G17 G49 G40 G80\nN15 G21\nN20 G28 G91 Z0.\nN25 G90\nN30 T4 M6\nN35 S5000 M3\nN40 G54\nN45 M8\nN50 G0 X0. Y0.\n"
              "N55 G43 Z50. H4\nN57 T5\nN60 G1 Z5. F500.\nN65 G0 Z50.\nN70 M9\nN75 M5\nN80 G28 G91 Z0.\nN85 G90\nN87 G53 G0 Y0.\nN90 M30\n%\nSEE SHEET 2\n",
    "mastercam": "PROGRAM FOR JOB 7\n%\nO0000 (T)\nN100 G21\nN102 G0 G17 G40 G49 G80 G90\nN104 T4 M6\nN106 G0 G90 G54 X0. Y0. A0. S5000 M3\nN108 G43 H4 Z50.\nN110 Z10.\n"
                 "N112 G99 G83 Z-5. R2. Q1. F100.\nN114 X10.\nN116 G80\nN118 M5\nN120 G91 G28 Z0.\nN122 G28 X0. Y0.\nN124 M30\n%\n",
    "headers": "\ufeffG21\r\n/M8\r\nG17 G40 G49 G80 G90 G98 G69 G50 G64 P0.01\r\nG93\r\nG0 X0 Y0 Z50\r\nG1 Z5 F10.\r\nG94\r\nG0 Z50\r\nM30\r\n",
    "old line ends": "G21 G90\rG0 X0 Y0 Z50\rG1 Z5 F100\rM30\r",
    "second zero system alone": "G21 G90 G55\nG0 X0 Y0 Z50\nG1 Z5 F100\nM30\n",
    "lead-in": HEAD + "G0 Z10\nG18 G3 X-5 Z5 I-5 K0 F400\nG1 X-20\nG17\nG0 Z50\nM30\n",
}


def check_posts(probebox, folder):
    """What posts write and what changes no path is no obstacle."""
    for name, program in POSTS.items():
        status, told, said = run(probebox, folder, cell([CLAMP, TABLE]), program)
        assert status == 0 and told["moves"] >= 1, (name, told, said)
    # Two tools: each with its own shape, and a tool that the cell does not have is refused.
    program = "T4 M6\nG43 H4\nG0 X0 Y0 Z50\nG1 Z5 F100\nG91 G28 Z0\nG90\nT5 M6\nG0 X50 Y0\nG43 H5 Z50\nG1 Z5\nG0 Z50\n"
    thick = cell([CLAMP, TABLE]) + "[[tool]]\nnumber = 5\nholder_radius_mm = 20\nholder_length_mm = 62\nradius_mm = 8\nlength_mm = 58\n"
    status, told, said = run(probebox, folder, thick, program)
    assert status == 1 and {(hit["line"], hit["tool"]) for hit in told["hits"]} == {(10, 5), (11, 5)}, (told, said)
    assert run(probebox, folder, cell([CLAMP, TABLE]), program)[1]["error"] == "other-tool"


def check_own_programs(probebox, folder):
    """The programs of `probebox gcode` are read, and a probing move ends where the cutter touches."""
    for dialect in ("linuxcnc", "fanuc", "haas", "siemens"):
        done = subprocess.run([probebox, "gcode", "delay-multi-speed", "--dialect", dialect, "--probe-tools", "4", "--stylus", "6", "--sphere", "25", "--safe-z", "80", "--output", str(folder / "own.nc"), "--force"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        status, told, said = run(probebox, folder, cell([CLAMP, TABLE]), (folder / "own.nc").read_text())
        assert status == 0 and told["moves"] > 100, (dialect, told, said)
    touch = HEAD + "G38.2 Z-100 F100\nG91\nG1 Z10 F100\nX20\n"
    status, told, _ = run(probebox, folder, cell([TABLE], least_mm=0.5), touch)
    assert status == 0 and abs(told["path_mm"] - (150 + 10 + 20)) < 1e-6, told
    # It backs away from where it touched, not from where it was sent: 55 beside the clamp, 60 in it.
    status, told, _ = run(probebox, folder, cell([CLAMP]), HEAD + "G0 Z5\nG31 X80 F100\nG91\nG0 X-20\nZ50\nX20\n")
    assert status == 0, told["hits"]
    status, told, _ = run(probebox, folder, cell([CLAMP]), HEAD + "G0 Z5\nG31 X80 F100\nG91\nG1 X1\n")
    assert status == 1 and told["hits"][0]["line"] == 8, told["hits"]
    # An arc from there is not that of the program: then the touch is a hit.
    for solids, lines in (([TABLE], []), ([CLAMP], [6])):
        status, told, _ = run(probebox, folder, cell(solids), HEAD + "G0 Z5\nG31 X80 F100\nG2 X80 I-3\n")
        assert status == len(lines) and [hit["line"] for hit in told["hits"]][:1] == lines, told
    block = {**BLOCK, "at_mm": [0, 0, 0]}
    status, told, _ = run(probebox, folder, cell([block]), HEAD + "G31 Z-5 F100\nG0 Z50\n")
    assert status == 0 and told["removed_mm3"] == 0, told


def check_refusals(probebox, folder):
    """Each by its name, with the line."""
    place = "G0 X0 Y0 Z50\n"
    refused = {
        "unread-word": ("G1 X10 P3", "G1 X10 I5", "G54 P3", "G1 X10 L10", "D0", "G1 X10 H4", "G2 X10 I5 K0", "G4 P1 X5", "G0 U5", "M8 Q3", "G1 X1E2"),
        "unknown-code": ("G1.5 X1", "G5.2 X1", "G999", "G1 X1\nM72"),
        "code-not-followed": ("G41 D1 X10", "G68 X0 Y0 R45", "G43.4 H4", "G54.1 P3", "G51 X2", "G16"),
        "not-a-word": ("G1 X#1", "G1 XINF", "G1 Znan", "G1 X[1+2]", "CALL SUB"),
        "word-twice": ("G1 X1 X2",),
        "too-far": ("G1 X9999999999",),
        "codes-disagree": ("G0 G1 X5", "G90 G91 X5", "G17 G18"),
        "other-program": ("M98 P100", "M99", "o<sub> call"),
        "conditional-motion": ("/G1 X10", "/2 G91", "IF[#1EQ2]GOTO10", "o1 if [1]\nG1 X5", "o1 while [1]"),
        "system-variable": ("#5221=10", "IF[1EQ1]THEN#2004=3"),
        "no-rotary-axis": ("G1 A10",),
        "wrong-length": ("G49 H4", "T4 M6\nG43 H5", "G43", "G91 G28 Z0\nG90 G43 H4 Z60\nH5"),
        "late-length": ("G43 H4",),
        "length-off": ("G49 G91 G28 Z0\nG90 G43 H4 Z50\nG49\nG0 Z0", "G43 H0\nG0 Z40", "G91 G28 Z0\nG90 G43 H4 Z40\nG49\nG0 X10"),
        "not-a-tool": ("T0505",),
        "other-tool": ("T7 M6", "G91 G28 Z0\nT0 M6\nG90 G0 Z0"),
        "change-at-height": ("T5 M6",),
        "home-at-height": ("G28 X0 Y0", "G91 G28 X0 Z0", "G28"),
        "machine-height": ("G53 G0 Z-10",),
        "machine-motion": ("G91 G53 G0 X0",),
        "other-zero": ("G55", "G10 L20 P1 X0", "G10 L2 P2 X0", "G10 L1 P4 Z3"),
        "bad-arc": ("G2 X10 I2", "G2 X10", "G2 X10 R4", "G2 X0 Y0 R4", "G2 I5 P0", "G90.1\nG2 X10 I5", "G2 I5 P1.5"),
        "bad-cycle": ("G81 X1 Z-5", "G81 X1 Z-5 R60", "G81 X1 Z5 R2", "G81 X1 Z-5 R2 L0.5", "G18 G81 X1 Z-5 R2"),
        "too-many-moves": ("G91 G81 X0 Z-1 R-1\n" + 11 * "X0.001 L9999\n",),
        "bad-comment": ("G0 X10 (move (fast) G1 Z-190 F100", "G0 X10 (never closed G1 Z-190 F100", "G0 X10 (one) two)"),
        "unknown-place": ("G38.2 X10 F100\nG81 Z-5 R2", "G31 X10 F100\nG92 X0"),
    }
    two = cell([BOX]) + "[[tool]]\nnumber = 5\nholder_radius_mm = 20\nholder_length_mm = 62\nradius_mm = 6\nlength_mm = 58\n"
    for name, programs in refused.items():
        for program in programs:
            status, told, said = run(probebox, folder, two, place + program + "\n")
            assert status == 2 and told["error"] == name and f"line {program.rstrip().count(chr(10)) + 2}: " in said, (name, program, status, told, said)
    whole = {"no-motion-code": "X1\n", "no-moves": "G0 X0\n", "tool-not-used": "T5 M6\nG0 X0 Y0 Z0\nX1\n", "unknown-place": "G91 G0 X1\n",
             "two-programs": "G0 X0 Y0 Z0\n%\nG0 X5 Y0 Z0\n%\n"}
    for name, program in whole.items():
        status, told, said = run(probebox, folder, two, program)
        assert status == 2 and told["error"] == name, (name, program, told, said)
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
        for one in (check_turning, check_path, check_cutting, check_measured, check_stl, check_text_stl, check_stl_kinds, check_thin, check_size, check_interrupted,
                    check_circles, check_programs, check_followed, check_posts, check_own_programs, check_refusals):
            one(probebox, folder)
        print(f"40 random poses agree within {worst * 1e3:.3f} um, 30 with rotary axes within {turned_worst * 1e3:.3f} um")


if __name__ == "__main__":
    main(*sys.argv[1:])
