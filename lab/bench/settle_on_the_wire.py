#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A small test over Modbus: loopwardend on a pymodbus plant whose valve has friction of its own (a balance of forces), or a
loose linkage. `gap` reads a quiet record and proposes a test, `valve-test --plan --live` carries it out and judges it.

Prints the explanations before and after, and what was predicted.
Example: lab/bench/settle_on_the_wire.py --truth stiction --out /tmp/settle
"""
import argparse
import json
import math
import os
import pathlib
import pty
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402

DEVICE = os.path.join(bench_daemon.ROOT, "tests/support/device/plant_device.py")
LOOPWARDEN = os.path.join(bench_daemon.BIN, "loopwarden")
GAIN, LAG, DEAD_TIME, WIRE = 1.2264, 1.69376, 2.6256, 0.1  # L/min per V, s, s, s of the clock
START, SP, KP, KI = 4.25, 5.2, 0.25, 0.06                  # V, L/min, V/(L/min), per s of the plant
TAG = "FIC-1"

LOOP = """loop: FIC-1
sample_time: 0.1
process_variable: {{unit: L/min, range: [0, 10]}}
controller:
  action: reverse
  kp: {kp}
  ki: {ki:.6g}
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10]}}
start: {{mode: automatic, set_point: {sp}}}
safe_actions: {{stop: hold, bad_pv: hold, output_lost: hold, late_cycle_periods: 40, enable_open: hold, recovery: previous_mode}}
recording: {{enabled: true}}
io:
  backend: modbus
  poll_period: 0.1
  transmitter: {{link: skid, unit: 1, register: {{table: input, address: 0, type: f32}}}}
  positioner:
    link: skid
    unit: 1
    command: {{address: 0, type: f32}}
    read_back: {{table: input, address: 20, type: f32}}
    comm_loss: none_accepted
"""

MODEL = """sample_time: 0.1
controller: {{action: reverse, kp: {kp}, ki: {ki:.6g}, output: [0, 10]}}
valve: {{effects: []}}
process: {{gain: {gain}, time_constant: {lag:.6g}, dead_time: {dead_time:.6g}}}
transmitter: {{range: [0, 10], resolution: 0, noise: {noise}}}
"""


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def in_terminal(command, answer):
    """Runs a command in a terminal and types the answer at its prompt. Returns its exit code and what it showed."""
    child, terminal = pty.fork()
    if child == 0:
        os.execv(command[0], command)
    shown, asked = b"", False
    while True:
        try:
            some = os.read(terminal, 4096)
        except OSError:
            break
        if not some:
            break
        shown += some
        if not asked and b"press Enter to leave" in shown:
            os.write(terminal, answer.encode() + b"\n")
            asked = True
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), shown.decode(errors="replace")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--truth", choices=("stiction", "backlash"), default="stiction")
    parser.add_argument("--band", type=float, default=0.12, help="V of 10 V")
    parser.add_argument("--jump", type=float, default=0.4, help="of stiction, share of the band")
    parser.add_argument("--noise", type=float, default=0.03, help="of PV, L/min")
    parser.add_argument("--speed", type=float, default=4.0, help="plant seconds per second")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the record, by the clock")
    parser.add_argument("--step", type=float, default=0.5, help="of SP in the record, L/min")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", required=True, help="folder")
    args = parser.parse_args()
    friction = (["--stick", str(args.band), "--jump", str(args.jump * args.band), "--mass", "0.002"]
                if args.truth == "stiction" else ["--play", str(args.band)])
    device = subprocess.Popen(
        ["/usr/bin/python3", DEVICE, "--start", str(START), "--speed", str(args.speed), "--noise", str(args.noise),
         "--load", "0.002", "--seed", str(args.seed), *friction],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    port = int(device.stdout.readline().split("port=")[1])
    daemon = bench_daemon.Daemon(
        bench_daemon.PROGRAM,
        f"real_time: {{priority: 0}}\nlinks:\n  skid: {{transport: tcp, host: 127.0.0.1, port: {port}}}\n", [])
    keys = {"kp": KP, "ki": KI * args.speed, "sp": SP}
    with open(os.path.join(daemon.folder, f"config/loops.d/{TAG}.yaml"), "w") as file:
        file.write(LOOP.format(**keys))
    os.makedirs(args.out, exist_ok=True)
    model = os.path.join(args.out, "model.yaml")
    with open(model, "w") as file:
        file.write(MODEL.format(**keys, gain=GAIN, lag=LAG / args.speed, dead_time=DEAD_TIME / args.speed + WIRE,
                                noise=args.noise))
    try:
        with daemon:
            time.sleep(15.0)
            begun = time.monotonic()
            time.sleep(args.seconds / 3.0)
            daemon.ask({"request": "set", "loop": TAG, "set_point": SP + args.step})
            time.sleep(args.seconds / 3.0)
            daemon.ask({"request": "set", "loop": TAG, "set_point": SP})
            time.sleep(args.seconds / 3.0)
            length = math.ceil(time.monotonic() - begun)
            socket = ["--socket", os.path.join(daemon.folder, "control.sock")]
            found = json.loads(run(LOOPWARDEN, "gap", "--loop", TAG, "--last", f"{length}s", "--model", model, "--out",
                                   os.path.join(args.out, "gap"), "--json", *socket))
            print("before:", json.dumps(found["posterior"]))
            plan = found["next_test"]
            if not plan:
                sys.exit(f"no test is proposed: {found['verdict']}")
            print("test:", json.dumps(plan))
            code, shown = in_terminal(
                [LOOPWARDEN, "valve-test", TAG, "--plan", os.path.join(args.out, "gap", "next_test.yaml"), "--live",
                 "--out", os.path.join(args.out, "test"), *socket], TAG)
            print(shown)
            print(run(LOOPWARDEN, "outcome", "--tests", *socket))
            if code == 0:
                with open(os.path.join(args.out, "test", "test.json")) as file:
                    print("decided:", json.load(file)["decided"], "truth:", args.truth)
    finally:
        device.kill()
        device.wait()


if __name__ == "__main__":
    main()
