# SPDX-License-Identifier: Apache-2.0
"""The real loopwardend as a child, with the campaign in the place of systemd and of the operator."""

import asyncio
import ctypes
import json
import mmap
import os
import resource
import signal
import socket
import struct
import subprocess
import time

import bench_daemon

WATCHDOG_S = 2.0
PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH = 0x4206, 0x4207, 17
WALL = 0x40000000
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]


# The same layout as in shim.c: three switches; count of deeds; levels and refusals of the lines; the deeds;
# files that hang and the number of hanging calls; slow files, their delay, and the number of calls.
LINES, DEEDS, DEED = 16, 1024, struct.Struct("4q")
COUNT_AT, LEVELS_AT = 24, 32
REFUSALS_AT = LEVELS_AT + 8 * LINES
DEEDS_AT = REFUSALS_AT + 8 * LINES
HANGS_AT = DEEDS_AT + DEED.size * DEEDS
SLOW_AT = HANGS_AT + 16
SWITCHES_BYTES = SLOW_AT + 24
# Files whose disk can hang, by the bit of the switch.
HANGING = {"recorder": 1, "CSV record": 2, "journal": 4, "evidence": 8, "metrics": 16, "log": 32}


class Board:
    """The digital lines of the machine, and what the daemon did to its hardware."""

    def __init__(self, switches):
        self.switches = switches
        self.seen = 0

    def level(self, line):
        return struct.unpack_from("q", self.switches, LEVELS_AT + 8 * line)[0]

    def set_level(self, line, level):
        struct.pack_into("q", self.switches, LEVELS_AT + 8 * line, level)

    def refuse(self, line, on):
        struct.pack_into("q", self.switches, REFUSALS_AT + 8 * line, on)

    def deeds(self):
        """(time, source, value) of each since the last call."""
        begun = struct.unpack_from("q", self.switches, COUNT_AT)[0]
        self.seen = max(self.seen, begun - DEEDS)
        while self.seen < begun:
            at, source, value, number = DEED.unpack_from(
                self.switches, DEEDS_AT + DEED.size * ((self.seen + 1) % DEEDS))
            if number < self.seen + 1 and self.seen + 1 > begun - 16:
                return  # being written, or its writer was killed over it: then more follow
            self.seen += 1
            if number == self.seen:
                yield at / 1e9, source, value


class Daemon:
    def __init__(self, program, folder, shim):
        self.program, self.folder = program, folder
        self.process = None
        self.log_path = folder / "log"
        self.switches_file = folder / "switches"
        self.switches_file.write_bytes(bytes(SWITCHES_BYTES))
        with open(self.switches_file, "r+b") as file:
            self.switches = mmap.mmap(file.fileno(), SWITCHES_BYTES)
        self.board = Board(self.switches)
        self.notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self.notify.bind(str(folder / "notify"))
        self.notify.setblocking(False)
        self.environment = dict(
            os.environ, LD_PRELOAD=str(shim), LOOPWARDEN_FAULTS=str(self.switches_file),
            NOTIFY_SOCKET=str(folder / "notify"), WATCHDOG_USEC=str(int(WATCHDOG_S * 1e6)))
        self.environment.pop("WATCHDOG_PID", None)
        self.environment_of_safe = {key: value for key, value in self.environment.items()
                                    if key not in ("NOTIFY_SOCKET", "WATCHDOG_USEC")}
        self.fed = 0.0  # last WATCHDOG=1
        self.messages = []
        self.connection = None
        self.asking = asyncio.Lock()  # faults of several loops at a time share the connection

    # --- life ------------------------------------------------------------------------------------

    def start(self):
        self.messages.clear()
        with open(self.log_path, "ab") as log:
            self.process = subprocess.Popen(
                [self.program, "--config", str(self.folder / "config")], env=self.environment,
                stdout=log, stderr=log, close_fds=True, umask=0o027)
        self.fed = time.monotonic()

    @property
    def pid(self):
        return self.process.pid

    def alive(self):
        return self.process is not None and self.process.poll() is None

    def signal(self, number):
        self.process.send_signal(number)

    async def ended(self, patience_s=30.0):
        """The exit code; None, and a kill, if it does not end."""
        end = time.monotonic() + patience_s
        while self.process.poll() is None and time.monotonic() < end:
            await asyncio.sleep(0.02)
        code = self.process.poll()
        if code is None:
            self.process.kill()
            self.process.wait()
        await self.hang_up()
        return code

    async def safe(self):
        """Runs the command of ExecStopPost; returns exit code and text."""
        child = await asyncio.create_subprocess_exec(
            self.program, "--config", str(self.folder / "config"), "--safe",
            env=self.environment_of_safe, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        text, _ = await child.communicate()
        return child.returncode, text.decode(errors="replace")

    def hear(self):
        """Receives the daemon's messages to the service manager."""
        while True:
            try:
                message = self.notify.recv(4096).decode()
            except BlockingIOError:
                return
            for line in message.splitlines():
                if line == "WATCHDOG=1":
                    self.fed = time.monotonic()
                elif not line.startswith("STATUS="):
                    self.messages.append(line)

    def log(self, since=0):
        with open(self.log_path, "rb") as file:
            file.seek(since)
            return file.read().decode(errors="replace")

    def log_size(self):
        return self.log_path.stat().st_size

    # --- operator --------------------------------------------------------------------------------

    async def hang_up(self):
        if self.connection:
            self.connection[1].close()
            self.connection = None

    async def ask(self, request, patience_s=5.0):
        """An answer of the control socket, or None."""
        async with self.asking:
            try:
                if not self.connection:
                    self.connection = await asyncio.wait_for(
                        asyncio.open_unix_connection(str(self.folder / "control.sock"), limit=1 << 22),
                        patience_s)
                reader, writer = self.connection
                writer.write(json.dumps(request).encode() + b"\n")
                line = await asyncio.wait_for(reader.readline(), patience_s)
                if not line:
                    raise ConnectionError
                return json.loads(line)
            except (OSError, asyncio.TimeoutError, ConnectionError):
                await self.hang_up()
                return None

    # --- what the kernel knows -------------------------------------------------------------------

    def files(self):
        """Open descriptors, and of them those of segments: one for each loop, open from its first flush on."""
        opened = []
        for name in os.listdir(f"/proc/{self.pid}/fd"):
            try:
                opened.append(os.readlink(f"/proc/{self.pid}/fd/{name}"))
            except FileNotFoundError:  # closed meanwhile
                pass
        return len(opened), sum("/segments/" in path for path in opened)

    def threads(self):
        names = {}
        for tid in os.listdir(f"/proc/{self.pid}/task"):
            with open(f"/proc/{self.pid}/task/{tid}/comm", encoding="utf-8") as file:
                names.setdefault(file.read().strip(), int(tid))
        return names

    def field_kib(self, name):
        return bench_daemon.status_kib(self.pid, name)

    def cpu_s(self):
        return bench_daemon.cpu_s(self.pid)

    # --- switches --------------------------------------------------------------------------------

    def clock_offset(self, seconds):
        self.switches[0:8] = struct.pack("q", seconds)

    def disk_full(self, on):
        self.switches[8:16] = struct.pack("q", on)

    def disk_slow(self, milliseconds):
        self.switches[16:24] = struct.pack("q", milliseconds)

    def disk_hangs(self, what):
        """Opening, writing and syncing of these files blocks; an empty list ends it."""
        struct.pack_into("q", self.switches, HANGS_AT, sum(HANGING[name] for name in what))

    def disk_takes(self, milliseconds, what):
        """Each opening, renaming and syncing of these files takes this long; an empty list ends it."""
        struct.pack_into("qq", self.switches, SLOW_AT, sum(HANGING[name] for name in what), milliseconds)

    def slow_calls(self):
        return struct.unpack_from("q", self.switches, SLOW_AT + 16)[0]

    def hung_calls(self):
        return struct.unpack_from("q", self.switches, HANGS_AT + 8)[0]

    def limit(self, what, soft):
        _, hard = resource.prlimit(self.pid, what)
        resource.prlimit(self.pid, what, (hard if soft is None else soft, hard))

    def hang_thread(self, tid):
        """Stops one thread of the daemon; the others continue. Returns False if that is not permitted."""
        if libc.ptrace(PTRACE_SEIZE, tid, None, None) != 0:
            return False
        libc.ptrace(PTRACE_INTERRUPT, tid, None, None)
        try:
            os.waitpid(tid, WALL)
        except ChildProcessError:
            return False
        return True

    def let_go(self, tid):
        libc.ptrace(PTRACE_DETACH, tid, None, None)

    def abort(self):
        """As the service manager ends a service whose watchdog is not fed."""
        self.signal(signal.SIGABRT)
