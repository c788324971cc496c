# SPDX-License-Identifier: Apache-2.0
"""Modbus TCP in front of a device, with replies that can be spoiled. Unit 1 answers."""

import asyncio
import struct
import time

from device import ModbusUnit

UNIT = 1


class TcpFront(ModbusUnit):
    def __init__(self, device):
        super().__init__(device)
        self.port = 0
        self.server = None
        self.connections = set()
        self.last_reply = b""

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

    async def reply(self, writer, number, unit, pdu):
        spoil = self.spoil
        if spoil == "reset":
            writer.transport.abort()
            return
        answer = self.spoiled_answer(pdu) if unit == UNIT else None
        if answer is None:
            return
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
