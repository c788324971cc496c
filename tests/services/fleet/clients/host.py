#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A Sparkplug host made of paho-mqtt and the classes that protoc generates from sparkplug_b.proto.

It reads births, requests and receives a rebirth, and reads data by alias.
Usage: host.py FOLDER_OF_sparkplug_b_pb2 PORT GROUP EDGE"""
import json
import sys
import threading
import time

import paho.mqtt.client

sys.path.insert(0, sys.argv[1])
import sparkplug_b_pb2  # noqa: E402  made by protoc

PORT, GROUP, EDGE = int(sys.argv[2]), sys.argv[3], sys.argv[4]
FLOAT, BOOLEAN, UINT64 = 9, 11, 8
seen = {"births": 0, "device": None, "pv": None, "unit": None, "config_hash": None, "data": 0, "gaps": 0}
names = {}  # by alias
state = {"expected": None}
done = threading.Event()


def ask(client):
    payload = sparkplug_b_pb2.Payload(timestamp=int(time.time() * 1000))
    payload.metrics.add(name="Node Control/Rebirth", datatype=BOOLEAN, boolean_value=True)
    client.publish(f"spBv1.0/{GROUP}/NCMD/{EDGE}", payload.SerializeToString())


def properties(metric):
    return dict(zip(metric.properties.keys, metric.properties.values))


def take_birth(kind, device, metrics):
    names.update({metric.alias: metric for metric in metrics if metric.HasField("alias")})
    by_name = {metric.name: metric for metric in metrics}
    if kind == "NBIRTH":
        assert by_name["bdSeq"].HasField("long_value") and not by_name["Node Control/Rebirth"].boolean_value
        assert by_name["config_hash"].datatype == UINT64
        seen["births"] += 1
        seen["config_hash"] = by_name["config_hash"].long_value
    else:
        assert by_name["pv"].datatype == FLOAT
        seen.update(device=device, pv=by_name["pv"].float_value,
                    unit=properties(by_name["pv"])["engUnit"].string_value)


def on_message(client, _, message):
    levels = message.topic.split("/")
    kind, device = levels[2], levels[4] if len(levels) > 4 else None
    if kind not in ("NBIRTH", "DBIRTH", "NDATA", "DDATA"):
        return
    payload = sparkplug_b_pb2.Payload.FromString(message.payload)
    if kind != "NBIRTH" and state["expected"] not in (None, payload.seq):
        seen["gaps"] += 1
    state["expected"] = (payload.seq + 1) % 256
    if kind.endswith("BIRTH"):
        take_birth(kind, device, payload.metrics)
    elif kind == "DDATA" and seen["births"]:
        assert all(metric.alias in names and not metric.name for metric in payload.metrics)
        seen["data"] += 1
        if seen["data"] == 3:
            done.set()


def on_connect(client, *_):
    client.subscribe(f"spBv1.0/{GROUP}/#")


def main():
    client = paho.mqtt.client.Client("python-host")
    client.on_connect = on_connect
    client.on_message = on_message
    client.on_subscribe = lambda client, *_: ask(client)
    client.connect("127.0.0.1", PORT)
    client.loop_start()
    came = done.wait(60)
    client.disconnect()
    print(json.dumps(seen))
    sys.exit(0 if came else "no further data within 60 s")


main()
