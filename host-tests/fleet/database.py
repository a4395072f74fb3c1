"""A PostgreSQL of a test's own, with the tables of tools/fleet/postgresql. Skips the test where something for it is not installed."""
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


class Database:
    """Without a port, in a folder of a short name, as a socket's path has to be; PostgreSQL refuses to be root."""

    def __enter__(self):
        self.folder = tempfile.mkdtemp(prefix="probebox-pg-")
        self.name = f"host={self.folder} user=test dbname=postgres"
        as_user = {"user": "postgres"} if os.geteuid() == 0 else {}
        if as_user:
            os.chown(self.folder, pwd.getpwnam("postgres").pw_uid, -1)
        data = os.path.join(self.folder, "data")
        subprocess.run([os.path.join(BIN, "initdb"), "-D", data, "-A", "trust", "-U", "test", "--no-sync"], check=True, capture_output=True,
                       cwd=self.folder, **as_user)
        self.process = shop.Process(os.path.join(self.folder, "postgres.log"), os.path.join(BIN, "postgres"), "-D", data, "-k", self.folder,
                                    "-c", "listen_addresses=", cwd=self.folder, **as_user)
        shop.until(self.is_up, "the database")
        self.run("schema.sql")
        self.rows = psycopg2.connect(self.name)
        self.rows.autocommit = True
        return self

    def __exit__(self, *_):
        self.rows.close()  # else the server waits for it
        for process in reversed(shop.Process.all):
            process.end()
        shutil.rmtree(self.folder)

    def is_up(self):
        try:
            psycopg2.connect(self.name).close()
            return True
        except psycopg2.OperationalError:
            return False

    def run(self, script):
        subprocess.run([PSQL, "-q", "-v", "ON_ERROR_STOP=1", self.name, "-f", os.path.join(TABLES, script)], check=True)

    def select(self, query):
        with self.rows.cursor() as cursor:
            cursor.execute(query)
            return cursor.fetchall()

    def fill(self, folder, broker):
        """Starts the program that fills the tables from the broker."""
        return shop.Process(os.path.join(folder, "fill.log"), os.path.join(TABLES, "fill"), f"127.0.0.1:{broker.port}", self.name)
