#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A Sparkplug B edge node made of paho-mqtt and the classes that protoc generates from
sparkplug_b.proto. It has one device, whose data has aliases and no types.
Usage: sparkplug_edge.py PORT GROUP EDGE DEVICE

Commands, one per line: connect | drop (no goodbye: the broker publishes the will) | set NAME VALUE | null NAME |
quality NAME CODE | historical NAME VALUE | device_death | lose (a sequence number) | publish TOPIC TEXT |
retain TOPIC TEXT | state"""
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

import paho.mqtt.client

PROTO = pathlib.Path(__file__).parents[3] / "services/net/sparkplug"
made = tempfile.TemporaryDirectory()
subprocess.run(["protoc", f"--proto_path={PROTO}", f"--python_out={made.name}", "sparkplug_b.proto"], check=True)
sys.path.insert(0, made.name)
import sparkplug_b_pb2  # noqa: E402  made by protoc

PORT, GROUP, EDGE, DEVICE = int(sys.argv[1]), *sys.argv[2:5]
INT16, INT64, FLOAT, BOOLEAN = 2, 4, 9, 11
now = lambda: int(time.time() * 1000)


class Edge:
    def __init__(self):
        self.values = {"PV": (10, FLOAT, 1.0), "OP": (11, FLOAT, 50.0), "SP": (12, FLOAT, 1.0), "MODE": (13, INT16, 1)}
        self.seq, self.bd_seq, self.births, self.commands = 0, -1, 0, 0
        self.lock = threading.RLock()
        self.client = None
        self.live = threading.Event()

    def topic(self, kind, device=""):
        return f"spBv1.0/{GROUP}/{kind}/{EDGE}" + (f"/{device}" if device else "")

    def payload(self):
        payload = sparkplug_b_pb2.Payload(timestamp=now(), seq=self.seq)
        self.seq = (self.seq + 1) % 256
        return payload

    def put(self, metric, kind, value):
        metric.timestamp = now()
        if kind == FLOAT:
            metric.float_value = value
        else:  # an Int16 below zero is the number's 32 bits
            metric.int_value = int(value) & 0xFFFFFFFF

    def say(self, kind, payload, device=""):
        self.client.publish(self.topic(kind, device), payload.SerializeToString()).wait_for_publish(5)

    def births_of_all(self):
        with self.lock:
            self.seq = 0
            node = self.payload()
            node.metrics.add(name="bdSeq", datatype=INT64, long_value=self.bd_seq, timestamp=now())
            node.metrics.add(name="Node Control/Rebirth", datatype=BOOLEAN, boolean_value=False, timestamp=now())
            device = self.payload()
            for name, (alias, kind, value) in self.values.items():
                self.put(device.metrics.add(name=name, alias=alias, datatype=kind), kind, value)
            self.births += 1
        self.client.publish(self.topic("NBIRTH"), node.SerializeToString())
        self.client.publish(self.topic("DBIRTH", DEVICE), device.SerializeToString())
        self.live.set()

    def connect(self):
        self.bd_seq += 1
        self.live.clear()
        self.client = paho.mqtt.client.Client(f"edge-{EDGE}")
        will = sparkplug_b_pb2.Payload(timestamp=now())
        will.metrics.add(name="bdSeq", datatype=INT64, long_value=self.bd_seq, timestamp=now())
        self.client.will_set(self.topic("NDEATH"), will.SerializeToString(), qos=1)
        self.client.on_connect = lambda client, *_: client.subscribe(self.topic("NCMD"))
        self.client.on_subscribe = lambda *_: self.births_of_all()
        self.client.on_message = self.on_command
        for _ in range(500):
            try:
                self.client.connect("127.0.0.1", PORT)
                break
            except OSError:
                time.sleep(0.02)
        self.client.loop_start()
        assert self.live.wait(20), "no connection"

    def drop(self):
        self.client._sock_close()  # no DISCONNECT
        self.client.loop_stop()

    def on_command(self, _, __, message):
        payload = sparkplug_b_pb2.Payload.FromString(message.payload)
        self.commands += 1
        if any(m.name == "Node Control/Rebirth" and m.boolean_value for m in payload.metrics):
            self.births_of_all()

    def data(self, name, value=None, code=None, historical=False):
        with self.lock:
            alias, kind, old = self.values[name]
            payload = self.payload()
            metric = payload.metrics.add(alias=alias)
            metric.timestamp = now()
            if value is None and code is None:
                metric.is_null = True
            else:
                self.put(metric, kind, old if value is None else value)
            if code is not None:
                metric.properties.keys.append("Quality")
                metric.properties.values.add(type=3, int_value=code)
            if historical:
                metric.is_historical = True
                metric.timestamp = now() - 3_600_000
            elif value is not None:
                self.values[name] = (alias, kind, value)
        self.say("DDATA", payload, DEVICE)


def answer(edge, words):
    command, rest = words[0], words[1:]
    if command == "connect":
        edge.connect()
    elif command == "drop":
        edge.drop()
    elif command == "set":
        edge.data(rest[0], float(rest[1]))
    elif command == "null":
        edge.data(rest[0])
    elif command == "quality":
        edge.data(rest[0], code=int(rest[1]))
    elif command == "historical":
        edge.data(rest[0], float(rest[1]), historical=True)
    elif command == "device_death":
        edge.say("DDEATH", edge.payload(), DEVICE)
    elif command == "lose":
        edge.payload()
    elif command in ("publish", "retain"):
        edge.client.publish(rest[0], " ".join(rest[1:]), qos=1, retain=command == "retain").wait_for_publish(5)
    elif command != "state":
        return f"ERROR {command}"
    return f"OK births={edge.births} commands={edge.commands}"


def main():
    edge = Edge()
    print("READY", flush=True)
    for line in sys.stdin:
        try:
            print(answer(edge, line.split()), flush=True)
        except Exception as error:  # reported to the test
            print(f"ERROR {error}".replace("\n", " "), flush=True)


main()
