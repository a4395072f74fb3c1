"""PostgreSQL is filled from MQTT: each result has one row, although the program that fills is killed and messages come again."""
import os
import pwd
import shutil
import subprocess
import tempfile

import shop

PSQL = shop.program("psql", "postgresql")
try:
    import paho.mqtt.client  # noqa: F401
    import psycopg2
except ImportError as missing:
    shop.skip(f"{missing.name} is not installed: apt-get install python3-paho-mqtt python3-psycopg2")
VERSIONS = "/usr/lib/postgresql"
if not os.path.isdir(VERSIONS):
    shop.skip("postgresql is not installed")
BIN = os.path.join(VERSIONS, max(os.listdir(VERSIONS), key=int), "bin")
TABLES = os.path.join(shop.ROOT, "tools", "fleet", "postgresql")


def own_server(folder):
    """A cluster of this test's own, without a port; PostgreSQL refuses to be root."""
    as_user = {"user": "postgres"} if os.geteuid() == 0 else {}
    if as_user:
        os.chown(folder, pwd.getpwnam("postgres").pw_uid, -1)
    data = os.path.join(folder, "data")
    subprocess.run([os.path.join(BIN, "initdb"), "-D", data, "-A", "trust", "-U", "test", "--no-sync"], check=True, capture_output=True,
                   cwd=folder, **as_user)
    shop.Process(os.path.join(folder, "postgres.log"), os.path.join(BIN, "postgres"), "-D", data, "-k", folder, "-c", "listen_addresses=",
                 cwd=folder, **as_user)
    database = f"host={folder} user=test dbname=postgres"

    def is_up():
        try:
            psycopg2.connect(database).close()
            return True
        except psycopg2.OperationalError:
            return False

    shop.until(is_up, "the database")
    return database


def test(folder):
    with tempfile.TemporaryDirectory(prefix="probebox-pg-") as short:  # a socket's path is short
        try:
            fill_and_query(folder, own_server(short))
        finally:
            for process in reversed(shop.Process.all):
                process.end()


def fill_and_query(folder, database):
    subprocess.run([PSQL, "-q", "-v", "ON_ERROR_STOP=1", database, "-f", os.path.join(TABLES, "schema.sql")], check=True)
    rows = psycopg2.connect(database)
    rows.autocommit = True

    def select(query):
        with rows.cursor() as cursor:
            cursor.execute(query)
            return cursor.fetchall()

    broker = shop.Broker(folder)

    def fill():
        return shop.Process(os.path.join(folder, "fill.log"), os.path.join(TABLES, "fill"), f"127.0.0.1:{broker.port}", database)

    filling = fill()
    box = shop.Box(folder, 1, "--mqtt", f"127.0.0.1:{broker.port}")
    shop.until(lambda: select("SELECT document->>'up' FROM box") == [("true",)], "the state of the box")
    box.propose(shop.case("delay-known-sphere"))
    box.command("accept", "1", "--by", "Ada")
    shop.until(lambda: select("SELECT id FROM result") == [(1,)], "the first result")

    filling.end(kill=True)
    box.propose(shop.case("bore-fit"))
    # The publisher forgets what it has sent: all of it comes again.
    box.fleet.end(kill=True)
    os.unlink(os.path.join(box.folder, "fleet", box.serial))
    box.start_fleet()
    fill()
    shop.until(lambda: select("SELECT count(*) FROM result") == [(2,)], "the second result")
    numbers = [each["number"] for each in box.history()]
    shop.until(lambda: [n for n, in select("SELECT number FROM history ORDER BY number")] == numbers, "the history")
    assert select("SELECT DISTINCT subject, machine <> '' FROM accepted_value") == [("delay", True)]
    assert all(u > 0 for u, in select("SELECT u FROM result_value WHERE key = 'tau_s'"))
    subprocess.run([PSQL, "-q", "-v", "ON_ERROR_STOP=1", database, "-f", os.path.join(TABLES, "queries.sql")], check=True)

    # A store that is made anew counts from 1 again: its first result is another one.
    box.daemon.end(kill=True)
    shutil.rmtree(os.path.join(box.folder, "state"))
    box.start_box()
    shop.until(box.answers, "the box with another store")
    box.propose(shop.case("spindle-offset-four"))
    shop.until(lambda: select("SELECT subject FROM result WHERE id = 1 ORDER BY proposed_utc") == [("delay",), ("spindle-offset",)],
               "the first result of the other store")
    # What one store says of a number is about none of the other's: 1 was accepted before, and 2 is now.
    box.propose(shop.case("delay-known-sphere"))
    box.command("accept", "2", "--by", "Ada")
    shop.until(lambda: select("SELECT count(*) FROM history WHERE state = 'active'") == [(2,)], "the second acceptance")
    assert select("SELECT DISTINCT id, subject FROM accepted_value ORDER BY id") == [(1, "delay"), (2, "delay")]


shop.run(test)
