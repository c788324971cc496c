#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Cost of status readers: many loops, with several overview requests a second over status.sock.

Runs the real daemon on simulated loops of plant 1 and prints the size of an answer, how long it took, the processor time
of lw-status, and the late cycles with and without readers.

Example: lab/bench/status_readers.py --loops 1000 --rate 5 --seconds 30
"""
import argparse
import json
import pathlib
import socket
import statistics
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402


class Reader:
    """One connection to status.sock."""

    def __init__(self, folder):
        self.peer = socket.socket(socket.AF_UNIX)
        self.peer.settimeout(60)
        self.peer.connect(folder + "/status.sock")

    def ask(self, request):
        self.peer.sendall(json.dumps(request).encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            some = self.peer.recv(1 << 20)
            if not some:
                raise OSError("the status socket closed")
            answer += some
        return answer


def read(folder, request, rate, until, seconds):
    reader = Reader(folder)
    due = time.monotonic()
    while due < until:
        time.sleep(max(0.0, due - time.monotonic()))
        begun = time.monotonic()
        reader.ask(request)
        seconds.append(time.monotonic() - begun)
        due += 1.0 / rate


def stretch(daemon, options, readers):
    """Runs for options.seconds; returns status and CPU before and after, and the times of all answers."""
    before, cpu_before = daemon.status()["daemon"], daemon.threads()
    until, seconds = time.monotonic() + options.seconds, []
    threads = [threading.Thread(target=read, args=(daemon.folder, {"request": options.request}, options.rate, until,
                                                   seconds)) for _ in range(readers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    time.sleep(max(0.0, until - time.monotonic()))
    return before, cpu_before, daemon.status()["daemon"], daemon.threads(), seconds


def late(before, after):
    return f"{after['overruns'] - before['overruns']} of {after['ticks'] - before['ticks']}"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--loops", type=int, default=1000)
    parser.add_argument("--readers", type=int, default=1)
    parser.add_argument("--rate", type=float, default=5.0, help="requests a second of each reader")
    parser.add_argument("--request", default="overview")
    parser.add_argument("--seconds", type=float, default=30.0)
    options = parser.parse_args()
    with bench_daemon.Daemon(options.daemon, "", [(0.1, "")] * options.loops) as daemon:
        time.sleep(5.0)
        size = len(Reader(daemon.folder).ask({"request": options.request}))
        quiet_before, _, quiet_after, _, _ = stretch(daemon, options, 0)
        before, cpu_before, after, cpu_after, seconds = stretch(daemon, options, options.readers)
        memory = daemon.memory_mb()
        daemon.stop()
    used = cpu_after["lw-status"] - cpu_before["lw-status"]
    print(f"{options.loops} loops at 10 Hz; {options.readers} x {options.rate:g} '{options.request}' a second for "
          f"{options.seconds:g} s")
    print(f"an answer            {size / 1000:8.1f} kB")
    print(f"until it is there    {1000 * statistics.median(seconds):8.2f} ms median, "
          f"{1000 * statistics.quantiles(seconds, n=100)[98]:.2f} ms p99")
    print(f"CPU lw-status        {100 * used / options.seconds:8.2f} % of one core, "
          f"{1e6 * used / len(seconds):.0f} us an answer")
    print(f"memory               {memory:8.1f} MB resident")
    print(f"late cycles          {late(before, after)} ticks with readers, "
          f"{late(quiet_before, quiet_after)} without")
    return 0


if __name__ == "__main__":
    sys.exit(main())
