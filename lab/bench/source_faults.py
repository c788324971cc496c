#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Faults of the sources of watched loops, one after the other on each source, all sources at a time: servers restarted or
hung, feeders killed, values frozen, stamps an hour off, bad quality, renamed tags, floods, bad lines. Four loops a source
at 1 s; each fault lasts --fault s, and after it the loop must be good again within 60 s. Prints what was seen of each kind,
and every valve alarm there was.

As lab/bench/watched_loops.py needs it.  Example: lab/bench/source_faults.py --rounds 50
"""
import argparse
import collections
import os
import pathlib
import random
import signal
import socket
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402
import watched_loops

VALVE_ALARMS = {"stiction", "backlash", "hysteresis", "leakage", "valve_blocked", "model_gap", "air_supply", "low_air_supply", "positioner"}
RECOVERY_S = 60


class Faults:
    """Faults of each source: their begin, their end, and whether PV must turn bad meanwhile."""

    def __init__(self, plant, plc):
        self.plant, self.plc = plant, plc
        self.kinds = {
            "modbus": {
                "server restarted": (lambda: self.plc_says("restart 5"), lambda: None, None),
                "server hangs": (lambda: plc.send_signal(signal.SIGSTOP), lambda: plc.send_signal(signal.SIGCONT), True),
            },
            "feed": {
                "feeder killed": (self.close_script, self.open_script, True),
                "feeder says nothing": self.held("feed", True),
                "values frozen": self.frozen("feed"),
                "an hour ahead": self.ahead("feed", 3600),
                "an hour behind": self.ahead("feed", -3600),
                "bad quality": (lambda: self.say_bad("bad"), self.end_bad, True),
                "flood": (lambda: self.flood(b'{"values": [{"name": "FIC001.XX", "value": 1}]}\n'), lambda: None, None),
                "bad lines": (lambda: self.flood(b'{"values": [{"name": "FIC001.PV", "val\n', 2000), lambda: None, None),
            },
            "mqtt": {
                "broker hangs": (lambda: self.broker(signal.SIGSTOP), lambda: self.broker(signal.SIGCONT), None),
                "feeder killed": (lambda: self.kill("mqtt"), lambda: self.start("mqtt"), True),
                "feeder hangs": (lambda: self.signal("mqtt", signal.SIGSTOP), lambda: self.signal("mqtt", signal.SIGCONT), True),
                "publisher says nothing": self.held("mqtt", None),
                "values frozen": self.frozen("mqtt"),
                "an hour ahead": self.ahead("mqtt", 3600),
                "an hour behind": self.ahead("mqtt", -3600),
            },
            "opcua": {
                "server hangs": (lambda: plant.server.send_signal(signal.SIGSTOP), lambda: plant.server.send_signal(signal.SIGCONT), True),
                "feeder killed": (lambda: self.kill("opcua"), lambda: self.start("opcua"), True),
                "feeder hangs": (lambda: self.signal("opcua", signal.SIGSTOP), lambda: self.signal("opcua", signal.SIGCONT), True),
                "values frozen": self.frozen("opcua"),
                "an hour ahead": self.ahead("opcua", 3600),
                "bad quality": (lambda: self.order_all("status", "BadSensorFailure"), lambda: self.order_all("status", "Good"), True),
                "tags renamed": (lambda: self.rename("", ".OLD"), lambda: self.rename(".OLD", ""), True),
            },
        }

    def plc_says(self, command):
        self.plc.stdin.write(command + "\n")
        self.plc.stdin.flush()

    def held(self, source, bad):
        return lambda: self.plant.held.add(source), lambda: self.plant.held.discard(source), bad

    def frozen(self, source):
        return lambda: self.plant.frozen.add(source), lambda: self.plant.frozen.discard(source), False

    def ahead(self, source, seconds):
        def turn(by):
            self.plant.ahead_s[source] = by
        return lambda: turn(seconds), lambda: turn(0), None

    def close_script(self):
        self.plant.held.add("feed")
        self.plant.script.close()

    def open_script(self):
        self.plant.script = socket.socket(socket.AF_UNIX)
        self.plant.script.connect(self.plant.daemon.folder + "/feed.sock")
        self.plant.held.discard("feed")

    def say_bad(self, quality):
        self.plant.held.add("feed")
        time.sleep(1.1)
        self.plant.say_script(time.time(), quality)

    def end_bad(self):
        self.plant.held.discard("feed")

    def flood(self, line, count=None):
        """For 3 s, or so many lines; the socket is the feeder's own, and between two of its lines."""
        self.plant.held.add("feed")
        time.sleep(1.1)
        end = time.monotonic() + 3
        while time.monotonic() < end if count is None else count > 0:
            self.plant.script.sendall(line * 100)
            count = count - 100 if count is not None else None
        self.plant.held.discard("feed")

    def broker(self, which):
        self.plant.broker.process.send_signal(which)

    def signal(self, name, which):
        self.plant.feeders[name].send_signal(which)

    def kill(self, name):
        self.signal(name, signal.SIGKILL)
        self.plant.feeders[name].wait()

    def start(self, name):
        self.plant.start_feeder(name)
        if name == "mqtt":
            self.plant.seq = 0  # a new birth without a request

    def order_all(self, *words):
        tags = [f"{tag}.PV" for tag in self.plant.tags["opcua"]]
        with self.plant.server_lock:
            for tag in tags:
                self.plant.server.stdin.write(" ".join((words[0], tag, *words[1:])) + "\n")
                self.plant.server.stdin.flush()
                self.plant.server.stdout.readline()

    def rename(self, old, new):
        # node-opcua's server fails an assertion if a removed node still has values to send.
        self.plant.held.add("opcua")
        time.sleep(5)
        with self.plant.server_lock:
            self.plant.renamed = bool(new)
            for tag in self.plant.tags["opcua"]:
                self.plant.server.stdin.write(f"rename {tag}.PV{old} {tag}.PV{new}\n")
                self.plant.server.stdin.flush()
                self.plant.server.stdout.readline()
        self.plant.held.discard("opcua")


class Campaign:
    def __init__(self, options, daemon, tags, faults):
        self.options, self.daemon, self.tags, self.faults = options, daemon, tags, faults
        self.seen = collections.defaultdict(list)  # (source, kind): (went bad, s until good again or None)
        self.alarms = collections.Counter()

    def loop(self, source, tag):
        return self.daemon.ask({"request": "loop", "loop": f"{source}-{tag}"})

    def all_good(self, source):
        loops = [self.loop(source, tag) for tag in self.tags[source]]
        for loop in loops:
            for alarm, state in loop["alarms"].items():
                if state["active"] and alarm in VALVE_ALARMS:
                    self.alarms[f"{source}: {alarm}"] += 1
        return all(loop["pv_quality"] == "good" for loop in loops)

    def one(self, source, kind):
        begin, finish, _ = self.faults.kinds[source][kind]
        begin()
        went_bad, end = False, time.monotonic() + self.options.fault
        while time.monotonic() < end:
            went_bad |= not self.all_good(source)
            time.sleep(0.5)
        finish()
        since = time.monotonic()
        while time.monotonic() < since + RECOVERY_S:
            if self.all_good(source):
                time.sleep(1.0)
                if self.all_good(source):
                    return went_bad, time.monotonic() - since
            went_bad = True
            time.sleep(0.5)
        return went_bad, None

    def run_source(self, source, rounds, seed):
        chance = random.Random(seed)
        kinds = list(self.faults.kinds[source])
        for number in range(rounds):
            kind = kinds[number % len(kinds)]
            self.seen[source, kind].append(self.one(source, kind))
            time.sleep(chance.uniform(2, 6))

    def run(self):
        threads = [threading.Thread(target=self.run_source, args=(source, self.options.rounds, 17 + place))
                   for place, source in enumerate(self.faults.kinds) if self.tags[source]]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def report(self):
        failures = 0
        for (source, kind), outcomes in sorted(self.seen.items()):
            must = self.faults.kinds[source][kind][2]
            bad = sum(went for went, _ in outcomes)
            times = [back for _, back in outcomes if back is not None]
            lost = len(outcomes) - len(times)
            wrong = lost + sum(must is not None and went != must for went, _ in outcomes)
            failures += wrong
            print(f"{source:8}{kind:24}{len(outcomes):4} times, PV bad in {bad:3}, good again after at most {max(times, default=0):5.1f} s"
                  f"{f', NOT good again: {lost}' if lost else ''}{'' if not wrong else '  <- not as expected'}")
        total = sum(map(len, self.seen.values()))
        print(f"{total} faults, not as expected: {failures}; valve alarms: {dict(self.alarms) or 'none'}")
        return failures == 0 and not self.alarms


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--rounds", type=int, default=50, help="faults of each source")
    parser.add_argument("--fault", type=float, default=10.0, help="s that each lasts")
    parser.add_argument("--loops", type=int, default=16)
    parser.add_argument("--without", nargs="*", default=[], choices=watched_loops.SOURCES)
    options = parser.parse_args()
    options.recording = False
    plc, port = watched_loops.start_plc()
    daemon, tags = watched_loops.daemon_with(options, options.loops, 0, port)
    try:
        with daemon:
            plant = watched_loops.Plant(daemon, tags)
            try:
                plant.start()
                time.sleep(15)
                campaign = Campaign(options, daemon, tags, Faults(plant, plc))
                campaign.run()
                good = campaign.report()
                print("feeders: " + ", ".join(f"{name} bad lines {f['bad_lines']} unknown {f['unknown_names']}"
                                              for name, f in watched_loops.taken(daemon).items()))
            finally:
                plant.end()
    finally:
        plc.kill()
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
