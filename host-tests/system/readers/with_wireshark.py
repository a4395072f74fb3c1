"""The generated dissector in tshark, on a capture that carries a recording and requests.

Usage: with_wireshark.py PROBEBOXD PROBEBOX READERS. Status 77 where tshark is not installed.
"""
import shutil
import socket
import struct
import subprocess
import sys

from captured import PATIENCE_S, box, recording, skip, table

HOST, BOX = 40000, 7627


def checksum_free_segment(source, target, sequence, data):
    """Ethernet, IPv4 and TCP around some bytes."""
    tcp = struct.pack("!HHIIBBHHH", source, target, sequence, 1, 5 << 4, 0x18, 65535, 0, 0) + data
    address = bytes([127, 0, 0, 1])
    ip = struct.pack("!BBHHHBBH", 0x45, 0, 20 + len(tcp), 0, 0, 64, 6, 0) + address + address
    return bytes(12) + b"\x08\x00" + ip + tcp


def capture(path, sent):
    """sent: (from the host, bytes). Segments of odd sizes, so that frames are cut anywhere."""
    sequences = {True: 1, False: 1}
    with open(path, "wb") as out:
        out.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1))
        time = 0
        for from_host, data in sent:
            for at in range(0, len(data), 1021):
                part = data[at : at + 1021]
                ports = (HOST, BOX) if from_host else (BOX, HOST)
                frame = checksum_free_segment(*ports, sequences[from_host], part)
                sequences[from_host] += len(part)
                time += 100
                out.write(struct.pack("<IIII", time // 1_000_000, time % 1_000_000, len(frame), len(frame)) + frame)


def talk(uri, probebox):
    """Both directions of a link on which `status` is asked."""
    heard = []
    listener = socket.create_server(("127.0.0.1", 0))
    command = subprocess.Popen([probebox, "-u", f"tcp:127.0.0.1:{listener.getsockname()[1]}", "status"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    host, _ = listener.accept()
    box_ = socket.create_connection(("127.0.0.1", int(uri.rpartition(":")[2])))
    host.settimeout(0.02)
    box_.settimeout(0.02)
    while command.poll() is None:
        for one, other, from_host in ((host, box_, True), (box_, host, False)):
            try:
                data = one.recv(65536)
            except TimeoutError:
                continue
            if data:
                heard.append((from_host, data))
                try:
                    other.sendall(data)
                except OSError:
                    pass
    return heard


def fields(tshark, script, path, wanted, *names):
    command = [tshark, "-X", "lua_script:" + script, "-r", str(path), "-Y", wanted, "-T", "fields", "-E", "occurrence=a",
               "-E", "separator=;", *(part for name in names for part in ("-e", name))]
    run = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert run.returncode == 0, run.stderr
    rows = [line.split(";") for line in run.stdout.splitlines()]
    return [[value for row in rows for value in row[k].split(",") if value] for k in range(len(names))]


def main(probeboxd, probebox, readers):
    tshark = shutil.which("tshark")
    if tshark is None:
        skip("tshark is not installed (apt-get install tshark)")
    script = readers + "/probebox.lua"
    with box(probeboxd) as (uri, folder):
        path = recording(probebox, uri, folder)
        samples, triggers = table(probebox, path, folder)
        data = path.read_bytes()
        capture(folder / "stream.pcap", [(False, data)])
        number, x_mm = fields(tshark, script, folder / "stream.pcap", "probebox.trigger.number", "probebox.trigger.number",
                              "probebox.trigger.position_mm")
        assert number == [row["number"] for row in triggers], number
        shown, exact = [float(x) for x in x_mm[::3]], [float(row["x_mm"]) for row in triggers]
        assert all(abs(a - b) < 1e-6 * abs(b) for a, b in zip(shown, exact, strict=True)), (shown, exact)
        first, count = fields(tshark, script, folder / "stream.pcap", "probebox.samples.first", "probebox.samples.first",
                              "probebox.samples.count")
        assert sum(map(int, count)) == len(samples) and int(first[0]) == int(samples[0]["sample"])
        accepted, = fields(tshark, script, folder / "stream.pcap", "probebox.heartbeat.edges.accepted_edges",
                           "probebox.heartbeat.edges.accepted_edges")
        assert len(accepted) >= 5 and int(accepted[-1]) > int(accepted[0])
        damaged = bytearray(data)
        damaged[len(data) // 2] ^= 1
        for name, bytes_, wrong in (("stream", data, False), ("damaged", bytes(damaged), True)):
            capture(folder / "seen.pcap", [(False, bytes_)])
            found, = fields(tshark, script, folder / "seen.pcap", "probebox.damaged or probebox.cut", "frame.number")
            assert bool(found) == wrong, f"{name}: {found}"

        capture(folder / "asked.pcap", talk(uri, probebox))
        asked, = fields(tshark, script, folder / "asked.pcap", "probebox.request.operation == 1", "probebox.request.operation")
        board, edges = fields(tshark, script, folder / "asked.pcap", "probebox.status_answer.board",
                              "probebox.status_answer.board", "probebox.status_answer.clock.state")
        assert asked and board[0] == "sim" and edges, (asked, board, edges)
        cut, = fields(tshark, script, folder / "asked.pcap", "probebox.cut or probebox.damaged", "frame.number")
        assert not cut, cut
        print(f"{len(number)} triggers, {len(count)} blocks and an answer dissected")


if __name__ == "__main__":
    main(*sys.argv[1:])
