"""`export -o x.mcap`, read by a reader that was written from https://mcap.dev/spec alone, and by npm's @mcap/core where
its packages are installed (`npm ci` in tools/view/web). Usage: mcap.py PROBEBOXD PROBEBOX WEB
"""
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import zlib

from captured import box, recording, table

MAGIC = b"\x89MCAP0\r\n"


class Bytes:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, code):
        value = struct.unpack_from("<" + code, self.data, self.at)[0]
        self.at += struct.calcsize("<" + code)
        return value

    def sized(self, code="I"):
        size = self.take(code)
        self.at += size
        return self.data[self.at - size : self.at]

    def text(self):
        return self.sized().decode()


def records(data):
    at = Bytes(data)
    while at.at < len(data):
        op = at.take("B")
        yield op, at.sized("Q"), at.at


def cdr(definition, data):
    """One message of flat fields: numbers aligned to their size behind four bytes."""
    assert data[:4] == b"\0\1\0\0"
    at, fields = 4, {}
    for line in definition.splitlines():
        kind, name = line.split()
        size = {"int64": 8, "float64": 8, "uint8": 1, "string": 4}[kind]
        at += -(at - 4) % size
        code = {"int64": "q", "float64": "d", "uint8": "B", "string": "I"}[kind]
        value = struct.unpack_from("<" + code, data, at)[0]
        at += size
        if kind == "string":
            at += value
            value = data[at - value : at - 1].decode()
        fields[name] = value
    assert at == len(data)
    return fields


def read(path):
    """Messages by topic: (ns, fields)."""
    data = path.read_bytes()
    assert data.startswith(MAGIC) and data.endswith(MAGIC)
    schemas, channels, messages, chunks, told = {}, {}, {}, 0, {}

    def take(op, content):
        nonlocal chunks
        body = Bytes(content)
        if op == 3:
            number, _, encoding, definition = body.take("H"), body.text(), body.text(), body.text()
            assert encoding == "ros2msg"
            schemas[number] = definition
        elif op == 4:
            number, schema, topic, encoding = body.take("H"), body.take("H"), body.text(), body.text()
            assert encoding == "cdr"
            channels[number] = (topic, schema)
        elif op == 5:
            topic, schema = channels[body.take("H")]
            sequence, time, _ = body.take("I"), body.take("Q"), body.take("Q")
            sofar = messages.setdefault(topic, [])
            assert sequence == len(sofar)
            sofar.append((time, cdr(schemas[schema], content[22:])))
        elif op == 6:
            chunks += 1
            begin, end, size, crc, compression = body.take("Q"), body.take("Q"), body.take("Q"), body.take("I"), body.text()
            inner = body.sized("Q")
            assert compression == "" and len(inner) == size and zlib.crc32(inner) == crc
            for one, what, _ in records(inner):
                take(one, what)
                if one == 5:
                    assert begin <= struct.unpack_from("<Q", what, 6)[0] <= end
        elif op == 11:
            told["messages"], told["schemas"] = body.take("Q"), body.take("H")
        elif op == 2:
            begin, _, crc = body.take("Q"), body.take("Q"), body.take("I")
            assert zlib.crc32(data[begin : len(data) - len(MAGIC) - 4]) == crc

    for op, content, _ in records(data[len(MAGIC) : -len(MAGIC)]):
        take(op, content)
    assert told["messages"] == sum(map(len, messages.values())) and told["schemas"] == 4
    return messages, chunks


def compare(samples, triggers, messages):
    rows = messages["/probebox/samples"]
    assert len(rows) == len(samples) > 100
    for row, (time, fields) in zip(samples, rows):
        assert time == int(row["time_ns"])
        for name, value in fields.items():
            assert float(row[name]) == value, f"{name}: {row[name]} and {value}"
    assert set(rows[0][1]) == {name for name in samples[0] if name not in ("time_ns", "delay_result_id") and "tau_" not in name}
    assert len(messages["/probebox/triggers"]) == len(triggers) > 0
    for row, (time, fields) in zip(triggers, messages["/probebox/triggers"]):
        assert time == int(row["at_ns"]) and fields["number"] == int(row["number"])
        for name in ("x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg", "correction_x_mm"):
            assert math.isnan(fields[name]) if row[name] == "" else fields[name] == float(row[name]), name


NODE = """
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { readFileSync } from "node:fs";
const data = new Uint8Array(readFileSync(process.argv[2]));
const readable = { size: async () => BigInt(data.length), read: async (at, size) => data.slice(Number(at), Number(at + size)) };
const reader = await McapIndexedReader.Initialize({ readable });
const readers = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  readers.set(channel.id, [channel.topic, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }))]);
}
const messages = {};
for await (const message of reader.readMessages()) {
  const [topic, decoder] = readers.get(message.channelId);
  (messages[topic] ??= []).push([message.logTime, decoder.readMessage(message.data)]);
}
const metadata = [];
for await (const one of reader.readMetadata()) metadata.push(Object.fromEntries(one.metadata));
const plain = (_, value) => (typeof value === "bigint" ? Number(value) : Number.isNaN(value) ? "nan" : value);
process.stdout.write(JSON.stringify({ messages, metadata }, plain));
"""


def with_npm(web, path, folder):
    """The same messages through npm's reader by its index, or nothing where it is not there."""
    modules = pathlib.Path(web) / "node_modules"
    node = shutil.which("node")
    if node is None or not (modules / "@mcap").exists():
        print("Not opened with @mcap/core: run `npm ci` in tools/view/web")
        return None
    script = folder / "read.mjs"
    script.write_text(NODE)
    (folder / "node_modules").symlink_to(modules)
    told = json.loads(subprocess.run([node, str(script), str(path)], check=True, capture_output=True, text=True).stdout)
    assert told["metadata"][0]["board"] == "sim", told["metadata"]
    number = lambda value: math.nan if value == "nan" else value
    return {topic: [(time, {name: number(value) for name, value in fields.items()}) for time, fields in all_]
            for topic, all_ in told["messages"].items()}


def main(probeboxd, probebox, web):
    with box(probeboxd) as (uri, folder):
        path = recording(probebox, uri, folder)
        log = folder / "scan.mcap"
        for name in ("scan.parquet", "scan.txt"):
            refused = subprocess.run([probebox, "export", str(path), "-o", str(folder / name)], capture_output=True, text=True)
            assert refused.returncode == 2 and ".mcap" in refused.stderr, refused.stderr
        subprocess.run([probebox, "export", str(path), "-o", str(log)], check=True, capture_output=True)
        streamed = subprocess.run([probebox, "export", str(path), "-o", str(folder / "again.mcap")], check=True,
                                  capture_output=True, text=True)
        assert "--triggers FILE" not in streamed.stderr, streamed.stderr
        samples, triggers = table(probebox, path, folder)
        messages, chunks = read(log)
        compare(samples, triggers, messages)
        by_npm = with_npm(web, log, folder)
        if by_npm is not None:
            compare(samples, triggers, by_npm)
        print(f"{len(samples)} samples and {len(triggers)} triggers in {chunks} chunks; npm: {by_npm is not None}")


if __name__ == "__main__":
    main(*sys.argv[1:])
