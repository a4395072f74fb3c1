"""A daemon with the emulated machine and one serial line to a controller, and descriptions that differ from board/sim."""
import json
import os
import pty
import signal
import subprocess
import time
import tty

from connection import port_of
from master import Master

PATIENCE_S = 120


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.05)


def config(folder, faults=(), **changes):
    """A folder of board/sim's descriptions in which keys have other values: machine={"key": value}, world={..}."""
    board = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "board", "sim")
    made = os.path.join(folder, "config")
    os.mkdir(made)
    for name, values in changes.items():
        with open(os.path.join(board, name + ".toml")) as file:
            lines = file.read().splitlines()
        for key, value in values.items():
            changed = [i for i, line in enumerate(lines) if line.split("=")[0].strip() == key]
            assert changed, key
            for i in changed:
                lines[i] = f"{key} = {value}"
        if name == "world":
            for kind, at_s, lasts_s in faults:
                lines += ["[[fault]]", f'kind = "{kind}"', f"at_s = {at_s}", f"lasts_s = {lasts_s}"]
        with open(os.path.join(made, name + ".toml"), "w") as file:
            file.write("\n".join(lines) + "\n")
    return made


class Box:
    """The line outlives the daemon, and is a device that can be unplugged: a link to the one end of a pseudo terminal."""

    def __init__(self, probeboxd, probebox, folder, config=None, options=()):
        self.options = [*(["--config", config] if config else []), *options]
        self.probeboxd, self.probebox, self.folder = probeboxd, probebox, folder
        self.device = os.path.join(folder, "line")
        self.connection = "modbus:" + self.device
        self.ends = None
        self.master = Master(None)
        self.plug_in()
        self.daemon = None

    def plug_in(self):
        self.ends = pty.openpty()
        for end in self.ends:
            tty.setraw(end)
        os.symlink(os.ttyname(self.ends[1]), self.device + ".new")
        os.rename(self.device + ".new", self.device)
        self.master.line = self.ends[0]

    def unplug(self):
        os.unlink(self.device)
        for end in self.ends:
            os.close(end)
        self.master.line = None

    def start(self):
        command = [self.probeboxd, "--board", "sim", "--state", os.path.join(self.folder, "state")]
        command += ["--link", "tcp:127.0.0.1:0", "--cnc", self.connection] + self.options
        with open(os.path.join(self.folder, "log"), "a") as log:
            environment = {**os.environ, "PROBEBOX_RENDEZVOUS": self.folder}
            self.daemon = subprocess.Popen(command, stdout=log, stderr=log, env=environment)

    def kill(self):
        self.daemon.kill()
        self.daemon.wait(PATIENCE_S)

    def stop(self):
        self.daemon.send_signal(signal.SIGTERM)
        assert self.daemon.wait(PATIENCE_S) == 0, self.log()

    def log(self):
        with open(os.path.join(self.folder, "log")) as file:
            return file.read()

    def command(self, *words):
        port = port_of(self.daemon, self.folder)
        done = subprocess.run(
            [self.probebox, "-u", f"tcp:127.0.0.1:{port}", "--json", *words],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout.strip().splitlines()[-1])
