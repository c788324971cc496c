#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Faults in small tests, with the real programs: `valve-test --plan --live` in a terminal on a simulated loop. At a random
time a key, a signal or kill -9 ends the command, kill -9 ends the daemon, or a second person acts. Then the loop must be
where a test must leave it. The kinds that need a device or a fake clock are in tests_daemon "[test_campaign]".

Example: tests/system/test_faults.py --faults 20
"""
import argparse
import os
import pathlib
import pty
import random
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402

LOOPWARDEN = os.path.join(bench_daemon.BIN, "loopwarden")
TAG, SP, SIZE, HOLD = "FIC-101", 3.0, 0.15, 20.0
KINDS = ("none", "key", "SIGINT", "SIGHUP", "workbench", "daemon", "manual", "second test", "reload")
PLAN = """planned_at: "2090-01-01T00:00:00Z"
model: "{root}/examples/models/plant1.yaml"
record: "record.csv"
move: {move}
from: {start}
size: {size}
hold: {hold}
limits: {{pv: [0.5, 8.5], co: [0.2, 8]}}
expected: {{probability_right: 0.9, probability_wrong: 0.01, pv_swing: 0.5, output_swing: 0.5}}
explanations: [{{effects: [stiction], probability: 0.5}}, {{effects: [backlash], probability: 0.5}}]
"""


class Terminal:
    """valve-test in a terminal of its own, with the tag typed."""

    def __init__(self, command):
        self.child, self.terminal = pty.fork()
        if self.child == 0:
            os.execv(command[0], command)
        self.shown = b""
        self.until(b"press Enter to leave")
        self.type(TAG + "\n")

    def type(self, text):
        os.write(self.terminal, text.encode())

    def read(self):
        try:
            some = os.read(self.terminal, 4096)
        except OSError:
            return False
        self.shown += some
        return bool(some)

    def until(self, text):
        while text not in self.shown:
            if not self.read():
                raise SystemExit("valve-test: " + self.shown.decode(errors="replace"))

    def end(self):
        while self.read():
            pass
        return os.waitstatus_to_exitcode(os.waitpid(self.child, 0)[1])


def state(daemon):
    return next(one for one in daemon.status()["loops"] if one["name"] == TAG)


def wait(seconds, true):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if true():
            return True
        time.sleep(0.1)
    return False


def settle(daemon):
    daemon.ask({"request": "set", "loop": TAG, "mode": "auto", "set_point": SP})
    if not wait(120.0, lambda: state(daemon).get("mode") == "AUTO" and state(daemon)["sp"] == SP
                and abs(state(daemon)["pv"] - SP) < 0.1 and state(daemon)["commissioning"] is None
                and not any(alarm["active"] for alarm in state(daemon)["alarms"].values())):
        raise SystemExit("the loop does not settle: " + str(state(daemon)))


def inject(kind, daemon, terminal):
    """Returns the mode in which the loop must be."""
    if kind == "key":
        terminal.type("x")
    elif kind in ("SIGINT", "SIGHUP"):
        os.kill(terminal.child, getattr(signal, kind))
    elif kind == "workbench":
        os.kill(terminal.child, signal.SIGKILL)
    elif kind == "daemon":
        daemon.process.kill()
        daemon.process.wait()
        daemon.__enter__()
    elif kind == "manual":
        daemon.ask({"request": "set", "loop": TAG, "mode": "man"})
        return "MAN"
    elif kind == "second test":
        terms = {"pv": [1, 5], "co": [1, 5], "moved": [2.9, 3.1], "longest_s": 60}
        for request in ({"request": "commissioning", "test": terms}, {"request": "set", "set_point": 4.0}):
            try:
                if daemon.ask({**request, "loop": TAG}).get("ok"):
                    return "refused"
            except OSError:
                pass
    elif kind == "reload":
        daemon.ask({"request": "reload"})
    return "AUTO"


def difference(daemon, plan, kind, at, by_output):
    terminal = Terminal([LOOPWARDEN, "valve-test", TAG, "--plan", plan, "--live", "--out",
                         os.path.join(daemon.folder, "test"), "--socket", os.path.join(daemon.folder, "control.sock")])
    moved = "MAN" if by_output else "AUTO"
    terminal.until(b" s of ")
    time.sleep(at)
    if state(daemon)["mode"] != moved:
        return "the test does not run"
    mode = inject(kind, daemon, terminal)
    code = terminal.end()
    if (kind in ("none", "second test", "reload")) != (code == 0 or b"record.csv" in terminal.shown):
        return f"exit code {code}: {terminal.shown.decode(errors='replace')[-300:]}"
    if not wait(80.0, lambda: state(daemon)["commissioning"] is None):
        return "the loop is still out of service"
    time.sleep(1.0)
    now = state(daemon)
    if now["requested_mode"] != mode:
        return f"the mode is {now['requested_mode']}"
    if now["set_point_wanted"] != SP and mode == "AUTO":
        return f"the set point is {now['set_point_wanted']}"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    chance = random.Random(args.seed)
    daemon = bench_daemon.Daemon(bench_daemon.PROGRAM, "real_time: {priority: 0}\naccelerate: 5\n",
                                 [(0.1, "")])
    loop = pathlib.Path(daemon.folder) / "config/loops.d/0000.yaml"
    loop.write_text(loop.read_text().replace("start: {mode: automatic,", "start: {after_restart: continue, output: 2.4, mode: automatic,"))
    right = 0
    with daemon:
        for number in range(args.faults):
            settle(daemon)
            kind = KINDS[number % len(KINDS)] if number < len(KINDS) else chance.choice(KINDS)
            by_output = chance.random() < 0.5
            plan = os.path.join(daemon.folder, "next_test.yaml")
            with open(plan, "w") as file:
                file.write(PLAN.format(root=bench_daemon.ROOT, move="output_pair" if by_output else "set_point_pair",
                                       start=state(daemon)["co"] if by_output else SP, size=SIZE, hold=HOLD))
            at = 5.0 * chance.random()
            why = difference(daemon, plan, kind, at, by_output)
            right += not why
            print(f"{number + 1:>4} {kind}, {'output' if by_output else 'SP'}, after {at:.1f} s: {why or 'as it must be'}", flush=True)
    print(f"{args.faults} faults, loop as a test must leave it: {right}")
    return 0 if right == args.faults else 1


if __name__ == "__main__":
    sys.exit(main())
