#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Planned moves over Modbus: loopwardend on two pymodbus plants whose valve sticks, with the same load on both. One runs
only under PI, the other with planned moves. Plant 1 of the thesis runs faster than real time, so that minutes are enough.

Prints RMS of SP - PV and stem travel of both over the second half.  Example: lab/bench/calm_on_the_wire.py --minutes 6
"""
import argparse
import math
import os
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402

DEVICE = os.path.join(bench_daemon.ROOT, "tests/support/device/plant_device.py")
GAIN, LAG, DEAD_TIME = 1.2264, 1.69376, 2.6256  # L/min per V, s, s
STICK, JUMP, START = 0.8, 0.4, 4.0              # V

LOOP = """loop: {tag}
sample_time: 0.05
process_variable: {{unit: L/min, range: [0, 10]}}
controller:
  action: reverse
  kp: 0.25
  ki: {ki:.6g}
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10]}}{compensator}
start: {{mode: automatic, set_point: 5.2}}
safe_actions: {{stop: hold, bad_pv: hold, output_lost: hold, late_cycle_periods: 40, enable_open: hold, recovery: previous_mode}}
io:
  backend: modbus
  poll_period: 0.05
  transmitter: {{link: {link}, unit: 1, register: {{table: input, address: 0, type: f32}}}}
  positioner:
    link: {link}
    unit: 1
    command: {{address: 0, type: f32}}
    read_back: {{table: input, address: 20, type: f32}}
    comm_loss: none_accepted
"""

# The wire's 0.1 s is dead time.
MOVES = """
  compensator:
    kind: planned_moves
    process: {{gain: {gain}, time_constant: {lag:.6g}, dead_time: {dead_time:.6g}}}
    load: {load:.6g}
    s: {stick}
    s_interval: [{low}, {high}]
    j: {jump}
    max_move: 2
    max_moves_per_hour: 2000"""


def device(args):
    process = subprocess.Popen(
        ["/usr/bin/python3", DEVICE, "--start", str(START), "--speed", str(args.speed), "--stick", str(STICK),
         "--jump", str(JUMP), "--load", str(args.load), "--seed", str(args.seed)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    return process, int(process.stdout.readline().split("port=")[1])


class Measured:
    """RMS of SP - PV, L/min, and stem travel, V, of one loop from now on."""

    def __init__(self, daemon, tag):
        self.daemon, self.tag = daemon, tag
        self.next = self.rows()["period"][-1] + 1
        self.squares = self.travel = 0.0
        self.count, self.stem = 0, None

    def rows(self, first=0):
        return self.daemon.ask({"request": "trend", "loop": self.tag, "from": first})

    def take(self):
        rows = self.rows(self.next)
        for sp, pv, stem in zip(rows["sp"], rows["pv"], rows["stem"]):
            self.squares += (sp - pv) ** 2
            self.count += 1
            self.travel += 0.0 if self.stem is None else abs(stem - self.stem)
            self.stem = stem
        if rows["period"]:
            self.next = rows["period"][-1] + 1

    def rms(self):
        return math.sqrt(self.squares / max(1, self.count))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=6.0, help="of the clock")
    parser.add_argument("--speed", type=float, default=5.0, help="plant seconds per second")
    parser.add_argument("--load", type=float, default=0.006, help="intensity, L/min/sqrt(s) of the plant")
    parser.add_argument("--seed", type=int, default=1, help="of the load")
    args = parser.parse_args()
    devices = [device(args) for _ in range(2)]
    links = "links:\n" + "".join(
        f"  {name}: {{transport: tcp, host: 127.0.0.1, port: {port}}}\n"
        for name, (_, port) in zip(("pi", "moves"), devices))
    daemon = bench_daemon.Daemon(bench_daemon.PROGRAM, "real_time: {priority: 0}\n" + links, [])
    moves = MOVES.format(gain=GAIN, lag=LAG / args.speed, dead_time=DEAD_TIME / args.speed + 0.1,
                         load=args.load * math.sqrt(args.speed), stick=STICK, jump=JUMP,
                         low=0.8 * STICK, high=1.3 * STICK)
    for tag, link, compensator in (("FIC-1", "pi", ""), ("FIC-2", "moves", moves)):
        with open(os.path.join(daemon.folder, f"config/loops.d/{tag}.yaml"), "w") as file:
            file.write(LOOP.format(tag=tag, link=link, ki=0.06 * args.speed, compensator=compensator))
    try:
        with daemon:
            half_s = 30.0 * args.minutes
            time.sleep(half_s)
            pi, calm = both = [Measured(daemon, tag) for tag in ("FIC-1", "FIC-2")]
            until = time.monotonic() + half_s
            while time.monotonic() < until:
                time.sleep(2.0)
                for one in both:
                    one.take()
            says = daemon.ask({"request": "loop", "loop": "FIC-2"})["compensator"]["says"]
    finally:
        for process, _ in devices:
            process.kill()
            process.wait()
    hours = half_s * args.speed / 3600.0
    print(f"{'':<16}{'RMS, L/min':>12}{'travel, V/h':>14}")
    for name, one in (("PI", pi), ("planned moves", calm)):
        print(f"{name:<16}{one.rms():>12.4f}{one.travel / hours:>14.1f}")
    print(f"RMS {calm.rms() / pi.rms():.2f} of that without; state: {says}")


if __name__ == "__main__":
    main()
