"""A box, a LinuxCNC and the line between them, for tests: everything in a folder that goes away with them."""
import json
import os
import pty
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import tty

PATIENCE_S = 120  # generous: the computer may be busy with other tests


def eventually(condition, what, patience_s=PATIENCE_S):
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError("never came: " + what)


class Cable:
    """Two serial ports with a cable between them; `connected` False keeps every byte from passing."""

    def __init__(self, folder, name):
        self.connected = True
        self.ports, self._ends, self._held = [], [], []
        for side in ("box", "cnc"):
            end, device = pty.openpty()
            for fd in (end, device):
                tty.setraw(fd)
            port = os.path.join(folder, name + "-" + side)
            os.symlink(os.ttyname(device), port)
            self.ports.append(port)
            self._ends.append(end)
            self._held.append(device)
            os.set_blocking(end, False)
        self._stop = False
        self._thread = threading.Thread(target=self._pump, daemon=True)
        self._thread.start()

    def _pump(self):
        while not self._stop:
            for end in select.select(self._ends, [], [], 0.1)[0]:
                try:
                    data = os.read(end, 4096)
                    if self.connected:
                        os.write(self._ends[1 - self._ends.index(end)], data)
                except OSError:
                    pass

    def close(self):
        self._stop = True
        self._thread.join()
        for fd in self._ends + self._held:
            os.close(fd)


class Room:
    def __init__(self, binaries, kit):
        self.folder = tempfile.mkdtemp(prefix="pb-")
        self.binaries = binaries
        self.kit = os.path.join(self.folder, "kit")
        shutil.copytree(kit, self.kit)
        self.processes, self.cables = {}, {}
        self.environment = dict(os.environ, HOME=self.folder, PATH="/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
                                XDG_RUNTIME_DIR=self.folder, PROBEBOX_RENDEZVOUS=os.path.join(self.folder, "rendezvous"))
        self.hal = None

    def cable(self, name):
        self.cables[name] = Cable(self.folder, name)
        return self.cables[name]

    def path(self, name):
        return os.path.join(self.folder, name)

    def start(self, name, command, cwd=None):
        log = open(self.path(name + ".log"), "ab")
        self.processes[name] = subprocess.Popen(command, cwd=cwd or self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                                stdout=log, stderr=log, start_new_session=True)
        return self.processes[name]

    def start_box(self, board, *more):
        self.start("box", [os.path.join(self.binaries, "probeboxd"), "--board", board, "--state", self.path("state"),
                           "--link", "tcp:127.0.0.1:7627"] + list(more))
        eventually(lambda: self.probebox("status").returncode == 0, "a box that answers")

    def corrections(self):
        """What the box corrects now: the whole answer."""
        return json.loads(self.probebox("--json", "corrections", "--count", "1").stdout)

    def kill_box(self):
        box = self.processes.pop("box")
        box.kill()
        box.wait()

    def probebox(self, *words):
        command = [os.path.join(self.binaries, "probebox"), "-u", "tcp:127.0.0.1:7627"] + list(words)
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=600)

    def edit(self, file, *changes):
        path = os.path.join(self.kit, file)
        text = open(path).read()
        for old, new in changes:
            assert old in text, "%s has no %r" % (file, old)
            text = text.replace(old, new)
        open(path, "w").write(text)

    def start_linuxcnc(self, ini):
        import hal
        import linuxcnc
        open(os.path.join(self.kit, "tool.tbl"), "a").close()
        self.start("linuxcnc", ["linuxcnc", "-r", ini], cwd=self.kit)

        def ready():
            assert self.processes["linuxcnc"].poll() is None, "LinuxCNC has ended: " + self.log("linuxcnc")
            # The display is started last. Whoever asks for the status before it is there never gets one.
            try:
                socket.create_connection(("127.0.0.1", 5007), 5).close()
                linuxcnc.stat().poll()
                return True
            except (linuxcnc.error, SystemError, OSError) as error:
                self.why = repr(error)
                return False

        os.environ["HOME"] = self.folder  # where LinuxCNC shares its tool table
        os.environ["INI_FILE_NAME"] = os.path.join(self.kit, ini)
        eventually(ready, "a LinuxCNC that answers")
        if self.hal is None:
            self.hal = hal.component("test%d" % os.getpid())
            self.hal.ready()
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()

    def pin(self, name):
        import hal
        return hal.get_value(name)

    def machine_on(self):
        import linuxcnc
        for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
            self.command.state(state)
            self.command.wait_complete(PATIENCE_S)
        eventually(lambda: self.polled().enabled, "a machine that is on")

    def machine_off(self):
        import linuxcnc
        self.command.state(linuxcnc.STATE_OFF)
        self.command.wait_complete(PATIENCE_S)

    def home(self):
        import linuxcnc
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete(PATIENCE_S)
        self.command.home(-1)
        eventually(lambda: self.pin("motion.is-all-homed"), "a machine that is homed")

    def polled(self):
        import linuxcnc

        def poll():
            try:
                self.status.poll()
                return True
            except (SystemError, linuxcnc.error):  # now and then, while LinuxCNC writes it
                return False

        eventually(poll, "a status of LinuxCNC")
        return self.status

    def stop_linuxcnc(self):
        """By its own shutdown; what does not end by that is ended."""
        if self.hal is not None:
            self.hal.exit()
            self.hal = None
        linuxcnc = self.processes.pop("linuxcnc", None)
        if linuxcnc is None:
            return
        try:
            with socket.create_connection(("127.0.0.1", 5007), 5) as shell:
                shell.sendall(b"hello EMC test 1\r\nset enable EMCTOO\r\nshutdown\r\n")
                linuxcnc.wait(60)
        except (OSError, subprocess.TimeoutExpired):
            os.killpg(linuxcnc.pid, signal.SIGTERM)
            linuxcnc.wait(60)

    def log(self, name):
        try:
            return open(self.path(name + ".log"), errors="replace").read()[-3000:]
        except FileNotFoundError:
            return ""

    def close(self):
        try:
            self.stop_linuxcnc()
        finally:
            for process in self.processes.values():
                process.kill()
                process.wait()
            for cable in self.cables.values():
                cable.close()
            shutil.rmtree(self.folder, ignore_errors=True)


def run(test, binaries, kit):
    """Runs test(room); prints the logs of a failure."""
    room = Room(binaries, kit)
    try:
        test(room)
    except BaseException:
        print(getattr(room, "why", ""))
        for name in ("box", "linuxcnc"):
            print("---- %s.log\n%s" % (name, room.log(name)))
        raise
    finally:
        room.close()
