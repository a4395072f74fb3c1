"""The rules for alerts, on two days of 50 machines of which three drift (promtool), and a Prometheus that scrapes boxes of which one goes."""
import json
import os
import subprocess

import shop

PROMTOOL = shop.program("promtool", "prometheus")
RULES = os.path.join(shop.ROOT, "tools", "fleet", "prometheus", "alerts.yml")
MACHINES, DRIFTING, BOXES = 50, (7, 23, 41), 4


def series(name, values, **labels):
    text = ",".join(f'{key}="{each}"' for key, each in labels.items())
    return {"series": f"{name}{{{text}}}", "values": values}


def rules_on_two_days(folder):
    """Samples are an hour apart; a newer result comes into force after 30 hours, off by 6 u where the machine drifts, else by 2 u."""
    inputs = []
    for k in range(MACHINES):
        moved = 5.03e-3 if k in DRIFTING else 5.01e-3
        labels = {"instance": f"mill-{k}", "subject": "delay", "key": "tau_s"}
        inputs.append(series("probebox_result_value", f"5e-3x30 {moved}x20", **labels))
        inputs.append(series("probebox_result_u", "3.5e-6x50", **labels))
        inputs.append(series("probebox_up", "1x50", instance=f"mill-{k}"))
        inputs.append(series("probebox_corrections_valid", "1x50" if k != 5 else "1x30 0x20", instance=f"mill-{k}"))
        inputs.append(series("probebox_certificate_due_timestamp_seconds", f"{36 * 3600 if k == 9 else 9e9}x50", instance=f"mill-{k}",
                             subject="sphere"))

    def expected(alert, at, instances, **labels):
        return {"eval_time": at, "alertname": alert, "exp_alerts": [{"exp_labels": {"instance": f"mill-{k}", **labels}} for k in instances]}

    moved = {"severity": "warning", "subject": "delay", "key": "tau_s"}
    # promtool compares annotations too, which are sentences.
    bare = os.path.join(folder, "rules.yml")
    with open(RULES) as file, open(bare, "w") as without:
        without.writelines(line for line in file if not line.lstrip().startswith(("annotations:", "summary:")))
    tests = {"rule_files": [bare], "evaluation_interval": "1h", "tests": [{
        "interval": "1h", "input_series": inputs, "alert_rule_test": [
            expected("ProbeboxResultMoved", "29h", ()),
            expected("ProbeboxResultMoved", "32h", DRIFTING, **moved),
            expected("ProbeboxAway", "48h", ()),
            expected("ProbeboxCorrectionInvalid", "29h", ()),
            expected("ProbeboxCorrectionInvalid", "34h", (5,), severity="critical"),
            expected("ProbeboxCertificateOverdue", "35h", ()),
            expected("ProbeboxCertificateOverdue", "37h", (9,), severity="warning", subject="sphere")]}]}
    path = os.path.join(folder, "rules_test.json")
    with open(path, "w") as file:
        json.dump(tests, file)  # JSON is YAML
    done = subprocess.run([PROMTOOL, "test", "rules", path], capture_output=True, text=True)
    return done.stdout + done.stderr, done.returncode


def test(folder):
    said, status = rules_on_two_days(folder)
    assert status == 0, said

    boxes = [shop.Box(folder, k) for k in range(BOXES)]
    query = shop.Prometheus(folder, boxes, RULES, 5).query
    shop.until(lambda: len(query("probebox_up == 1")) == BOXES, "all boxes seen")
    boxes[1].daemon.end(kill=True)
    shop.until(lambda: query("probebox_up == 0").keys() == {f"127.0.0.1:{boxes[1].metrics_port}"}, "the box that went")
    shop.until(lambda: len(query('up{job="probebox"} == 1')) == BOXES, "the scrape is answered all the same")


shop.run(test)
