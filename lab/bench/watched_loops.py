#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A plant of watched loops at 1 s, a quarter of each source: Modbus TCP (pymodbus, 20 units), feed.sock (this script),
MQTT (half plain JSON, half Sparkplug B by alias; Mosquitto, loopwarden-feed) and OPC UA (node-opcua, loopwarden-opcua).
CPU and memory of loopwardend and of the feeders, and how many of the sent values did not arrive.

With --beside N: N loops controlled by this daemon (10 Hz, simulated) run without and with the watched ones, in --pairs
alternating pairs of --seconds each; late cycles of both.

Needs root, because each feeder has its own user. `tests/services/opcua/check` must have fetched the npm packages, or
use --without opcua.  Example: lab/bench/watched_loops.py --loops 1000 --seconds 3600
"""
import argparse
import json
import os
import pathlib
import random
import re
import shutil
import socket
import statistics
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/support"))
import bench_daemon  # noqa: E402
from edge_beside import Broker

USERS = {"feed": "root", "mqtt": "daemon", "opcua": "bin"}
SOURCES = ("modbus", "feed", "mqtt", "opcua")
UNITS, LOOPS_A_UNIT, REGISTERS_A_LOOP = 20, 13, 9
PARTS = ("PV", "OP", "SP")
LOOP = """loop: {tag}
control: elsewhere
sample_time: 1
process_variable: {{unit: m3/h, range: [0, 40], max_age: 5}}
output: {{unit: "%", range: [0, 100]}}
recording: {{enabled: {recording}}}
io:
{io}"""
OPCUA = os.path.join(bench_daemon.ROOT, "services/opcua/loopwarden-opcua")


def modbus_io(number):
    unit, at = number % UNITS + 1, number // UNITS * REGISTERS_A_LOOP
    return "  backend: modbus\n" + "".join(
        f"  {part}: {{link: plc, unit: {unit}, register: {{table: input, address: {at + offset}, type: f32}}}}\n"
        for part, offset in (("pv", 0), ("co", 2), ("sp", 4)))


def fed_io(feeder, tag):
    return "  backend: feed\n" + "".join(f'  {key}: {{feed: "{feeder}:{tag}.{part}"}}\n'
                                         for key, part in zip(("pv", "co", "sp"), PARTS))


class Plant:
    """Programs that are sources, and what they have sent by feeder."""

    def __init__(self, daemon, tags):
        self.daemon, self.tags = daemon, tags
        self.sent = dict.fromkeys(USERS, 0)
        self.feeders, self.children, self.ended = {}, [], threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.held = set()     # silent sources
        self.frozen = set()   # sources that send the same values with new stamps
        self.last = {}
        self.renamed = False  # PV of the OPC UA server
        self.server_lock = threading.Lock()
        self.ahead_s = dict.fromkeys(USERS, 0.0)  # of the source's clock

    def spawn(self, *words, **more):
        child = subprocess.Popen(words, text=True, **more)
        self.children.append(child)
        return child

    def start_feeder(self, name):
        program = OPCUA if name == "opcua" else os.path.join(bench_daemon.BIN, "loopwarden-feed")
        config = "opcua.yaml" if name == "opcua" else "feed.yaml"
        words = [program, "--config", f"{self.daemon.folder}/{config}"]
        with open(f"{self.daemon.folder}/{name}.log", "a") as log:
            self.feeders[name] = self.spawn(*words, stderr=log, stdout=log, user=USERS[name], group="root")

    def await_log(self, name, word):
        for _ in range(600):
            with open(f"{self.daemon.folder}/{name}.log") as log:
                text = log.read()
            if word in text:
                return
            time.sleep(0.1)
        raise SystemExit(f"{name} does not say '{word}':\n{text}")

    def start(self):
        folder = self.daemon.folder
        os.chmod(folder, 0o777)
        if self.tags["feed"]:
            self.script = socket.socket(socket.AF_UNIX)
            self.script.connect(folder + "/feed.sock")
        if self.tags["mqtt"]:
            self.start_mqtt(folder)
        if self.tags["opcua"]:
            self.start_opcua(folder)
        self.thread.start()

    def start_mqtt(self, folder):
        import paho.mqtt.client
        self.broker = Broker(folder)
        half = len(self.tags["mqtt"]) // 2
        self.plain, self.sparkplug = self.tags["mqtt"][:half], self.tags["mqtt"][half:]
        topics = "".join(f"  - {{name: {tag}.{part}, topic: p/{tag}, value: /{part}, time: /t}}\n"
                         for tag in self.plain for part in PARTS)
        metrics = "".join(f"  - {{name: {tag}.{part}, group: plant, edge: e, device: d, metric: {tag}/{part}}}\n"
                          for tag in self.sparkplug for part in PARTS)
        with open(folder + "/feed.yaml", "w") as file:
            file.write(f"broker: {{url: 'mqtt://127.0.0.1:{self.broker.port}', reconnect_min: 0.1}}\n"
                       f"runtime_directory: {folder}\ntopics:\n{topics}metrics:\n{metrics}")
        sys.path.insert(0, self.daemon.folder)
        proto = os.path.join(bench_daemon.ROOT, "services/net/sparkplug")
        subprocess.run(["protoc", f"--proto_path={proto}", f"--python_out={folder}", "sparkplug_b.proto"], check=True)
        import sparkplug_b_pb2
        self.payload_of = sparkplug_b_pb2.Payload
        time.sleep(0.5)
        self.start_feeder("mqtt")
        self.await_log("mqtt", "broker: connected")
        self.client = paho.mqtt.client.Client("plant")
        self.client.max_queued_messages_set(0)
        self.client.connect("127.0.0.1", self.broker.port)
        self.client.loop_start()
        self.seq = 0

    def start_opcua(self, folder):
        port = bench_daemon.free_port()
        script = os.path.join(bench_daemon.ROOT, "tests/services/opcua/server.js")
        self.server = self.spawn("node", script, str(port), folder + "/server", "--loops", str(len(self.tags["opcua"])),
                                 "--user", "watcher:word", stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        while self.server.stdout.readline() != "ready\n":
            pass
        nodes = "".join(f"  {tag}.{part}: nsu=urn:test:dcs;s={tag}.{part}\n" for tag in self.tags["opcua"] for part in PARTS)
        with open(folder + "/opcua.yaml", "w") as file:
            file.write(f"url: opc.tcp://127.0.0.1:{port}\nuser: watcher\npassword: {{file: password}}\n"
                       f"runtime_directory: {folder}\nstate_directory: {folder}/opcua\n"
                       f"publishing_interval: 0.5\nsampling_interval: 0.1\nnodes:\n{nodes}")
        with open(folder + "/password", "w") as file:
            file.write("word\n")
        os.mkdir(folder + "/opcua")
        shutil.chown(folder + "/opcua", USERS["opcua"], "root")
        config = ["--config", folder + "/opcua.yaml"]
        as_user = {"user": USERS["opcua"], "group": "root", "capture_output": True, "text": True}
        said = subprocess.run([OPCUA, *config], **as_user).stderr
        found = re.search(r"not trusted[^$]*?SHA-256 ([0-9A-F:]{95})", said)
        if not found:
            raise SystemExit("loopwarden-opcua tells no fingerprint:\n" + said)
        subprocess.run([OPCUA, "trust", "--fingerprint", found.group(1), *config], check=True, **as_user)
        self.start_feeder("opcua")

    def values(self, source, tag):
        """Values of a steady loop: CO hunts a little, PV is noisy; no value repeats."""
        if source in self.frozen:
            return self.last[source, tag]
        new = {"PV": 20 + random.gauss(0, 0.1), "OP": 50 + random.gauss(0, 0.2), "SP": 20 + 0.001 * random.random()}
        self.last[source, tag] = new
        return new

    def run(self):
        due = time.monotonic()
        while not self.ended.is_set():
            now = time.time()
            for source, say in (("feed", self.say_script), ("mqtt", self.say_mqtt), ("opcua", self.say_opcua)):
                if self.tags[source] and source not in self.held:
                    say(now + self.ahead_s[source])
            # A late round delays those after it, because an OPC UA server would merge two within its sampling interval.
            due = max(due + 1, time.monotonic() + 0.5)
            self.ended.wait(due - time.monotonic())

    def say_script(self, now, quality="good"):
        for begin in range(0, len(self.tags["feed"]), 50):
            values = [{"name": f"{tag}.{part}", "value": value, "time": now, "quality": quality}
                      for tag in self.tags["feed"][begin:begin + 50] for part, value in self.values("feed", tag).items()]
            self.script.sendall(json.dumps({"values": values}).encode() + b"\n")
            self.sent["feed"] += len(values)

    def say_mqtt(self, now):
        for tag in self.plain:
            self.client.publish(f"p/{tag}", json.dumps({**self.values("mqtt", tag), "t": now}), qos=1)
        ms = int(now * 1000)
        kind = "DDATA" if self.seq else "DBIRTH"
        if not self.seq:
            node = self.payload_of(timestamp=ms, seq=0)
            node.metrics.add(name="bdSeq", datatype=4, long_value=0, timestamp=ms)
            self.client.publish("spBv1.0/plant/NBIRTH/e", node.SerializeToString(), qos=1)
        self.seq += 1
        device = self.payload_of(timestamp=ms, seq=self.seq % 256)
        for alias, tag in enumerate(self.sparkplug):
            for place, (part, value) in enumerate(self.values("mqtt", tag).items()):
                metric = device.metrics.add(alias=3 * alias + place, timestamp=ms, double_value=value)
                if kind == "DBIRTH":
                    metric.name, metric.datatype = f"{tag}/{part}", 10
        self.client.publish(f"spBv1.0/plant/{kind}/e/d", device.SerializeToString(), qos=1)
        self.sent["mqtt"] += len(PARTS) * len(self.tags["mqtt"])

    def say_opcua(self, now):
        with self.server_lock:
            orders = [f"set {tag}.{part} {value} {now}\n" for tag in self.tags["opcua"] for part, value in self.values("opcua", tag).items()
                      if part != "PV" or not self.renamed]
            self.server.stdin.write("".join(orders))
            self.server.stdin.flush()
            for _ in orders:
                self.server.stdout.readline()
        self.sent["opcua"] += len(orders)

    def settled(self):
        """Returns the counts of received and sent values, while no value is on its way."""
        self.held.update(USERS)
        time.sleep(2.5)
        counts = taken(self.daemon), dict(self.sent)
        self.held.clear()
        return counts

    def end(self):
        self.ended.set()
        if self.thread.is_alive():
            self.thread.join()
        for child in self.children:
            child.kill()
            child.wait()
        if hasattr(self, "broker"):
            self.client.loop_stop()
            self.broker.end()


def start_plc():
    device = os.path.join(bench_daemon.ROOT, "tests/support/device/plc_device.py")
    plc = subprocess.Popen([sys.executable, device, "--units", ",".join(str(u + 1) for u in range(UNITS)), "--loops", str(LOOPS_A_UNIT)],
                           stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    return plc, plc.stdout.readline().split("port=")[1].strip()


def tags_of(loops, without):
    sources = [source for source in SOURCES if source not in without]
    tags = {source: [] for source in SOURCES}
    for i in range(loops):
        which = tags[sources[i % len(sources)]]
        which.append(f"FIC{len(which) + 1:03}")  # as the OPC UA server names its own
    return tags


def daemon_with(options, watched, controlled, plc_port):
    tags = tags_of(watched, options.without)
    yaml = "log_level: warn\nmodbus_server: {port: %d}\n" % bench_daemon.free_port()
    yaml += f"links: {{plc: {{transport: tcp, host: 127.0.0.1, port: {plc_port}}}}}\n"
    yaml += "feeders:\n" + "".join(f"  {name}: {{user: {user}}}\n" for name, user in USERS.items())
    daemon = bench_daemon.Daemon(options.daemon, yaml, [(0.1, "")] * controlled)
    for source in SOURCES:
        for number, tag in enumerate(tags[source]):
            io = modbus_io(number) if source == "modbus" else fed_io(source, tag)
            with open(f"{daemon.folder}/config/loops.d/w-{source}-{number:04}.yaml", "w") as file:
                file.write(LOOP.format(tag=f"{source}-{tag}", io=io, recording="true" if options.recording else "false"))
    return daemon, tags


def taken(daemon):
    return {feeder["name"]: feeder for feeder in daemon.status()["daemon"]["feeders"]}


def measure(options, plc_port):
    daemon, tags = daemon_with(options, options.loops, 0, plc_port)
    with daemon:
        plant = Plant(daemon, tags)
        try:
            plant.start()
            time.sleep(options.warm_up)
            processes = {"loopwardend": daemon.process, **plant.feeders}
            came, sent = plant.settled()
            cpu_before = {n: bench_daemon.cpu_s(p.pid) for n, p in processes.items()}
            threads, begin = daemon.threads(), time.monotonic()
            time.sleep(options.seconds)
            elapsed = time.monotonic() - begin
            cpu = {n: bench_daemon.cpu_s(p.pid) - cpu_before[n] for n, p in processes.items()}
            used = {n: t - threads.get(n, 0) for n, t in daemon.threads().items()}
            after, sent_after = plant.settled()
            print(f"{options.loops} watched loops at 1 s ({', '.join(f'{len(t)} {s}' for s, t in tags.items() if t)}), {elapsed:.0f} s")
            for name, process in processes.items():
                print(f"{name:16}{100 * cpu[name] / elapsed:8.2f} % of a core{bench_daemon.status_kib(process.pid, 'VmRSS') / 1024:8.1f} MB"
                      f"{bench_daemon.status_kib(process.pid, 'VmHWM') / 1024:8.1f} MB at most")
            for name in sorted(used, key=lambda n: -used[n])[:5]:
                print(f"  thread {name:16}{100 * used[name] / elapsed:8.2f} %")
            for name in USERS:
                if tags[name]:
                    grown = {key: after[name][key] - came[name][key] for key in ("values", "doubled", "out_of_order", "bad_lines")}
                    print(f"{name:8} sent {sent_after[name] - sent[name]}, taken " + ", ".join(f"{key} {n}" for key, n in grown.items()))
            report_loops(daemon, tags)
            plant.end()
            daemon.stop()
        finally:
            plant.end()


def report_loops(daemon, tags):
    loops = {f"{source}-{tag}": daemon.ask({"request": "loop", "loop": f"{source}-{tag}"}) for source in SOURCES for tag in tags[source]}
    io = [loop["io"] for name, loop in loops.items() if name.startswith("modbus")]
    print("modbus   " + ", ".join(f"{key} {sum(one[key] for one in io)}" for key in ("transactions", "timeouts", "device_exceptions", "invalid_replies")))
    good = sum(loop["pv_quality"] == "good" for loop in loops.values())
    raised = [f"{name} {alarm}" for name, loop in loops.items() for alarm, state in loop["alarms"].items() if state["active"]]
    print(f"PV good: {good} of {len(loops)}; alarms: {', '.join(raised) or 'none'}")


def late_cycles(options, watched, plc_port):
    daemon, tags = daemon_with(options, watched, options.beside, plc_port)
    with daemon:
        plant = Plant(daemon, tags)
        try:
            if watched:
                plant.start()
            time.sleep(options.warm_up)
            before = daemon.status()["daemon"]
            time.sleep(options.seconds)
            after = daemon.status()["daemon"]
            plant.end()
            daemon.stop()
            return after["overruns"] - before["overruns"], after["ticks"] - before["ticks"], after["wake_up_us"]
        finally:
            plant.end()


def compare(options, plc_port):
    late = {0: [], options.loops: []}
    for pair in range(options.pairs):
        for watched in (0, options.loops) if pair % 2 == 0 else (options.loops, 0):
            overruns, ticks, wake = late_cycles(options, watched, plc_port)
            late[watched].append(overruns)
            print(f"pair {pair + 1}, {options.beside} controlled, {watched:4} watched: {overruns} late of {ticks} ticks; wake-up "
                  f"median {wake['p50']:.0f} us, p99.9 {wake['p99_9']:.0f} us", flush=True)
    for watched, counts in late.items():
        print(f"median of late cycles, {watched} watched: {statistics.median(counts):g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--loops", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--warm-up", type=float, default=20.0)
    parser.add_argument("--without", nargs="*", default=[], choices=SOURCES)
    parser.add_argument("--recording", action="store_true", help="record every sample as well")
    parser.add_argument("--beside", type=int, default=0, help="loops that are controlled here")
    parser.add_argument("--pairs", type=int, default=3)
    options = parser.parse_args()
    plc, port = start_plc()
    try:
        if options.beside:
            compare(options, port)
        else:
            measure(options, port)
    finally:
        plc.kill()
    return 0


if __name__ == "__main__":
    sys.exit(main())
