# SPDX-License-Identifier: Apache-2.0
"""A plant with its valve, and the registers of a Modbus transmitter and positioner in front of it.

Shares no code with the daemon. The positioner has its own communication watchdog and judges
every command when it arrives: finite, inside the limits, within the rate, and continuous
with the valve's position. Registers of each unit:

  input   0 PV f32, 18 status (0 good), 20 valve position f32
  holding 0 command f32, 10 watchdog time u16 in tenths of a second, 0 off
"""

import collections
import math
import random
import struct
import time

STEP_S = 0.01
# Plant 1 at ten times its speed.
GAIN, LAG_S, DEAD_TIME_S, STEM_LAG_S = 1.2264, 0.169, 0.26, 0.05
FAIL_SAFE = 0.5  # CO units, where the device's own watchdog sends the valve
STEM_ENDS = (0.0, 10.0)  # CO units, the valve's seat and its stop
KEPT_S = 6.0  # of the past


class Limits:
    """Limits of the loop's file, and the allowed age of the daemon's information about the valve."""

    def __init__(self, low, high, rate, knowledge_s, period_s):
        self.low, self.high, self.rate = low, high, rate
        self.knowledge_s = knowledge_s  # s: largest age of a read-back on which a command is based
        self.period_s = period_s


class Device:
    """The plant, and what each command is judged by; how it is reached is the subclasses'."""

    TOLERANCE = 0.02  # CO units: f32 or the converter's steps, and the valve's creep

    def __init__(self, limits, start, seed):
        self.limits = limits
        self.random = random.Random(seed)
        self.command = self.stem = start
        self.pv = GAIN * start
        self.on_the_way = collections.deque([start] * round(DEAD_TIME_S / STEP_S))
        self.tripped = False  # the watchdog has moved the valve to its fail-safe position
        self.last_write = time.monotonic()  # last write that the watchdog counts
        self.last_command = self.last_write
        self.history = collections.deque()  # (time, stem, demand, PV)
        self.violations = []
        self.pv_fault = None  # a function of the true PV
        self.stem_fault = None  # of the true position, as read back
        self.spoilt_at = -math.inf  # when one of the two was last set
        self.valve_stuck = False
        self.steps_allowed = False
        self.deeds = 0  # whatever the daemon did to it: commands, watchdog's register, edges of the alive line
        self.worst_tick_s = 0.0  # this process was late by so much: what is judged by time waits

    # --- plant -----------------------------------------------------------------------------------

    def demand(self):
        """Where the positioner sends the valve."""
        return self.command

    def watch(self, now):
        """Steps the device's watchdog."""
        raise NotImplementedError

    def step(self, now):
        self.watch(now)
        if self.pv_fault or self.stem_fault:
            self.spoilt_at = now
        if not self.valve_stuck:
            self.stem += (self.demand() - self.stem) * min(1.0, STEP_S / STEM_LAG_S)
            self.stem = min(max(self.stem, STEM_ENDS[0]), STEM_ENDS[1])
        self.on_the_way.append(self.stem)
        self.pv += (GAIN * self.on_the_way.popleft() - self.pv) * min(1.0, STEP_S / LAG_S)
        self.history.append((now, self.stem, self.command, self.pv))
        while self.history and self.history[0][0] < now - KEPT_S:
            self.history.popleft()

    def measured(self):
        return self.pv if self.pv_fault is None else self.pv_fault(self.pv)

    def position(self):
        return self.stem if self.stem_fault is None else self.stem_fault(self.stem)

    # --- judgement -------------------------------------------------------------------------------

    def judge(self, value, now):
        limits = self.limits
        if not math.isfinite(value):
            self.violations.append(f"wrote {value}")
            return
        # Where the valve and its demand have been while the daemon could last have looked.
        known = [(stem, demand) for at, stem, demand, _ in self.history
                 if at >= now - limits.knowledge_s - self.worst_tick_s]
        places = [self.command] + [p for pair in known for p in pair]
        low, high = min(places), max(places)
        if value < min(limits.low, low) - self.TOLERANCE or value > max(limits.high, high) + self.TOLERANCE:
            self.violations.append(f"{value:.3f} beyond its limits {limits.low} to {limits.high}")
        # Time since the last command, because the watchdog's own register may have been written in between.
        passed = now - self.last_command + 2 * limits.period_s + self.worst_tick_s
        step = limits.rate * min(passed, limits.knowledge_s + self.worst_tick_s)
        if self.steps_allowed:
            return
        if value < low - step - self.TOLERANCE or value > high + step + self.TOLERANCE:
            self.violations.append(
                f"{value:.3f} is a step: valve and demand were within {low:.3f} to {high:.3f}, "
                f"{step:.3f} allowed")
        self.judge_watchdog(now)

    def judge_watchdog(self, now):
        """Whether a command may come at all."""

    def unprotected(self):
        """Returns the failure in words if commands have ceased and the device's watchdog has not acted."""
        raise NotImplementedError

    def shown_wrong(self, state):
        """In words, a value that the daemon shows as good and that the device did not have of late."""
        now = time.monotonic()
        known_s = now - self.history[0][0] if self.history else 0.0
        if min(known_s, now - self.spoilt_at) < KEPT_S - 1.0 or self.worst_tick_s > 0.3:
            return []
        pv = state.get("pv") if state.get("pv_quality") == "good" else None
        wrong = []
        for what, shown, column in (("PV", pv, 3), ("valve position", state.get("stem"), 1)):
            seen = [row[column] for row in self.history]
            if shown is not None and not min(seen) - 0.02 <= shown <= max(seen) + 0.02:
                wrong.append(f"shows {what} {shown:.3f}, which was within {min(seen):.3f} to "
                             f"{max(seen):.3f} for {KEPT_S:.0f} s")
        return wrong


class ModbusDevice(Device):
    def __init__(self, limits, start, seed):
        super().__init__(limits, start, seed)
        self.watchdog_tenths = 0
        self.forgot_at = -math.inf
        self.status = 0

    def watch(self, now):
        if self.watchdog_tenths and not self.tripped:
            if now - self.last_write > self.watchdog_tenths / 10:
                self.trip()

    def trip(self):
        self.tripped = True
        self.command = FAIL_SAFE

    def restart(self):
        """Registers as at start; the valve at its fail-safe position."""
        self.command = FAIL_SAFE
        self.watchdog_tenths = 0
        self.tripped = False
        self.forgot_at = time.monotonic()

    def input_registers(self, address, count):
        image = [0] * 64
        image[0:2] = struct.unpack(">2H", struct.pack(">f", self.measured()))
        image[18] = self.status
        image[20:22] = struct.unpack(">2H", struct.pack(">f", self.position()))
        return image[address : address + count]

    def holding_registers(self, address, count):
        image = [0] * 64
        image[0:2] = struct.unpack(">2H", struct.pack(">f", self.command))
        image[10] = self.watchdog_tenths
        return image[address : address + count]

    def write_registers(self, address, values):
        self.deeds += 1
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
        self.last_write = self.last_command = now
        self.tripped = False

    def judge_watchdog(self, now):
        if self.watchdog_tenths == 0 and not self.forgot_lately(now):
            self.violations.append("a command while the device's watchdog was off")

    def forgot_lately(self, now):
        """A restart between two requests is seen at the next look at the register, within 10 s."""
        return now - self.forgot_at <= 12.0

    def guarded(self):
        return self.watchdog_tenths != 0

    def unprotected(self):
        if self.watchdog_tenths == 0 and self.forgot_lately(time.monotonic()):
            return []  # not yet configured again: no protection is promised
        return [] if abs(self.command - FAIL_SAFE) <= 0.01 else ["the device's watchdog did not act"]


class ModbusUnit:
    """A unit that answers for a device; `spoil` names what happens to its replies."""

    def __init__(self, device):
        self.device = device
        self.spoil = None
        self.slowest_s = 0.0  # for a reply in pieces

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

    def spoiled_answer(self, pdu):
        """Returns the reply without its frame; None: no reply. The request is carried out unless it is lost."""
        spoil = self.spoil
        if spoil == "lost_requests":
            return None
        answer = self.answer(pdu)
        if spoil == "silent":
            return None
        if spoil == "exception":
            return bytes([pdu[0] | 0x80, self.device.random.choice((4, 6, 10))])
        if spoil == "wrong_function":
            return bytes([answer[0] ^ 0x07]) + answer[1:]
        if spoil == "wrong_length":
            return answer + b"\x00\x00"
        if spoil == "other_value" and pdu[0] == 16:
            return bytes([16, 0, 1, 0, 2])
        return answer
