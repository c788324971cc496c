# SPDX-License-Identifier: Apache-2.0
"""One daemon with its loops and devices; injects faults at random times and judges what follows."""

import asyncio
import gc
import math
import os
import pathlib
import random
import resource
import shutil
import signal
import sqlite3
import stat
import struct
import tempfile
import time

import bench_daemon
from converter import (CO_RANGE, HALF_PERIOD_S, NOT_TAKEN, OUT_MA, READ_FAILS, READ_HANGS, SOUND,
                       WRITE_FAILS, current_ma)
from daemon import HANGING, WATCHDOG_S, Daemon
from device import STEP_S
from loops import (BAD_PV, CURRENT, ENABLE_OPEN, HIGH, KINDS, LOOP, LOW, RATE, RESPONSE_S, SENSOR,
                   SET_POINT, SPOILED, STOP, VALVE, make_loop, without_read_back)

BAD_PV_S = 2.0  # from a bad PV to an output at its safe value; a silent PV is bad once older than `max_age`
SLACK_S = 1.0  # beyond a stated time, because the machine has no real-time rights
NOT_JUDGED_S = 0.3  # after a longer stall of this process, times are not judged

CELL_KINDS = {
    "SIGSTOP, short": 4, "SIGSTOP, long": 4, "kill -9, restart": 4, "kill -9, --safe, restart": 3,
    "SIGTERM, restart": 3, "starts without a known output": 3, "reload: tuning changed": 4, "reload: units changed": 3,
    "reload: io changed": 3, "reload: broken file": 4, "reload: file half written": 3, "reload during an order": 3, "disk full": 3,
    "disk slow": 2, "descriptors exhausted": 3, "memory short": 3, "mailbox overflow": 3,
    "wall clock jumps": 3, "control socket abused": 3, "main thread hangs": 1, "loop thread hangs": 1,
    "helper thread hangs": 1}
# They take a minute each, so there are few of them.
HANG_S = 60.0
# Alarms of a window, the routine or the twin; the others report the injected faults.
VALVE_ALARMS = {"stiction", "backlash", "hysteresis", "low_air_supply", "unknown", "model_gap"}
for what in [*HANGING, "all"]:
    CELL_KINDS[f"disk hangs 60 s, {what}"] = 0.2
CELL_KINDS["disk hangs, SIGTERM"] = 0.5
SLOW = ("journal", "evidence", "recorder")
for what in SLOW:
    CELL_KINDS[f"disk slow, {what}"] = 1
HEARTBEAT_S = 1.5  # without one the daemon takes its Modbus master for lost


def loop_kinds():
    return list(dict.fromkeys(kind for kinds in KINDS.values() for kind in kinds))


class Master:
    """A Modbus TCP client of the daemon; one request at a time."""

    SHELVES_AT, SHELVES = 46, 5  # holding registers of the first loop, minutes

    def __init__(self, reader, writer):
        self.reader, self.writer = reader, writer
        self.done = 0
        self.slowest_s = 0.0

    @staticmethod
    async def connect(port):
        return Master(*await asyncio.wait_for(asyncio.open_connection("127.0.0.1", port), 5.0))

    async def ask(self, pdu):
        self.writer.write(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
        await self.reader.readexactly(7)
        function = await self.reader.readexactly(1)
        if function != pdu[:1]:
            raise OSError(f"exception {(await self.reader.readexactly(1))[0]}")
        await self.reader.readexactly(4)
        self.done += 1

    async def beat(self, number):
        await self.ask(struct.pack(">BHH", 6, 0, number % 0x10000))

    async def beat_for_ever(self, number):
        while True:
            number += 1
            begin = time.monotonic()
            await self.beat(number)
            self.slowest_s = max(self.slowest_s, time.monotonic() - begin)
            await asyncio.sleep(0.2)

    async def shelve_all_for_ever(self):
        minutes = 1
        while True:
            await self.ask(struct.pack(f">BHHB{self.SHELVES}H", 16, self.SHELVES_AT, self.SHELVES,
                                       2 * self.SHELVES, *[minutes] * self.SHELVES))
            minutes = 1 - minutes
            await asyncio.sleep(0.2)

    def close(self):
        self.writer.close()


class Cell:
    def __init__(self, index, seed, program, shim, loops):
        self.index = index
        self.random = random.Random(f"{seed}/{index}")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix=f"loopwarden-faults-{index}-"))
        (self.folder / "config/loops.d").mkdir(parents=True)
        self.daemon = Daemon(program, self.folder, shim)
        self.period = self.random.choice((0.05, 0.1))
        self.max_age = self.random.choice((0.4, 3.0))
        self.recovery = self.random.choice(("previous_mode", "previous_mode", "manual"))
        self.loops = [make_loop(i, index, seed, self.folder, self.daemon.board, self.period, self.random)
                      for i in range(loops)]
        self.modbus_port = bench_daemon.free_port(self.random)
        self.analog = [loop for loop in self.loops if loop.wiring == "analog"]
        self.results = []  # (kind, what the round held, failures)
        self.not_judged = 0
        self.orders = []  # commands confirmed as written to the disk
        self.order_number = 0
        self.overdue = False
        self.lives = 0

    # --- surroundings ----------------------------------------------------------------------------

    async def tick(self):
        due = time.monotonic()
        self.stall = 0.0
        while True:
            due += STEP_S
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            now = time.monotonic()
            self.take_deeds()
            late = now - due
            self.stall = max(self.stall * 0.99, late)
            while due + STEP_S < now:
                for loop in self.loops:
                    loop.device.step(due)
                due += STEP_S
            for loop in self.loops:
                loop.device.worst_tick_s = self.stall
                loop.device.step(now)
            self.daemon.hear()

    def take_deeds(self):
        """Reads the daemon's writes to its converters and lines since the last call."""
        for at, source, value in self.daemon.board.deeds():
            for loop in self.analog:
                if loop.device.take(source, value, at):
                    break

    def loop_text(self, loop, low=LOW, high=HIGH, rate=RATE, ki=0.4, stop=STOP, told=True):
        """`told`: a read-back reports the output, otherwise the output is unknown."""
        io = loop.io_text() if told else without_read_back(loop.io_text())
        return LOOP.format(name=loop.name, period=self.period, max_age=self.max_age, low=low,
                           high=high, rate=rate, ki=ki, stop=stop, recovery=self.recovery,
                           start="automatic" if told else "manual") + io

    def loop_file(self, loop):
        return self.folder / f"config/loops.d/{loop.name}.yaml"

    def write_config(self):
        text = (f"runtime_directory: {self.folder}\nstate_directory: {self.folder}/state\n"
                "recording: {sync: 1}\n"
                f"modbus_server:\n  port: {self.modbus_port}\n  writes: true\n"
                "  clients: [{peer: 127.0.0.1, writes: true}]\n"
                f"  master_heartbeat: {{timeout: {HEARTBEAT_S}, action: report}}\nlinks:\n")
        for loop in self.loops:
            text += loop.links_text()
            self.loop_file(loop).write_text(self.loop_text(loop))
        (self.folder / "config/loopwardend.yaml").write_text(text)

    async def status(self):
        answer = await self.daemon.ask({"request": "status"})
        if not answer or not answer.get("ok"):
            return {}
        self.daemon_status = answer["daemon"]
        states = {loop["name"]: loop for loop in answer["loops"]}
        for loop in self.loops:
            loop.device.violations += loop.device.shown_wrong(states.get(loop.name, {}))
        return states

    def cease(self):
        """The daemon's commands are about to cease: its I/O threads may put out the safe current."""
        for loop in self.analog:
            loop.device.ceased = True

    async def wait(self, seconds):
        await asyncio.sleep(seconds)

    # --- bringing it back ------------------------------------------------------------------------

    async def recover(self, patience_s=15.0):
        """Waits until every loop controls again; what is wrong in words if one does not."""
        end = time.monotonic() + patience_s
        states, trouble = {}, ["no answer from the daemon"]
        while time.monotonic() < end:
            if not self.daemon.alive():
                return [f"the daemon ended with {self.daemon.process.poll()}"]
            states = await self.status()
            trouble = []
            for loop in self.loops:
                state = states.get(loop.name, {})
                if state.get("fault") == "none" and state.get("requested_mode") == "MAN":
                    await self.daemon.ask({"request": "set", "loop": loop.name, "mode": "auto",
                                           "set_point": SET_POINT})
                elif state.get("fault") == "none" and state.get("set_point_wanted") != SET_POINT:
                    await self.operator_moves(loop, SET_POINT)
                pv = state.get("pv")
                if (state.get("fault"), state.get("mode")) != ("none", "AUTO"):
                    trouble.append(f"{loop.name}: {state.get('fault')}, {state.get('mode')}")
                elif pv is None or abs(pv - SET_POINT) > 0.5 or abs(loop.device.pv - SET_POINT) > 0.5:
                    trouble.append(f"{loop.name}: PV {pv}, not at its set point")
            trouble += self.lines_wrong()
            if not trouble:
                for loop in self.analog:
                    loop.device.ceased = False
                return []
            await asyncio.sleep(0.1)
        return [f"not back after {patience_s:.0f} s: {t}" for t in trouble]

    def lines_wrong(self):
        """Of loops that control: the relay energised, the alive line moving."""
        now, found = time.monotonic(), []
        for loop in self.analog:
            if not loop.device.energised():
                found.append(f"{loop.name}: the alarm relay is not energised")
            if now - loop.device.last_edge > HALF_PERIOD_S + SLACK_S:
                found.append(f"{loop.name}: no edge of the alive line")
        return found

    async def begin_life(self):
        self.daemon.start()
        self.lives += 1
        self.baseline = None

    def take_baseline(self):
        self.baseline = (self.daemon.files(), sum(1 for _ in os.listdir(f"/proc/{self.daemon.pid}/task")),
                         self.daemon.field_kib("VmRSS"), time.monotonic())

    def leaks(self):
        if self.baseline is None:
            self.take_baseline()
            return []
        files, threads, rss, _ = self.baseline
        found = []
        opened, segments = self.daemon.files()
        # The connection of the operator may be open or closed. SQLite keeps a descriptor for the journal's next reader.
        # The journal may be saving what alarms remember.
        if opened - segments > files[0] - files[1] + 3 or segments > len(self.loops):
            found.append(f"{opened} descriptors, {segments} of segments; {files[0]}, {files[1]} at first")
        now = len(os.listdir(f"/proc/{self.daemon.pid}/task"))
        if now != threads:
            found.append(f"{now} threads, {threads} at first")
        grown = self.daemon.field_kib("VmRSS") - rss
        if grown > 8192:
            found.append(f"{grown} KiB more than at first")
        return found

    def unexpected(self):
        """Returns observations of the devices that must never occur."""
        found = []
        for loop in self.loops:
            found += [f"{loop.name}: {v}" for v in loop.violations()][:3]
        return found

    def judged_by_time(self):
        if self.stall > NOT_JUDGED_S:
            self.not_judged += 1
            return False
        return True

    # --- faults of one loop ----------------------------------------------------------------------

    async def spoil_loop(self, loop, kind):
        """Injects one fault into one loop and takes it back; returns (kind, failures)."""
        rng, device, failures = self.random, loop.device, []
        fronts = loop.fronts()
        await self.wait(rng.uniform(0.0, 0.5))
        lasts = rng.choice((rng.uniform(0.05, 0.5), rng.uniform(2.0, 3.5)))
        if kind in SPOILED:
            victims = fronts if rng.random() < 0.5 else {rng.choice(sorted(fronts, key=id))}
            for front in victims:
                front.spoil = SPOILED[kind]
                front.slowest_s = 0.0
            await self.wait(lasts)
            if kind == "reply in pieces":
                # The replies are slow but correct. They must cause no fault, provided this machine delivered them in time.
                in_time = all(front.slowest_s < RESPONSE_S / 2 for front in victims)
                self.not_judged += not in_time
                state = (await self.status()).get(loop.name, {})
                if in_time and state.get("fault") not in ("none", "late cycle") and self.judged_by_time():
                    failures.append(f"{state.get('fault')}, although every reply was sound")
            if kind == "silent link" and lasts > 2.0 and loop.positioner in victims:
                failures += device.unprotected()
            for front in victims:
                front.spoil = None
        elif kind in SENSOR:
            failures += await self.spoil_sensor(loop, kind, lasts)
        elif loop.wiring == "analog" and kind not in VALVE:
            failures += await self.spoil_analog(loop, kind, lasts)
        elif kind in ("noise between frames", "line never silent", "serial adapter unplugged"):
            await self.spoil_line(loop.line, kind, lasts)
        elif kind == "device restart":
            for front in fronts:
                await front.close()
            device.restart()
            await self.wait(rng.choice((0.0, rng.uniform(0.1, 1.5))))
            for front in fronts:
                await front.open()
        elif kind == "device forgets":
            device.restart()
            await self.wait(lasts)
        elif kind in ("link closed", "transmitter link closed"):
            victims = fronts if kind == "link closed" else {loop.transmitter}
            for front in victims:
                await front.close()
            await self.wait(lasts)
            if lasts > 2.0:
                failures += await self.expect_silent(loop, loop.positioner in victims, lasts)
            for front in victims:
                await front.open()
        elif kind == "read-back dies with the link":
            for front in fronts:
                await front.close()
            device.stem_fault = lambda stem: math.nan
            await self.wait(2.0)  # the device's watchdog has moved the valve
            for front in fronts:
                await front.open()
            failures += await self.stays_untouched([loop], rng.uniform(0.5, 2.0))
            failures += await self.first_output(loop)
            device.stem_fault = None
        elif kind == "transmitter silent":
            loop.transmitter.spoil = "silent"
            await self.wait(2.0)
            failures += await self.expect_silent(loop, loop.positioner is loop.transmitter, 2.0)
            loop.transmitter.spoil = None
        elif kind == "valve not following":
            device.valve_stuck = True
            await self.wait(lasts)
            device.valve_stuck = False
        elif kind == "valve sticks and slips":
            for _ in range(5):
                device.valve_stuck = True
                await self.wait(rng.uniform(0.05, 0.6))
                device.valve_stuck = False
                await self.wait(rng.uniform(0.02, 0.1))
        elif kind == "read-back NaN":
            device.stem_fault = lambda stem: math.nan
            await self.wait(lasts)
            device.stem_fault = None
        elif kind == "device watchdog expires":
            device.trip()
            await self.wait(lasts)
        return kind, failures

    async def stays_untouched(self, loops, seconds):
        """If the output is unknown, the device is not written, and no CO is shown."""
        self.take_deeds()
        deeds = {loop: loop.device.deeds for loop in loops}
        await self.wait(seconds)
        states = await self.status()
        self.take_deeds()
        failures = []
        for loop in loops:
            state, more = states.get(loop.name, {}), loop.device.deeds - deeds[loop]
            if more:
                failures.append(f"{loop.name}: {more} deeds at a device of unknown output")
            if state.get("co") is not None:
                failures.append(f"{loop.name}: shows CO {state['co']} of an output that is not known")
            if state and state.get("fault") in ("none", "starting"):
                failures.append(f"{loop.name}: shows '{state['fault']}' with an unknown output")
        return failures

    async def first_output(self, loop):
        """The operator's command defines the output, arms the watchdog and reaches the device."""
        output, device, end = self.random.uniform(2.0, 6.0), loop.device, time.monotonic() + 5.0
        # The output moves directly to the commanded value.
        device.steps_allowed = True
        answer = None
        while time.monotonic() < end:
            # Refused while a fault that ends by itself is there.
            if not (answer and answer.get("ok")):
                answer = await self.daemon.ask({"request": "set", "loop": loop.name, "mode": "man",
                                                "output": output})
            self.take_deeds()
            if abs(device.command - output) < 0.02 and device.guarded():
                break
            await self.wait(0.05)
        device.steps_allowed = False
        if abs(device.command - output) >= 0.02:
            return [f"{loop.name}: output at {device.command:.3f} instead of the {output:.3f} ordered: {answer}"]
        return [] if device.guarded() else [f"{loop.name}: the first output armed no watchdog"]

    async def spoil_line(self, line, kind, lasts):
        if kind == "serial adapter unplugged":
            line.unplug()
            await self.wait(lasts)
            line.plug()
        else:
            # A second of noise has no gap as long as the response timeout.
            pauses = (0.02, 0.5) if kind == "noise between frames" else (0.001, 0.01)
            await line.noise(*pauses, time.monotonic() + lasts)

    async def spoil_analog(self, loop, kind, lasts):
        rng, device, failures = self.random, loop.device, []
        long = lasts > 2.0
        if kind in CURRENT:
            (low, high), reason = CURRENT[kind]
            current = rng.uniform(low, high)
            device.pv_current = lambda true: current
            await self.wait(lasts)
            if long:
                # A held value has its own time: between the limits it turns stale in the end.
                failures += await self.expect_fault(loop, {"bad PV"}, {reason, "stale"}
                                                    if "between" in kind else reason)
                failures += self.expect_output(loop, BAD_PV)
            device.pv_current = None
        elif kind == "read-back wire broken":
            device.position_current = lambda true: 0.0
            await self.wait(lasts)
            device.position_current = None
        elif kind in ("input unreadable", "input is no number"):
            if kind == "input unreadable":
                device.inputs.set_mode(device.PV_RAW, READ_FAILS)
            else:
                device.text = rng.choice(("", "\n", "x\n", "12 34\n", "nan\n", "inf\n", "1e999\n", "-\n",
                                          "0x1F\n", "12.5.1\n", "\0\0\0"))
            await self.wait(lasts)
            if long:
                failures += await self.expect_fault(loop, {"bad PV"}, "device error")
                failures += self.expect_output(loop, BAD_PV)
            device.inputs.set_mode(device.PV_RAW, SOUND)
            device.text = None
        elif kind == "input hangs":
            # This stops the loop's I/O thread: no output is written, relay included, and the alive line stops.
            device.inputs.set_mode(device.PV_RAW, READ_HANGS)
            await self.wait(lasts)
            if long:
                failures += await self.expect_fault(loop, {"output lost"}, relay=False)
                failures += device.unprotected() if self.judged_by_time() else []
            device.inputs.set_mode(device.PV_RAW, SOUND)
        elif kind == "converter in vanishes":
            device.inputs.unplug()
            await self.wait(lasts)
            if long:
                failures += await self.expect_fault(loop, {"bad PV"}, "link lost")
                failures += self.expect_output(loop, BAD_PV)
            device.plug_inputs()
        elif kind == "converter out vanishes":
            raw = round(current_ma(device.command, CO_RANGE) / OUT_MA)
            device.outputs.unplug()
            await self.wait(lasts)
            if long:
                failures += await self.expect_fault(loop, {"output lost"})
            device.plug_outputs(rng.choice((0, raw)))
        elif kind == "converters renumbered":
            device.outputs.unplug()
            device.inputs.unplug()
            device.plug_inputs()
            device.plug_outputs()
        elif kind == "converter out restarts":
            device.outputs.write(device.OUT_RAW, 0)
            device.command = device.output_of(0)
            await self.wait(lasts)
        elif kind in ("output not writable", "output not taken"):
            refused = await self.write_errors(loop)
            device.outputs.set_mode(device.OUT_RAW, WRITE_FAILS if "writable" in kind else NOT_TAKEN)
            await self.operator_moves(loop, 7.0)
            await self.wait(lasts)
            if long and kind == "output not writable":
                failures += await self.expect_fault(loop, {"output lost"})
            elif long and await self.write_errors(loop) <= refused and self.judged_by_time():
                # The fault is raised and clears: the loop holds the value that the converter holds.
                failures.append("not detected: the converter keeps its old value")
            device.outputs.set_mode(device.OUT_RAW, SOUND)
            await self.operator_moves(loop, SET_POINT)
        else:
            failures += await self.spoil_contact(loop, kind, lasts)
        return failures

    async def spoil_contact(self, loop, kind, lasts):
        rng, device, failures = self.random, loop.device, []
        if kind == "enable contact bounces":
            # Bursts shorter than `debounce`, by a contact that is closed otherwise: they must have no effect.
            begin, longest = time.monotonic(), 0.0
            while time.monotonic() < begin + lasts:
                burst = time.monotonic()
                for closed in (False, True, False, True):
                    device.close_contact(closed)
                    await self.wait(rng.uniform(0.001, 0.005))
                longest = max(longest, time.monotonic() - burst)
                await self.wait(rng.uniform(0.1, 0.3))
            state = (await self.status()).get(loop.name, {})
            if longest > 0.03 or self.stall > 0.03:
                self.not_judged += 1
            elif state.get("fault") not in ("none", "late cycle"):
                failures.append(f"{state.get('fault')} by a contact that bounces")
            return failures
        if kind == "enable contact opens":
            for _ in range(rng.choice((0, 5))):
                device.close_contact(False)
                await self.wait(rng.uniform(0.001, 0.01))
                device.close_contact(True)
                await self.wait(rng.uniform(0.001, 0.01))
            device.close_contact(False)
        else:
            device.board.refuse(device.contact, 1)
        await self.wait(lasts)
        if lasts > 2.0:
            failures += await self.expect_fault(loop, {"enable open"})
            failures += self.expect_output(loop, ENABLE_OPEN)
        device.board.refuse(device.contact, 0)
        device.close_contact(True)
        return failures

    async def spoil_sensor(self, loop, kind, lasts):
        device, rng = loop.device, self.random
        stuck = device.pv
        offset = rng.uniform(-2.0, 2.0)
        if kind == "sensor failed":
            device.status = rng.randint(1, 65535)
        else:
            device.pv_fault = {
                "sensor NaN": lambda pv: math.nan,
                "sensor infinite": lambda pv: math.copysign(math.inf, offset),
                "sensor out of range": lambda pv: 42.0 if offset > 0 else -5.0,
                "sensor stuck": lambda pv: stuck,
                "sensor jumps": lambda pv: pv + offset,
                "sensor noisy": lambda pv: pv + rng.gauss(0.0, 0.5)}[kind]
        if kind == "sensor stuck":
            # A frozen value shows once the output moves.
            await self.operator_moves(loop, 7.0)
        await self.wait(lasts)
        failures = []
        if kind in ("sensor failed", "sensor NaN", "sensor infinite", "sensor out of range") and lasts > 2.0:
            failures += await self.expect_fault(loop, {"bad PV"}, SENSOR[kind])
            failures += self.expect_output(loop, BAD_PV)
        if kind == "sensor stuck":
            await self.wait(max(0.0, 3.5 - lasts))
            failures += await self.expect_fault(loop, {"bad PV"}, "frozen")
            await self.operator_moves(loop, SET_POINT)
        if kind == "sensor failed":
            device.status = 0
        device.pv_fault = None
        return failures

    async def expect_fault(self, loop, faults, reason=None, relay=True):
        state = (await self.status()).get(loop.name, {})
        if not self.judged_by_time() or state.get("fault") == "late cycle":
            return []
        if state.get("fault") not in faults:
            return [f"{loop.name}: shows '{state.get('fault')}' instead of {' or '.join(sorted(faults))}"]
        if reason and state.get("pv_reason") not in (reason if isinstance(reason, set) else {reason}):
            return [f"{loop.name}: PV is '{state.get('pv_reason')}' instead of '{reason}'"]
        ne107 = "function_check" if state.get("fault") == "enable open" else "failure"
        if state.get("ne107") != ne107 and reason != "frozen":
            return [f"{loop.name}: NE 107 is '{state.get('ne107')}' while {state.get('fault')}"]
        if relay and loop.wiring == "analog" and loop.device.energised():
            return [f"{loop.name}: the alarm relay is energised while {state.get('fault')}"]
        return []

    async def expect_silent(self, loop, positioner_too, waited):
        """The transmitter has been silent for `waited`, at least 2 s. It alone counts once PV is older than `max_age`."""
        if positioner_too:
            return await self.expect_fault(loop, {"output lost"})
        await self.wait(max(0.0, self.max_age + BAD_PV_S - waited))
        failures = await self.expect_fault(loop, {"bad PV"}, {"link lost", "stale"})
        return failures + self.expect_output(loop, BAD_PV)

    def expect_output(self, loop, value):
        """The stated time: hold for 0.3 s and travel at the rate limit, all within `BAD_PV_S` waited."""
        self.take_deeds()
        if not self.judged_by_time() or abs(loop.device.command - value) < 0.02:
            return []
        return [f"{loop.name}: output at {loop.device.command:.3f} instead of {value} in time"]

    # --- faults of the daemon and its machine ----------------------------------------------------

    async def restart(self, code=None):
        await self.begin_life()
        return []

    async def spoil_cell(self, kind):
        rng, daemon, failures = self.random, self.daemon, []
        await self.wait(rng.uniform(0.0, 0.5))
        if kind.startswith("SIGSTOP"):
            self.cease()
            daemon.signal(signal.SIGSTOP)
            await self.wait(rng.uniform(0.05, 0.5) if "short" in kind else rng.uniform(1.3, 2.5))
            if "long" in kind:
                for loop in self.loops:
                    failures += [f"{loop.name}: {text}" for text in loop.device.unprotected()]
            daemon.signal(signal.SIGCONT)
            self.daemon.fed = time.monotonic()
        elif kind.startswith("kill -9"):
            daemon.signal(signal.SIGKILL)
            await daemon.ended()
            if "--safe" in kind:
                failures += await self.run_safe()
            else:
                await self.wait(rng.choice((0.0, rng.uniform(0.0, 1.5))))
            await self.begin_life()
        elif kind == "starts without a known output":
            failures += await self.start_untold()
        elif kind == "SIGTERM, restart":
            failures += await self.end_well()
            await self.begin_life()
        elif kind == "reload: tuning changed":
            failures += await self.change_tuning()
        elif kind in ("reload: units changed", "reload: io changed"):
            failures += await self.change_meaning(self.in_percent if "units" in kind else self.rewired)
        elif kind == "reload: broken file":
            failures += await self.break_file()
        elif kind == "reload: file half written":
            failures += await self.write_by_halves()
        elif kind == "reload during an order":
            failures += await self.reload_during_orders()
        elif kind in ("disk full", "disk slow"):
            if kind == "disk full":
                daemon.disk_full(1)
            else:
                daemon.disk_slow(rng.randint(10, 500))
            for _ in range(3):
                await self.operate()
                await self.wait(rng.uniform(0.1, 1.0))
            daemon.disk_full(0)
            daemon.disk_slow(0)
            failures += await self.journal_works_again()
        elif kind.startswith("disk slow"):
            failures += await self.slow_disk(kind.split(", ")[1])
        elif kind == "disk hangs, SIGTERM":
            failures += await self.end_on_hung_disk()
        elif kind.startswith("disk hangs"):
            what = kind.split(", ")[1]
            failures += await self.hang_disk(list(HANGING) if what == "all" else [what])
        elif kind == "descriptors exhausted":
            failures += await self.exhaust(resource.RLIMIT_NOFILE, 3)
        elif kind == "memory short":
            room = rng.choice((0, 64, 512)) * 1024
            failures += await self.exhaust(resource.RLIMIT_AS, daemon.field_kib("VmSize") * 1024 + room)
        elif kind == "mailbox overflow":
            failures += await self.overflow_mailbox()
        elif kind == "wall clock jumps":
            daemon.clock_offset(rng.choice((-1, 1)) * rng.choice((1, 3600, 86400 * 365, 86400 * 3650)))
            await self.operate()
            await self.wait(rng.uniform(0.3, 1.5))
            states = await self.status()
            for loop in self.loops:
                fault = states.get(loop.name, {}).get("fault")
                if fault not in ("none", "late cycle") and self.judged_by_time():
                    failures.append(f"{loop.name}: {fault} by a jump of the wall clock")
            daemon.clock_offset(0)
        elif kind == "control socket abused":
            failures += await self.abuse_socket()
        elif kind.endswith("thread hangs"):
            failures += await self.hang(kind)
        return kind, failures

    async def untold(self):
        """Waits until each loop reports that its output is unknown."""
        end, states = time.monotonic() + 10.0, {}
        while time.monotonic() < end:
            states = await self.status()
            if states and all(s.get("fault") == "output unknown" for s in states.values()):
                return [f"{name}: NE 107 is '{s.get('ne107')}' with an unknown output"
                        for name, s in states.items() if s.get("ne107") != "function_check"]
            await asyncio.sleep(0.05)
        return [f"{name}: shows '{s.get('fault')}' with an unknown output" for name, s in states.items()
                if s.get("fault") != "output unknown"] or ["no answer from the daemon"]

    async def start_untold(self):
        """Loops without read-back and start value, whatever happens, until the operator gives each an output."""
        rng, daemon, failures = self.random, self.daemon, []
        daemon.signal(signal.SIGKILL)
        await daemon.ended()
        for loop in self.loops:
            self.loop_file(loop).write_text(self.loop_text(loop, told=False))
        self.take_deeds()
        deeds = {loop: loop.device.deeds for loop in self.loops}
        await self.begin_life()
        for _ in range(rng.randint(1, 3)):
            failures += await self.untold()
            surprise = rng.choice(("kill", "stop", "device", "link", "none"))
            if surprise == "kill":
                daemon.signal(signal.SIGKILL)
                await daemon.ended()
                await self.begin_life()
            elif surprise == "stop":
                daemon.signal(signal.SIGSTOP)
                await self.wait(rng.uniform(0.3, 1.5))
                daemon.signal(signal.SIGCONT)
                daemon.fed = time.monotonic()
            for loop in self.loops:
                if surprise == "device" and loop.wiring != "analog":
                    loop.device.restart()
                if surprise == "link":
                    for front in loop.fronts():
                        front.cut()
            await self.wait(rng.uniform(0.1, 0.6))
        failures += await self.untold() + await self.stays_untouched(self.loops, rng.uniform(0.3, 1.0))
        failures += [f"{loop.name}: its device was touched before the first output was known"
                     for loop in self.loops if loop.device.deeds != deeds[loop]]
        for loop in self.loops:
            failures += await self.first_output(loop)
        daemon.signal(signal.SIGKILL)
        await daemon.ended()
        for loop in self.loops:
            self.loop_file(loop).write_text(self.loop_text(loop))
        await self.begin_life()
        return failures

    async def run_safe(self):
        for loop in self.loops:
            loop.device.steps_allowed = True  # --safe moves directly to the stop action, as documented
        code, text = await self.daemon.safe()
        self.take_deeds()
        for loop in self.loops:
            loop.device.steps_allowed = False
        if code != 0:
            return [f"--safe ended with {code}: {text.strip()[-200:]}"]
        return [f"{loop.name}: --safe left the output at {loop.device.command:.3f}"
                for loop in self.loops if abs(loop.device.command - STOP) > 0.01]

    async def end_well(self):
        self.daemon.signal(signal.SIGTERM)
        begin = time.monotonic()
        code = await self.daemon.ended()
        self.take_deeds()
        if code != 0:
            return [f"SIGTERM: ended with {code} after {time.monotonic() - begin:.1f} s"]
        return ([f"{loop.name}: SIGTERM left the output at {loop.device.command:.3f}"
                 for loop in self.loops if abs(loop.device.command - STOP) > 0.01] +
                [f"{loop.name}: SIGTERM left the alarm relay energised"
                 for loop in self.analog if loop.device.energised()])

    async def reload(self, *outcomes):
        """By command or by SIGHUP; what is wrong unless it ends as one of `outcomes`."""
        if self.random.random() < 0.5:
            since = self.daemon.log_size()
            self.daemon.signal(signal.SIGHUP)
            words = {"in_force": "done, everything in", "waits": "done, not everything in",
                     "refused": "reload refused"}
            end = time.monotonic() + 10.0
            while time.monotonic() < end:
                ended = [outcome for outcome, word in words.items() if word in self.daemon.log(since)]
                if ended:
                    return [] if ended[0] in outcomes else [f"SIGHUP: {ended[0]} instead of {outcomes}"]
                await asyncio.sleep(0.05)
            return ["SIGHUP: the log does not say what became of it"]
        result = await self.reload_by_command()
        if result is None:
            return ["reload: not done within 10 s"]
        return [] if result["outcome"] in outcomes else [
            f"reload: {result['outcome']} instead of {outcomes}: {result['lines']}"]

    async def reload_by_command(self):
        """Returns the daemon's status after it has finished."""
        answer = await self.daemon.ask({"request": "reload"})
        end = time.monotonic() + 10.0
        while answer and answer.get("ok") and time.monotonic() < end:
            state = await self.daemon.ask({"request": "reload_state", "reload": answer["reload"]})
            if state and state.get("state") == "done":
                return state
            await asyncio.sleep(0.02)
        return None

    async def sound(self, what):
        """No loop has a fault by it, and each shows the range that it has had from the start."""
        states, failures = await self.status(), []
        for each in self.loops:
            state = states.get(each.name, {})
            if state.get("fault") not in ("none", "late cycle") and self.judged_by_time():
                failures.append(f"{each.name}: {state.get('fault')} by {what}")
            if state and (state["co_range"], state["co_unit"]) != ([0.0, 10.0], "V"):
                failures.append(f"{each.name}: output of {state['co_range']} {state['co_unit']} by {what}")
        return failures

    def in_percent(self, loop):
        """The loop's file in another unit: every number of CO ten times as large."""
        text = self.loop_text(loop, low=10 * LOW, high=10 * HIGH, rate=10 * RATE, ki=4.0, stop=10 * STOP)
        for volts, percent in (("unit: V, range: [0, 10]", "unit: '%', range: [0, 100]"),
                               ("kp: 0.3494", "kp: 3.494"), ("then: 1.5", "then: 15"),
                               ("enable_open: 0.8", "enable_open: 8"),
                               (f"range: {list(CO_RANGE)}", f"range: {[10 * x for x in CO_RANGE]}")):
            text = text.replace(volts, percent)
        return text

    def rewired(self, loop):
        """Another register or channel, and with it the tuning of what is there."""
        text = self.loop_text(loop, high=6.0, ki=0.1, stop=3.0)
        old, new = self.random.choice(
            (("channel: current0", "channel: current1"), ("channel: voltage1", "channel: voltage3"))
            if loop.wiring == "analog" else
            (("command: {address: 0", "command: {address: 4"), ("address: 20", "address: 24"),
             ("comm_loss: {timeout: 1.0", "comm_loss: {timeout: 2.0")))
        assert old in text
        return text.replace(old, new)

    async def change_meaning(self, changed):
        """Loops whose numbers would change their meaning keep their configuration; all others get the new one."""
        rng = self.random
        kept = rng.sample(self.loops, rng.randint(1, len(self.loops)))
        for loop in self.loops:
            self.loop_file(loop).write_text(changed(loop) if loop in kept else self.loop_text(loop, ki=0.3))
        result, failures = await self.reload_by_command(), []
        if result is None or result["outcome"] != "waits":
            failures.append(f"reload: {result and (result['outcome'], result['lines'])} instead of waits")
        else:
            wrong = {plan["loop"]: plan for plan in result["plan"]["loops"]
                     if (plan["decision"] == "keep") != (plan["loop"] in [loop.name for loop in kept])
                     or plan["decision"] == "keep" and plan["applied"]}
            failures += [f"{name}: {plan['decision']}, applied {plan['applied']}"
                         for name, plan in wrong.items()]
        for _ in range(rng.randint(0, 2)):
            failures += await self.reload("waits")
        await self.wait(rng.uniform(0.2, 1.5))
        failures += await self.sound("a file that is to wait")
        for loop in self.loops:
            self.loop_file(loop).write_text(self.loop_text(loop))
        return failures + await self.reload("in_force")

    async def break_file(self):
        rng = self.random
        loop = rng.choice(self.loops)
        path, good = self.loop_file(loop), self.loop_text(loop)
        # Bytes may happen to be sound; a loop whose file is gone runs on.
        outcomes = {"bytes": ("refused", "waits", "in_force"), "gone": ("waits", "refused")}
        how = rng.choice(("bytes", "key", "value", "gone", "empty", "folder"))
        if how == "bytes":
            raw = bytearray(good.encode())
            for _ in range(20):
                raw[rng.randrange(len(raw))] = rng.randrange(256)
            path.write_bytes(raw)
        elif how == "key":
            path.write_text(good.replace("rate_limit", "rate_limti"))
        elif how == "value":
            path.write_text(good.replace("kp: 0.3494", f"kp: {rng.choice(('.nan', '-1', 'x', '1e999'))}"))
        elif how == "gone":
            path.unlink()
        elif how == "empty":
            path.write_text("")
        elif how == "folder":
            path.unlink()
            path.mkdir()
        failures = await self.reload(*outcomes.get(how, ("refused",)))
        await self.wait(rng.uniform(0.2, 0.6))
        failures += await self.sound(f"a broken file ({how})")
        if path.is_dir():
            path.rmdir()
        path.write_text(good)
        return failures + await self.reload("in_force")

    async def write_by_halves(self):
        """A reload during an editor's write reads half a file."""
        rng, failures = self.random, []
        loop = rng.choice(self.loops)
        text = self.loop_text(loop, high=rng.uniform(7.0, 9.5), ki=rng.uniform(0.1, 0.6))
        cut = rng.randint(1, text.index("poll_period"))
        with open(self.loop_file(loop), "w", encoding="utf-8") as file:
            file.write(text[:cut])
            file.flush()
            for _ in range(rng.randint(1, 3)):
                failures += await self.reload("refused")
            failures += await self.sound("half a file")
            file.write(text[cut:])
        failures += await self.reload("in_force", "waits")
        await self.wait(rng.uniform(0.0, 0.5))
        self.loop_file(loop).write_text(self.loop_text(loop))
        return failures + await self.reload("in_force")

    def tuned(self, loop, lowest_high):
        rng = self.random
        return self.loop_text(loop, low=rng.uniform(0.2, 0.45), high=rng.uniform(lowest_high, 9.5),
                              rate=rng.uniform(1.0, RATE), ki=rng.uniform(0.1, 0.6),
                              stop=rng.uniform(1.0, 3.0))

    async def change_tuning(self):
        """Limits may exclude CO: then they wait."""
        rng = self.random
        loop = rng.choice(self.loops)
        self.loop_file(loop).write_text(self.tuned(loop, 6.0))
        failures = await self.reload("in_force", "waits")
        await self.wait(rng.uniform(0.2, 1.0))
        self.loop_file(loop).write_text(self.loop_text(loop))
        return failures + await self.reload("in_force")

    async def give_orders(self, loop):
        """Each is answered, as done or as refused."""
        rng, failures = self.random, []
        for _ in range(rng.randint(3, 8)):
            order = rng.choice(({"mode": "man", "output": rng.uniform(1.0, 9.0)},
                                {"mode": "auto", "set_point": rng.uniform(4.0, 6.0)}, {"mode": "man"}))
            answer = await self.daemon.ask({"request": "set", "loop": loop.name, **order})
            if answer is None:
                failures.append("an order got no answer")
            elif answer["ok"]:
                end, state = time.monotonic() + 5.0, "waiting"
                while state == "waiting" and time.monotonic() < end:
                    await asyncio.sleep(0.02)
                    told = await self.daemon.ask(
                        {"request": "order", "loop": loop.name, "order": answer["order"]})
                    state = (told or {}).get("state", "waiting")
                if state == "waiting":
                    failures.append(f"{loop.name}: no cycle answered an order")
            await self.wait(rng.uniform(0.0, 0.2))
        return failures

    async def reload_during_orders(self):
        """Limits come and go while the operator moves the output, inside and outside of them."""
        rng, failures = self.random, []

        async def reload_again(loop):
            found = []
            for _ in range(rng.randint(2, 4)):
                self.loop_file(loop).write_text(self.tuned(loop, 3.0))
                found += await self.reload("in_force", "waits")
                await self.wait(rng.uniform(0.0, 0.2))
            return found

        loop = rng.choice(self.loops)
        for found in await asyncio.gather(self.give_orders(loop), reload_again(loop)):
            failures += found
        failures += await self.sound("reloads during orders")
        self.loop_file(loop).write_text(self.loop_text(loop))
        return failures + await self.reload("in_force")

    async def journal_works_again(self):
        end = time.monotonic() + 12.0
        error = "no answer"
        while time.monotonic() < end:
            await self.status()
            journal = self.daemon_status["journal"]
            error = journal["error"] or (f"{journal['waiting']} lines wait" if journal["waiting"] else "")
            if not error:
                break
            await asyncio.sleep(0.2)
        lost = self.daemon_status["journal"]["lost"]
        return ([f"journal: {error}"] if error else []) + ([f"journal lost {lost} lines"] if lost else [])

    async def exhaust(self, what, soft):
        """Takes descriptors or memory away while links break and the operator asks."""
        daemon, rng = self.daemon, self.random
        failures = []
        daemon.limit(what, soft)
        cpu, begin = daemon.cpu_s(), time.monotonic()
        for loop in self.loops:
            if rng.random() < 0.6:
                for front in loop.fronts():
                    front.cut()
        strangers = []
        for _ in range(3):
            try:
                strangers.append(await asyncio.wait_for(
                    asyncio.open_unix_connection(str(self.folder / "control.sock")), 0.5))
            except (OSError, asyncio.TimeoutError):
                pass
        for _ in range(4):
            await self.daemon.ask({"request": "status"}, 0.3)
            if rng.random() < 0.3:
                daemon.signal(signal.SIGHUP)
            await self.wait(rng.uniform(0.1, 0.5))
        if daemon.alive():
            used = (daemon.cpu_s() - cpu) / (time.monotonic() - begin)
            if used > 0.5:
                failures.append(f"burns {used:.0%} of a core meanwhile")
            daemon.limit(what, None)
        for _, writer in strangers:
            writer.close()
        await daemon.hang_up()
        return failures

    async def hang_disk(self, what):
        """Loops, watchdog, status and operator must not notice; afterwards all is written that found room."""
        daemon, failures, life = self.daemon, [], self.daemon.pid
        loop = self.random.choice(self.loops)
        rows = sum(s["recording"]["rows"] for s in (await self.status()).values())
        csv = "CSV record" in what
        if csv:
            name = f"trial{daemon.log_size()}"
            answer = await daemon.ask({"request": "record", "loop": loop.name, "start": name})
            failures += [] if answer and answer["ok"] else [f"no CSV record: {answer}"]
            await self.wait(1.0)
        daemon.disk_hangs(what)
        if csv:  # its rows are buffered: what waits for the disk is its end
            answer = await daemon.ask({"request": "record", "loop": loop.name, "stop": True})
            if answer is None or answer["ok"] or "completed once it does" not in answer["error"]:
                failures.append(f"CSV record ended on a hung disk: {answer}")
        end, slowest, hung_calls = time.monotonic() + HANG_S, 0.0, 0
        while time.monotonic() < end and daemon.alive() and not failures:
            # The journal's lines go on; reading it and explaining an alarm need the disk.
            await self.operate()
            await daemon.ask({"request": "journal", "most": 5})
            await daemon.ask({"request": "explain", "loop": loop.name, "alarm": "stiction"})
            await self.operator_moves(loop, SET_POINT)
            begin = time.monotonic()
            states = await self.status()
            slowest = max(slowest, time.monotonic() - begin)
            hung_calls = max(hung_calls, daemon.hung_calls())
            if not states:
                failures.append("no answer to the status")
            for each in self.loops:
                fault = states.get(each.name, {}).get("fault", "none")
                if fault not in ("none", "late cycle") and self.judged_by_time():
                    failures.append(f"{each.name}: {fault} by a hung disk")
            failures += self.feeding()
            await self.wait(self.random.uniform(0.2, 2.0))
        if slowest > 1.0 and self.judged_by_time():
            failures.append(f"the status took {slowest:.1f} s")
        if not hung_calls:
            failures.append("nothing hung")
        daemon.disk_hangs([])
        if not daemon.alive() or daemon.pid != life:
            return failures + ["the daemon did not outlive it"]
        if failures:
            return failures
        return await self.journal_works_again() + await self.recording_works_again(rows, csv)

    async def slow_disk(self, what):
        """Only requests that need the disk wait for it: a Modbus master that acts on many alarms, an operator.
        Meanwhile another master's heartbeats are answered, and none is missed."""
        daemon, failures = self.daemon, []
        loop = self.random.choice(self.loops)
        rows = sum(s["recording"]["rows"] for s in (await self.status()).values())
        beat = 0
        try:
            leader, operator = [await Master.connect(self.modbus_port) for _ in range(2)]
            # The one of the round before is gone: that is in the journal, or will not come any more.
            for beat in range(1, 6):
                await asyncio.wait_for(leader.beat(beat), 5.0)
                await self.wait(0.2)
        except (OSError, asyncio.TimeoutError) as error:
            return [f"no connection to the Modbus server: {error}"]
        before = await self.newest_line("master lost")
        calls = daemon.slow_calls()
        daemon.disk_takes(self.random.randint(10, 500), [what])
        beating = asyncio.ensure_future(leader.beat_for_ever(beat))
        acting = asyncio.ensure_future(operator.shelve_all_for_ever())
        end, slowest = time.monotonic() + self.random.uniform(4.0, 9.0), {}
        while time.monotonic() < end and daemon.alive():
            for asks, question in (("status", self.status()), ("set", self.operator_moves(loop, SET_POINT))):
                begin = time.monotonic()
                await question
                slowest[asks] = max(slowest.get(asks, 0.0), time.monotonic() - begin)
            for master in (beating, acting):
                if master.done():
                    failures.append(f"a master's connection ended: {master.exception()}")
            if not failures and self.random.random() < 0.3:
                await self.operate()
                await daemon.ask({"request": "explain", "loop": loop.name, "alarm": "stiction"})
            failures += self.feeding()
            if failures:
                break
            await self.wait(0.1)
        # Before the last heartbeat: what was lost is in the journal.
        daemon.disk_takes(0, [])
        failures += await self.journal_works_again()
        lost = await self.newest_line("master lost") > before
        slowest["a heartbeat"] = leader.slowest_s
        beating.cancel()
        acting.cancel()
        if self.judged_by_time():
            failures += [f"{asks} took {took:.1f} s" for asks, took in slowest.items() if took > 1.0]
            if lost:
                failures.append("a master that wrote its heartbeat counted as lost")
        if operator.done < 2:
            failures.append("the alarms were not acted on")
        if daemon.slow_calls() == calls:
            failures.append("nothing was slow")
        leader.close()
        operator.close()
        if not daemon.alive() or failures:
            return failures or ["the daemon did not outlive it"]
        return await self.recording_works_again(rows, False)

    async def newest_line(self, text):
        """Returns the number of the journal's newest line with this text, 0 if there is no such line."""
        for _ in range(50):
            answer = await self.daemon.ask({"request": "journal", "most": 1, "text": text})
            if answer and answer["ok"]:
                return max((line["id"] for line in answer["lines"]), default=0)
            await asyncio.sleep(0.2)
        return 0

    async def recording_works_again(self, rows, csv):
        end = time.monotonic() + 15.0
        while time.monotonic() < end:
            states = await self.status()
            recordings = {name: state["recording"] for name, state in states.items()}
            waits = [f"{name}: {r['waiting']} rows wait for the disk" for name, r in recordings.items()
                     if r["waiting"] > 100]
            waits += [f"{name}: the CSV record is not completed" for name, r in recordings.items()
                      if r["csv_file"]]
            if recordings and not waits:
                break
            await asyncio.sleep(0.2)
        if not recordings or waits:
            return waits or ["no answer to the status"]
        failures = [f"{name}: {key} {r[key]}" for name, r in recordings.items()
                    for key in ("csv_error", "last_disk_error") if r[key] and csv]
        if sum(r["rows"] for r in recordings.values()) <= rows:
            failures.append("no row was recorded meanwhile")
        return failures

    async def end_on_hung_disk(self):
        """The stop actions come first, and the end in a stated time, with the loss as its exit code."""
        self.daemon.disk_hangs(list(HANGING))
        await self.operate()
        await self.wait(self.random.uniform(0.2, 3.0))
        self.daemon.signal(signal.SIGTERM)
        begin = time.monotonic()
        # Afterwards commands cease, and a Modbus device's own watchdog moves its valve on.
        missing = set(self.loops)
        while missing and time.monotonic() - begin < 6.0:
            self.take_deeds()
            missing = {loop for loop in missing if abs(loop.device.command - STOP) > 0.01}
            await asyncio.sleep(0.02)
        code = await self.daemon.ended()
        took = time.monotonic() - begin
        self.daemon.disk_hangs([])
        failures = [] if code == 74 else [f"SIGTERM on a hung disk: ended with {code}"]
        if took > 16.0 and self.judged_by_time():
            failures.append(f"SIGTERM on a hung disk: ended after {took:.1f} s")
        failures += [f"{loop.name}: SIGTERM on a hung disk: not at the stop action within 6 s"
                     for loop in missing]
        await self.begin_life()
        return failures

    async def overflow_mailbox(self):
        loop = self.random.choice(self.loops)
        reader, writer = await asyncio.open_unix_connection(str(self.folder / "control.sock"))
        line = (f'{{"request":"set","loop":"{loop.name}","set_point":{SET_POINT},"mode":"auto"}}\n').encode()
        count = 200
        writer.write(line * count)
        refused = 0
        try:
            for _ in range(count):
                answer = await asyncio.wait_for(reader.readline(), 5.0)
                refused += b"too many commands" in answer
        except asyncio.TimeoutError:
            return ["not every order was answered"]
        finally:
            writer.close()
        return [] if refused else ["no order was refused, although the mailbox holds 32"]

    async def abuse_socket(self):
        rng = self.random
        path = str(self.folder / "control.sock")
        peers = []
        for _ in range(25):
            try:
                peers.append(await asyncio.wait_for(asyncio.open_unix_connection(path), 1.0))
            except (OSError, asyncio.TimeoutError):
                break
        for _, writer in peers:
            writer.write(rng.choice((b"{", b"\n\n\n", b"null\n", b'{"request":"set"}\n', b"[" * 5000 + b"\n",
                                     rng.randbytes(500) + b"\n", b"x" * 70000)))
        await self.wait(0.3)
        for _, writer in peers:
            writer.transport.abort()
        await self.daemon.hang_up()
        await self.wait(0.3)
        return [] if await self.status() else ["the operator gets no answer afterwards"]

    async def hang(self, kind):
        daemon = self.daemon
        threads = daemon.threads()
        if kind == "main thread hangs":
            tid = daemon.pid
        elif kind == "loop thread hangs":
            tid = threads["lw-loops"]
        else:
            tid = threads[self.random.choice(("lw-historian", "lw-monitor", "lw-control"))]
        await daemon.hang_up()
        self.cease()
        if not daemon.hang_thread(tid):
            return ["a thread can't be stopped here (ptrace)"]
        begin = time.monotonic()
        # Patience of the daemon: at most 10 s for a thread, then the service manager's own.
        while time.monotonic() - daemon.fed < WATCHDOG_S and time.monotonic() - begin < 20.0:
            await asyncio.sleep(0.05)
        failures = []
        if time.monotonic() - daemon.fed < WATCHDOG_S:
            failures.append("the watchdog was fed all the time")
        if kind == "loop thread hangs":
            self.take_deeds()
            for loop in self.loops:
                failures += [f"{loop.name}: {text}" for text in loop.device.unprotected()]
            for loop in self.analog:
                safe = loop.device.safe_raw
                if safe is not None and loop.device.command != loop.device.output_of(safe):
                    failures.append(f"{loop.name}: output at {loop.device.command:.3f} V instead of "
                                    "at the safe current")
        daemon.let_go(tid)
        daemon.abort()
        await daemon.ended()
        failures += await self.run_safe()
        await self.begin_life()
        return failures

    # --- operator and journal --------------------------------------------------------------------

    async def operator_moves(self, loop, set_point):
        await self.daemon.ask({"request": "set", "loop": loop.name, "set_point": set_point})

    async def write_errors(self, loop):
        return (await self.status()).get(loop.name, {}).get("io", {}).get("write_errors", 0)

    async def operate(self):
        """Sends a command that is written to the journal; stored if the daemon confirms that it is on the disk."""
        loop = self.random.choice(self.loops)
        self.order_number += 1
        reason = f"cell {self.index} order {self.order_number}"
        request = {"request": "alarm", "loop": loop.name,
                   "alarm": self.random.choice(("stiction", "backlash", "unknown")),
                   "action": "shelve", "minutes": 1, "reason": reason}
        answer = await self.daemon.ask(request)
        if answer and answer.get("ok") and answer.get("on_disk"):
            self.orders.append(reason)

    def journal_complete(self):
        if not self.orders:
            return []
        try:
            with sqlite3.connect(f"file:{self.folder}/state/journal.sqlite?mode=ro", uri=True) as db:
                table = db.execute("select name from sqlite_master where type='table' and sql like "
                                   "'%reason%'").fetchone()[0]
                kept = {row[0] for row in db.execute(f"select reason from {table}")}
        except (sqlite3.Error, TypeError) as error:
            return [f"journal can't be read: {error}"]
        missing = [order for order in self.orders if order not in kept]
        self.orders = self.orders[-50:]
        return [f"journal lacks '{order}', which was confirmed" for order in missing[:3]]

    def permissions(self):
        """With the unit's umask: other users have access only to the metrics, owner and group to the socket."""
        found = []
        for path in (self.folder / "state").rglob("*"):
            mode = stat.S_IMODE(path.lstat().st_mode)
            if mode & 0o027:
                found.append(f"{path.relative_to(self.folder)} has mode {mode:o}")
        mode = stat.S_IMODE((self.folder / "control.sock").stat().st_mode)
        if mode != 0o660:
            found.append(f"the control socket has mode {mode:o}")
        mode = stat.S_IMODE((self.folder / "metrics.prom").stat().st_mode)
        if mode != 0o644:
            found.append(f"the metrics have mode {mode:o}")
        return found

    async def alarms_right(self):
        """No fault injected here is one of a valve that the monitor would name."""
        answer = await self.daemon.ask({"request": "alarms"})
        if not answer or not answer.get("ok"):
            return ["no answer to alarms"]
        return [f"{a['loop']}: alarm {a['alarm']} without cause" for a in answer["alarms"]
                if a["active"] and a["alarm"] in VALVE_ALARMS]

    # --- the campaign ----------------------------------------------------------------------------

    def feeding(self):
        """The watchdog must be fed whenever the daemon is sound."""
        if "READY=1" in self.daemon.messages and time.monotonic() - self.daemon.fed > WATCHDOG_S:
            return [] if not self.judged_by_time() else ["the watchdog was not fed"]
        return []

    def cell_kinds(self, until):
        """Those that end before the campaign does."""
        return {kind: weight for kind, weight in CELL_KINDS.items()
                if "60 s" not in kind or time.monotonic() + HANG_S + 30.0 < until}

    async def round(self, quota, until):
        rng = self.random
        open_to_faults = [loop for loop in self.loops if loop.kinds()]
        kinds = self.cell_kinds(until)
        if kinds and (not open_to_faults or rng.random() < 0.35):
            kind = rng.choices(list(kinds), kinds.values())[0]
            injected = [await self.spoil_cell(kind)]
        else:
            injected = await asyncio.gather(*(self.spoil_loop(loop, rng.choice(loop.kinds()))
                                              for loop in open_to_faults[:quota]))
        failures = await self.recover()
        if not self.daemon.alive():
            failures.append("log ends: " + self.daemon.log()[-400:])
            await self.daemon.ended()
            await self.begin_life()
            await self.recover()
        else:
            if rng.random() < 0.5:
                await self.operate()
            failures += await self.alarms_right() + self.leaks() + self.feeding()
            failures += await self.journal_works_again() if "journal" in "".join(failures) else []
        failures += self.unexpected() + self.journal_complete()
        # A fault observed after a round with several faults belongs to one of them: it is counted once.
        together = sorted({kind for kind, _ in injected})
        results = [(kind, [kind], own) for kind, own in injected]
        if failures:
            results[0] = (injected[0][0], together, injected[0][1] + failures)
        self.results += results
        return len(injected)

    async def run(self, injections, report, until=math.inf):
        gc.disable()
        for loop in self.loops:
            await loop.open()
        self.write_config()
        ticking = asyncio.ensure_future(self.tick())
        try:
            await self.begin_life()
            trouble = await self.recover(30.0)
            if trouble:
                raise RuntimeError(f"cell {self.index} does not start: {trouble} {self.daemon.log()[-2000:]}")
            self.take_baseline()
            self.unexpected()
            done = 0
            while done < injections and time.monotonic() < until:
                known = len(self.results)
                done += await self.round(injections - done, until)
                report(self.index, self.results[known:])
            final = self.permissions()
            final += await self.end_well() + self.journal_complete()
            if final:
                report(self.index, [("end of the campaign", ["end of the campaign"], final)])
        finally:
            ticking.cancel()
            if self.daemon.alive():
                self.daemon.process.kill()
            if not any(failures for _, _, failures in self.results):
                shutil.rmtree(self.folder, ignore_errors=True)
