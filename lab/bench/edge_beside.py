#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Late cycles and wake-up times of the daemon with loops at 10 Hz: without loopwarden-edge, with it, and with one whose
broker accepts and then hangs. The daemon is restarted for each.

Exit code 1 if the edge ended, or if there were more overruns than --allow beyond those without it.

Example: lab/bench/edge_beside.py --loops 50 --seconds 60
"""
import argparse
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402

EDGE = os.path.join(bench_daemon.BIN, "loopwarden-edge")
EDGE_YAML = """broker: {{url: "mqtt://127.0.0.1:{port}", keep_alive: 5, reconnect_min: 0.1, reconnect_max: 1}}
sparkplug: {{group: plant, edge: box}}
runtime_directory: {folder}
store: {{directory: {folder}}}
data: {{interval: 0.2, dead_band: 0}}
"""


class Broker:
    def __init__(self, folder):
        with socket.socket() as any_port:
            any_port.bind(("127.0.0.1", 0))
            self.port = any_port.getsockname()[1]
        with open(folder + "/mosquitto.conf", "w", encoding="ascii") as file:
            file.write(f"listener {self.port} 127.0.0.1\nallow_anonymous true\nuser root\nlog_type none\n")
        self.process = subprocess.Popen([shutil.which("mosquitto", path="/usr/sbin:/usr/bin"), "-c", folder + "/mosquitto.conf"],
                                        stderr=subprocess.DEVNULL)

    def hang(self):
        """Stops the broker; its system continues to accept connections."""
        self.process.send_signal(signal.SIGSTOP)

    def end(self):
        self.process.kill()
        self.process.wait()


def start_edge(folder, port):
    with open(folder + "/edge.yaml", "w", encoding="ascii") as file:
        file.write(EDGE_YAML.format(folder=folder, port=port))
    with open(folder + "/edge.log", "w", encoding="ascii") as log:
        return subprocess.Popen([EDGE, "--config", folder + "/edge.yaml"], stderr=log)


def await_log(folder, word):
    for _ in range(600):
        with open(folder + "/edge.log", encoding="ascii") as log:
            if word in log.read():
                return
        time.sleep(0.1)
    raise SystemExit(f"loopwarden-edge does not say '{word}'")


def counted(daemon, seconds):
    before = daemon.status()["daemon"]
    time.sleep(seconds)
    after = daemon.status()["daemon"]
    return {"ticks": after["ticks"] - before["ticks"], "overruns": after["overruns"] - before["overruns"],
            "wake": after["wake_up_us"], "missing": after["real_time_missing"]}


def alone(daemon, seconds):
    return counted(daemon, seconds)


def beside(daemon, seconds, hangs):
    broker = Broker(daemon.folder)
    edge = None
    try:
        time.sleep(0.5)
        edge = start_edge(daemon.folder, broker.port)
        await_log(daemon.folder, "broker: connected")
        if hangs:
            broker.hang()
        result = counted(daemon, seconds)
        if hangs:
            # Makes sure that the edge noticed it; otherwise the case tests no fault.
            await_log(daemon.folder, "warning broker:")
        edge.send_signal(signal.SIGTERM)
        result["edge"] = edge.wait(timeout=60)
        return result
    finally:
        broker.end()
        if edge and edge.poll() is None:
            edge.kill()
            edge.wait()


PHASES = {"alone": alone, "beside the edge": lambda daemon, seconds: beside(daemon, seconds, False),
          "its broker hangs": lambda daemon, seconds: beside(daemon, seconds, True)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--loops", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each phase; at least 15, so that the edge gives up")
    parser.add_argument("--allow", type=int, default=0, help="overruns beyond those of the daemon alone")
    options = parser.parse_args()
    print(f"{'':24}{'ticks':>8}{'overruns':>10}{'wake-up median':>16}{'p99.9':>10}{'worst, us':>11}")
    results = {}
    for name, phase in PHASES.items():
        with bench_daemon.Daemon(options.daemon, "log_level: warn\n", [(0.1, "")] * options.loops) as daemon:
            results[name] = phase(daemon, options.seconds)
            daemon.stop()
        wake = results[name]["wake"]
        print(f"{name:24}{results[name]['ticks']:8}{results[name]['overruns']:10}{wake['p50']:16.0f}{wake['p99_9']:10.0f}"
              f"{wake['worst']:11.0f}", flush=True)
    print(f"{options.loops} loops at 10 Hz, the edge looks five times a second; "
          f"{results['alone']['missing'] or 'real-time rights'}")
    most = results["alone"]["overruns"] + options.allow
    good = all(result["overruns"] <= most and result.get("edge", 0) == 0 for result in results.values())
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
