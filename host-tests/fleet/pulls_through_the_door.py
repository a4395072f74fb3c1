"""probebox-pull updates a box over a network: signed manifest, real command, real daemon behind a tls: link. The updater, which needs
root and a box that can restart, is played."""
import functools
import hashlib
import http.server
import os
import ssl
import subprocess
import threading

import shop

OPENSSL, CURL = shop.program("openssl", "openssl"), shop.program("curl", "curl")
KEYS = os.path.join(shop.ROOT, "tools", "keys")
PULL = os.path.join(shop.ROOT, "tools", "fleet", "probebox-pull")
RUNS, NEXT = "1.0", "2.0"


def write(path, content):
    with open(path, "wb") as file:
        file.write(content if isinstance(content, bytes) else content.encode())


def a_bundle():
    """Looks like one of RAUC from outside: a squashfs, a signature with a manifest, the size of that."""
    signature = f"0\x02\n[update]\ncompatible=probebox-sim\nversion={NEXT}\n\n[bundle]\n".encode()
    return b"hsqs" + os.urandom(2_000_000) + signature + len(signature).to_bytes(8, "big")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class Box:
    def __init__(self, folder):
        self.folder, self.port = folder, shop.free_port()
        for name in ("config", "reports", "box-state"):
            os.mkdir(f"{folder}/{name}")
        write(f"{folder}/confirmed", "")
        keys = f"{folder}/shop/boxes/PB-1"
        write(f"{folder}/config/service.toml",
              f'links = ["tls:127.0.0.1:{self.port}"]\n[access]\nallow_marker = true\nallow_homing = true\nallow_inhibit = true\n'
              f'[tls]\ncertificate = "{keys}/box.crt"\nkey = "{keys}/box.key"\npeople_ca = "{keys}/people.crt"\n'
              '[[person]]\nname = "updates"\nallow_update = true\n')
        self.report("idle", 0, RUNS)
        self.start()

    def start(self):
        self.daemon = shop.Process(f"{self.folder}/box.log", shop.PROBEBOXD, "--board", "sim", "--config", f"{self.folder}/config",
                                   "--state", f"{self.folder}/box-state", "--updater", f"{self.folder}/reports",
                                   "--confirmed", f"{self.folder}/confirmed",
                                   env={**os.environ, "PROBEBOX_RENDEZVOUS": self.folder})
        shop.until(lambda: shop.is_listening(self.port), "the door is open")

    def report(self, state, installation, running):
        write(f"{self.folder}/reports/state.new",
              f"state {state}\ninstallation {installation}\nversion {NEXT}\nrunning {running}\ntext as the updater says\n")
        os.rename(f"{self.folder}/reports/state.new", f"{self.folder}/reports/state")

    def install(self):
        """What updater and restart do with the bundle; returns that."""
        asked = f"{self.folder}/box-state/update"
        shop.until(lambda: os.path.exists(f"{asked}/request"), "the bundle is handed over")
        with open(f"{asked}/bundle", "rb") as file:
            bundle = file.read()
        with open(f"{asked}/request") as file:
            number = file.read().split()[0]
        os.unlink(f"{asked}/request")
        self.report("installing", number, RUNS)
        self.report("installed", number, RUNS)
        shop.until(lambda: os.path.exists(f"{asked}/restart"), "a restart is asked for")
        os.unlink(f"{asked}/restart")
        self.report("restarting", number, RUNS)
        self.daemon.end()
        self.start()
        self.report("done", number, NEXT)
        return bundle


def test(folder):
    def run(*words):
        subprocess.run(words, check=True, capture_output=True)

    for words in (["shop"], ["box", "PB-1", "localhost"], ["person", "updates"], ["person", "somebody"]):
        run(KEYS, "--in", f"{folder}/shop", *words)
    for name in ("web", "state", "cache", "bin"):
        os.mkdir(f"{folder}/{name}")
    os.symlink(shop.PROBEBOX, f"{folder}/bin/probebox")
    for name in ("server", "vendor"):
        shop.certificate(folder, name)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(f"{folder}/server.pem", f"{folder}/server.key")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=f"{folder}/web"))
    server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"https://localhost:{server.server_address[1]}"
    bundle = a_bundle()
    write(f"{folder}/web/2.0.raucb", bundle)
    write(f"{folder}/manifest", "probebox-manifest 1\nserial 1\nuntil 2999-12-31\n"
          f"ring office {NEXT} {address}/2.0.raucb {hashlib.sha256(bundle).hexdigest()}\n")
    run(OPENSSL, "cms", "-sign", "-nodetach", "-binary", "-in", f"{folder}/manifest", "-signer", f"{folder}/vendor.pem", "-inkey",
        f"{folder}/vendor.key", "-outform", "DER", "-out", f"{folder}/web/manifest.p7m")
    box = Box(folder)
    write(f"{folder}/pull.conf", f"manifest {address}/manifest.p7m\nkeyring {folder}/vendor.pem\nring office\nuri tls:localhost:{box.port}\n")

    def pull(person):
        environment = {"PATH": f"{folder}/bin:{os.environ['PATH']}", "STATE_DIRECTORY": f"{folder}/state", "CACHE_DIRECTORY": f"{folder}/cache",
                       "PROBEBOX_PULL_CA": f"{folder}/server.pem", "PROBEBOX_TLS": f"{folder}/shop/people/{person}"}
        return shop.Process(f"{folder}/pull-{person}.log", "sh", PULL, f"{folder}/pull.conf", env=environment)

    refused = pull("somebody")
    assert refused.popen.wait(shop.PATIENCE_S) == 1
    assert refused.said("allow_update") and refused.said("not-updated"), "a person without the right"
    assert not os.path.exists(f"{folder}/box-state/update/request")

    pulled = pull("updates")
    assert box.install() == bundle
    assert pulled.popen.wait(shop.PATIENCE_S) == 0
    assert pulled.said(f"the box runs {NEXT}")
    again = pull("updates")
    assert again.popen.wait(shop.PATIENCE_S) == 0 and again.said(f"the box runs {NEXT}"), "and is left alone"


shop.run(test)
