"""A shop of emulated boxes, each with its probebox-fleet, and a broker: processes of this test on free ports."""
import json
import os
import random
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request

PATIENCE_S = 120
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PROBEBOXD, PROBEBOX, FLEET = sys.argv[1:4]


def skip(why):
    print(f"Skipped: {why}")
    sys.exit(77)


def program(name, package):
    """Its path; skips the test where it is not installed."""
    found = shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
    return found or skip(f"{name} is not installed: apt-get install {package}")


def until(condition, what, last_seen=lambda: ""):
    end = time.monotonic() + PATIENCE_S
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < end, f"not within {PATIENCE_S} s: {what} {last_seen()}"
        time.sleep(0.1)


def free_port(given=set()):
    """Below the ports that the kernel gives to connections, so that none takes it before the process that is to listen there."""
    while True:
        port = random.randrange(20_000, 32_768)
        with socket.socket() as one:
            if port not in given and one.connect_ex(("127.0.0.1", port)) != 0:
                given.add(port)
                return port


def is_listening(port):
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


class Process:
    """Ended by its number when the test ends."""
    all = []

    def __init__(self, log, *command, **options):
        self.log = log
        with open(log, "a") as file:
            self.popen = subprocess.Popen(command, stdout=file, stderr=file, **options)
        Process.all.append(self)

    def end(self, kill=False):
        if self.popen.poll() is None:
            (self.popen.kill if kill else self.popen.terminate)()
        self.popen.wait(PATIENCE_S)

    def said(self, pattern):
        with open(self.log) as file:
            return re.findall(pattern, file.read())


def certificate(folder, name):
    """FOLDER/NAME.pem and .key, signed by itself, for localhost."""
    subprocess.run([program("openssl", "openssl"), "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "30", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost", "-keyout", f"{folder}/{name}.key", "-out", f"{folder}/{name}.pem"],
                   check=True, capture_output=True)


class Broker:
    """At `port` for all of this computer, at `tls_port` for who has a certificate: see tls_options()."""

    def __init__(self, folder):
        if b"without MQTT" in subprocess.run([FLEET, "--version"], capture_output=True, check=True).stdout:
            skip("probebox-fleet was built without MQTT: apt-get install libmosquitto-dev, and configure again")
        self.mosquitto = program("mosquitto", "mosquitto")
        self.port, self.tls_port, self.folder = free_port(), free_port(), folder
        for name in ("broker", "box", "stranger"):
            certificate(folder, name)
        self.config = os.path.join(folder, "mosquitto.conf")
        with open(self.config, "w") as file:
            # Of a subscriber that is away it keeps what comes, also over its own end.
            file.write(f"listener {self.port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n"
                       f"listener {self.tls_port} 127.0.0.1\ncafile {folder}/box.pem\ncertfile {folder}/broker.pem\n"
                       f"keyfile {folder}/broker.key\nrequire_certificate true\n"
                       f"persistence true\npersistence_location {folder}/\nuser root\nautosave_interval 1\n")
        self.start()

    def start(self):
        self.process = Process(os.path.join(self.folder, "mosquitto.log"), self.mosquitto, "-c", self.config)
        until(lambda: is_listening(self.port), "the broker")

    def tls_options(self, who="box"):
        files = {"--ca": "broker.pem", "--certificate": who + ".pem", "--key": who + ".key"}
        return ["--mqtt", f"localhost:{self.tls_port}", *(word for key, file in files.items() for word in (key, f"{self.folder}/{file}"))]

    def end(self):
        self.process.end()


class Subscriber:
    """Everything that came, in its order: (topic, document)."""

    def __init__(self, folder, broker):
        self.log = os.path.join(folder, "subscriber.log")
        self.process = Process(self.log, program("mosquitto_sub", "mosquitto-clients"), "-h", "127.0.0.1", "-p", str(broker.port),
                               "-i", "subscriber", "-c", "-q", "1", "-t", "probebox/v1/#", "-v")

    def messages(self):
        with open(self.log) as file:
            lines = [line for line in file if line.startswith("probebox/v1/") and line.endswith("\n")]
        return [(topic, json.loads(text)) for topic, text in (line.split(" ", 1) for line in lines)]

    def of(self, kind):
        return [(topic, document) for topic, document in self.messages() if f"/{kind}/" in topic]


class Box:
    """A box of its own serial number, whose machine is slower than real time: many share this computer."""
    time_scale = 0.25

    def __init__(self, folder, number, *fleet_options):
        self.serial = f"SHOP-{number:03}"
        self.folder = os.path.join(folder, self.serial)
        config = os.path.join(self.folder, "config")
        os.makedirs(config)
        os.mkdir(os.path.join(self.folder, "fleet"))
        with open(os.path.join(ROOT, "board", "sim", "box.toml")) as file:
            text, count = re.subn(r'(?m)^serial_number *= *"[^"]*"', f'serial_number = "{self.serial}"', file.read())
        assert count == 1
        with open(os.path.join(config, "box.toml"), "w") as file:
            file.write(text)
        self.environment = {**os.environ, "PROBEBOX_RENDEZVOUS": self.folder}
        self.port, self.metrics_port, self.fleet_options = free_port(), free_port(), fleet_options
        self.uri = f"tcp:127.0.0.1:{self.port}"
        self.start_box()
        self.start_fleet()

    def start_box(self):
        self.daemon = Process(os.path.join(self.folder, "box.log"), PROBEBOXD, "--board", "sim", "--config",
                              os.path.join(self.folder, "config"), "--state", os.path.join(self.folder, "state"), "--link", self.uri,
                              "--time-scale", str(self.time_scale), env=self.environment)

    def start_fleet(self):
        self.fleet = Process(os.path.join(self.folder, "fleet.log"), FLEET, "-u", self.uri, "--listen", f"127.0.0.1:{self.metrics_port}",
                             *self.fleet_options, *(["--state", os.path.join(self.folder, "fleet")] if self.fleet_options else []),
                             env=self.environment)

    def command(self, *words):
        done = subprocess.run([PROBEBOX, "-u", self.uri, "--json", *words], capture_output=True, text=True, env=self.environment,
                              timeout=PATIENCE_S)
        assert done.returncode == 0, (words, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def answers(self):
        done = subprocess.run([PROBEBOX, "-u", self.uri, "--json", "status"], capture_output=True, env=self.environment,
                              timeout=PATIENCE_S)
        return done.returncode == 0

    def propose(self, case):
        return self.command("propose", case, "--as-this-machine", "--by", "Ada")

    def history(self):
        return [each for each in self.command("history") if "number" in each]

    def scrape(self):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics_port}/metrics", timeout=10) as answer:
                assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
                return answer.read().decode()
        except (OSError, urllib.error.URLError):
            return ""


class Prometheus:
    """Scrapes boxes, by the rules of a file."""

    def __init__(self, folder, boxes, rules, interval_s):
        self.port = free_port()
        config = os.path.join(folder, "prometheus.yml")
        every = f"{interval_s}s"
        with open(config, "w") as file:
            json.dump({"global": {"scrape_interval": every, "evaluation_interval": every}, "rule_files": [rules], "scrape_configs": [
                {"job_name": "probebox", "static_configs": [{"targets": [f"127.0.0.1:{box.metrics_port}" for box in boxes]}]}]}, file)
        self.process = Process(os.path.join(folder, "prometheus.log"), program("prometheus", "prometheus"), f"--config.file={config}",
                               f"--storage.tsdb.path={folder}/tsdb", f"--web.listen-address=127.0.0.1:{self.port}", "--log.level=warn")

    def query(self, expression):
        """Values by instance; empty while the server does not answer."""
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/api/v1/query?query=" + urllib.parse.quote(expression)) as answer:
                return {each["metric"].get("instance", ""): float(each["value"][1]) for each in json.load(answer)["data"]["result"]}
        except OSError:
            return {}


def case(name):
    return os.path.join(ROOT, "host-tests", "unit", "report", "cases", name)


def value(text, series):
    """Of a scraped text; None where it is not in it."""
    found = re.search(r"(?m)^" + re.escape(series) + r" (\S+)$", text)
    return float(found.group(1)) if found else None


def run(test):
    with tempfile.TemporaryDirectory(prefix="probebox-fleet-") as folder:
        try:
            test(folder)
        except BaseException:
            for path, _, names in os.walk(folder):
                for name in names:
                    if name.endswith(".log") and name != "subscriber.log":
                        with open(os.path.join(path, name), errors="replace") as file:
                            print(f"--- {os.path.join(path, name)}\n{file.read()[-2000:]}")
            raise
        finally:
            for process in reversed(Process.all):
                process.end(kill=True)
