#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A proxy between a Modbus master and a device that spoils replies, on TCP or on a serial line.

TCP:    fault_proxy.py --to HOST:PORT      prints "READY port=N"
Serial: fault_proxy.py --serial            makes two pseudo-terminals and prints
                                           "READY master=PATH device=PATH"

Commands on standard input, each answered with OK or ERROR. N is the number of spoilt replies.
0, the default, means all until the next command:
  ok                    pass everything
  late MS [N]           deliver replies later, in order
  duplicate [N]         deliver each reply twice
  duplicate_late MS [N] the second one later
  truncate [N]          only the first half of the reply
  garbage [N]           random bytes instead of the reply
  wrong_unit [N]        the reply of another unit (checksum right)
  wrong_number [N]      TCP: another transaction number
  exception CODE [N]    an exception instead of the reply
  refuse FUNCTION [N]   exception 1 instead of replies of this function
  ignore FUNCTION [N]   swallow replies of this function
  spoil FUNCTION [N]    random bytes instead of replies of this function
  stray BYTES [N]       this number of zero bytes after each reply
  stray_before BYTES [N]  the same before each reply
  echo                  serial: each request is echoed before its reply
  close_each            TCP: the connection is closed after each reply
  silent                swallow all replies; connections stay open
  mute UNIT             swallow this unit's replies, `mute 0` ends that
  close                 close all connections once
  down                  close all connections and refuse new ones; serial: same as silent
  up                    accept connections again
  quit
"""

import argparse
import asyncio
import os
import random
import struct
import sys
import tty


def crc(frame):
    value = 0xFFFF
    for byte in frame:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1
    return struct.pack("<H", value)


class Frame:
    """A reply taken apart into header, unit + data, and checksum."""

    def __init__(self, raw, is_tcp):
        self.is_tcp = is_tcp
        self.number = raw[:2] if is_tcp else b""
        self.body = raw[6:] if is_tcp else raw[:-2]

    def bytes(self):
        if self.is_tcp:
            return self.number + b"\0\0" + struct.pack(">H", len(self.body)) + self.body
        return self.body + crc(self.body)


class Faults:
    """The active fault. It turns a reply into a list of (delay in s, bytes)."""

    def __init__(self, is_tcp):
        self.is_tcp = is_tcp
        self.kind = "ok"
        self.value = 0
        self.left = 0
        self.muted = 0
        self.random = random.Random(1)

    def set(self, kind, value=0, count=0):
        self.kind, self.value, self.left = kind, value, count

    def apply(self, raw):
        frame = Frame(raw, self.is_tcp)
        if self.kind in ("silent", "down") or (self.muted and frame.body[0] == self.muted):
            return []
        kind, value = self.kind, self.value
        if kind in ("refuse", "ignore", "spoil") and frame.body[1] != value:
            return [(0, raw)]
        if self.left:
            self.left -= 1
            if self.left == 0:
                self.kind = "ok"
        if kind == "late":
            return [(value / 1000, raw)]
        if kind == "duplicate":
            return [(0, raw + raw)]
        if kind == "duplicate_late":
            return [(0, raw), (value / 1000, raw)]
        if kind == "ignore":
            return []
        if kind == "stray":
            return [(0, raw + bytes(value))]
        if kind == "stray_before":
            return [(0, bytes(value) + raw)]
        if kind == "close_each":
            return [(0, raw), (0, None)]
        if kind == "truncate":
            return [(0, raw[: len(raw) // 2])]
        if kind in ("garbage", "spoil"):
            return [(0, bytes(self.random.randrange(256) for _ in raw))]
        if kind == "wrong_unit":
            frame.body = bytes([frame.body[0] ^ 0x55]) + frame.body[1:]
        elif kind == "wrong_number":
            frame.number = struct.pack(">H", (struct.unpack(">H", frame.number)[0] + 1) & 0xFFFF)
        elif kind == "refuse":
            frame.body = bytes([frame.body[0], frame.body[1] | 0x80, 1])
        elif kind == "exception":
            frame.body = bytes([frame.body[0], frame.body[1] | 0x80, value])
        return [(0, frame.bytes())]


class Delivery:
    """Passes pieces on in order, each at its time."""

    def __init__(self, write, close=None):
        self.write = write
        self.close = close
        self.queue = asyncio.Queue()
        self.task = asyncio.ensure_future(self.run())

    def put(self, pieces):
        now = asyncio.get_running_loop().time()
        for delay, data in pieces:
            self.queue.put_nowait((now + delay, data))

    async def run(self):
        while True:
            due, data = await self.queue.get()
            await asyncio.sleep(due - asyncio.get_running_loop().time())
            if data is None:
                self.close()
            else:
                self.write(data)


class TcpProxy:
    def __init__(self, target, faults):
        self.host, self.port = target.rsplit(":", 1)
        self.faults = faults
        self.writers = set()
        self.server = None
        self.listen_port = 0

    async def up(self):
        if self.server is None:
            self.server = await asyncio.start_server(self.serve, "127.0.0.1", self.listen_port)
            self.listen_port = self.server.sockets[0].getsockname()[1]

    async def down(self):
        if self.server is not None:
            self.server.close()
            self.server = None
        self.close()

    def close(self):
        for writer in self.writers:
            writer.transport.abort()
        self.writers.clear()

    async def serve(self, reader, writer):
        try:
            device_reader, device_writer = await asyncio.open_connection(self.host, self.port)
        except OSError:
            writer.transport.abort()
            return
        self.writers |= {writer, device_writer}
        delivery = Delivery(writer.write, writer.close)
        try:
            await asyncio.gather(self.requests(reader, device_writer),
                                 self.replies(device_reader, delivery))
        except (OSError, asyncio.IncompleteReadError):
            pass
        finally:
            delivery.task.cancel()
            writer.transport.abort()
            device_writer.transport.abort()
            self.writers -= {writer, device_writer}

    async def requests(self, reader, writer):
        while data := await reader.read(4096):
            writer.write(data)
        raise ConnectionResetError

    async def replies(self, reader, delivery):
        while True:
            header = await reader.readexactly(6)
            body = await reader.readexactly(struct.unpack(">H", header[4:6])[0])
            delivery.put(self.faults.apply(header + body))


class SerialProxy:
    """Two pseudo-terminals. A reply ends when the line is silent for a few milliseconds."""

    GAP = 0.005

    def __init__(self, faults):
        self.faults = faults
        self.master_end, self.master_path = self.terminal()
        self.device_end, self.device_path = self.terminal()
        self.reply = b""
        self.timer = None

    @staticmethod
    def terminal():
        end, other = os.openpty()
        tty.setraw(other)
        os.set_blocking(end, False)
        return end, os.ttyname(other)  # `other` stays open, so that the line outlives its users

    def start(self):
        loop = asyncio.get_running_loop()
        self.delivery = Delivery(lambda data: os.write(self.master_end, data))
        loop.add_reader(self.master_end, self.on_request)
        loop.add_reader(self.device_end, self.on_reply)

    def on_request(self):
        request = os.read(self.master_end, 4096)
        if self.faults.kind == "echo":
            os.write(self.master_end, request)
        os.write(self.device_end, request)

    def on_reply(self):
        self.reply += os.read(self.device_end, 4096)
        if self.timer:
            self.timer.cancel()
        self.timer = asyncio.get_running_loop().call_later(self.GAP, self.end_of_reply)

    def end_of_reply(self):
        reply, self.reply = self.reply, b""
        self.delivery.put(self.faults.apply(reply))

    async def up(self):
        pass

    async def down(self):
        pass

    def close(self):
        pass


async def answer_commands(proxy, faults):
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    with_value = ("late", "duplicate_late", "exception", "refuse", "ignore", "spoil", "stray", "stray_before")
    plain = ("echo", "close_each", "ok", "duplicate", "truncate", "garbage", "wrong_unit", "wrong_number", "silent")
    while line := await reader.readline():
        command, *numbers = line.decode().split() or [""]
        numbers = [int(number) for number in numbers]
        if command == "quit":
            return
        if command in with_value:
            faults.set(command, numbers[0], numbers[1] if len(numbers) > 1 else 0)
        elif command in plain:
            faults.set(command, 0, numbers[0] if numbers else 0)
        elif command == "mute":
            faults.muted = numbers[0]
        elif command == "close":
            proxy.close()
        elif command == "down":
            faults.set("down")
            await proxy.down()
        elif command == "up":
            faults.set("ok")
            await proxy.up()
        else:
            print(f"ERROR unknown command {command!r}", flush=True)
            continue
        print("OK", flush=True)


async def main():
    parser = argparse.ArgumentParser()
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument("--to", metavar="HOST:PORT")
    group.add_argument("--serial", action="store_true")
    args = parser.parse_args()

    faults = Faults(is_tcp=not args.serial)
    if args.serial:
        proxy = SerialProxy(faults)
        proxy.start()
        print(f"READY master={proxy.master_path} device={proxy.device_path}", flush=True)
    else:
        proxy = TcpProxy(args.to, faults)
        await proxy.up()
        print(f"READY port={proxy.listen_port}", flush=True)
    await answer_commands(proxy, faults)


if __name__ == "__main__":
    asyncio.run(main())
