#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Footprint of the daemon and of each service: memory, processor, threads, files, time until READY, writes to the disk.

Runs the real programs on simulated loops, in real time. Mosquitto and Node-RED (empty flow) run on the same machine at
the same time, if they are installed. The fleet host runs if PostgreSQL and python3-psycopg2 are installed. As root, the state directory of each daemon is a separate ext4 file system on a
loop device, and the kernel counts the sectors that are written to it: records, journal, evidence and metadata.

Sizes are LOOPSxPERIOD, for example 12x1 for 12 loops at 1 s. Services run beside the first size.

Example: lab/bench/footprint.py --size 12x1 100x1 --seconds 300
"""
import argparse
import glob
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tests/support"), str(HERE / "fleet_kit")]
import bench_daemon  # noqa: E402
try:
    import plant  # noqa: E402
except ImportError:
    plant = None

ROW_BYTES = 88
DAY_S = 86400
SECTOR = 512
DISK_BYTES = 2 << 30
# ext4 stores changed metadata within 5 s; the kernel writes changed pages within 30 s.
SETTLE_S = 35


class Disk:
    """An ext4 file system of its own, if this user may mount one."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="loopwarden-footprint-")
        self.counter = None
        if os.geteuid() != 0:
            return
        image = self.folder + ".img"
        with open(image, "wb") as file:
            file.truncate(DISK_BYTES)
        made = subprocess.run(["mkfs.ext4", "-q", "-b", "4096", image], check=False)
        if made.returncode == 0 and subprocess.run(["mount", "-o", "loop", image, self.folder], check=False).returncode == 0:
            device = os.stat(self.folder).st_dev
            self.counter = f"/sys/dev/block/{os.major(device)}:{os.minor(device)}/stat"
        os.unlink(image)

    def written(self):
        if self.counter is None:
            return None
        with open(self.counter, encoding="ascii") as file:
            return int(file.read().split()[6]) * SECTOR

    def remove(self):
        if self.counter is not None:
            subprocess.run(["umount", "--lazy", self.folder], check=False)
        shutil.rmtree(self.folder, ignore_errors=True)


class Ready:
    """The socket of a service manager. Waits until a program reports READY."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="loopwarden-ready-")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.folder + "/notify")
        self.socket.settimeout(60)
        self.began = time.monotonic()

    def environment(self):
        return dict(os.environ, NOTIFY_SOCKET=self.folder + "/notify")

    def wait(self):
        try:
            while b"READY=1" not in self.socket.recv(4096):
                pass
            return time.monotonic() - self.began
        finally:
            self.socket.close()
            shutil.rmtree(self.folder)


class Program:
    def __init__(self, name, command, reports_ready=True):
        self.name = name
        ready = Ready() if reports_ready else None
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                        env=ready.environment() if ready else None)
        try:
            self.start_s = ready.wait() if ready else None
        except TimeoutError as error:
            self.end()
            raise SystemExit(f"{name} does not start: {' '.join(command)}") from error
        self.cpu_s = 0.0
        self.at_s = 0.0

    def begin(self):
        self.cpu_s, self.at_s = bench_daemon.cpu_s(self.process.pid), time.monotonic()

    def line(self, written=""):
        pid = self.process.pid
        cpu = 100 * (bench_daemon.cpu_s(pid) - self.cpu_s) / (time.monotonic() - self.at_s)
        with open(f"/proc/{pid}/smaps_rollup", encoding="ascii") as file:
            pss = next(int(line.split()[1]) for line in file if line.startswith("Pss:"))
        start = "" if self.start_s is None else f"{self.start_s:.2f}"
        return (f"| {self.name} | {bench_daemon.status_kib(pid, 'VmRSS') / 1024:.1f} | {pss / 1024:.1f} | {cpu:.2f} | "
                f"{len(os.listdir(f'/proc/{pid}/task'))} | {len(os.listdir(f'/proc/{pid}/fd'))} | {start} | {written} |")

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Daemon:
    def __init__(self, count, period, more):
        self.count, self.period = count, period
        self.disk = Disk()
        self.bench = bench_daemon.Daemon(bench_daemon.PROGRAM, "", [(period, "")] * count, recording=True)
        self.folder = self.bench.folder
        # A simulated loop needs a model with its own period.
        model = self.folder + "/config/plant.yaml"
        with open(bench_daemon.ROOT + "/examples/models/plant1.yaml", encoding="ascii") as file:
            text = re.sub(r"(?m)^sample_time:.*", f"sample_time: {period:g}", file.read())
        with open(model, "w", encoding="ascii") as file:
            file.write(text)
        for loop in pathlib.Path(self.folder, "config/loops.d").iterdir():
            loop.write_text(loop.read_text().replace(bench_daemon.ROOT + "/examples/models/plant1.yaml", model))
        with open(self.folder + "/config/loopwardend.yaml", "w", encoding="ascii") as file:
            file.write(f"runtime_directory: {self.folder}\nstate_directory: {self.disk.folder}\n{more}")
        self.written = None
        try:
            self.program = Program(f"loopwardend, {count} loops at {period:g} s",
                                   [bench_daemon.PROGRAM, "--config", self.folder + "/config"])
        except SystemExit:
            self.remove()
            raise

    def begin(self):
        self.program.begin()
        self.written, self.rows_from = self.disk.written(), time.monotonic()

    def line(self):
        elapsed = time.monotonic() - self.rows_from
        rows = self.count * ROW_BYTES / self.period * DAY_S
        if self.written is None:
            return self.program.line("not measured: needs root")
        day = (self.disk.written() - self.written) * DAY_S / elapsed
        return self.program.line(f"{day / 1e6:.0f} MB = {day / rows:.1f} x rows")

    def end(self):
        self.program.end()
        self.remove()

    def remove(self):
        self.disk.remove()
        shutil.rmtree(self.folder, ignore_errors=True)


def services(runtime, folder):
    """Starts each service with a short configuration, and the programs to compare them with."""
    def file(name, text):
        with open(os.path.join(folder, name), "w", encoding="ascii") as out:
            out.write(text)
        return os.path.join(folder, name)

    broker = bench_daemon.free_port()
    running = []
    mosquitto = shutil.which("mosquitto", path="/usr/sbin:/usr/bin")
    if mosquitto:
        file("mosquitto.conf", f"listener {broker} 127.0.0.1\nallow_anonymous true\nuser root\nlog_type none\n")
        running.append(Program("mosquitto", [mosquitto, "-c", folder + "/mosquitto.conf"], reports_ready=False))
    node_red = shutil.which("node-red")
    if node_red:
        running.append(Program("Node-RED, empty flow",
                               [node_red, "--port", str(bench_daemon.free_port()), "--userDir", folder + "/red"],
                               reports_ready=False))
    of = {"page": f"listen: [{{address: 127.0.0.1, port: {bench_daemon.free_port()}}}]\nsockets: {{status: {runtime}/status.sock}}\n",
          "notify": f"socket: {runtime}/status.sock\nstate_directory: {folder}\nchannels: {{log: {{kind: journal}}}}\n"
                    "routes: [{channels: [log]}]\n",
          "edge": f"broker: {{url: 'mqtt://127.0.0.1:{broker}'}}\nsparkplug: {{group: plant, edge: box}}\n"
                  f"runtime_directory: {runtime}\nstore: {{directory: {folder}}}\n",
          "feed": f"broker: {{url: 'mqtt://127.0.0.1:{broker}'}}\nruntime_directory: {runtime}\n"
                  "topics: [{name: FIC205.PV, topic: plant/fic205, value: /pv}]\n"}
    if plant is not None and shutil.which("initdb", path=":".join(glob.glob("/usr/lib/postgresql/*/bin"))):
        fleet = plant.Plant()
        fleet.start_database()
        of["fleet"] = (f"broker: mqtt://127.0.0.1:{broker}\ndatabase: {fleet.database}\ngroups: [plant]\n"
                       f"state_directory: {folder}/fleet\nmetrics: {{port: 0}}\n")
    for name, text in of.items():
        running.append(Program(name, [os.path.join(bench_daemon.BIN, f"loopwarden-{name}"), "--config", file(name + ".yaml", text)]))
    return running


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", nargs="+", default=["12x1", "100x1"], metavar="LOOPSxPERIOD")
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--sync", type=float, default=60.0, help="recording.sync, s")
    parser.add_argument("--no-services", action="store_true")
    options = parser.parse_args()
    more = f"real_time: {{priority: 0, lock_memory: false}}\nrecording: {{sync: {options.sync:g}}}\n"
    folder = tempfile.mkdtemp(prefix="loopwarden-footprint-services-")
    daemons, programs = [], []
    try:
        for size in options.size:
            count, _, period = size.partition("x")
            daemons.append(Daemon(int(count), float(period), more))
        if not options.no_services:
            programs = services(daemons[0].folder, folder)
        # The first sync makes the folders and files.
        time.sleep(options.sync + SETTLE_S)
        for one in daemons + programs:
            one.begin()
        time.sleep(options.seconds)
        print(f"load of the machine {os.getloadavg()[0]:.1f}, {options.seconds:g} s, rows every {options.sync:g} s")
        print("| program | RSS, MiB | PSS, MiB | CPU, % of a core | threads | files | READY after, s | written a day |")
        print("|---|---|---|---|---|---|---|---|")
        for one in daemons + programs:
            print(one.line(), flush=True)
    finally:
        for one in programs + daemons:
            one.end()
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
