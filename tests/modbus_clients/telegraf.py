#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The Telegraf snippet is TOML, and every register of the map is in it once, with its loop as a tag.
Usage: telegraf.py SNIPPET MAP_AS_JSON WORD_ORDER"""
import json
import sys
import tomllib

TABLES = {"input": "input register", "holding": "holding register", "discrete": "discrete input", "coil": "coil"}
TYPES = {"UINT16": "u16", "INT16": "i16", "UINT32": "u32", "FLOAT32": "f32", None: "bit"}


def main():
    with open(sys.argv[1], "rb") as file:
        plugin = tomllib.load(file)["inputs"]["modbus"][0]
    wanted = {(r["table"], r["address"]): (r["loop"] or "box", r["type"], r["scale"])
              for r in json.loads(sys.argv[2])["registers"]}
    found, names = {}, set()
    for metric in plugin["metric"]:
        loop = metric["tags"]["loop"]
        for field in metric["fields"]:
            kind = TYPES[field.get("type")]
            found[(TABLES[field["register"]], field["address"])] = (loop, kind, field.get("scale", 1.0))
            assert (loop, field["name"]) not in names, field
            names.add((loop, field["name"]))
            if kind in ("u32", "f32"):
                assert metric["byte_order"] == sys.argv[3].upper(), metric["byte_order"]
            else:
                assert metric["byte_order"] == "ABCD" or sys.argv[3] == "abcd", metric["byte_order"]
    assert plugin["configuration_type"] == "metric" and found == wanted, "not the map"
    print(f"{len(found)} fields of {len({loop for loop, _ in names})} tags for Telegraf")


main()
