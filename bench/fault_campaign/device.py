# SPDX-License-Identifier: Apache-2.0
"""Transmitter and positioner as Modbus TCP devices that can be spoiled, with their plant.

Shares no code with the daemon. The positioner has a communication watchdog of its own and judges
every command at the moment it arrives: finite, inside the limits, within the rate, and going on
from where the valve stands. Each server answers unit 1:

  input   0 PV f32, 18 status (0 good), 20 valve position f32
  holding 0 command f32, 10 watchdog time u16 in tenths of a second, 0 off
"""

import asyncio
import collections
import math
import random
import struct
import time

UNIT = 1
STEP_S = 0.01
# Plant 1 at ten times its speed.
GAIN, LAG_S, DEAD_TIME_S, STEM_LAG_S = 1.2264, 0.169, 0.26, 0.05
FAIL_SAFE = 0.5  # CO units, where the device's own watchdog sends the valve


class Limits:
    """What the loop's file allows, and how late the daemon may know of the valve."""

    def __init__(self, low, high, rate, knowledge_s, period_s):
        self.low, self.high, self.rate = low, high, rate
        self.knowledge_s = knowledge_s  # s: a read-back may be so old when a command stands on it
        self.period_s = period_s


class Device:
    TOLERANCE = 0.02  # CO units: f32, and the valve's creep towards its command

    def __init__(self, limits, start, seed):
        self.limits = limits
        self.random = random.Random(seed)
        self.command = self.stem = start
        self.pv = GAIN * start
        self.on_the_way = collections.deque([start] * round(DEAD_TIME_S / STEP_S))
        self.watchdog_tenths = 0
        self.tripped = False
        self.last_write = time.monotonic()
        self.forgot_at = -math.inf
        self.history = collections.deque()  # (time, stem, demand)
        self.writes = 0
        self.violations = []
        self.pv_fault = None  # a function of the true PV
        self.stem_fault = None  # of the true position, as read back
        self.status = 0
        self.valve_stuck = False
        self.steps_allowed = False
        self.worst_tick_s = 0.0  # this process was late by so much: what is judged by time waits

    # --- plant -----------------------------------------------------------------------------------

    def step(self, now):
        if self.watchdog_tenths and not self.tripped:
            if now - self.last_write > self.watchdog_tenths / 10:
                self.tripped = True
                self.command = FAIL_SAFE
        if not self.valve_stuck:
            self.stem += (self.command - self.stem) * min(1.0, STEP_S / STEM_LAG_S)
        self.on_the_way.append(self.stem)
        self.pv += (GAIN * self.on_the_way.popleft() - self.pv) * min(1.0, STEP_S / LAG_S)
        self.history.append((now, self.stem, self.command))
        while self.history and self.history[0][0] < now - 5.0:
            self.history.popleft()

    def restart(self):
        """Registers as at start; the valve at its fail-safe position."""
        self.command = FAIL_SAFE
        self.watchdog_tenths = 0
        self.tripped = False
        self.forgot_at = time.monotonic()

    # --- registers -------------------------------------------------------------------------------

    def measured(self):
        return self.pv if self.pv_fault is None else self.pv_fault(self.pv)

    def input_registers(self, address, count):
        image = [0] * 64
        image[0:2] = struct.unpack(">2H", struct.pack(">f", self.measured()))
        image[18] = self.status
        position = self.stem if self.stem_fault is None else self.stem_fault(self.stem)
        image[20:22] = struct.unpack(">2H", struct.pack(">f", position))
        return image[address : address + count]

    def holding_registers(self, address, count):
        image = [0] * 64
        image[0:2] = struct.unpack(">2H", struct.pack(">f", self.command))
        image[10] = self.watchdog_tenths
        return image[address : address + count]

    def write_registers(self, address, values):
        if address == 0 and len(values) == 2:
            self.take_command(struct.unpack(">f", struct.pack(">2H", *values))[0])
        elif address == 10 and len(values) == 1:
            self.watchdog_tenths = values[0]
            self.last_write = time.monotonic()

    def take_command(self, value):
        now = time.monotonic()
        self.judge(value, now)
        if math.isfinite(value):
            self.command = value
        self.last_write = now
        self.tripped = False
        self.writes += 1

    def judge(self, value, now):
        limits = self.limits
        if not math.isfinite(value):
            self.violations.append(f"wrote {value}")
            return
        # Where the valve and its demand have been while the daemon could last have looked.
        known = [(stem, demand) for at, stem, demand in self.history
                 if at >= now - limits.knowledge_s - self.worst_tick_s]
        places = [self.command] + [p for pair in known for p in pair]
        low, high = min(places), max(places)
        if value < min(limits.low, low) - self.TOLERANCE or value > max(limits.high, high) + self.TOLERANCE:
            self.violations.append(f"{value:.3f} beyond its limits {limits.low} to {limits.high}")
        passed = now - self.last_write + 2 * limits.period_s + self.worst_tick_s
        step = limits.rate * min(passed, limits.knowledge_s + self.worst_tick_s)
        if self.steps_allowed:
            return
        if value < low - step - self.TOLERANCE or value > high + step + self.TOLERANCE:
            self.violations.append(
                f"{value:.3f} is a step: valve and demand were within {low:.3f} to {high:.3f}, "
                f"{step:.3f} allowed")
        # A restart between two requests is seen at the next look at the register, within 10 s.
        if self.watchdog_tenths == 0 and now - self.forgot_at > 12.0:
            self.violations.append("a command while the device's watchdog was off")


class Front:
    """A Modbus TCP server in front of a device; `spoil` names what happens to its replies."""

    def __init__(self, device):
        self.device = device
        self.spoil = None
        self.port = 0
        self.server = None
        self.connections = set()
        self.last_reply = b""
        self.slowest_s = 0.0  # for a reply in pieces

    async def open(self):
        self.server = await asyncio.start_server(self.serve, "127.0.0.1", self.port,
                                                 reuse_address=True)
        self.port = self.server.sockets[0].getsockname()[1]

    async def close(self):
        if self.server:
            self.server.close()
            self.server = None
        self.cut()

    def cut(self):
        for writer in list(self.connections):
            writer.transport.abort()

    async def serve(self, reader, writer):
        self.connections.add(writer)
        try:
            while True:
                header = await reader.readexactly(7)
                number, protocol, length, unit = struct.unpack(">HHHB", header)
                if protocol != 0 or not 2 <= length <= 254:
                    self.device.violations.append("a request that is no Modbus")
                    return
                body = await reader.readexactly(length - 1)
                await self.reply(writer, number, unit, body)
        except (asyncio.IncompleteReadError, ConnectionError, OSError):
            pass
        finally:
            self.connections.discard(writer)
            writer.transport.abort()

    def answer(self, pdu):
        device, function = self.device, pdu[0]
        if function in (3, 4):
            address, count = struct.unpack(">HH", pdu[1:5])
            if count == 0 or address + count > 64:
                return bytes([function | 0x80, 2])
            words = (device.holding_registers if function == 3 else device.input_registers)(address, count)
            return bytes([function, 2 * count]) + struct.pack(f">{count}H", *words)
        if self.spoil == "writes_refused":
            return bytes([function | 0x80, 4])
        if function == 6:
            address, value = struct.unpack(">HH", pdu[1:5])
            device.write_registers(address, [value])
            return pdu
        if function == 16:
            address, count = struct.unpack(">HH", pdu[1:5])
            device.write_registers(address, list(struct.unpack(f">{count}H", pdu[6:6 + 2 * count])))
            return pdu[:5]
        return bytes([function | 0x80, 1])

    async def reply(self, writer, number, unit, pdu):
        spoil = self.spoil
        if spoil == "reset":
            writer.transport.abort()
            return
        if unit != UNIT or spoil == "lost_requests":
            return
        answer = self.answer(pdu)
        if spoil == "silent":
            return
        if spoil == "exception":
            answer = bytes([pdu[0] | 0x80, self.device.random.choice((4, 6, 10))])
        elif spoil == "wrong_function":
            answer = bytes([answer[0] ^ 0x07]) + answer[1:]
        elif spoil == "wrong_length":
            answer = answer + b"\x00\x00"
        elif spoil == "other_value" and pdu[0] == 16:
            answer = bytes([16, 0, 1, 0, 2])
        frame = struct.pack(">HHHB", (number + 77) % 65536 if spoil == "wrong_number" else number, 0,
                            len(answer) + 1, unit + 1 if spoil == "wrong_unit" else unit) + answer
        if spoil == "garbage":
            frame = self.device.random.randbytes(self.device.random.randint(1, 60))
        elif spoil == "truncated":
            frame = frame[: self.device.random.randint(1, len(frame) - 1)]
        elif spoil == "late":
            await asyncio.sleep(self.device.random.uniform(0.2, 0.5))
        elif spoil == "duplicated":
            frame = frame + frame
        elif spoil == "old_reply" and self.last_reply:
            frame, self.last_reply = self.last_reply, frame
        elif spoil == "in_pieces":
            begin = time.monotonic()
            for i in range(0, len(frame) - 1):
                writer.write(frame[i:i + 1])
                await asyncio.sleep(0.001)
            self.slowest_s = max(self.slowest_s, time.monotonic() - begin)
            frame = frame[-1:]
        if spoil != "old_reply":
            self.last_reply = frame
        writer.write(frame)
