#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the Telegraf snippet is TOML and keeps the rules of Telegraf's plugin (inputs.modbus,
metric style). It must have every register of the map once, with its loop as a tag.
Telegraf itself does not run, because neither Debian nor npm has it.
Usage: telegraf.py SNIPPET MAP_AS_JSON WORD_ORDER"""
import json
import sys
import tomllib

TABLES = {"input": "input register", "holding": "holding register", "discrete": "discrete input", "coil": "coil"}
TYPES = {"UINT16": "u16", "INT16": "i16", "UINT32": "u32", "FLOAT32": "f32", None: "bit"}
# Keys that the plugin reads; any other key ends Telegraf at its start.
PLUGIN_KEYS = {"name", "timeout", "controller", "configuration_type", "metric"}
METRIC_KEYS = {"slave_id", "byte_order", "measurement", "fields", "tags"}
FIELD_KEYS = {"register", "address", "name", "type", "scale", "output"}


def check_field(field):
    assert field.keys() <= FIELD_KEYS, field
    is_bit = field["register"] in ("coil", "discrete")
    assert field["name"] and isinstance(field["address"], int), field
    assert is_bit == (field.get("type") is None), field
    assert not is_bit or "scale" not in field, field
    # A scaled value is a float, or it would be cut to a whole number.
    assert ("scale" in field) == (field.get("output") == "FLOAT64"), field
    width = 2 if TYPES[field.get("type")] in ("u32", "f32") else 1
    assert 0 <= field["address"] <= 65535 - width, field


def check_plugin(plugin):
    assert plugin.keys() <= PLUGIN_KEYS and plugin["configuration_type"] == "metric", plugin.keys()
    assert plugin["controller"].startswith("tcp://"), plugin["controller"]
    for metric in plugin["metric"]:
        assert metric.keys() <= METRIC_KEYS and metric["fields"] and 0 <= metric["slave_id"] <= 255, metric
        assert metric["byte_order"] in ("ABCD", "DCBA", "BADC", "CDAB"), metric["byte_order"]
        assert all(isinstance(value, str) for value in metric["tags"].values()), metric["tags"]
        for field in metric["fields"]:
            check_field(field)


def main():
    with open(sys.argv[1], "rb") as file:
        plugin = tomllib.load(file)["inputs"]["modbus"][0]
    check_plugin(plugin)
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
    assert found == wanted, "not the map"
    print(f"{len(found)} fields of {len({loop for loop, _ in names})} tags for Telegraf, not run")


main()
