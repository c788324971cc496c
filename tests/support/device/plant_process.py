#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A flow loop's valve and process in a separate process, for the test device.

Reads the valve's command, one number per line, from standard input. Writes "PV STEM" lines to
standard output every period. Valve: stiction (He 2007: it sticks up to (S + J)/2 and slips until
(S - J)/2 remains), then a first-order lag. With --mass, a balance of forces instead: actuator
pressure against spring, inertia, viscous and dry friction (Karnopp 1985), where the friction at
rest is (S + J)/2 and that of motion (S - J)/2. With --play, the plug follows the stem behind a
loose linkage; the read-back is that of the stem. Process: gain, first-order lag, dead time. The
disturbance is a random walk that decays with a time constant of 300 s.
"""

import argparse
import collections
import math
import os
import random
import select
import sys
import time


class BalancedStem:
    """Forces in CO units of the spring; positions in CO units."""

    DAMPING, SLOW, STEP = 0.06, 0.02, 0.001  # CO units s/CO unit, CO units/s, s

    def __init__(self, start, mass, at_rest, moving, lag):
        self.pressure = self.position = start
        self.speed = 0.0
        self.mass, self.at_rest, self.moving, self.lag = mass, at_rest, moving, lag

    def step(self, command, seconds):
        for _ in range(max(1, round(seconds / self.STEP))):
            self.pressure += (command - self.pressure) * self.STEP / self.lag
            force = self.pressure - self.position
            if abs(self.speed) < self.SLOW and abs(force) <= self.at_rest:
                self.speed = 0.0
                continue
            way = self.speed if abs(self.speed) >= self.SLOW else force
            force -= self.DAMPING * self.speed + math.copysign(self.moving, way)
            before, self.speed = self.speed, self.speed + force / self.mass * self.STEP
            if before * self.speed < 0.0:
                self.speed = 0.0
            self.position += self.speed * self.STEP
        return self.position


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--gain", type=float, default=1.2264, help="PV units per CO unit")
    parser.add_argument("--time-constant", type=float, default=1.69376, help="s")
    parser.add_argument("--dead-time", type=float, default=2.6256, help="s")
    parser.add_argument("--stem-lag", type=float, default=0.1, help="s")
    parser.add_argument("--stick", type=float, default=0.0, help="S, CO units; 0: it does not stick")
    parser.add_argument("--jump", type=float, default=0.0, help="J, CO units")
    parser.add_argument("--mass", type=float, default=0.0, help="CO units s2/CO unit; 0: no balance of forces")
    parser.add_argument("--play", type=float, default=0.0, help="of the linkage, CO units")
    parser.add_argument("--noise", type=float, default=0.0, help="of PV, PV units")
    parser.add_argument("--load", type=float, default=0.0, help="PV units/sqrt(s) of the plant")
    parser.add_argument("--seed", type=int, default=1, help="of the load")
    parser.add_argument("--speed", type=float, default=1.0, help="plant seconds per second")
    parser.add_argument("--start", type=float, default=0.0, help="CO at which it is at rest")
    args = parser.parse_args()

    period = 0.01
    step = period * args.speed
    bears, left = (args.stick + args.jump) / 2, (args.stick - args.jump) / 2
    chance, load = random.Random(args.seed), 0.0
    stem = goes_to = command = plug = args.start
    balanced = BalancedStem(args.start, args.mass, bears, left, args.stem_lag) if args.mass > 0.0 else None
    pv = args.gain * stem
    on_the_way = collections.deque([stem] * max(1, round(args.dead_time / step)))
    pending = b""
    due = time.monotonic()
    os.set_blocking(sys.stdin.fileno(), False)
    while True:
        due += period
        while True:
            readable, _, _ = select.select([sys.stdin], [], [], max(0.0, due - time.monotonic()))
            if not readable:
                break
            received = os.read(sys.stdin.fileno(), 4096)
            if not received:
                return
            *lines, pending = (pending + received).split(b"\n")
            if lines:
                command = float(lines[-1])
        if balanced:
            stem = balanced.step(command, step)
        else:
            if abs(command - goes_to) > bears:
                goes_to = command - math.copysign(left, command - goes_to)
            stem += (goes_to - stem) * min(1.0, step / args.stem_lag)
        plug = min(max(plug, stem - args.play / 2), stem + args.play / 2)
        on_the_way.append(plug)
        pv += (args.gain * on_the_way.popleft() - pv) * min(1.0, step / args.time_constant)
        load += -load * step / 300.0 + args.load * math.sqrt(step) * chance.gauss(0.0, 1.0)
        sys.stdout.write(f"{pv + load + args.noise * chance.gauss(0.0, 1.0):.9g} {stem:.9g}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    try:
        main()
    except (BrokenPipeError, KeyboardInterrupt):
        pass
