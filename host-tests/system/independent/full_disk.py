"""Disks that are full: a recording that finds no more room says so and can be read up to there, a box whose store finds
none refuses what it cannot keep; and samples flow on, all accounted for. `full_disk.py PROBEBOXD PROBEBOX`; status 0 when
all holds. A limit on the size of files stands for the disk."""
import json
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

from connection import port_of

PATIENCE_S = 240


def limited(size):
    """For the program that is started: no file of its grows beyond that."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


class Daemon:
    def __init__(self, probeboxd, folder, file_size=None):
        self.log = open(os.path.join(folder, "log"), "a")
        command = [probeboxd, "--board", "sim", "--time-scale", "20", "--state", os.path.join(folder, "state")]
        self.process = subprocess.Popen(
            command + ["--link", "tcp:127.0.0.1:0"],
            stdout=self.log,
            stderr=self.log,
            env={**os.environ, "PROBEBOX_RENDEZVOUS": folder},
            restore_signals=False,
            preexec_fn=limited(file_size) if file_size else None,
        )
        self.folder = folder

    def __enter__(self):
        return port_of(self.process, self.folder)

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(PATIENCE_S) == 0


class Command:
    def __init__(self, probebox, folder):
        self.probebox, self.folder, self.prefix = probebox, folder, []

    def run(self, *words, file_size=None):
        return subprocess.run(
            self.prefix + list(words),
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            restore_signals=False,
            preexec_fn=limited(file_size) if file_size else None,
        )

    def answer(self, *words, **named):
        done = self.run(*words, **named)
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout.strip().splitlines()[-1])

    def wait(self, port):
        self.prefix = [self.probebox, "-u", f"tcp:127.0.0.1:{port}", "--json"]
        end = time.monotonic() + PATIENCE_S
        while self.run("info").returncode != 0:
            assert time.monotonic() < end, "the box does not answer"
            time.sleep(0.1)
        while self.answer("status")["clock"]["state"] != "locked":
            assert time.monotonic() < end, "the clock does not lock"
            time.sleep(0.1)

    def exact_record(self, name):
        path = os.path.join(self.folder, name)
        summary = self.answer("record", "-o", path, "--for", "2")
        assert summary["balanced"] and summary["received_samples"] > 0, summary
        assert summary["produced_samples"] == summary["received_samples"] + summary["declared_lost_samples"], summary


def recording_on_a_full_disk(box):
    path = os.path.join(box.folder, "cut.pbx")
    done = box.run("record", "-o", path, "--for", "30", "--profile", "raw", file_size=100_000)
    assert done.returncode == 2 and "cut.pbx" in done.stdout and "the disk is full" in done.stdout, done.stdout + done.stderr
    assert 50_000 < os.path.getsize(path) <= 100_000
    found = json.loads(box.run("verify", path).stdout.strip().splitlines()[-1])
    assert found["frames"] > 10 and found["damaged_frames"] == 0, found
    box.exact_record("after.pbx")


def store_on_a_full_disk(probeboxd, folder, box):
    with Daemon(probeboxd, folder) as port:
        box.wait(port)
        box.answer("calibrate", "delay-multi-speed", "--accept", "--by", "Ada")
        accepted = delay_in_force(box)
    state = os.path.join(folder, "state")
    largest = max(os.path.getsize(os.path.join(at, name)) for at, _, names in os.walk(state) for name in names)
    with Daemon(probeboxd, folder, file_size=largest) as port:
        box.wait(port)
        done = box.run("calibrate", "delay-multi-speed", "--accept", "--by", "Ada")
        assert done.returncode == 1 and "not-stored" in done.stdout and "check the disk" in done.stdout, done.stdout
        assert delay_in_force(box) == accepted
        box.exact_record("meanwhile.pbx")
    with Daemon(probeboxd, folder) as port:
        box.wait(port)
        assert delay_in_force(box) == accepted, "what was accepted is in force"
        box.exact_record("again.pbx")


def box_that_starts_on_a_full_disk(probeboxd, folder, box):
    """Nothing can be made in its folder: it serves, and says what it cannot do."""
    os.mkdir(folder)
    with Daemon(probeboxd, folder, file_size=100) as port:
        box.wait(port)
        problems = box.answer("status")["storage_problems"]
        assert any("results.db" in problem for problem in problems), problems
        box.exact_record("on-a-full-disk.pbx")
        done = box.run("calibrate", "delay-multi-speed", "--accept", "--by", "Ada")
        # The limit that plays the full disk here also bounds the file in memory through which the solver gets its case.
        named = "nothing can be stored" in done.stdout or "got no memory to begin" in done.stdout
        assert done.returncode == 1 and named, done.stdout
        assert not box.answer("corrections")["delay_calibrated"]


def box_with_a_damaged_result(probeboxd, folder, box):
    """A number that the disk has turned into another one is not in force, and is named."""
    store = sqlite3.connect(os.path.join(folder, "state", "results.db"))
    changed = store.execute("UPDATE results SET result_json = replace(result_json, '1', '2') WHERE state = 2")
    assert changed.rowcount == 1
    store.commit()
    store.close()
    with Daemon(probeboxd, folder) as port:
        box.wait(port)
        problems = box.answer("status")["storage_problems"]
        assert any("about delay is damaged" in problem for problem in problems), problems
        assert not box.answer("corrections")["delay_calibrated"]
        box.answer("calibrate", "delay-multi-speed", "--accept", "--by", "Ada")
        delay_in_force(box)
        assert box.answer("status")["storage_problems"] == []


def delay_in_force(box):
    """Told to the core a moment after the start."""
    end = time.monotonic() + PATIENCE_S
    while not (served := box.answer("corrections"))["delay_calibrated"]:
        assert time.monotonic() < end, "no delay is in force"
        time.sleep(0.1)
    return served["tau_s"]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-disk-") as scratch:
        command = Command(sys.argv[2], scratch)
        with Daemon(sys.argv[1], scratch) as port:
            command.wait(port)
            recording_on_a_full_disk(command)
        print("a recording on a full disk can be read up to there")
        store_on_a_full_disk(sys.argv[1], scratch, command)
        print("a store on a full disk loses nothing that was accepted")
        box_with_a_damaged_result(sys.argv[1], scratch, command)
        print("a damaged result is named, and a new one takes its place")
        box_that_starts_on_a_full_disk(sys.argv[1], os.path.join(scratch, "full"), command)
        print("a box that starts on a full disk serves samples and says that it keeps nothing")
