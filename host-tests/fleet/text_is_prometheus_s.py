"""What is scraped, and what `probebox metrics` writes, as promtool and Prometheus' own Python parser read it."""
import os
import socket
import subprocess

import shop

PROMTOOL = shop.program("promtool", "prometheus")
try:
    from prometheus_client.parser import text_string_to_metric_families
except ImportError:
    shop.skip("python3-prometheus-client is not installed")


def check(text):
    done = subprocess.run([PROMTOOL, "check", "metrics"], input=text, capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr, done.stderr
    families = list(text_string_to_metric_families(text))
    series = [(sample.name, tuple(sorted(sample.labels.items()))) for family in families for sample in family.samples]
    assert len(series) == len(set(series)) and len({family.name for family in families}) == len(families)
    return {family.name: family for family in families}


def ask(box, text, wait_s=10):
    """First line of the answer; empty where the connection is closed without one."""
    with socket.create_connection(("127.0.0.1", box.metrics_port), timeout=wait_s) as one:
        try:
            one.sendall(text)
            return one.makefile("rb").readline().decode().strip()
        except ConnectionError:
            return ""


def serves_others_beside_bad_clients(box):
    assert ask(box, b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n") == "HTTP/1.1 200 OK"
    assert ask(box, b"HEAD /metrics?a=b HTTP/1.1\r\n\r\n") == "HTTP/1.1 200 OK"
    assert ask(box, b"GET / HTTP/1.1\r\n\r\n").split()[1] == "404"
    assert ask(box, b"GET\r\n\r\n").split()[1] == "404"
    assert ask(box, b"POST /metrics HTTP/1.1\r\n\r\n").split()[1] == "405"
    assert ask(box, b"\r\n\r\n").split()[1] == "405"
    assert ask(box, b"GET /metrics HTTP/1.1\r\nA: " + b"x" * 20_000) in ("HTTP/1.1 431 Request Header Fields Too Large", "")
    silent = [socket.create_connection(("127.0.0.1", box.metrics_port)) for _ in range(40)]
    shop.until(lambda: shop.value(box.scrape(), "probebox_up") == 1, "a scrape beside silent clients")
    # The last of them are closed after a while, whatever they say.
    silent[-1].settimeout(15)
    assert silent[-1].recv(1) == b""
    for one in silent:
        one.close()


def test(folder):
    rules = os.path.join(shop.ROOT, "tools", "fleet", "prometheus", "alerts.yml")
    done = subprocess.run([PROMTOOL, "check", "rules", rules], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    box = shop.Box(folder, 1)
    shop.until(lambda: shop.value(box.scrape(), "probebox_up") == 1, "a scrape")
    box.propose(shop.case("delay-known-sphere"))
    box.command("accept", "1", "--by", "Ada")
    families = check(shop.until(lambda: "probebox_result_value{" in (text := box.scrape()) and text, "the result in force"))
    assert families["probebox_clock_edges_accepted_edges"].type == "counter"
    info = families["probebox_info"].samples[0].labels
    assert info["serial_number"] == box.serial, info
    assert {sample.labels["source"] for sample in families["probebox_corrections_sources"].samples} == \
        {"screw", "swivel", "rotary", "centreline"}
    print(f"{sum(len(family.samples) for family in families.values())} series")

    serves_others_beside_bad_clients(box)

    written = os.path.join(folder, "box.prom")
    box.command("metrics", "-o", written)
    with open(written) as file:
        by_file = check(file.read())
    # What the program says of itself comes beside.
    assert by_file.keys() == families.keys(), by_file.keys() ^ families.keys()
    box.daemon.end(kill=True)
    away = subprocess.run([shop.PROBEBOX, "-u", box.uri, "metrics", "-o", written], capture_output=True, env=box.environment)
    assert away.returncode == 3
    with open(written) as file:
        assert shop.value(file.read(), "probebox_up") == 0
    assert sorted(os.listdir(folder)) == sorted({"box.prom", box.serial}), "nothing is left beside the file"


shop.run(test)
