#!/usr/bin/env python3
"""Reads every register of a Loopwarden map and prints it as JSON. Runs with pymodbus 3.0 (Debian 12) and later."""
import inspect
import json
import struct
import sys

from pymodbus.client import ModbusTcpClient

HOST, PORT, UNIT = @HOST@, @PORT@, @UNIT@
WORDS_REVERSED, BYTES_SWAPPED = @WORDS_REVERSED@, @BYTES_SWAPPED@  # word_order @ORDER@
REGISTERS = [
    # table, address, words, type, scale, name
@REGISTERS@]


def decode(words, kind):
    """One value of one or two registers."""
    if kind in ("u32", "f32"):
        if WORDS_REVERSED:
            words = words[::-1]
        raw = struct.pack(">HH", *words)
        if BYTES_SWAPPED:
            raw = bytes((raw[1], raw[0], raw[3], raw[2]))
        return struct.unpack(">f" if kind == "f32" else ">I", raw)[0]
    return struct.unpack(">h", struct.pack(">H", words[0]))[0] if kind == "i16" else words[0]


def main():
    host = sys.argv[1] if len(sys.argv) > 1 else HOST
    port = int(sys.argv[2]) if len(sys.argv) > 2 else PORT
    client = ModbusTcpClient(host, port=port)
    if not client.connect():
        sys.exit(f"no connection to {host} port {port}")
    read = {
        "input register": client.read_input_registers,
        "holding register": client.read_holding_registers,
        "discrete input": client.read_discrete_inputs,
        "coil": client.read_coils,
    }
    # The unit's argument has changed its name twice.
    names = inspect.signature(client.read_coils).parameters
    unit = {next((n for n in ("device_id", "slave") if n in names), "slave"): UNIT}
    values = {}
    for table, address, words, kind, scale, name in REGISTERS:
        answer = read[table](address, count=words, **unit)
        if answer.isError():
            sys.exit(f"{name}: {answer}")
        if kind == "bit":
            value = int(answer.bits[0])
        else:
            value = decode(answer.registers, kind) * scale
        values[f"{table}:{name}"] = value
    client.close()
    json.dump(values, sys.stdout, indent=1)
    print()


main()
