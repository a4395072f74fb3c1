"""probebox-pull: signed manifests over HTTPS, rings, and what it does not take; `probebox` is played."""
import hashlib
import http.server
import os
import ssl
import subprocess
import threading

import shop

OPENSSL, CURL = shop.program("openssl", "openssl"), shop.program("curl", "curl")
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

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet)
    server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"https://localhost:{server.server_address[1]}"

    with open(f"{folder}/bin/probebox", "w") as file:
        file.write(f'#!/bin/sh\nif [ $# = 4 ]; then echo \'{{"running_version":"\'"$(cat {folder}/runs)"\'"}}\'; exit; fi\n'
                   f'cat "$5" >{folder}/taken\necho \'{{"state":"\'"$(cat {folder}/ends)"\'"}}\'\n'
                   f'[ "$(cat {folder}/ends)" = done ] || exit 1\necho 1.4 >{folder}/runs\n')
    os.chmod(f"{folder}/bin/probebox", 0o755)
    bundle = b"a bundle, which the box checks itself"
    with open(f"{web}/1.4.raucb", "wb") as file:
        file.write(bundle)
    good = hashlib.sha256(bundle).hexdigest()

    def put(name, text):
        with open(os.path.join(folder, name), "w") as file:
            file.write(text)

    def publish(serial=1, until="2999-12-31", ring="office", sha256=good, url=address + "/1.4.raucb", key="vendor", head="probebox-manifest 1"):
        put("manifest", f"{head}\nserial {serial}\nuntil {until}\nring {ring} 1.4 {url} {sha256}\n")
        openssl("cms", "-sign", "-nodetach", "-binary", "-in", f"{folder}/manifest", "-signer", f"{folder}/{key}.pem", "-inkey",
                f"{folder}/{key}.key", "-outform", "DER", "-out", f"{web}/manifest.p7m")

    def pull(url=address + "/manifest.p7m"):
        put("pull.conf", f"# of a test\nmanifest {url}\nkeyring {folder}/vendor.pem\nring office\nuri tcp:box:7627\n")
        if os.path.exists(f"{folder}/taken"):
            os.unlink(f"{folder}/taken")
        environment = {"PATH": f"{folder}/bin:{os.environ['PATH']}", "STATE_DIRECTORY": f"{folder}/state",
                       "CACHE_DIRECTORY": f"{folder}/cache", "PROBEBOX_PULL_CA": f"{folder}/server.pem"}
        done = subprocess.run(["sh", PULL, f"{folder}/pull.conf"], capture_output=True, text=True, env=environment, timeout=60)
        refusal = done.stderr.strip().splitlines()[-1].split(":")[1].strip() if done.returncode else ""
        taken = os.path.exists(f"{folder}/taken")
        print(f"{done.returncode} {done.stdout.strip()}{done.stderr.strip()}")
        return refusal, taken

    def fresh():
        put("runs", "1.3\n")
        put("ends", "done\n")
        for name in ("manifest-serial", "gone-back"):
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
    put("runs", "1.3\n")
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


shop.run(test)
