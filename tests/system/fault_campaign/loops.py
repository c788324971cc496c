# SPDX-License-Identifier: Apache-2.0
"""The loops of a cell by their wiring: their files, how their devices are reached, which faults they take."""

from converter import CO_RANGE, HALF_PERIOD_S, PV_RANGE, RELAY_S, SHUNT_OHM, AnalogDevice
from device import Limits, ModbusDevice
from serial_line import LineUnit, SerialLine
from tcp_front import TcpFront

STOP, BAD_PV, ENABLE_OPEN, START, SET_POINT = 2.0, 1.5, 0.8, 3.0, 5.0
LOW, HIGH, RATE = 0.2, 9.5, 5.0
RESPONSE_S = 0.15
LINE_POLL_S = 0.1  # shorter keeps a serial line busier than the daemon allows

LOOP = """\
loop: {name}
sample_time: {period}
process_variable: {{unit: L/min, range: [0, 12], max_age: {max_age}, frozen_after: 0.8}}
controller:
  action: reverse
  kp: 0.3494
  ki: {ki}
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10], limits: [{low}, {high}], rate_limit: {rate}}}
start: {{mode: {start}, set_point: 5, output: hold}}
safe_actions:
  stop: {stop}
  bad_pv: {{hold_for: 0.3, then: 1.5}}
  output_lost: hold
  enable_open: 0.8
  recovery: {recovery}
  recovery_delay: 0.3
recording: {{enabled: true, limit_mb: 1}}
"""
MODBUS = """\
io:
  backend: modbus
  poll_period: {period}
  transmitter:
    link: {transmitter_link}
    unit: {transmitter_unit}
    register: {{table: input, address: 0, type: f32}}
    status: {{table: input, address: 18, mask: 0xFFFF, value: 0}}
  positioner:
    link: {positioner_link}
    unit: {positioner_unit}
    command: {{address: 0, type: f32}}
    read_back: {{table: input, address: 20, type: f32}}
    comm_loss: {{timeout: 1.0, register: {{address: 10, type: u16, scale: 0.1}}, value: 1.0}}
"""
TCP_LINK = ("  {name}: {{transport: tcp, host: 127.0.0.1, port: {port}, response_timeout: 0.15, "
            "connect_timeout: 0.3, reconnect_min: 0.05, reconnect_max: 0.3}}\n")
# A pseudo-terminal has no parity, and Debian's C library calls it an error to ask for it twice.
RTU_LINK = ("  {name}: {{transport: rtu, device: {device}, baud: 115200, parity: none, "
            "response_timeout: 0.15, "
            "reconnect_min: 0.05, reconnect_max: 0.3, probe_interval: 0.5}}\n")
ANALOG = """\
io:
  backend: analog
  iio_root: {root}
  poll_period: {period}
  input:
    device: adc-{name}
    channel: voltage0
    units_per_ma: {shunt}
    range: {pv_range}
    ne43: {{recovery: 0.5}}
  read_back:
    device: adc-{name}
    channel: voltage1
    units_per_ma: {shunt}
    range: {co_range}
    ne43: {{recovery: 0.5}}
  output:
    device: dac-{name}
    channel: current0
    range: {co_range}
    {safe_current}
    comm_loss: {{timeout: {relay}, set_by: device}}
  enable: {{line: line{contact}, active_low: true, debounce: 0.05}}
  alarm_relay: {{line: line{alarm}}}
  alive: {{line: line{alive}, half_period: {half_period}}}
"""

# Kind of fault -> what becomes of the replies.
SPOILED = {
    "late reply": "late", "duplicated reply": "duplicated", "truncated reply": "truncated",
    "wrong-unit reply": "wrong_unit", "wrong-number reply": "wrong_number",
    "wrong-function reply": "wrong_function", "wrong-length reply": "wrong_length",
    "wrong check sum": "wrong_check_sum", "reply of an older request": "old_reply",
    "garbage": "garbage", "noise before replies": "noise_before", "echo of the request": "echo",
    "device exception": "exception", "write refused": "writes_refused",
    "echo of another write": "other_value", "silent link": "silent",
    "lost requests": "lost_requests", "connection reset": "reset", "reply in pieces": "in_pieces"}
# Kind of fault -> expected state of PV; None: not determined.
SENSOR = {
    "sensor failed": "sensor failure", "sensor NaN": "not finite", "sensor infinite": "not finite",
    "sensor out of range": "out of range", "sensor stuck": "frozen", "sensor jumps": None,
    "sensor noisy": None}
VALVE = ["valve not following", "valve sticks and slips"]
MODBUS_DEVICE = ["device restart", "device forgets", "transmitter silent", "read-back NaN",
                 "device watchdog expires"]
# Kind of fault -> current of the transmitter, mA, and expected state of PV.
CURRENT = {
    "broken wire": ((0.0, 3.5), "sensor failure"), "current above NE 43": ((21.2, 24.0), "sensor failure"),
    "current between NE 43 limits": ((3.65, 3.75), "out of range")}
KINDS = {
    "tcp": [kind for kind in SPOILED if kind not in (
        "wrong check sum", "noise before replies", "echo of the request")] +
           list(SENSOR) + VALVE + MODBUS_DEVICE +
           ["link closed", "transmitter link closed", "read-back dies with the link"],
    "rtu": [kind for kind in SPOILED if kind not in ("wrong-number reply", "connection reset")] +
           list(SENSOR) + VALVE + MODBUS_DEVICE +
           ["noise between frames", "line never silent", "serial adapter unplugged"],
    "analog": ["sensor stuck", "sensor jumps", "sensor noisy"] + VALVE + list(CURRENT) +
              ["read-back wire broken", "input hangs", "input unreadable", "input is no number",
               "converter in vanishes", "converter out vanishes", "converters renumbered",
               "converter out restarts", "output not writable", "output not taken",
               "enable contact opens", "enable contact unreadable", "enable contact bounces"]}


def without_read_back(text):
    """Returns the io section without the read-back."""
    kept, inside = [], None
    for line in text.splitlines(keepends=True):
        indent = len(line) - len(line.lstrip())
        if inside is not None and indent > inside:
            continue
        inside = indent if line.lstrip().startswith("read_back:") else None
        if inside is None:
            kept.append(line)
    return "".join(kept)


class Loop:
    wiring = ""

    def __init__(self, name, device, poll_s):
        self.name, self.device, self.poll_s = name, device, poll_s

    def kinds(self):
        return KINDS[self.wiring]

    def fronts(self):
        return set()

    async def open(self):
        """Opens the ports through which the daemon reaches the device."""

    def io_text(self):
        raise NotImplementedError

    def links_text(self):
        return ""

    def violations(self):
        found = list(dict.fromkeys(self.device.violations))
        self.device.violations.clear()
        return found


class TcpLoop(Loop):
    """Transmitter and positioner on one connection, or on two."""

    wiring = "tcp"

    def __init__(self, name, limits, seed, poll_s, apart):
        super().__init__(name, ModbusDevice(limits, START, seed), poll_s)
        self.transmitter = TcpFront(self.device)
        self.positioner = TcpFront(self.device) if apart else self.transmitter

    def fronts(self):
        return {self.transmitter, self.positioner}

    async def open(self):
        for front in self.fronts():
            await front.open()

    def valve_link(self):
        return f"pv_{self.name}" if self.positioner is self.transmitter else f"valve_{self.name}"

    def io_text(self):
        return MODBUS.format(period=self.poll_s, transmitter_link=f"pv_{self.name}", transmitter_unit=1,
                             positioner_link=self.valve_link(), positioner_unit=1)

    def links_text(self):
        text = TCP_LINK.format(name=f"pv_{self.name}", port=self.transmitter.port)
        if self.positioner is not self.transmitter:
            text += TCP_LINK.format(name=self.valve_link(), port=self.positioner.port)
        return text


class RtuLoop(Loop):
    """Transmitter and positioner as two units of one serial line."""

    wiring = "rtu"

    def __init__(self, name, limits, seed, poll_s, folder):
        super().__init__(name, ModbusDevice(limits, START, seed), poll_s)
        self.line = SerialLine(folder / f"line_{name}", self.device.random)
        self.transmitter = LineUnit(self.device, self.line, 11)
        self.positioner = LineUnit(self.device, self.line, 12)

    def fronts(self):
        return {self.transmitter, self.positioner}

    async def open(self):
        self.line.plug()

    def io_text(self):
        return MODBUS.format(period=self.poll_s, transmitter_link=f"line_{self.name}", transmitter_unit=11,
                             positioner_link=f"line_{self.name}", positioner_unit=12)

    def links_text(self):
        return RTU_LINK.format(name=f"line_{self.name}", device=self.line.path)

    def violations(self):
        found = super().violations() + list(dict.fromkeys(self.line.violations))
        self.line.violations.clear()
        return found


class AnalogLoop(Loop):
    """4-20 mA converters, an enable contact, an alarm relay, an alive line."""

    wiring = "analog"

    def __init__(self, name, limits, seed, poll_s, folder, line, board, safe_ma):
        self.root = folder / f"iio-{name}/devices"
        self.safe_ma = safe_ma
        device = AnalogDevice(limits, START, seed, self.root, name, line, board, safe_ma)
        super().__init__(name, device, poll_s)

    def io_text(self):
        safe = "" if self.safe_ma is None else f"safe_current: {self.safe_ma}"
        device = self.device
        return ANALOG.format(
            name=self.name, period=self.poll_s, root=self.root, shunt=SHUNT_OHM, pv_range=list(PV_RANGE),
            co_range=list(CO_RANGE), safe_current=safe, relay=RELAY_S, half_period=HALF_PERIOD_S,
            contact=device.contact, alarm=device.relay, alive=device.alive)


def make_loop(i, index, seed, folder, board, period, rng):
    """Two on TCP, one on a serial line, one on converters, and so on."""
    name, seed = f"FIC-{101 + i}", f"{seed}/{index}/{i}"

    def limits(poll_s, reply_s):
        # Largest age of the read-back on which an arriving command is based.
        return Limits(LOW, HIGH, RATE, 4 * poll_s + reply_s + 0.15, poll_s)

    if i % 4 < 2:
        return TcpLoop(name, limits(period, RESPONSE_S), seed, period, i % 4 == 1)
    if i % 4 == 2:
        poll_s = max(period, LINE_POLL_S)
        return RtuLoop(name, limits(poll_s, RESPONSE_S), seed, poll_s, folder)
    return AnalogLoop(name, limits(period, 0.0), seed, period, folder, 3 * (i // 4), board,
                      rng.choice((None, 3.6, 8.0)))
