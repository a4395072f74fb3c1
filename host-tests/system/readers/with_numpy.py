"""The generated reader for Python against `probebox export` and `pack`. Usage: with_numpy.py PROBEBOXD PROBEBOX READERS

Status 77 where no python3 has NumPy.
"""
import csv
import itertools
import math
import pathlib
import random
import socket
import subprocess
import sys
import time

from captured import PATIENCE_S, box, recording, skip, table

sys.path.append(str(pathlib.Path(__file__).parent.parent / "independent"))
import frames  # noqa: E402


def scan(count):
    """What stands still, steps, wanders, jumps and goes around in a circle with noise: every predictor."""
    random.seed(11)
    wander = 0
    for k in range(count):
        wander += random.randint(-3, 3)
        jump = 2**40 if random.random() < 0.01 else 0
        yield k, 4, 250 * k, wander, wander + jump, round(3e5 * math.cos(k / 60) + random.gauss(0, 30)), round(2e8 + 2e7 * math.sin(k / 60))


def check_codings(probebox, read, folder):
    rows = list(scan(3000))
    names = ["flags", "line", "wander", "jumps", "circle", "far"]
    (folder / "scan.csv").write_text(
        "sample," + ",".join(names) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    for profile in ("raw", "fast"):
        for batch in (64, 256, 700):
            subprocess.run([probebox, "pack", "--force", "--profile", profile, "--frame", str(batch), str(folder / "scan.csv"),
                            str(folder / "packed.pbx")], check=True, stdout=subprocess.DEVNULL)
            packed = read(str(folder / "packed.pbx"))
            assert len(packed) == len(rows)
            for k, name in enumerate(packed.channels()):
                assert packed[name].tolist() == [row[k + 1] for row in rows], f"{name}, {profile}, {batch} a frame"


def check_refusal(probebox, read, folder):
    """Of profile tight this reader knows the name, and the remedy."""
    (folder / "scan.csv").write_text("sample,x\n" + "".join(f"{k},{k}\n" for k in range(300)))
    subprocess.run([probebox, "pack", "--force", "--profile", "tight", str(folder / "scan.csv"), str(folder / "packed.pbx")],
                   check=True, stdout=subprocess.DEVNULL)
    try:
        read(str(folder / "packed.pbx"))
    except ValueError as refusal:
        assert "--profile fast" in str(refusal)
    else:
        raise AssertionError("a recording of profile tight was read")


def check_recording(probebox, read, path, folder):
    samples, triggers = table(probebox, path, folder)
    scan_ = read(str(path))
    assert scan_.damaged_frames == scan_.unreadable_blocks == 0
    assert scan_.sample.tolist() == [int(row["sample"]) for row in samples]
    assert scan_.time_ns.tolist() == [int(row["time_ns"]) for row in samples]
    for name, unit in scan_.units.items():
        column = name + "_" + unit.replace("/", "_") if unit else name
        off = max(abs(a - float(row[column])) for a, row in zip(scan_[name], samples))
        assert off < 1e-9 * max(1, abs(scan_[name]).max()), f"{name}: {off}"
    assert [t["number"] for t in scan_.triggers] == [int(row["number"]) for row in triggers]
    for trigger, row in zip(scan_.triggers, triggers):
        if row["x_mm"]:  # empty where the axis was not referenced yet
            assert trigger["position_mm"][0] == float(row["x_mm"])
    assert scan_.descriptor["board"] == "sim" and scan_.heartbeats[-1]["streaming"] is False
    return len(samples)


def accept_a_delay(probebox, uri):
    """Tips need one, and its gain."""
    subprocess.run([probebox, "-u", uri, "calibrate", "delay-known-sphere", "--accept", "--by", "Ada"], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def points_of(probebox, uri, path, exported):
    """On a busy computer the emulated encoders may fall silent, and the box then forgets where the axes are: it is told again."""
    for _ in range(3):
        subprocess.run([probebox, "-u", uri, "record", "-o", str(path), "--for", "0.5"], check=True, stdout=subprocess.DEVNULL)
        if subprocess.run([probebox, "export", str(path), "-o", str(exported), "--points", "--force"]).returncode == 0:
            return
        path.unlink()
        subprocess.run([probebox, "-u", uri, "home", "X=100", "Y=100", "Z=-100"])
    raise AssertionError("no sample has a tip")


def check_tips(probebox, uri, read, folder):
    path, exported = folder / "tips.pbx", folder / "points.csv"
    points_of(probebox, uri, path, exported)
    with open(exported, newline="") as file:
        rows = list(csv.DictReader(file))
    tips = read(str(path)).tip_mm
    assert len(tips) == len(rows) > 100
    for tip, row in zip(tips.tolist(), rows):
        for k, axis in enumerate("xyz"):
            cell = row[f"tip_{axis}_mm"]
            assert math.isnan(tip[k]) if not cell else abs(tip[k] - float(cell)) < 1e-6, (axis, tip, cell)
    assert any(row["tip_x_mm"] for row in rows)


def delimited(bare):
    """A frame as it stands in a recording: COBS, and its end."""
    out = bytearray()
    for group in (bare + b"\0").split(b"\0")[:-1]:
        while len(group) >= 254:
            out += b"\xff" + group[:254]
            group = group[254:]
        out += bytes([len(group) + 1]) + group
    return bytes(out) + b"\0"


def of_another_boot(reader, data):
    """The same, with another boot_id in its WELCOME, whose last field that is."""
    bare = reader._uncobs(next(piece for piece in data.split(b"\0") if piece))
    changed = bare[:-4 - 16] + bytes(16 * [0xA5])
    return delimited(changed + reader.crc32c(changed).to_bytes(4, "little")) + data[data.index(b"\0", 1) + 1:]


def check_damage(reader, path, folder):
    data = path.read_bytes()

    def read(name, content):
        (folder / name).write_bytes(content)
        return reader.read(str(folder / name))

    whole = reader.read(str(path))
    assert whole.closed and whole.missing_frames == whole.cut_bytes == 0
    flipped = bytearray(data)
    flipped[len(data) // 2] ^= 0x01
    damaged = read("damaged.pbx", flipped)
    assert 1 <= damaged.damaged_frames <= 2 and len(damaged) <= len(whole)
    assert damaged.missing_frames == 1 or damaged.damaged_frames == 2
    cut = read("cut.pbx", data[:-5])
    assert cut.cut_bytes > 0 and not cut.closed and cut.damaged_frames == 0
    frames = data.split(b"\0")
    holed = read("holed.pbx", b"\0".join(frames[:len(frames) // 2] + frames[len(frames) // 2 + 1:]))
    assert holed.missing_frames == 1 and holed.damaged_frames == 0 and holed.closed
    # A link that was made anew, and a box that was restarted.
    again = read("again.pbx", data + data)
    assert again.boot.tolist() == whole.boot.tolist() and again.sample.tolist() == whole.sample.tolist()
    assert again.missing_frames == 0 and again.closed
    two = read("two.pbx", data + of_another_boot(reader, data))
    assert two.damaged_frames == 0 and two.boot.tolist() == [0] * len(whole) + [1] * len(whole)
    assert two.sample.tolist() == 2 * whole.sample.tolist()


def check_link(reader, uri):
    """The bytes of a link, whose frames are short."""
    numbers, data, end = itertools.count(), b"", time.monotonic() + 3
    with socket.create_connection(("127.0.0.1", int(uri.rpartition(":")[2])), timeout=PATIENCE_S) as link:
        say = lambda kind, payload: link.sendall(frames.frame(kind, payload, next(numbers)))
        link.sendall(b"\0")
        say(frames.HELLO, frames.hello(bytes(16)))
        say(frames.START, frames.start(frames.FAST, frames.RECORD))
        while time.monotonic() < end:
            data += link.recv(65536)
            say(frames.CREDIT, frames.credit(frames.NO_LIMIT))
    data = data[: data.rfind(b"\0") + 1]
    kinds = [header["type"] for header, _ in reader.frames(data)]
    scan_ = reader.Recording(data)
    assert scan_.damaged_frames == scan_.missing_frames == scan_.baseless_frames == scan_.unreadable_blocks == 0
    assert kinds.count(frames.SHORT_SAMPLES) > kinds.count(frames.SAMPLES)
    assert len(scan_.heartbeats) == kinds.count(frames.HEARTBEAT) + kinds.count(frames.HEARTBEAT_CHANGE) > 10
    beat = scan_.heartbeats[-1]
    assert 0 < beat["sent_samples"] == int((scan_.sample < beat["position"]).sum())
    assert beat["lost_at_source"] + beat["lost_in_queue"] == sum(g["count"] for g in scan_.gaps if g["first"] < beat["position"])
    assert all(b["produced"] == b["sent_samples"] + b["lost_at_source"] + b["lost_in_queue"] for b in scan_.heartbeats)
    # Without anything that stands by itself nothing refers to what has come.
    at_rest = (frames.HEARTBEAT, frames.SAMPLES, frames.SAMPLES_HEAD)
    pieces = [piece for piece in data.split(b"\0") if piece and frames.read_frame(piece).kind not in at_rest]
    baseless = reader.Recording(b"\0".join(pieces) + b"\0")
    from_zeros = len(baseless.heartbeats)
    assert baseless.baseless_frames == kinds.count(frames.SHORT_SAMPLES) + kinds.count(frames.HEARTBEAT_CHANGE) - from_zeros
    assert baseless.baseless_frames > kinds.count(frames.SHORT_SAMPLES) and len(baseless) == baseless.unreadable_blocks == 0


def main(probeboxd, probebox, readers):
    sys.path.insert(0, readers)
    import probebox as reader

    with box(probeboxd) as (uri, folder):
        check_codings(probebox, reader.read, folder)
        check_refusal(probebox, reader.read, folder)
        path = recording(probebox, uri, folder)
        check_link(reader, uri)
        count = check_recording(probebox, reader.read, path, folder)
        check_damage(reader, path, folder)
        accept_a_delay(probebox, uri)
        check_tips(probebox, uri, reader.read, folder)
        print(f"{count} samples as `export` has them")


if __name__ == "__main__":
    try:
        import numpy
    except ImportError:
        if sys.executable == "/usr/bin/python3" or subprocess.run(["/usr/bin/python3", "-c", "import numpy"], capture_output=True).returncode:
            skip("no python3 has NumPy (apt-get install python3-numpy)")
        sys.exit(subprocess.run(["/usr/bin/python3", "-B", *sys.argv]).returncode)
    main(*sys.argv[1:])
