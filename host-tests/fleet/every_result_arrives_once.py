"""Results are proposed and accepted while the broker is away, a box is killed and a publisher is killed: each result and each entry of
each history arrives, once or marked, and a table filled from MQTT has each once."""
import collections
import os
import signal
import time

import shop

BOXES = 4
CASES = ("delay-known-sphere", "bore-fit", "spindle-offset-four")


def all_there(boxes, subscriber):
    came = {topic for topic, _ in subscriber.of("history")}
    return all(f"probebox/v1/{box.serial}/history/{each['number']}" in came for box in boxes for each in box.history())


def test(folder):
    broker = shop.Broker(folder)
    subscriber = shop.Subscriber(folder, broker)
    boxes = [shop.Box(folder, k, *broker.tls_options(), "--state-every", "1") for k in range(BOXES)]
    for box in boxes:
        shop.until(box.answers, f"{box.serial} answers")
    shop.until(lambda: {topic for topic, state in subscriber.messages() if topic.endswith("/state") and state["up"]} ==
               {f"probebox/v1/{box.serial}/state" for box in boxes}, "all states")

    # Whoever has no certificate that the broker knows gets nowhere, and goes on serving /metrics.
    stranger = shop.Box(folder, BOXES, *broker.tls_options("stranger"))
    shop.until(lambda: shop.value(stranger.scrape(), "probebox_up") == 1, "a scrape")

    # All is well.
    for box in boxes:
        box.propose(shop.case(CASES[0]))
    shop.until(lambda: all_there(boxes, subscriber), "the first results")

    # The broker is away; results are accepted; a box and a publisher are killed meanwhile.
    broker.end()
    boxes[0].daemon.end(kill=True)
    boxes[1].fleet.end(kill=True)
    boxes[0].start_box()
    shop.until(boxes[0].answers, "the killed box is back")
    for box in boxes:
        for name in CASES[1:]:
            box.propose(shop.case(name))
        box.command("accept", "1", "--by", "Grace")
    boxes[1].start_fleet()
    shop.until(lambda: shop.value(boxes[1].scrape(), "probebox_mqtt_connected") == 0, "a scrape without a broker")
    broker.start()
    shop.until(lambda: all_there(boxes, subscriber), "what was accepted without a broker")

    # A publisher is killed between a message and its acknowledgement, and at any time.
    os.kill(broker.process.popen.pid, signal.SIGSTOP)
    boxes[2].propose(shop.case(CASES[0]))
    shop.until(lambda: shop.value(boxes[2].scrape(), "probebox_mqtt_in_flight"), "a message that is not acknowledged")
    boxes[2].fleet.end(kill=True)
    os.kill(broker.process.popen.pid, signal.SIGCONT)
    boxes[2].start_fleet()
    shop.until(lambda: all_there(boxes, subscriber), "what was in flight")
    shop.until(lambda: any(document["again"] for _, document in subscriber.of("history")), "the mark of what may come twice")
    for _ in range(3):
        boxes[2].propose(shop.case(CASES[0]))
        boxes[2].fleet.end(kill=True)
        boxes[2].start_fleet()
    # A box goes away and says so by its state; its scrape is still answered.
    boxes[3].daemon.end(kill=True)
    shop.until(lambda: [state for topic, state in subscriber.messages() if topic == f"probebox/v1/{boxes[3].serial}/state"][-1]["up"] is False,
               "the state of a box that is gone")
    shop.until(lambda: shop.value(boxes[3].scrape(), "probebox_up") == 0, "probebox_up 0")
    boxes[3].start_box()
    for box in boxes:
        shop.until(box.answers, "all boxes")
    shop.until(lambda: all_there(boxes, subscriber), "all")
    time.sleep(2)  # for what would come twice

    expected = {f"probebox/v1/{box.serial}/history/{each['number']}" for box in boxes for each in box.history()}
    results = {f"probebox/v1/{box.serial}/result/{each['id']}" for box in boxes for each in box.history()}
    for kind, topics in (("history", expected), ("result", results)):
        came = collections.defaultdict(list)
        for topic, document in subscriber.of(kind):
            came[topic].append(document["again"])
        assert came.keys() == topics, (kind, came.keys() ^ topics)
        for topic, again in came.items():
            assert again.count(False) <= 1, f"{topic} came twice unmarked: {again}"
    document = next(document for topic, document in subscriber.of("result") if document["method"] == CASES[0])
    assert document["u"]["tau_s"] > 0 and document["covariance"]["components"], document
    # A publisher that has died is told by its last will.
    boxes[0].fleet.end(kill=True)
    shop.until(lambda: [state for topic, state in subscriber.messages() if topic == f"probebox/v1/{boxes[0].serial}/state"][-1]["up"] is False,
               "the last will")
    shop.until(lambda: shop.value(stranger.scrape(), "probebox_mqtt_connected") == 0, "a scrape of who is not let in")
    assert not any(f"/{stranger.serial}/" in topic for topic, _ in subscriber.messages())
    print(f"{len(expected)} entries and {len(results)} results of {BOXES} boxes came, "
          f"{sum(document['again'] for _, document in subscriber.of('history'))} entries marked as perhaps there before")


shop.run(test)
