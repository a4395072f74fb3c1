"""A box that went back to the version before, after a newer one had changed the form of its store: it streams, serves
registers, leaves the file alone, and names the remedy. `newer_store.py PROBEBOXD PROBEBOX`; status 0 when all
holds. The newer version is played."""
import os
import sqlite3
import sys
import tempfile

from box import Box, until


def change(store, statements):
    changed = sqlite3.connect(store)
    changed.executescript(statements)
    changed.close()


def content(path):
    with open(path, "rb") as file:
        return file.read()


def serves(box):
    until(lambda: box.command("status")["clock"]["state"] == "locked")
    summary = box.command("record", "-o", os.path.join(box.folder, "scan.pbx"), "--force", "--for", "2")
    assert summary["balanced"] and summary["received_samples"] > 0, summary
    produced = box.master.values(116, "I")
    until(lambda: box.master.values(116, "I") != produced)


def says(box, *words):
    problems = box.command("status")["storage_problems"]
    assert len(problems) == 1 and all(word in problems[0] for word in words), problems


def delay_in_force(box):
    served = box.command("corrections")
    return served["tau_s"] if served["delay_calibrated"] else None


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="probebox-newer-") as scratch:
        box = Box(sys.argv[1], sys.argv[2], scratch, options=["--time-scale", "20"])
        store = os.path.join(scratch, "state", "results.db")
        try:
            box.start()
            serves(box)
            box.command("calibrate", "delay-multi-speed", "--accept", "--by", "Ada")
            until(lambda: delay_in_force(box) is not None)
            accepted = delay_in_force(box)
            box.stop()

            kept = content(store)
            change(store, "ALTER TABLE results ADD COLUMN later TEXT; PRAGMA user_version = 99")
            newer = content(store)
            box.start()
            serves(box)
            says(box, "another schema (99)", "install that version again")
            assert delay_in_force(box) is None
            box.stop()
            assert content(store) == newer, "the file of the newer version is left alone"
            print("it serves, and nothing is in force")

            with open(store, "wb") as file:
                file.write(kept)
            box.start()
            serves(box)
            until(lambda: delay_in_force(box) == accepted)
            assert box.command("status")["storage_problems"] == []
            box.stop()
            print("a backup in its place is a store as before")
        finally:
            if box.daemon and box.daemon.poll() is None:
                box.daemon.kill()
                print(box.log())
