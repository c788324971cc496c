# SPDX-License-Identifier: Apache-2.0
"""A separate box for tests: loopwardend on simulated plants, loopwarden-page, segments of other
days and a browser."""
import json
import math
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "tests/support"))
from bench_daemon import ask, free_port  # noqa: E402
from chromium import Chromium, WebDriverException  # noqa: E402,F401

BIN = pathlib.Path(os.environ.get("LOOPWARDEN_BIN_DIR", ROOT / "build/release/bin"))
PASSWORD = "correct horse battery"
USERS = {"vera": "viewer", "otto": "operator", "ella": "engineer"}

LOOP = """loop: {tag}
description: {description}
sample_time: 0.1
process_variable: {{unit: L/min, range: [0, 10]}}
controller:
  action: reverse
  kp: 0.3494
  ki: 0.040007
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10]}}
start: {{mode: automatic, set_point: {set_point}}}
safe_actions: {{stop: 0, bad_pv: hold, output_lost: hold, late_cycle_periods: 100, enable_open: 0, recovery: previous_mode}}
recording: {{enabled: {recording}}}
monitor: {{specialists: {root}/examples/specialists/plant1{twin}}}
io: {{backend: simulated, model: {model}}}
"""


class Box:
    """Daemon and page in a separate folder; use with `with`. healthy: number of loops in
    addition to FIC-101, which sticks."""

    def __init__(self, healthy=3, accelerate=5, users=True, control=True, recording=True, twin=None, port=0, sticking=True,
                 time_zone="Africa/Johannesburg"):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="loopwarden-page-"))
        self.port = port or free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.daemon = self.page = None
        # For work on the site: serves its folder, without building the program.
        self.site = []
        if "LOOPWARDEN_PAGE_SITE" in os.environ:
            shutil.copytree(os.environ["LOOPWARDEN_PAGE_SITE"], self.folder / "site")
            shutil.copytree(ROOT / "services/page/third_party/uplot", self.folder / "site/uplot")
            self.site = ["--site", str(self.folder / "site")]
        (self.folder / "config/loops.d").mkdir(parents=True)
        self.state = self.folder / "state"
        self.state.mkdir()
        (self.folder / "config/loopwardend.yaml").write_text(
            f"accelerate: {accelerate}\nreal_time: {{lock_memory: false}}\nruntime_directory: {self.folder}\nstate_directory: {self.state}\n"
            f"page: {{alarms: true, control: {str(control).lower()}, tuning: {str(control).lower()}, reports: true, tests: {str(control).lower()}}}\n", encoding="utf-8")
        self._write_loops(healthy, recording, twin, sticking)
        self.config = self.folder / "page.yaml"
        more = f"users: {self.folder}/users\n" if users else ""
        self.config.write_text(
            f"listen: [{{address: 127.0.0.1, port: {self.port}}}]\nsockets: {{status: {self.folder}/status.sock, page: {self.folder}/page.sock}}\n"
            f"state_directory: {self.state}\ncontrol: {str(control).lower()}\nrate: 1000\ntime_zone: {time_zone}\n{more}", encoding="utf-8")
        for name, role in USERS.items() if users else ():
            subprocess.run([BIN / "loopwarden-page", "user", "add", name, "--role", role, "--users", self.folder / "users", "--stdin"],
                           input=PASSWORD + "\n", text=True, check=True, stdout=subprocess.DEVNULL)

    def _write_loops(self, healthy, recording, twin, sticking):
        models = ROOT / "examples/models"
        text = (models / "plant1.yaml").read_text(encoding="utf-8")
        calm = self.folder / "calm.yaml"
        calm.write_text(text[:text.index("  faults:")], encoding="utf-8")
        sick = self.folder / "sick.yaml"
        sick.write_text(text.replace("from: 120, ramp: 180", "from: 0, ramp: 1").replace("j: 0.4", "j: 0.9"), encoding="utf-8")
        names = ["Feed to reactor R-1", "Cooling water E-204", "Reflux T-301", "Caustic dosing", "Condensate return", "Quench Q-7"]
        for n in range(healthy + 1):
            first = n == 0 and sticking
            (self.folder / f"config/loops.d/{n:04}.yaml").write_text(LOOP.format(
                tag=f"FIC-{101 + n}", description=names[n % len(names)], set_point=5 if first else 3 + n % 5, root=ROOT,
                recording=str(recording).lower(), twin=f", twin: {twin}" if first and twin else "", model=sick if first else calm), encoding="utf-8")

    def __enter__(self):
        try:
            self.start_daemon()
            self.start_page()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for process in (self.page, self.daemon):
            if process and process.poll() is None:
                process.kill()
                process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start_daemon(self):
        with open(self.folder / "daemon.log", "a", encoding="utf-8") as log:
            self.daemon = subprocess.Popen([BIN / "loopwardend", "--config", self.folder / "config"], stdout=log, stderr=log)
        self._until(lambda: self.ask({"request": "status"}), self.daemon, "daemon.log")

    def start_page(self):
        with open(self.folder / "page.log", "a", encoding="utf-8") as log:
            self.page = subprocess.Popen([BIN / "loopwarden-page", "--config", self.config, *self.site], stdout=log, stderr=log)
        self._until(lambda: urllib.request.urlopen(self.url + "/api/session", timeout=5).read(), self.page, "page.log")

    def _until(self, attempt, process, log):
        for _ in range(600):
            try:
                return attempt()
            except OSError:
                if process.poll() is not None:
                    break
                time.sleep(0.05)
        raise SystemExit(f"{process.args[0]} does not start:\n" + (self.folder / log).read_text(encoding="utf-8"))

    def kill_daemon(self):
        self.daemon.send_signal(signal.SIGKILL)
        self.daemon.wait()

    def ask(self, request):
        return ask(self.folder / "control.sock", request)

    def write_old_segment(self, tag="FIC-101", ago_s=86400, seconds=3600, period_s=0.1, sequence=1):
        """Writes the recorder's file of another day: a sine with one spike to 8.5, in the format of
        record/segment_format.hpp. Returns the time of the spike, UTC ms. Call it before the daemon
        starts."""
        folder = self.state / "segments" / tag
        folder.mkdir(parents=True, exist_ok=True)
        start_ns = int((time.time() - ago_s) * 1e9)
        columns = ("time_ns:i64 period_index:u64 sp:f64 pv:f64 co:f64 stem:f64 calculated:f32 jacket_rate:f32 jacket_rate_shadow:f32 "
                   "compensator:f32 compensator_shadow:f32 mode:u8 fault:u8 pv_quality:u8 pv_reason:u8 flags:u8 jacket_form:u8 "
                   "requested_mode:u8 pv_limit:u8 age_ms:f32 row:u32 crc32:u32").encode()
        head = struct.pack("<8sIIQQdqq64s384sI", b"LWSEGMNT", 2, 88, sequence, sequence, period_s, start_ns, 0, tag.encode(), columns, 0)
        crc = zlib.crc32(head)
        rows = [head + struct.pack("<I", crc)]
        count = int(seconds / period_s)
        for k in range(count):
            pv = 8.5 if k == count // 2 else 4 + math.sin(k * period_s / 20)
            row = struct.pack("<qQddddfffff8BfI", int(k * period_s * 1e9), k, 4.0, pv, 5.0, 5.0, 5.0, 0, 0, 0, 0, 1, 0, 192, 0, 0, 0, 1, 0, 1.0, k)
            rows.append(row + struct.pack("<I", zlib.crc32(row, crc)))
        (folder / f"{sequence:010}.lwseg").write_bytes(b"".join(rows))
        return start_ns // 1_000_000 + int(1000 * period_s * (count // 2))


class Browser(Chromium):
    """On the page of a box."""

    def go(self, box, route=""):
        if not self.driver.current_url.startswith(box.url):
            self.driver.get(f"{box.url}/#/{route}")
        else:
            self.run(f"(() => {{ location.hash = {json.dumps('#/' + route)}; }})()")
        name = re.split("[/?]", route)[0] or "overview"
        self.until(lambda: self.run("document.querySelector('main')?.dataset.view") in (name, "login") and self.all("main h1"), f"the view {name} does not come")

    def log_in(self, box, user):
        self.go(box, "login")
        self.until(lambda: self.all("form.panel input[name=user]"), "there is no form to log in")
        self.find("form.panel input[name=user]").send_keys(user)
        self.find("form.panel input[name=password]").send_keys(PASSWORD)
        self.find("form.panel button[type=submit]").click()
        self.until(lambda: user in self.run("document.querySelector('.user')?.textContent ?? ''"), f"{user} can't log in")

    def log_out(self):
        self.press(".user button")
        self.until(lambda: self.all("form.panel input[name=user]"), "after the log-out no log-in is asked for")
