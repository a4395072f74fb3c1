#!/usr/bin/python3
"""probebox_master marks the step that the program has read, and no other. marker_test.py KIT"""
import sys

sys.dont_write_bytecode = True
from master_without_hal import component


class Box:
    """Registers of a box that waits for a step; a begin marker starts it."""

    def __init__(self, master):
        self.registers = [0] * 1000
        self.master, self.markers = master, []
        self.ask_for(run=7, number=3, kind=0)

    def ask_for(self, **values):
        values.setdefault("state", self.master.WAITS)
        for name, at, kind in self.master.STEP:
            if name in values:
                words = self.master.words_of(values[name], kind)
                self.registers[at:at + len(words)] = words

    def read(self, first, count):
        return self.registers[first:first + count]

    def write(self, first, words):
        self.registers[first:first + len(words)] = words
        if first == 144:
            self.markers.append((words[0] << 16 | words[1], words[2], words[3]))
            self.ask_for(state=self.master.RECORDS if words[3] == 0 else self.master.WAITS)


def asked(master, pins, what):
    """What the program gets for this request of probebox_ask.ngc."""
    pins["what"] = what
    work = master.request()
    while True:
        try:
            next(work)
        except StopIteration as done:
            return done.value


def main():
    module = component(sys.argv[1])
    box = Box(module)
    pins = dict.fromkeys(["what", "tool"] + ["value-%d" % k for k in range(1, 7)] + ["position-" + axis for axis in module.AXES]
                         + ["step-" + name for name, _, _ in module.STEP], 0)
    master = module.Master(box, pins)
    ask = lambda what: asked(master, pins, what)

    assert ask(12) == 0 and pins["step-number"] == 3
    assert ask(4) == 0 and box.markers == [(7, 3, 0)], box.markers
    assert ask(5) == 0 and box.markers[1:] == [(7, 3, 1)], box.markers

    # While the program goes there, another master gives the step up, starts another run, or the plan changes.
    for other in ({"number": 4}, {"run": 8}, {"kind": 6}):
        box.ask_for(run=7, number=3, kind=0)
        assert ask(12) == 0
        box.markers.clear()
        box.ask_for(**other)
        refusal = ask(4)
        assert refusal == 1003 and box.markers == [], (other, refusal, box.markers)
        assert ask(12) == 0 and ask(4) == 0 and len(box.markers) == 1, "it is asked for again, and done"
    print("ok")


main()
