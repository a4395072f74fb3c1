"""A box gets its identity, once, through a connection that may, and keeps it through any end; and its factory sheet."""
import html
import json
import os
import subprocess
import sys
import tempfile

from box import Box, config
from connection import port_of

BOARD = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "board")


def unit(folder, name, **changes):
    """board/start/unit.toml for the emulated board."""
    with open(os.path.join(BOARD, "start", "unit.toml")) as file:
        text = file.read()
    for old, new in {"my board": "sim", **changes}.items():
        assert old in text, old
        text = text.replace(old, new)
    path = os.path.join(folder, name)
    with open(path, "w") as file:
        file.write(text)
    return path


def refused(box, status, *words):
    port = port_of(box.daemon, box.folder)
    done = subprocess.run([box.probebox, "-u", f"tcp:127.0.0.1:{port}", *words], capture_output=True, text=True)
    assert done.returncode == status, (done.returncode, done.stdout, done.stderr)
    return done.stderr


def usb_identity(box):
    command = [box.probeboxd, "--board", "sim", "--state", os.path.join(box.folder, "state"), "--usb-identity"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return dict(line.split(" ", 1) for line in said.splitlines())


def provisioned_once(probeboxd, probebox, folder):
    box = Box(probeboxd, probebox, folder)
    assert usb_identity(box)["serial_number"] == "SIM-0001"
    box.start()
    assert box.command("info")["unit"] is None
    assert "did you mean 'vendor'?" in refused(box, 2, "provision", unit(folder, "slip.toml", **{"vendor =": "vendr ="}))
    other = unit(folder, "other.toml", **{'"sim"': '"vm"'})
    assert "unit.board" in refused(box, 4, "provision", other)
    first = unit(folder, "unit.toml", **{"0x0001": "0x0042", "25.00018": "25.00005"})
    assert box.command("provision", first)["serial_number"] == "PB-000123"
    assert box.command("info")["unit"]["in_use"] is False
    box.kill()
    for end in (box.kill, box.stop):
        box.start()
        info = box.command("info")
        assert info["serial_number"] == "PB-000123", info
        assert info["unit"]["in_use"] is True and info["unit"]["model"] == "Probe box 1", info
        assert info["unit"]["sphere"]["next_due"] == "2028-04-17", info
        assert info["unit"]["notes"] == [], info
        again = refused(box, 4, "provision", unit(folder, "second.toml", **{"PB-000123": "PB-000124"}))
        assert "as PB-000123" in again and "as root" in again, again
        assert box.command("info")["unit"]["serial_number"] == "PB-000123"
        end()
    assert usb_identity(box) == {
        "vendor_id": "0x1209",
        "product_id": "0x0042",
        "manufacturer": "My company",
        "product": "Probe box 1",
        "serial_number": "PB-000123",
    }
    # A person at the box takes the identity away.
    os.unlink(os.path.join(folder, "state", "unit"))
    box.start()
    assert box.command("info")["unit"] is None
    box.stop()


def overdue_and_other_sphere(probeboxd, probebox, folder):
    box = Box(probeboxd, probebox, folder)
    box.start()
    others = {"2026-04-17": "2020-04-17", "2028-04-17": "2022-04-17", "25.00018": "25.0101"}
    box.command("provision", unit(folder, "unit.toml", **others))
    box.stop()
    box.start()
    status = box.command("status")["unit"]
    assert status["sphere"]["overdue"] is True, status
    assert len(status["notes"]) == 1 and "not traceable" in status["notes"][0], status
    box.stop()


def connection_without_the_right(probeboxd, probebox, folder):
    for value, allowed in (("false", False), ("true", True)):
        here = os.path.join(folder, value)
        os.mkdir(here)
        box = Box(probeboxd, probebox, here, config(here, service={"allow_provision": value}))
        box.start()
        if allowed:
            box.command("inhibit", "on", "--by", "Ada")
            assert "a cut is on" in refused(box, 4, "provision", unit(here, "unit.toml"))
            box.command("inhibit", "off", "--by", "Ada")
            box.command("provision", unit(here, "unit.toml"))
        else:
            assert "allow_provision" in refused(box, 4, "provision", unit(here, "unit.toml"))
        assert (box.command("info")["unit"] is not None) == allowed
        box.stop()


LINES = [
    *("identity", "sphere", "firmware", "usb-numbers", "update-key", "time-source", "inputs", "storage", "clock", "stamp-lateness"),
    *(f"line-{name}" for name in ("probe trigger", "tool setter", "index X", "index Y", "index Z", "skip")),
    *(f"encoder-position_{axis}" for axis in "xyz"),
    *("index-pulses", "controller", "edges", "samples", "late-ticks", "link", "memory", "sandbox", "exposure"),
]


def sheet_of(box, name, *words):
    """The sheet as JSON and as a page; the exit status says whether a line fails."""
    path = os.path.join(box.folder, name)
    port = port_of(box.daemon, box.folder)
    command = [box.probebox, "-u", f"tcp:127.0.0.1:{port}", "--json", "factory-test", "-o", path, "--for", "2", *words]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout, done.stderr
    sheet = json.loads(done.stdout)
    failed = [row["name"] for row in sheet["rows"] if row["verdict"] == "failed"]
    assert sheet["failed"] == len(failed) and done.returncode == (1 if failed else 0), (done.returncode, sheet)
    with open(path) as page:
        # A line's own name is its device, here one of this run.
        names = [row["name"].split("/")[0].rstrip("-") if row["name"].startswith("controller-") else row["name"] for row in sheet["rows"]]
        return dict(zip(names, sheet["rows"])), html.unescape(page.read())


def factory_sheet(probeboxd, probebox, folder):
    box = Box(probeboxd, probebox, folder)
    box.start()
    rows, page = sheet_of(box, "bare.html")
    assert list(rows) == LINES, rows
    assert rows["identity"]["verdict"] == "failed" and "not provisioned" in rows["identity"]["measured"], rows
    assert "FAILED" in page and rows["usb-numbers"]["verdict"] == "failed", rows
    box.command("inhibit", "on", "--by", "Ada")
    assert "a cut is on" in refused(box, 4, "factory-test", "-o", os.path.join(folder, "none.html"))
    assert not os.path.exists(os.path.join(folder, "none.html"))
    box.command("inhibit", "off", "--by", "Ada")
    none = os.path.join(folder, "none.html")
    assert "line-skip" in refused(box, 2, "factory-test", "-o", none, "--for", "1", "--undriven", "line-skipped")
    assert not os.path.exists(none)
    box.command("provision", unit(folder, "unit.toml", **{"25.00018": "25.00005"}))
    box.stop()
    box.start()
    rows, page = sheet_of(box, "sheet.html", "--by", "Ada", "--undriven", "line-skip")
    for name in ("identity", "sphere", "firmware", "time-source", "inputs", "storage", "clock", "stamp-lateness", "link", "memory"):
        assert rows[name]["verdict"] == "passed", rows[name]
    assert rows["usb-numbers"]["verdict"] == "failed", rows  # those for tests
    assert rows["exposure"]["verdict"] not in ("passed", "failed"), rows
    assert rows["update-key"]["verdict"] not in ("passed", "failed"), rows  # no image
    assert rows["line-skip"]["verdict"] not in ("passed", "failed"), rows
    assert rows["line-index X"]["verdict"] == rows["encoder-position_x"]["verdict"] == "failed", rows  # nothing moves
    for row in rows.values():
        assert row["measured"] in page.replace("\N{MICRO SIGN}", "u"), row  # a page has the sign, JSON the letter
    counted = int(rows["samples"]["measured"].split(": ")[1].split()[0])
    assert 3000 < counted < 6000, rows["samples"]  # 2 s at 2000 a second, on a crowded computer
    assert "PB-000123" in page and "Ada" in page
    box.stop()


if __name__ == "__main__":
    for trial in (provisioned_once, overdue_and_other_sphere, connection_without_the_right, factory_sheet):
        with tempfile.TemporaryDirectory() as folder:
            trial(*sys.argv[1:], folder)
