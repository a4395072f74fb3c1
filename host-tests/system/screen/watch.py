"""`probebox watch` on a pseudo terminal, as pyte shows it. Usage: watch.py PROBEBOXD PROBEBOX. Status 77 without pyte."""
import fcntl
import os
import pathlib
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "readers"))
from captured import PATIENCE_S, box, skip, touching


class Terminal:
    """A command on a terminal of some size, and what it shows."""

    def __init__(self, command, rows=24, columns=80, **environment):
        self.screen = pyte.Screen(columns, rows)
        self.stream = pyte.ByteStream(self.screen)
        self.raw = b""
        self.master, slave = pty.openpty()
        self.resize(rows, columns)
        plain = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
        self.process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
                                        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
                                        env={**plain, "TERM": "linux", "LC_ALL": "C.UTF-8", **environment})
        os.close(slave)

    def resize(self, rows, columns):
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.screen.resize(rows, columns)

    def feed(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if not select.select([self.master], [], [], left)[0]:
                return
            try:
                data = os.read(self.master, 65536)
            except OSError:  # the other end is closed
                return
            self.raw += data
            self.stream.feed(data)

    def until(self, pattern):
        """The page once it shows this."""
        end = time.monotonic() + PATIENCE_S
        while not re.search(pattern, "\n".join(self.screen.display)):
            assert time.monotonic() < end and self.process.poll() is None, f"no {pattern}:\n" + "\n".join(self.screen.display)
            self.feed(0.1)
        return list(self.screen.display)

    def press(self, key):
        os.write(self.master, key.encode())

    def end(self):
        try:
            return self.process.wait(PATIENCE_S)
        finally:
            self.feed(0.1)
            os.close(self.master)


def place(page, pattern):
    """Where it is on the page."""
    for row, line in enumerate(page):
        if found := re.search(pattern, line):
            return row, found.start(), found.end()
    raise AssertionError(f"no {pattern}:\n" + "\n".join(page))


def check_machine_page(probebox, uri):
    """The verdict with its reason, alone by m, and beside the live page where there is room."""
    terminal = Terminal([probebox, "-u", uri, "watch"])
    terminal.until(r"May I cut\? +Check  \S")
    terminal.press("m")
    page = terminal.until(r"Machine(.|\n)*\[!!\] CHECK")
    place(page, r"q quit +space hold +m live")
    terminal.press("m")
    terminal.until("peaks of the last 10 s")
    terminal.resize(50, 200)
    os.killpg(terminal.process.pid, signal.SIGWINCH)
    both = terminal.until(r"(?m)^.{100,}\[!!\] CHECK")  # beside the live page
    place(both, "LIVE")
    place(both, r"sigma")
    terminal.press("q")
    assert terminal.end() == 0


def colours(screen):
    return {cell.fg for row in screen.buffer.values() for cell in row.values()} - {"default"}


def check_page(probebox, uri):
    terminal = Terminal([probebox, "-u", uri, "watch"])
    page = terminal.until(r"locked(.|\n)*screw good(.|\n)*Procedure +idle")
    for words in ("probebox +sim SIM-0001", "LIVE", "sigma", r"received \+ +\d+ lost +exact", r"X +[+-]\d+\.\d{4} mm", "Cut +none",
                  "Trigger", "Result +none", "Procedure", r"q quit +space hold", "peaks of the last 10 s"):
        place(page, words)
    assert sum("│" in line for line in page) == 3, "a bar for each deflection"
    first = place(page, r"X +[+-]\d+\.\d{4} mm")
    with touching(probebox, uri):
        moved = terminal.until(r"Trigger +\d+ +line \d+ +[\d.]+ s ago(.|\n)*step \d+ of \d+")
        assert place(moved, r"X +[+-]\d+\.\d{4} mm") == first, "a number has moved"
        assert any(re.search("[▂▃▄▅▆▇█]{2}", line) for line in moved), "a touch leaves no trace in the history"
        inhibit = subprocess.run([probebox, "-u", uri, "inhibit", "on", "--by", "Ada"], capture_output=True, text=True)
        assert inhibit.returncode == 0, inhibit.stderr
        place(terminal.until(r"Cut +ON .*Ada"), "Cut +ON")
        subprocess.run([probebox, "-u", uri, "inhibit", "off", "--by", "Ada"], check=True, capture_output=True)
        terminal.until(r"Cut +none")
        terminal.press(" ")
        held = terminal.until("HELD")
        terminal.feed(1)
        assert list(terminal.screen.display) == held, "a held picture moves"
        terminal.press(" ")
        terminal.until("LIVE")
    assert colours(terminal.screen), "a terminal with colours shows none"
    terminal.resize(40, 120)
    os.killpg(terminal.process.pid, signal.SIGWINCH)
    larger = terminal.until(r"(.*\n){39} q quit")
    assert place(larger, "LIVE")[2] > 110
    for rows, columns in ((24, 20), (10, 26)):
        terminal.resize(rows, columns)
        os.killpg(terminal.process.pid, signal.SIGWINCH)
        terminal.feed(0.5)
        assert terminal.process.poll() is None, f"{rows} rows of {columns} columns end it"
    terminal.resize(20, 70)
    os.killpg(terminal.process.pid, signal.SIGWINCH)
    terminal.until("too small: 80 columns and 24 rows")
    terminal.resize(24, 80)
    os.killpg(terminal.process.pid, signal.SIGWINCH)
    terminal.until("LIVE(.|\n)*q quit")
    terminal.press("q")
    assert terminal.end() == 0
    return page


def check_others(probebox, uri):
    plain = Terminal([probebox, "-u", uri, "watch"], NO_COLOR="1")
    plain.until("LIVE(.|\n)*Cut +none")
    assert not colours(plain.screen), f"NO_COLOR is set: {colours(plain.screen)}"
    os.killpg(plain.process.pid, signal.SIGINT)
    assert plain.end() == 130
    letters = Terminal([probebox, "-u", uri, "watch"], LC_ALL="C")
    page = letters.until("LIVE(.|\n)*Cut +none")
    assert all(ord(c) < 128 for line in page for c in line), "only ASCII was asked for"
    letters.press("q")
    assert letters.end() == 0
    for rows, columns, environment in ((20, 80, {}), (24, 79, {}), (24, 80, {"TERM": "dumb"})):
        small = Terminal([probebox, "-u", uri, "watch", "--for", "1"], rows, columns, **environment)
        small.until("clock locked")
        assert small.end() == 0 and b"\x1b[?1049h" not in small.raw and not any("LIVE" in l for l in small.screen.display)
    piped = subprocess.run([probebox, "-u", uri, "watch", "--for", "1"], capture_output=True, text=True)
    assert "\x1b" not in piped.stdout and piped.stdout.count("clock locked") >= 2


def check_lost_link(probeboxd, probebox):
    with box(probeboxd) as (uri, _):
        terminal = Terminal([probebox, "-u", uri, "watch", "--patience", "2"])
        terminal.until("LIVE(.|\n)*Cut +none")
    terminal.until("LINK LOST(.|\n)*waiting for")
    status = terminal.end()
    assert status == 3, f"status {status}"
    assert b"link was lost for good" in terminal.raw


def main(probeboxd, probebox):
    with box(probeboxd) as (uri, _):
        page = check_page(probebox, uri)
        check_machine_page(probebox, uri)
        check_others(probebox, uri)
    check_lost_link(probeboxd, probebox)
    print("\n".join(page))


if __name__ == "__main__":
    try:
        import pyte
    except ImportError:
        if sys.executable == "/usr/bin/python3" or subprocess.run(["/usr/bin/python3", "-c", "import pyte"], capture_output=True).returncode:
            skip("no python3 has pyte (apt-get install python3-pyte)")
        sys.exit(subprocess.run(["/usr/bin/python3", "-B", *sys.argv]).returncode)
    main(*sys.argv[1:])
