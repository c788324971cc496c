#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Loops at 10 Hz without and with a permanent explanation of an alarm: late cycles, wake-up times.

The explanation runs as in the daemon (`loopwarden explain --background`), repeatedly, on the minutes of a
simulated loop whose gain changes. Each run has separate figures, because the daemon is restarted.

Example: lab/bench/explain_beside.py --loops 50 --seconds 60
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402

PROGRAM = os.path.join(bench_daemon.BIN, "loopwarden")
MODEL = """sample_time: 0.1
controller: {{kp: 0.35, ki: 0.04, output: [0, 10]}}
process: {{gain: 1.2264, time_constant: 1.69376, dead_time: 2.6256}}
transmitter: {{range: [0, 10], resolution: 0.00244140625, noise: 0.01}}
scenario: {{duration: 2400, set_point: [[0, 4], [100, 5], [500, 4], [1000, 6], [1500, 4], [2000, 5]], faults: [{0}], seed: 1}}
"""


def make_evidence(folder):
    """Makes the files that the daemon stores for an alarm at 1800 s."""
    for name, fault in (("truth", "{effect: gain_change, factor: 0.8, block: process, from: 1700}"), ("twin", "")):
        with open(f"{folder}/{name}.yaml", "w", encoding="utf-8") as file:
            file.write(MODEL.format(fault))
    subprocess.run([PROGRAM, "simulate", f"{folder}/truth.yaml", "--out", f"{folder}/record.csv"], check=True,
                   stdout=subprocess.DEVNULL)
    with open(f"{folder}/record.csv", newline="", encoding="utf-8") as source, \
         open(f"{folder}/minutes.csv", "w", newline="", encoding="utf-8") as target:
        rows = csv.DictReader(source)
        writer = csv.DictWriter(target, rows.fieldnames, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({**row, "time": f"{float(row['time']) - 1800.0:.1f}"})
    with open(f"{folder}/evidence.json", "w", encoding="utf-8") as file:
        json.dump({"alarm": "model_gap", "raised_ms": 0, "loop": "FIC-101"}, file)


def explain_until(folder, ended, counts):
    while not ended.is_set():
        child = subprocess.Popen([PROGRAM, "explain", "--background", folder])
        while child.poll() is None and not ended.wait(0.1):
            pass
        if child.poll() is None:
            child.kill()
            child.wait()
        else:
            counts.append(child.returncode)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--loops", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each run")
    options = parser.parse_args()
    print(f"{'':24}{'ticks':>8}{'overruns':>10}{'wake-up median':>16}{'p99.9':>10}{'worst, us':>11}")
    with tempfile.TemporaryDirectory() as folder:
        make_evidence(folder)
        for name in ("alone", "beside explanations"):
            ended, counts = threading.Event(), []
            thread = threading.Thread(target=explain_until, args=(folder, ended, counts))
            with bench_daemon.Daemon(options.daemon, "log_level: warn\n",
                                     [(0.1, "")] * options.loops) as daemon:
                if name != "alone":
                    thread.start()
                time.sleep(options.seconds)
                status = daemon.status()["daemon"]
                ended.set()
                if name != "alone":
                    thread.join()
                daemon.stop()
            wake = status["wake_up_us"]
            print(f"{name:24}{status['ticks']:8}{status['overruns']:10}{wake['p50']:16.0f}{wake['p99_9']:10.0f}"
                  f"{wake['worst']:11.0f}")
        print(f"{len(counts)} explanations made meanwhile; {status['real_time_missing'] or 'real-time rights'}")
    return 0 if all(code == 0 for code in counts) else 1


if __name__ == "__main__":
    sys.exit(main())
