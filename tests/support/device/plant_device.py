#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Transmitter and positioner as Modbus devices on pymodbus, over TCP or a serial line.

The plant runs in plant_process.py. The positioner has a communication watchdog: if no command
arrives for the time in its watchdog register, the valve moves to its fail-safe value. A restart
clears that register, as in real devices.

Prints "READY port=N" or "READY serial=PATH". Commands on standard input, each answered by a line:
  state              STATE co=.. written=.. pv=.. stem=.. watchdog=ok|tripped trips=.. watchdog_register=.. writes=..
                     unguarded_writes=.. restarts=..
                     (co: the value that drives the valve; unguarded_writes: commands received while the
                     watchdog register was 0)
  restart [SECONDS]  off for this time, then on again with registers as at start
  forget             registers as at start without being off: a restart between two requests
  status VALUE       transmitter status register
  pv VALUE | auto    override PV (nan and inf are possible), or back to the plant
  quit

Registers, 0-based, the same for every unit:
  input 0 PV f32 ABCD, 2 PV f32 CDAB, 4 PV f32 BADC, 6 PV f32 DCBA, 8 PV f64 ABCD,
        12 PV u16 and 13 PV i16 (thousandths), 14 PV u32 and 16 PV i32 (thousandths),
        18 status (0 good), 20 stem f32 ABCD, 30 unit number,
        40, 42, 44, 46 tags u32: high word A000h + register, low word CLOCK_MONOTONIC in ms
        100 test number f32 123456.0
        Registers up to 119 exist.
  holding 0 CO f32 ABCD, 2 CO u16 (hundredths), 10 watchdog time u16, tenths of a second, 0 off.
        Registers up to 19 exist.
"""

import argparse
import asyncio
import logging
import struct
import sys
import time

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.datastore.store import BaseModbusDataBlock
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.server.async_io import StartAsyncSerialServer, StartAsyncTcpServer

HERE = __file__.rsplit("/", 1)[0]


def words(fmt, value):
    raw = struct.pack(">" + fmt, value)
    return list(struct.unpack(f">{len(raw) // 2}H", raw))


def swapped(word):
    return ((word & 0xFF) << 8) | (word >> 8)


class Positioner:
    """The valve's command and its communication watchdog."""

    def __init__(self, fail_safe, start):
        self.fail_safe = fail_safe
        self.command = start
        self.written = start
        self.watchdog_tenths = 0
        self.tripped = False
        self.trips = 0  # number of trips of the watchdog
        self.last_write = time.monotonic()
        self.writes = 0
        self.unguarded_writes = 0
        self.restarts = 0
        self.pv = 0.0
        self.stem = 0.0
        self.pv_override = None
        self.status = 0

    def write(self, value):
        self.command = value
        self.written = value
        self.last_write = time.monotonic()
        self.tripped = False
        self.writes += 1
        if self.watchdog_tenths == 0:
            self.unguarded_writes += 1

    def arm(self, tenths):
        # The time runs from here, not from an old command.
        self.watchdog_tenths = tenths
        self.last_write = time.monotonic()

    def restart(self):
        self.command = self.fail_safe
        self.watchdog_tenths = 0
        self.tripped = False
        self.restarts += 1

    def supervise(self):
        waited = time.monotonic() - self.last_write
        if self.watchdog_tenths and not self.tripped and waited > self.watchdog_tenths / 10:
            self.tripped = True
            self.trips += 1
            self.command = self.fail_safe

    def measured_pv(self):
        return self.pv if self.pv_override is None else self.pv_override

    def text(self):
        return (
            f"STATE co={self.command:.6g} written={self.written:.6g} pv={self.measured_pv():.6g} stem={self.stem:.6g} "
            f"watchdog={'tripped' if self.tripped else 'ok'} trips={self.trips} "
            f"watchdog_register={self.watchdog_tenths} writes={self.writes} "
            f"unguarded_writes={self.unguarded_writes} restarts={self.restarts}"
        )


class InputRegisters(BaseModbusDataBlock):
    def __init__(self, device, unit):
        self.device = device
        self.unit = unit

    def validate(self, address, count=1):
        return count > 0 and 0 <= address and address + count <= 120

    def getValues(self, address, count=1):
        image = [0] * 120
        pv = self.device.measured_pv()
        high, low = words("f", pv)
        image[0:2] = [high, low]
        image[2:4] = [low, high]
        image[4:6] = [swapped(high), swapped(low)]
        image[6:8] = [swapped(low), swapped(high)]
        image[8:12] = words("d", pv)
        thousandths = round(pv * 1000) if abs(pv) < 2e6 else 0
        image[12] = thousandths & 0xFFFF
        image[13] = thousandths & 0xFFFF
        image[14:16] = words("I", thousandths & 0xFFFFFFFF)
        image[16:18] = words("I", thousandths & 0xFFFFFFFF)
        image[18] = self.device.status
        image[20:22] = words("f", self.device.stem)
        image[30] = self.unit
        for register in range(40, 48, 2):
            image[register] = 0xA000 + register
            image[register + 1] = int(time.monotonic() * 1000) & 0xFFFF
        image[100:102] = words("f", 123456.0)
        return image[address : address + count]


class HoldingRegisters(BaseModbusDataBlock):
    def __init__(self, device):
        self.device = device

    def validate(self, address, count=1):
        return count > 0 and 0 <= address and address + count <= 20

    def getValues(self, address, count=1):
        image = [0] * 20
        image[0:2] = words("f", self.device.command)
        image[2] = round(self.device.command * 100) & 0xFFFF
        image[10] = self.device.watchdog_tenths
        return image[address : address + count]

    def setValues(self, address, values):
        if address == 0 and len(values) == 2:
            self.device.write(struct.unpack(">f", struct.pack(">2H", *values))[0])
        elif address == 2 and len(values) == 1:
            self.device.write(values[0] / 100)
        elif address == 10 and len(values) == 1:
            self.device.arm(values[0])


class Server:
    """The pymodbus server, which can be switched off and on."""

    def __init__(self, args, context):
        self.args = args
        self.context = context
        self.port = args.port
        self.server = None

    async def start(self):
        if self.args.serial:
            self.server = await StartAsyncSerialServer(
                context=self.context, framer=ModbusRtuFramer, port=self.args.serial,
                baudrate=self.args.baud, parity="N", ignore_missing_slaves=True, defer_start=True)
            await self.server.start()
            return
        self.server = await StartAsyncTcpServer(
            context=self.context, address=(self.args.host, self.port), defer_start=True,
            ignore_missing_slaves=True, allow_reuse_address=True)
        self.task = asyncio.ensure_future(self.server.serve_forever())
        await self.server.serving
        self.port = self.server.server.sockets[0].getsockname()[1]

    async def stop(self):
        if self.args.serial:
            await self.server.shutdown()
            return
        for handler in list(self.server.active_connections.values()):
            handler.transport.abort()
        await self.server.server_close()
        self.task.cancel()


async def run_plant(args, device, measured):
    """Sets `measured` when the device's PV and stem are those of the plant."""
    plant = await asyncio.create_subprocess_exec(
        "/usr/bin/python3", f"{HERE}/plant_process.py", "--speed", str(args.speed),
        "--start", str(args.start), "--stick", str(args.stick), "--jump", str(args.jump),
        "--mass", str(args.mass), "--play", str(args.play), "--noise", str(args.noise),
        "--load", str(args.load), "--seed", str(args.seed), stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE)
    while line := await plant.stdout.readline():
        pv, stem = line.split()
        device.pv, device.stem = float(pv), float(stem)
        measured.set()
        device.supervise()
        plant.stdin.write(f"{device.command}\n".encode())


async def input_lines():
    """The words of each line of standard input."""
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while line := await reader.readline():
        yield line.decode().split() or [""]


async def answer_commands(device, server):
    async for command, *arguments in input_lines():
        if command == "quit":
            return
        if command == "state":
            print(device.text(), flush=True)
            continue
        if command == "restart":
            await server.stop()
            device.restart()
            await asyncio.sleep(float(arguments[0]) if arguments else 0.0)
            await server.start()
        elif command == "forget":
            device.restart()
        elif command == "status":
            device.status = int(arguments[0])
        elif command == "pv":
            device.pv_override = None if arguments[0] == "auto" else float(arguments[0])
        else:
            print(f"ERROR unknown command {command!r}", flush=True)
            continue
        print("OK", flush=True)


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=0, help="0: any free port")
    parser.add_argument("--serial", help="serial device instead of TCP")
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--units", default="1", help="comma-separated; others are not answered")
    parser.add_argument("--fail-safe", type=float, default=0.0, help="CO units")
    parser.add_argument("--start", type=float, default=0.0, help="CO units")
    parser.add_argument("--speed", type=float, default=1.0, help="plant seconds per second")
    for name in ("stick", "jump", "mass", "play", "noise", "load"):
        parser.add_argument(f"--{name}", type=float, default=0.0, help="of plant_process.py")
    parser.add_argument("--seed", type=int, default=1, help="of the load")
    args = parser.parse_args()

    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    device = Positioner(args.fail_safe, args.start)
    slaves = {
        unit: ModbusSlaveContext(ir=InputRegisters(device, unit), hr=HoldingRegisters(device),
                                 zero_mode=True)
        for unit in map(int, args.units.split(","))
    }
    server = Server(args, ModbusServerContext(slaves=slaves, single=False))
    measured = asyncio.Event()
    plant = asyncio.ensure_future(run_plant(args, device, measured))
    await measured.wait()
    await server.start()
    ready = f"serial={args.serial}" if args.serial else f"port={server.port}"
    print(f"READY {ready}", flush=True)
    await answer_commands(device, server)
    plant.cancel()


if __name__ == "__main__":
    asyncio.run(main())
