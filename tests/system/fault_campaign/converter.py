# SPDX-License-Identifier: Apache-2.0
"""4-20 mA: converters as Linux IIO shows them, in a folder of plain files, and the digital lines.

Shares no code with the daemon. The shim in the daemon makes the files behave like those of sysfs (see there)
and notes each write with its time: `deeds`. After the converter, a relay watches the alive line
and cuts the positioner's supply. It is the only protection that a converter on the same board can have.
"""

import math
import os
import shutil

from device import FAIL_SAFE, Device

# Converter in: 16 bit over 250 ohm. Out: 12 bit, current.
SHUNT_OHM, IN_MV, IN_OFFSET = 250.0, 0.1875, -12
OUT_MA, OUT_HIGHEST_RAW = 0.0055, 4095
LOWEST_MA, HIGHEST_MA = 3.8, 20.5  # of all outputs except the safe current
PV_RANGE, CO_RANGE = (0.0, 12.0), (0.0, 10.0)  # at 4 and 20 mA
HALF_PERIOD_S = 0.1  # of the alive line
RELAY_S = 1.0  # longest time without an edge of the alive line
TEXT_BYTES = 8  # each number is written in one call with the same length, so that no reader sees half of it

# Refused operations of an attribute, coded in its file mode for the shim; the sticky bit marks all.
SOUND, READ_FAILS, READ_HANGS, WRITE_FAILS, NOT_TAKEN = 0o1666, 0o1266, 0o1662, 0o1466, 0o1646


def current_ma(value, span):
    return 4.0 + 16.0 * (value - span[0]) / (span[1] - span[0])


class IioDevice:
    """A folder of attributes under the root of all IIO devices."""

    numbers = 0

    def __init__(self, root, name, fixed, raw):
        self.root, self.name, self.fixed, self.raw = root, name, fixed, raw
        self.folder = None
        self.files = {}

    def plug(self, values):
        """Appears as a whole, under a number that no device had before."""
        folder = self.root / f"iio:device{IioDevice.numbers}"
        IioDevice.numbers += 1
        making = self.root.parent / f"making-{folder.name}"
        making.mkdir(parents=True)
        (making / "name").write_text(self.name + "\n")
        for file, text in self.fixed.items():
            (making / file).write_text(text + "\n")
        for file in self.raw:
            self.files[file] = os.open(making / file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC)
            self.write(file, values.get(file, 0))
            os.fchmod(self.files[file], SOUND)
        making.rename(folder)
        self.folder = folder

    def unplug(self):
        if self.folder is None:
            return
        for file, fd in self.files.items():
            (self.folder / file).unlink()
            os.close(fd)
        self.files.clear()
        shutil.rmtree(self.folder)
        self.folder = None

    def write(self, file, number):
        self.write_text(file, f"{number:<{TEXT_BYTES - 1}}\n")

    def write_text(self, file, text):
        if file in self.files:
            os.pwrite(self.files[file], text.encode(), 0)
            os.ftruncate(self.files[file], len(text))

    def set_mode(self, file, mode):
        if file in self.files:
            os.fchmod(self.files[file], mode)

    def inode(self, file):
        return os.fstat(self.files[file]).st_ino if file in self.files else None


class AnalogDevice(Device):
    """Transmitter, positioner and lines of one loop. `line` is the first of its three lines."""

    PV_RAW, POSITION_RAW, OUT_RAW = "in_voltage0_raw", "in_voltage1_raw", "out_current0_raw"

    def __init__(self, limits, start, seed, root, name, line, board, safe_ma):
        super().__init__(limits, start, seed)
        self.board = board
        self.contact, self.relay, self.alive = line, line + 1, line + 2
        self.safe_raw = None if safe_ma is None else round(safe_ma / OUT_MA)
        root.mkdir(parents=True, exist_ok=True)
        self.inputs = IioDevice(root, f"adc-{name}", {
            "in_voltage_scale": f"{IN_MV}", "in_voltage0_offset": f"{IN_OFFSET}",
            "in_voltage1_offset": f"{IN_OFFSET}"}, (self.PV_RAW, self.POSITION_RAW))
        self.outputs = IioDevice(root, f"dac-{name}", {"out_current0_scale": f"{OUT_MA}"}, (self.OUT_RAW,))
        self.pv_current = None  # a function of the true current, mA
        self.position_current = None
        self.text = None  # instead of PV's number
        self.last_edge, self.alive_level = -math.inf, None
        self.ceased = False  # commands cease, by the campaign's doing: the safe current may come
        self.close_contact(True)
        self.plug_inputs()
        self.plug_outputs(round(current_ma(start, CO_RANGE) / OUT_MA))

    # --- converters ------------------------------------------------------------------------------

    def plug_inputs(self):
        self.inputs.plug({})
        self.show()

    def plug_outputs(self, raw=0):
        """A converter that is plugged in again has lost its output value."""
        self.outputs.plug({self.OUT_RAW: raw})
        self.command = self.output_of(raw)

    @staticmethod
    def output_of(raw):
        low, high = CO_RANGE
        return low + (raw * OUT_MA - 4.0) / 16.0 * (high - low)

    @staticmethod
    def counts(current):
        return min(max(round(current * SHUNT_OHM / IN_MV) - IN_OFFSET, -32768), 32767)

    def show(self):
        """Puts the measured values into the files."""
        pv = current_ma(self.measured(), PV_RANGE)
        position = current_ma(self.position(), CO_RANGE)
        if self.text is None:
            self.inputs.write(self.PV_RAW, self.counts(self.pv_current(pv) if self.pv_current else pv))
        else:
            self.inputs.write_text(self.PV_RAW, self.text)
        self.inputs.write(self.POSITION_RAW, self.counts(
            self.position_current(position) if self.position_current else position))

    def step(self, now):
        if self.pv_current or self.position_current or self.text is not None:
            self.spoilt_at = now
        super().step(now)
        self.show()

    # --- what the daemon does --------------------------------------------------------------------

    def take(self, source, value, at):
        """One deed of the daemon; True if it was at this device."""
        if source == self.outputs.inode(self.OUT_RAW):
            self.take_raw(value, at)
        elif source == -1 - self.alive:
            if value != self.alive_level:
                self.take_edge(at)
            self.alive_level = value
        else:
            return False
        return True

    def take_raw(self, raw, at):
        self.deeds += 1
        if not 0 <= raw <= OUT_HIGHEST_RAW:
            self.violations.append(f"raw number {raw}, which the converter does not have")
            return
        current = raw * OUT_MA
        if raw == self.safe_raw and (self.ceased or self.worst_tick_s > 0.1):
            pass  # the stated step of the I/O thread, within no rate
        else:
            if not LOWEST_MA - 1e-9 <= current <= HIGHEST_MA + 1e-9:
                self.violations.append(f"{current:.3f} mA put out")
            self.judge(self.output_of(raw), at)
        self.command = self.output_of(raw)
        self.last_command = at

    def take_edge(self, at):
        self.deeds += 1
        # A tenth: between the daemon's look at the clock and the edge its thread may have waited.
        if at - self.last_edge < HALF_PERIOD_S / 10:
            self.violations.append(f"two edges of the alive line within {at - self.last_edge:.3f} s")
        self.last_edge = at

    # --- watchdog --------------------------------------------------------------------------------

    def watch(self, now):
        self.tripped = now - self.last_edge > RELAY_S

    def demand(self):
        return FAIL_SAFE if self.tripped else self.command

    def guarded(self):
        return not self.tripped

    def unprotected(self):
        return [] if self.tripped else ["the alive line did not stop: the positioner keeps its supply"]

    # --- lines -----------------------------------------------------------------------------------

    def close_contact(self, closed):
        self.board.set_level(self.contact, 0 if closed else 1)  # active low

    def energised(self):
        return self.board.level(self.relay) == 1
