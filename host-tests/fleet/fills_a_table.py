"""PostgreSQL is filled from MQTT: each result has one row, although the program that fills is killed and messages come again."""
import os
import shutil

import database
import shop


def test(folder):
    with database.Database() as tables:
        fill_and_query(folder, tables)


def fill_and_query(folder, tables):
    select, broker = tables.select, shop.Broker(folder)
    filling = tables.fill(folder, broker)
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
    tables.fill(folder, broker)
    shop.until(lambda: select("SELECT count(*) FROM result") == [(2,)], "the second result")
    numbers = [each["number"] for each in box.history()]
    shop.until(lambda: [n for n, in select("SELECT number FROM history ORDER BY number")] == numbers, "the history")
    shop.until(lambda: select("SELECT DISTINCT subject, machine <> '' FROM accepted_value") == [("delay", True)], "what is in force")
    assert all(u > 0 for u, in select("SELECT u FROM result_value WHERE key = 'tau_s'"))
    tables.run("queries.sql")

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
    shop.until(lambda: select("SELECT DISTINCT id, subject FROM accepted_value ORDER BY id") == [(1, "delay"), (2, "delay")], "both in force",
               lambda: [select(f"SELECT {columns} FROM {table} ORDER BY arrival") for columns, table in
                        (("arrival, id, proposed_utc, subject", "result"), ("arrival, number, utc, result_id, state", "history"))])


shop.run(test)
