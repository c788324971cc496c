#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Imports the unchanged flow into a running Node-RED, waits until its values equal those of another
master, and writes a set point through it.  Usage: node_red.py PORT FLOW.json VALUES.json"""
import json
import sys
import time
import urllib.error
import urllib.request

from compare import compare

PORT = sys.argv[1]


def ask(method, path, body=None):
    request = urllib.request.Request(f"http://127.0.0.1:{PORT}{path}", method=method,
                                     data=None if body is None else json.dumps(body).encode(),
                                     headers={"Content-Type": "application/json",
                                              "Accept": "application/json"})
    with urllib.request.urlopen(request, timeout=10) as answer:
        text = answer.read()
    return json.loads(text) if text[:1] in (b"{", b"[") else text


def eventually(what, check, seconds=90):
    end = time.monotonic() + seconds
    last = None
    while time.monotonic() < end:
        try:
            last = check()
            if last:
                return last
        except (urllib.error.URLError, ConnectionError, KeyError) as error:
            last = error
        time.sleep(0.5)
    sys.exit(f"{what}: not within {seconds} s ({last})")


def values():
    """Returns the values that the flow has decoded, by table and name as in the other master."""
    stored = ask("GET", "/context/flow/lw-tab")["memory"]["loopwarden"]["msg"]
    return json.loads(stored) if isinstance(stored, str) else stored


def same_names(wanted, decoded):
    """The other master's values, by the names that the flow gives them."""
    renamed = {}
    for name, value in wanted.items():
        table, field = name.split(":", 1)
        owner, short = field.rsplit(".", 1)
        others = [] if table in ("input register", "discrete input") else [f"set/{short}", f"third/{short}"]
        known = next((other for other in others if other in decoded.get(owner, {})), short)
        renamed[f"{owner}.{known}"] = value
    return renamed


def main():
    with open(sys.argv[2], encoding="utf-8") as file:
        flow = json.load(file)
    with open(sys.argv[3], encoding="utf-8") as file:
        wanted = json.load(file)
    eventually("Node-RED", lambda: ask("GET", "/settings"), 300)
    kinds = {kind for module in ask("GET", "/nodes") for kind in module["types"]}
    assert "modbus-read" in kinds and "modbus-flex-write" in kinds, "no node-red-contrib-modbus"
    ask("POST", "/flows", flow)
    reads = sum(node["type"] == "modbus-read" for node in flow)
    eventually("values of every block",
               lambda: sum(len(block) for block in values().values()) >= len(same_names(wanted, values())))
    decoded = values()
    compare(same_names(wanted, decoded), {f"{owner}.{name}": value for owner, block in decoded.items()
                                          for name, value in block.items()})
    new_set_point = 4.25
    ask("POST", "/inject/lw-sp-1", {"__user_inject_props__": [{"p": "payload", "v": str(new_set_point), "vt": "num"},
                                                            {"p": "topic", "v": "FIC-102/sp", "vt": "str"}]})
    eventually("the set point that was written", lambda: values()["FIC-102"]["sp"] == new_set_point)
    assert values()["FIC-101"]["sp"] != new_set_point
    # As printed, a press sends the value in the box.
    ask("POST", "/inject/lw-sp-0", {})
    ask("POST", "/inject/lw-acknowledge", {})
    print(f"Node-RED reads {reads} blocks, {sum(map(len, decoded.values()))} values, and writes")


main()
