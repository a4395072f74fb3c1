"""A recording of the emulated box with triggers in it."""
import contextlib
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

PATIENCE_S = 300
SKIPPED = 77


def port_of(daemon, rendezvous):
    path = os.path.join(rendezvous, f"{daemon.pid}.uri")
    end = time.monotonic() + PATIENCE_S
    while True:
        if os.path.exists(path):
            ports = [uri.rpartition(":")[2] for uri in pathlib.Path(path).read_text().split() if uri.startswith("tcp:")]
            if ports:
                return ports[0]
        assert daemon.poll() is None, "the daemon has ended"
        assert time.monotonic() < end, "the daemon does not say where it listens"
        time.sleep(0.05)


@contextlib.contextmanager
def box(probeboxd):
    """The URI of an emulated box, and a folder."""
    with tempfile.TemporaryDirectory(prefix="probebox-readers-") as folder:
        command = [probeboxd, "--board", "sim", "--state", folder + "/state", "--link", "tcp:127.0.0.1:0"]
        with open(folder + "/log", "w") as log:
            daemon = subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, "PROBEBOX_RENDEZVOUS": folder})
        try:
            yield "tcp:127.0.0.1:" + port_of(daemon, folder), pathlib.Path(folder)
        finally:
            daemon.send_signal(signal.SIGTERM)
            daemon.wait(PATIENCE_S)


def is_referenced(probebox, uri):
    shown = subprocess.run([probebox, "--json", "-u", uri, "corrections"], capture_output=True, text=True, timeout=PATIENCE_S)
    return shown.returncode == 0 and json.loads(shown.stdout)["referenced"]


@contextlib.contextmanager
def touching(probebox, uri):
    """A calibration runs meanwhile, whose touches are triggers at known places."""
    command = [probebox, "-u", uri, "calibrate", "delay-multi-speed"]
    end = time.monotonic() + PATIENCE_S
    while not is_referenced(probebox, uri):
        assert time.monotonic() < end, "the axes were not homed"
        time.sleep(0.1)
    while True:  # the box does not know at once when and where it is
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        time.sleep(1)
        if run.poll() is None:
            break
        assert time.monotonic() < end, run.stderr.read()
    try:
        yield
    finally:
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=PATIENCE_S)


def record(probebox, uri, path, *options):
    return subprocess.run([probebox, "--json", "-u", uri, "record", "-o", str(path), *options], check=True,
                          capture_output=True, text=True, timeout=PATIENCE_S).stdout


def recording(probebox, uri, folder):
    """With triggers, made once."""
    path = folder / "scan.pbx"
    with touching(probebox, uri):
        record(probebox, uri, folder / "first.pbx", "--on-trigger", "--before", "0", "--after", "0")
        record(probebox, uri, path, "--on-trigger", "--before", "0.5", "--after", "2")
    return path


def table(probebox, path, folder):
    """Rows of `export`, and its triggers, as dictionaries of text."""
    samples, triggers = folder / "samples.csv", folder / "triggers.csv"
    subprocess.run([probebox, "export", "--force", str(path), "-o", str(samples), "--triggers", str(triggers)], check=True,
                   capture_output=True)
    return [list(csv.DictReader(file.open())) for file in (samples, triggers)]


def skip(why):
    print("Skipped: " + why)
    sys.exit(SKIPPED)
