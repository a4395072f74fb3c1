"""`record --on-trigger`: the history, the trigger and what follows, as a recording that is whole.

Usage: on_trigger.py PROBEBOXD PROBEBOX
"""
import json
import subprocess
import sys

from captured import PATIENCE_S, box, table, touching


def main(probeboxd, probebox):
    with box(probeboxd) as (uri, folder):
        nothing = subprocess.run([probebox, "-u", uri, "record", "-o", str(folder / "none.pbx"), "--on-trigger", "--for", "1"],
                                 capture_output=True, text=True)
        assert nothing.returncode == 1 and "no trigger came" in nothing.stderr, nothing
        assert not (folder / "none.pbx").exists(), "an empty recording is left behind"

        recorder = subprocess.Popen([probebox, "--json", "-u", uri, "record", "-o", str(folder / "cut.pbx"), "--on-trigger", "--before", "1.5",
                                     "--after", "0.7"], stdout=subprocess.PIPE, text=True)
        # It has more than that behind it when the first touch comes, also on a busy computer.
        subprocess.run([probebox, "-u", uri, "watch", "--for", "5"], check=True, capture_output=True)
        with touching(probebox, uri):
            told = json.loads(recorder.communicate(timeout=PATIENCE_S)[0])
        assert told["balanced"] and told["end_known"] and told["received_triggers"] >= 1, told
        verified = subprocess.run([probebox, "verify", str(folder / "cut.pbx")], capture_output=True, text=True)
        assert verified.returncode == 0, verified.stdout + verified.stderr
        samples, triggers = table(probebox, folder / "cut.pbx", folder)
        assert len(samples) == told["received_samples"]
        at, first, last = (int(t) for t in (triggers[0]["at_ns"], samples[0]["time_ns"], samples[-1]["time_ns"]))
        before, after = (at - first) * 1e-9, (last - at) * 1e-9
        assert 1.5 <= before < 2.5, f"{before} s of history"
        assert 0.7 <= after < 1.7, f"{after} s after the trigger"

        # From a recording: the same trigger, with less around it.
        again = folder / "again.pbx"
        subprocess.run([probebox, "-u", f"file:{folder / 'cut.pbx'}", "record", "-o", str(again), "--on-trigger", "--before",
                        "0.3", "--after", "0.1"], check=True, capture_output=True)
        subprocess.run([probebox, "verify", str(again)], check=True, capture_output=True)
        less, same = table(probebox, again, folder)
        assert same[0] == triggers[0] and len(less) < len(samples)
        assert at - int(less[0]["time_ns"]) >= 300_000_000
        print(f"{before:.2f} s before and {after:.2f} s after trigger {triggers[0]['number']}, {len(samples)} samples")


def check_lost_link(probeboxd, probebox):
    """One trouble, by its name, when the box goes away before any trigger."""
    with box(probeboxd) as (uri, folder):
        waiting = subprocess.Popen([probebox, "-u", uri, "--json", "record", "-o", str(folder / "lost.pbx"), "--on-trigger", "--patience", "1"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        subprocess.run([probebox, "-u", uri, "watch", "--for", "3"], check=True, capture_output=True)
    said, _ = waiting.communicate()
    told = [json.loads(line) for line in said.splitlines()]
    assert waiting.returncode == 3 and [one.get("error") for one in told] == ["link-lost"], (waiting.returncode, said)


if __name__ == "__main__":
    main(*sys.argv[1:])
    check_lost_link(*sys.argv[1:])
