#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Many loops at 10 Hz with specialists on: CPU by thread, memory, backlog of windows, late cycles.

Runs the real daemon on simulated loops of plant 1, each judged by examples/specialists/plant1 as configured by
default (a window of 96 s, one each 48 s), for --seconds after the first window. The simulation of the plants is part of
lw-loops' time.

Example: lab/bench/many_loops.py --loops 500 --seconds 120
"""
import argparse
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--loops", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--warm-up", type=float, default=100.0, help="s until windows are full")
    parser.add_argument("--specialists", default=bench_daemon.ROOT + "/examples/specialists/plant1")
    parser.add_argument("--recording", action="store_true", help="record every cycle as well")
    options = parser.parse_args()
    monitor = f"monitor: {{specialists: {options.specialists}}}\n" if options.specialists else ""
    with bench_daemon.Daemon(options.daemon, "modbus_server: {port: 15021}\n",
                             [(0.1, monitor)] * options.loops, options.recording) as daemon:
        time.sleep(options.warm_up)
        before, cpu_before, start = daemon.status()["daemon"], daemon.threads(), time.monotonic()
        backlog = 0
        while time.monotonic() < start + options.seconds:
            time.sleep(1.0)
            backlog = max(backlog, daemon.status()["daemon"]["monitor"]["backlog"])
        elapsed = time.monotonic() - start
        after, cpu_after = daemon.status()["daemon"], daemon.threads()
        memory = daemon.memory_mb()
        daemon.stop()
    windows = after["monitor"]["windows"] - before["monitor"]["windows"]
    print(f"{options.loops} loops at 10 Hz, {elapsed:.0f} s; "
          f"{after['real_time_missing'] or 'real-time rights'}")
    for name in sorted(cpu_after, key=lambda n: cpu_before.get(n, 0) - cpu_after[n]):
        used = 100 * (cpu_after[name] - cpu_before.get(name, 0.0)) / elapsed
        print(f"CPU {name:<16} {used:8.2f} % of one core")
    # The requests of this script once a second are handled only by lw-control.
    print(f"memory               {memory:8.1f} MB resident")
    print(f"windows judged       {windows:8} ({windows / elapsed:.1f}/s)")
    print(f"windows' backlog     {backlog:8} loops at most")
    print(f"cycles dropped       {after['monitor']['dropped']:8}")
    print(f"overruns             {after['overruns'] - before['overruns']:8} of "
          f"{after['ticks'] - before['ticks']} ticks")
    print(f"a tick's work        {after['work_us']['p50']:8.0f} us median, "
          f"{after['work_us']['p99_9']:.0f} us p99.9, of 100000 us")
    return 0


if __name__ == "__main__":
    sys.exit(main())
