"""Where a daemon listens that was given port 0: a port chosen beforehand may be somebody else's by the time it starts."""
import os
import time

PATIENCE_S = 120


def port_of(daemon, rendezvous):
    """Waits for the daemon to announce itself, one URI a line."""
    path = os.path.join(rendezvous, f"{daemon.pid}.uri")
    end = time.monotonic() + PATIENCE_S
    while True:
        if os.path.exists(path):
            with open(path) as announced:
                ports = [int(uri.rpartition(":")[2]) for uri in announced.read().split() if uri.startswith("tcp:")]
            if ports:
                return ports[0]
        assert daemon.poll() is None, "the daemon has ended"
        assert time.monotonic() < end, "the daemon does not say where it listens"
        time.sleep(0.05)
