# SPDX-License-Identifier: Apache-2.0
"""Modbus RTU on a pseudo-terminal: the line, its adapter, and the units on it.

Framing and check sum are written separately from the daemon. The daemon opens the line by a symbolic link, like those in
/dev/serial/by-id. An unplugged adapter removes link and terminal, and returns with another terminal.
A request is carried out when it arrives; replies leave in the order of their requests.
"""

import asyncio
import os
import time
import tty

from device import ModbusUnit

BROKEN_OFF_S = 0.1  # an incomplete request is dropped after this time


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc.to_bytes(2, "little")


def request_size(data):
    """Bytes of the request that begins here; None: not known yet."""
    if len(data) < 2:
        return None
    if data[1] == 16:
        return 9 + data[6] if len(data) > 6 else None
    return 8


class LineUnit(ModbusUnit):
    """One unit of the line; its front towards the campaign is that of a TCP device."""

    def __init__(self, device, line, number):
        super().__init__(device)
        self.line, self.number = line, number
        self.powered = True
        self.last_reply = b""
        line.units[number] = self

    async def open(self):
        self.powered = True

    async def close(self):
        self.powered = False

    def cut(self):
        self.line.unplug()
        self.line.plug()

    async def reply(self, request):
        """Sends what becomes of the reply; the request has been carried out already."""
        frame, spoil = request
        line, rng = self.line, self.device.random
        if spoil == "late":
            await asyncio.sleep(rng.uniform(0.2, 0.5))
        elif spoil == "in_pieces":
            begin = time.monotonic()
            for i in range(0, len(frame) - 1):
                line.send(frame[i:i + 1])
                await asyncio.sleep(0.001)
            self.slowest_s = max(self.slowest_s, time.monotonic() - begin)
            frame = frame[-1:]
        elif spoil == "noise_before":
            line.send(rng.randbytes(rng.randint(1, 6)))
        line.send(frame)

    def take(self, request):
        """Carries a request out; what is to be sent, or None."""
        if not self.powered:
            return None
        spoil, rng = self.spoil, self.device.random
        answer = self.spoiled_answer(request[1:-2])
        if answer is None:
            return None
        frame = bytes([self.number + 1 if spoil == "wrong_unit" else self.number]) + answer
        frame += crc16(frame)
        if spoil == "wrong_check_sum":
            at = rng.randrange(len(frame))
            frame = frame[:at] + bytes([frame[at] ^ 1 << rng.randrange(8)]) + frame[at + 1:]
        elif spoil == "garbage":
            frame = rng.randbytes(rng.randint(1, 60))
        elif spoil == "truncated":
            frame = frame[: rng.randint(1, len(frame) - 1)]
        elif spoil == "duplicated":
            frame = frame + frame
        elif spoil == "echo":
            frame = request + frame
        elif spoil == "old_reply" and self.last_reply:
            frame, self.last_reply = self.last_reply, frame
        if spoil != "old_reply":
            self.last_reply = frame
        return frame, spoil


class SerialLine:
    def __init__(self, path, rng):
        self.path, self.random = path, rng
        self.units = {}
        self.master = self.slave = None
        self.received, self.received_at = b"", 0.0
        self.queue = None
        self.sender = None
        self.violations = []

    def plug(self):
        # The campaign holds the terminal open as well: without a daemon it would read errors.
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        for file in (self.master, self.slave):
            os.set_inheritable(file, False)
        self.received = b""
        self.queue = asyncio.Queue()
        self.sender = asyncio.ensure_future(self.send_replies(self.queue))
        asyncio.get_running_loop().add_reader(self.master, self.receive)
        fresh = self.path.with_suffix(".new")
        fresh.symlink_to(os.ttyname(self.slave))
        fresh.rename(self.path)

    def unplug(self):
        if self.master is None:
            return
        # The name first: the next terminal with this number may be another line's.
        self.path.unlink()
        asyncio.get_running_loop().remove_reader(self.master)
        self.sender.cancel()
        os.close(self.master)
        os.close(self.slave)
        self.master = self.slave = None

    def send(self, data):
        if self.master is None:
            return
        try:
            os.write(self.master, data)
        except BlockingIOError:
            pass  # without a reader the bytes are lost, as in a UART

    async def send_replies(self, queue):
        while True:
            unit, reply = await queue.get()
            await unit.reply(reply)

    def receive(self):
        try:
            data = os.read(self.master, 4096)
        except OSError:
            return
        now = time.monotonic()
        if self.received and now - self.received_at > BROKEN_OFF_S:
            self.received = b""
        self.received_at = now
        self.received += data
        while (size := request_size(self.received)) is not None and len(self.received) >= size:
            request, self.received = self.received[:size], self.received[size:]
            if request[-2:] != crc16(request[:-2]):
                self.violations.append(f"a request with a wrong check sum: {request.hex()}")
                self.received = b""
                return
            unit = self.units.get(request[0])
            reply = unit.take(request) if unit else None
            if reply:
                self.queue.put_nowait((unit, reply))

    async def noise(self, shortest_s, longest_s, until):
        """Sends bytes of no request, with this time between them."""
        while time.monotonic() < until:
            self.send(self.random.randbytes(self.random.randint(1, 8)))
            await asyncio.sleep(self.random.uniform(shortest_s, longest_s))
