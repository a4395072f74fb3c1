"""A hall of fifty boxes (or PROBEBOX_BOXES) with a broker, Prometheus and PostgreSQL on this one computer: all are seen; while the broker
is away a box is killed and every box gets a new result, which on three machines has drifted; each result and each entry arrives once,
and exactly the three raise an alert. Prints what a box costs."""
import concurrent.futures
import csv
import os
import re
import shutil
import subprocess
import time

import database
import shop

BOXES = int(os.environ.get("PROBEBOX_BOXES", "50"))
DRIFTING = (BOXES // 7, BOXES // 2, BOXES - 1)
DRIFT_U, USUAL_U = 8, 2  # how far the second result is from the first, in combined standard uncertainties; the rule asks for 4 sqrt 2
SCRAPE_S, APART_S = 15, 120  # between scrapes; between the two times that the rule for moved results compares, here
COST_S = 60
shop.PATIENCE_S = 900
shop.Box.time_scale = 0.02
MOVED = 'ALERTS{alertname="ProbeboxResultMoved"}'
TAU = '{subject="delay",key="tau_s"}'


def on_all(boxes, act):
    """A few at a time: this computer runs the boxes too."""
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        return list(pool.map(act, boxes))


def later(case, by_s, folder):
    """The case with a probe whose stamps are later."""
    moved = os.path.join(folder, f"later-{by_s:.7f}")
    if not os.path.exists(moved):
        shutil.copytree(case, moved)
        with open(os.path.join(case, "probe.csv")) as file:
            rows = list(csv.reader(file))
        at = rows[0].index("t_s")
        for row in rows[1:]:
            row[at] = f"{float(row[at]) + by_s:.12f}"
        with open(os.path.join(moved, "probe.csv"), "w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    return moved


def prometheus(folder, boxes):
    """Scrapes them; the rule for moved results compares with APART_S before instead of a day."""
    with open(os.path.join(shop.ROOT, "tools", "fleet", "prometheus", "alerts.yml")) as file:
        rules, count = re.subn(r"offset 1d", f"offset {APART_S}s", file.read())
    assert count == 2
    path = os.path.join(folder, "rules.yml")
    with open(path, "w") as file:
        file.write(rules)
    return shop.Prometheus(folder, boxes, path, SCRAPE_S)


def cost(processes):
    """Processor time in s, memory in bytes, of processes and their children."""
    ticks = pages = 0
    parents = {}
    for number in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{number}/stat") as file:
                fields = file.read().rsplit(")", 1)[1].split()
            with open(f"/proc/{number}/statm") as file:
                parents[int(number)] = (int(fields[1]), int(fields[11]) + int(fields[12]), int(file.read().split()[1]))
        except (OSError, IndexError):
            pass
    wanted = {process.popen.pid for process in processes}
    while True:
        more = {number for number, (parent, _, _) in parents.items() if parent in wanted} - wanted
        if not more:
            break
        wanted |= more
    for number in wanted & parents.keys():
        ticks += parents[number][1]
        pages += parents[number][2]
    return ticks / os.sysconf("SC_CLK_TCK"), pages * os.sysconf("SC_PAGE_SIZE")


def print_costs(groups):
    before = {name: cost(processes)[0] for name, processes in groups.items()}
    began = time.monotonic()
    time.sleep(COST_S)
    took = time.monotonic() - began
    for name, processes in groups.items():
        seconds, memory = cost(processes)
        print(f"{name}: {100 * (seconds - before[name]) / took / len(processes):.2f} % of a core, {memory / len(processes) / 1e6:.0f} MB each")


def test(folder):
    with database.Database() as tables:
        broker = shop.Broker(folder)
        subscriber = shop.Subscriber(folder, broker)
        fill = tables.fill(folder, broker)
        boxes = [shop.Box(folder, k, *broker.tls_options()) for k in range(BOXES)]
        server = prometheus(folder, boxes)
        drifting = {f"127.0.0.1:{boxes[k].metrics_port}" for k in DRIFTING}
        shop.until(lambda: len(server.query("probebox_up == 1")) == BOXES, "all boxes seen")
        case = shop.case("delay-known-sphere")

        def take(box, case, *although):
            box.propose(case)
            box.command("accept", str(max(each["id"] for each in box.history())), "--by", "Grace", *although)

        def take_next(box):
            if boxes.index(box) in DRIFTING:
                take(box, later(case, DRIFT_U * u_s, folder), "--although-it-differs")  # the box itself asks
            else:
                take(box, later(case, USUAL_U * u_s, folder))

        on_all(boxes, lambda box: take(box, case))
        shop.until(lambda: len(server.query(f"probebox_result_value{TAU}")) == BOXES, "the first results")
        u_s = server.query(f"probebox_result_u{TAU}").popitem()[1]
        print_costs({"box at rest, its machine at 1/50 of real time": [box.daemon for box in boxes],
                     "probebox-fleet of a box": [box.fleet for box in boxes], "broker": [broker.process], "prometheus": [server.process],
                     "PostgreSQL": [tables.process], "fill": [fill]})
        time.sleep(APART_S)  # for the rule to see the first results at both times

        broker.end()
        boxes[0].daemon.end(kill=True)
        on_all(boxes[1:], take_next)
        boxes[0].start_box()
        shop.until(boxes[0].answers, "the killed box is back")
        take_next(boxes[0])
        broker.start()

        histories = dict(zip([box.serial for box in boxes], on_all(boxes, shop.Box.history)))
        entries = {(serial, each["number"]) for serial, history in histories.items() for each in history}
        results = {(serial, each["id"]) for serial, history in histories.items() for each in history}
        shop.until(lambda: set(tables.select("SELECT serial_number, number FROM history")) == entries, "all entries in the table")
        shop.until(lambda: set(tables.select("SELECT serial_number, id FROM result")) == results, "all results in the table")
        for kind, expected in (("history", entries), ("result", results)):
            unmarked = [topic for topic, document in subscriber.of(kind) if not document["again"]]
            assert len(unmarked) == len(set(unmarked)), f"{kind} came twice unmarked"
            came = {tuple(topic.split("/")[2::2]) for topic, _ in subscriber.of(kind)}
            assert came == {(serial, str(number)) for serial, number in expected}, kind

        shop.until(lambda: server.query(f'{MOVED} == 1').keys() == drifting, "an alert for each machine that has drifted")
        time.sleep(APART_S + 2 * SCRAPE_S)
        ever = server.query(f"max_over_time({MOVED}[1h])").keys()
        assert ever == drifting, f"{len(ever)} machines raised it"
        # Information is there: nobody has measured the centrelines that machine.toml requires.
        others = 'max_over_time(ALERTS{alertstate="firing",alertname!="ProbeboxResultMoved",severity!="info"}[1h])'
        assert not server.query(others), "another alert"
        series = int(server.query('count({__name__=~"probebox_.+"})')[""])
        print(f"{BOXES} boxes, {series} series: {len(entries)} entries and {len(results)} results came once; {len(ever)} alerts")


shop.run(test)
