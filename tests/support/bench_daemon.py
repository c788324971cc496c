# SPDX-License-Identifier: Apache-2.0
"""A loopwardend of one's own for measurements: its configuration, its status, its end."""
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BIN = os.environ.get("LOOPWARDEN_BIN_DIR", os.path.join(ROOT, "build/release/bin"))
PROGRAM = os.path.join(BIN, "loopwardend")

LOOP = """loop: {tag}
sample_time: {period}
process_variable: {{unit: L/min, range: [0, 10]}}
controller:
  action: reverse
  kp: 0.35
  ki: 0.04
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10]}}
start: {{mode: automatic, set_point: {set_point}}}
safe_actions: {{stop: 0, bad_pv: hold, output_lost: hold, late_cycle_periods: 1000, enable_open: 0, recovery: previous_mode}}
recording: {{enabled: {recording}}}
io: {{backend: simulated, model: {root}/examples/models/plant1.yaml}}
{more}"""


given_ports = set()


def free_port(chance=random):
    """One that was free a moment ago, below those that the kernel gives to whoever connects meanwhile; never the same twice."""
    while True:
        port = chance.randrange(15000, 32000)
        if port in given_ports:
            continue
        with socket.socket() as tried:
            try:
                tried.bind(("127.0.0.1", port))
                given_ports.add(port)
                return port
            except OSError:
                continue


def cpu_s(pid):
    """Processor time of a process."""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def status_kib(pid, name):
    """VmRSS, VmHWM and the like of a process; 0 if it has ended."""
    with open(f"/proc/{pid}/status") as file:
        for line in file:
            if line.startswith(name + ":"):
                return int(line.split()[1])
    return 0


def ask(control_socket, request):
    with socket.socket(socket.AF_UNIX) as peer:
        peer.settimeout(60)
        peer.connect(str(control_socket))
        peer.sendall(json.dumps(request).encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            some = peer.recv(1 << 20)
            if not some:
                raise OSError("the control socket closed")
            answer += some
    return json.loads(answer)


class Daemon:
    """Runs in a separate folder; use with `with`."""

    def __init__(self, program, daemon_yaml, loops, recording=False):
        self.program = program
        self.folder = tempfile.mkdtemp(prefix="loopwarden-bench-")
        os.makedirs(os.path.join(self.folder, "config/loops.d"))
        with open(os.path.join(self.folder, "config/loopwardend.yaml"), "w") as file:
            file.write(f"runtime_directory: {self.folder}\nstate_directory: {self.folder}\n")
            file.write(daemon_yaml)
        for number, (period, more) in enumerate(loops):
            tag = f"FIC-{101 + number}"
            text = LOOP.format(tag=tag, period=period, more=more, root=ROOT,
                               set_point=3 + number % 5, recording="true" if recording else "false")
            with open(os.path.join(self.folder, f"config/loops.d/{number:04}.yaml"), "w") as file:
                file.write(text)
        self.process = None

    def __enter__(self):
        log = open(os.path.join(self.folder, "log"), "w")
        self.process = subprocess.Popen([self.program, "--config", self.folder + "/config"],
                                        stderr=log, stdout=log)
        for _ in range(600):
            try:
                self.status()
                return self
            except OSError:
                if self.process.poll() is not None:
                    break
                time.sleep(0.1)
        raise SystemExit("loopwardend does not start:\n" + self.log())

    def __exit__(self, *_):
        if self.process and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def log(self):
        with open(os.path.join(self.folder, "log")) as file:
            return file.read()

    def ask(self, request):
        return ask(self.folder + "/control.sock", request)

    def status(self):
        return self.ask({"request": "status"})

    def stop(self):
        """Ends it as a service manager does; returns the exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=60)

    def threads(self):
        """CPU time in s by thread name."""
        ticks = os.sysconf("SC_CLK_TCK")
        times = {}
        for task in os.listdir(f"/proc/{self.process.pid}/task"):
            with open(f"/proc/{self.process.pid}/task/{task}/stat") as file:
                head, _, tail = file.read().rpartition(")")
            fields = tail.split()
            name = head.partition("(")[2]
            times[name] = times.get(name, 0.0) + (int(fields[11]) + int(fields[12])) / ticks
        return times

    def memory_mb(self):
        return status_kib(self.process.pid, "VmRSS") / 1024
