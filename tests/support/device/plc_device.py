#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A PLC that controls a flow loop by itself, on pymodbus. It includes PI law, valve and process.

Clients must not write to it. It keeps the function code of every request that reaches it.

Prints "READY port=N" or "READY serial=PATH". Commands on standard input, each answered by a line:
  state              STATE pv=.. co=.. sp=.. stem=.. mode=.. functions=3,4 (sorted, none: -) requests=..
  sp VALUE           set point
  mode NUMBER        1 automatic, 3 cascade (automatic as well), 0 manual, 2 being tuned (CO stays)
  stick VALUE        the stem rests until CO differs by this value, CO units
  restart [SECONDS]  off for this time, then on again
  quit

Registers, 0-based, the same for every unit, f32 ABCD:
  input 0 PV, 2 CO, 4 SP, 6 stem; 8 mode u16; holding the same; coil 0 and discrete input 0: closed (mode 1 or 3)
  (with --loops N the same N times in a row, 9 registers apart)
  120 of each exist, except those that --absent names. A request for an absent one is refused with
  exception --absent-code, or not answered if the code is 0.
"""

import argparse
import asyncio
import collections
import logging
import random

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.datastore.store import BaseModbusDataBlock
from pymodbus.server import async_io

from plant_device import Server, input_lines, words

PERIOD = 0.02  # s


class Plc:
    def __init__(self, args):
        self.args = args
        self.sp = args.sp
        self.co = self.stem = args.sp / args.gain
        self.pv = args.sp
        self.mode = 1
        self.stick = 0.0
        self.integral = self.co
        self.on_the_way = collections.deque([self.stem] * max(1, round(args.dead_time / PERIOD)))
        self.random = random.Random(1)
        self.functions = set()
        self.requests = 0

    def step(self):
        measured = self.measured = self.pv + self.random.gauss(0.0, self.args.noise)
        if self.mode in (1, 3):
            error = self.sp - measured
            self.integral += self.args.ki * error * PERIOD
            self.integral = min(max(self.integral, 0.0), 100.0)
            self.co = min(max(self.args.kp * error + self.integral, 0.0), 100.0)
        else:
            self.integral = self.co
        if abs(self.co - self.stem) > self.stick:
            self.stem = self.co
        self.on_the_way.append(self.stem)
        delayed = self.on_the_way.popleft()
        self.pv += (self.args.gain * delayed - self.pv) * PERIOD / self.args.time_constant

    def image(self):
        one = [word for value in (self.measured, self.co, self.sp, self.stem) for word in words("f", value)] + [self.mode]
        return (one * self.args.loops + [0] * 120)[:120]

    async def run(self):
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            self.step()
            due += PERIOD / self.args.speed
            await asyncio.sleep(max(0.0, due - loop.time()))

    def text(self):
        functions = ",".join(map(str, sorted(self.functions))) or "-"
        return (f"STATE pv={self.pv:.6g} co={self.co:.6g} sp={self.sp:.6g} stem={self.stem:.6g} mode={self.mode} "
                f"functions={functions} requests={self.requests}")


class Values(BaseModbusDataBlock):
    def __init__(self, plc, bits):
        self.plc = plc
        self.bits = bits

    def validate(self, address, count=1):
        asked = range(address, address + count)
        return count > 0 and 0 <= address and address + count <= 120 and not any(k in asked for k in self.plc.args.absent)

    def getValues(self, address, count=1):
        image = [self.plc.mode in (1, 3)] + [False] * 119 if self.bits else self.plc.image()
        return image[address : address + count]

    def setValues(self, address, values):
        pass  # writes are detected by their function code


def keep_function_codes(plc):
    execute = async_io.ModbusBaseRequestHandler.execute

    def kept(self, request, *addr):
        plc.functions.add(request.function_code)
        plc.requests += 1
        asked = range(getattr(request, "address", 0), getattr(request, "address", 0) + getattr(request, "count", 0))
        if plc.args.absent_code != 2 and any(k in asked for k in plc.args.absent):
            if plc.args.absent_code:
                response = request.doException(plc.args.absent_code)
                response.transaction_id, response.unit_id = request.transaction_id, request.unit_id
                self.send(response, *addr)
            return None
        return execute(self, request, *addr)

    async_io.ModbusBaseRequestHandler.execute = kept


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=0, help="0: any free port")
    parser.add_argument("--serial", help="serial device instead of TCP")
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--units", default="1", help="comma-separated; others are not answered")
    parser.add_argument("--sp", type=float, default=20.0, help="m3/h, at rest there")
    parser.add_argument("--gain", type=float, default=0.4, help="m3/h per %%")
    parser.add_argument("--time-constant", type=float, default=1.5, help="s")
    parser.add_argument("--dead-time", type=float, default=0.5, help="s")
    parser.add_argument("--kp", type=float, default=1.5, help="%% per m3/h")
    parser.add_argument("--ki", type=float, default=1.0, help="%% per m3/h and s")
    parser.add_argument("--noise", type=float, default=0.02, help="m3/h, one sigma")
    parser.add_argument("--loops", type=int, default=1, help="that show the same values, at most 13")
    parser.add_argument("--absent", type=int, nargs="*", default=[], help="addresses that do not exist")
    parser.add_argument("--absent-code", type=int, default=2, help="exception for these; 0: no reply")
    parser.add_argument("--speed", type=float, default=1.0, help="plant seconds per second")
    args = parser.parse_args()

    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    plc = Plc(args)
    plc.step()
    keep_function_codes(plc)
    registers, bits = Values(plc, False), Values(plc, True)
    slaves = {
        unit: ModbusSlaveContext(ir=registers, hr=registers, co=bits, di=bits, zero_mode=True)
        for unit in map(int, args.units.split(","))
    }
    server = Server(args, ModbusServerContext(slaves=slaves, single=False))
    running = asyncio.ensure_future(plc.run())
    await server.start()
    ready = f"serial={args.serial}" if args.serial else f"port={server.port}"
    print(f"READY {ready}", flush=True)
    async for command, *arguments in input_lines():
        if command == "quit":
            break
        if command == "state":
            print(plc.text(), flush=True)
            continue
        if command == "sp":
            plc.sp = float(arguments[0])
        elif command == "mode":
            plc.mode = int(arguments[0])
        elif command == "stick":
            plc.stick = float(arguments[0])
        elif command == "restart":
            await server.stop()
            await asyncio.sleep(float(arguments[0]) if arguments else 0.0)
            await server.start()
        else:
            print(f"ERROR unknown command {command!r}", flush=True)
            continue
        print("OK", flush=True)
    running.cancel()


if __name__ == "__main__":
    asyncio.run(main())
