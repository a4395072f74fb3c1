"""probebox-pull: signed manifests over HTTPS, rings, and what it does not take; `probebox` is played."""
import hashlib
import http.server
import os
import ssl
import subprocess
import threading

import shop

OPENSSL, CURL = shop.program("openssl", "openssl"), shop.program("curl", "curl")
VERSION = "1.4~deb12"  # of an image, as `probebox update` shows it
PULL = os.path.join(shop.ROOT, "tools", "fleet", "probebox-pull")


def openssl(*words):
    subprocess.run([OPENSSL, *words], check=True, capture_output=True)


def test(folder):
    web = os.path.join(folder, "web")
    for name in ("web", "state", "cache", "bin"):
        os.mkdir(os.path.join(folder, name))
    for name in ("server", "vendor", "stranger"):
        shop.certificate(folder, name)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(f"{folder}/server.pem", f"{folder}/server.key")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *words):
            super().__init__(*words, directory=web)

        def log_message(self, *_):
            pass

        def do_GET(self):
            if self.path != "/endless":
                return super().do_GET()
            self.protocol_version = "HTTP/1.1"
            self.send_response(200)
            self.send_header("Transfer-Encoding", "chunked")
            self.end_headers()
            try:
                while True:
                    self.wfile.write(b"100000\r\n" + bytes(1 << 20) + b"\r\n")
            except OSError:
                self.close_connection = True

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet)
    server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"https://localhost:{server.server_address[1]}"

    with open(f"{folder}/bin/probebox", "w") as file:
        file.write(f'#!/bin/sh\nstate="$(cat {folder}/ends)"\n'
                   f'if [ $# = 4 ]; then echo \'{{"state":"\'"$state"\'","version":"{VERSION}","running_version":"\'"$(cat {folder}/runs)"\'"}}\'; exit; fi\n'
                   f'cat "$5" >{folder}/taken\necho \'{{"state":"\'"$state"\'"}}\'\n'
                   f'[ "$state" != killed ] || {{ echo gone_back >{folder}/ends; kill -KILL $PPID; exit; }}\n'
                   f'[ "$state" = done ] || exit 1\necho "{VERSION}" >{folder}/runs\n')
    os.chmod(f"{folder}/bin/probebox", 0o755)
    bundle = b"a bundle, which the box checks itself"
    with open(f"{web}/1.4.raucb", "wb") as file:
        file.write(bundle)
    good = hashlib.sha256(bundle).hexdigest()

    def put(name, text):
        with open(os.path.join(folder, name), "w") as file:
            file.write(text)

    def publish(serial=1, until="2999-12-31", ring="office", sha256=good, url=address + "/1.4.raucb", key="vendor", head="probebox-manifest 1"):
        put("manifest", f"{head}\nserial {serial}\nuntil {until}\nring {ring} {VERSION} {url} {sha256}")  # without an end of the last line
        openssl("cms", "-sign", "-nodetach", "-binary", "-in", f"{folder}/manifest", "-signer", f"{folder}/{key}.pem", "-inkey",
                f"{folder}/{key}.key", "-outform", "DER", "-out", f"{web}/manifest.p7m")

    def pull(url=address + "/manifest.p7m"):
        put("pull.conf", f"# of a test\nmanifest {url}\nkeyring {folder}/vendor.pem\nring office\nuri tcp:box:7627")
        if os.path.exists(f"{folder}/taken"):
            os.unlink(f"{folder}/taken")
        environment = {"PATH": f"{folder}/bin:{os.environ['PATH']}", "STATE_DIRECTORY": f"{folder}/state",
                       "CACHE_DIRECTORY": f"{folder}/cache", "PROBEBOX_PULL_CA": f"{folder}/server.pem"}
        done = subprocess.run(["sh", PULL, f"{folder}/pull.conf"], capture_output=True, text=True, env=environment, timeout=60)
        refusal = done.stderr.strip().splitlines()[-1].split(":")[1].strip() if done.returncode > 0 else ""
        taken = os.path.exists(f"{folder}/taken")
        print(f"{done.returncode} {done.stdout.strip()}{done.stderr.strip()}")
        return refusal, taken

    def fresh():
        put("runs", "1.3~deb12\n")
        put("ends", "done\n")
        for name in ("manifest-serial", "gone-back", "handed-over"):
            if os.path.exists(f"{folder}/state/{name}"):
                os.unlink(f"{folder}/state/{name}")

    fresh()
    publish()
    assert pull() == ("", True)
    assert pull() == ("", False), "it runs already"
    fresh()
    publish(ring="shop")
    assert pull() == ("", False), "another ring's"
    for refusal, changes in {"not-signed": {"key": "stranger"}, "expired": {"until": "2020-01-31"}, "no-until": {"until": "soon"},
                             "no-serial": {"serial": "x"}, "unknown-manifest": {"head": "probebox-manifest 2"},
                             "hash-mismatch": {"sha256": "0" * 64}, "not-fetched": {"url": address + "/none.raucb"},
                             "not-https": {"url": "http" + address[5:] + "/1.4.raucb"}}.items():
        fresh()
        publish(**changes)
        assert pull() == (refusal, False), refusal
    fresh()
    publish(serial=7)
    assert pull() == ("", True)
    put("runs", "1.3~deb12\n")
    publish(serial=6)
    assert pull() == ("older", False)
    fresh()
    with open(f"{web}/manifest.p7m", "r+b") as file:
        file.seek(100)
        file.write(b"\xff\xff\xff")
    assert pull()[1] is False
    assert pull("http" + address[5:] + "/manifest.p7m") == ("not-https", False)
    # A version that was not healthy is not tried again by itself.
    fresh()
    publish()
    put("ends", "gone_back\n")
    assert pull() == ("not-updated", True)
    put("ends", "done\n")
    assert pull() == ("gone-back", False)
    # Nor where the restart of the box ends this program, until somebody says so.
    fresh()
    put("ends", "killed\n")
    assert pull() == ("", True)
    for _ in range(2):
        assert pull() == ("gone-back", False)
    os.unlink(f"{folder}/state/gone-back")
    assert pull() == ("not-updated", True), "tried again, and not healthy again"
    # An address that does not say how much comes, and does not end.
    assert pull(address + "/endless") == ("not-fetched", False)


shop.run(test)
