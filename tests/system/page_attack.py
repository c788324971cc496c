#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Attacks the page of a separate daemon and reports whether it had an effect.

Two phases of the same length, without and with hostile clients. These use silent connections, half a head, one byte a second,
invalid heads and bodies of a gigabyte. Others are listeners that do not read, and fast requests for a whole history.
Meanwhile one client requests the session and the alarms ten times a second, and another listens to the stream of events.
Printed: the daemon's late cycles, the clients' answers, the page's handling of the others. Exit code 1: a crash of daemon or
page, an unanswered client, a pause of the stream longer than --silence, or more overruns than --allow
beyond the phase without.

Example: tests/system/page_attack.py --minutes 10
         tests/system/page_attack.py --seconds 60 --page build/asan/bin/loopwarden-page
"""
import functools
import http.client
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import bench_attack  # noqa: E402
import bench_daemon  # noqa: E402

PAGE = os.path.join(bench_daemon.BIN, "loopwarden-page")
HOST = b"Host: 127.0.0.1\r\n"
SEEDS = [b"GET / HTTP/1.1\r\n" + HOST + b"\r\n",
         b"GET /api/session HTTP/1.1\r\n" + HOST + b"\r\n",
         b"GET /api/loops/FIC-101/history?from_ms=1&points=4000 HTTP/1.1\r\n" + HOST + b"\r\n",
         b"GET /api/loops/FIC-101/history.csv?from_ms=1 HTTP/1.1\r\n" + HOST + b"\r\n",
         b"GET /api/system HTTP/1.1\r\n" + HOST + b"\r\n",
         b"GET /api/journal?most=1000 HTTP/1.1\r\n" + HOST + b"\r\n",
         b"POST /api/login HTTP/1.1\r\n" + HOST + b"Content-Type: application/json\r\nContent-Length: 30\r\n\r\n"
         b'{"user":"a","password":"bcdef"}']
HUGE = b"POST /api/login HTTP/1.1\r\n" + HOST + b"Content-Length: 1073741824\r\n\r\n"
EVENTS = b"GET /api/events HTTP/1.1\r\n" + HOST + b"\r\n"


def act(chance, number, peer, fresh, second):
    """By turns: floods, the same without reading, silence, half a head, a byte a second, a gigabyte, deaf listeners."""
    role = number % 8
    if role < 2:
        peer.send(bench_attack.hostile_bytes(chance, SEEDS, 3000))
        peer.recv(65536)
    elif role == 2:
        peer.send(bench_attack.hostile_bytes(chance, SEEDS, 3000))
    elif role == 3 and second is not None:
        if not peer.recv(1):
            raise ConnectionError
    elif role == 4 and fresh:
        peer.send(SEEDS[0][:30])
    elif role == 5 and second is not None:
        peer.send(SEEDS[1][second % 40:][:1])
    elif role == 6:
        peer.send(HUGE if fresh else b"x" * 65536)
    elif role == 7 and fresh:
        peer.send(EVENTS)


def json_from(path, peer):
    peer.request("GET", path)
    return json.loads(peer.getresponse().read()) is not None


def good_client(port, until):
    """Asks ten times a second for the session and the alarms."""
    questions = bench_attack.Questions()
    while time.monotonic() < until:
        for path in ("/api/session", "/api/alarms"):
            questions.ask(lambda: http.client.HTTPConnection("127.0.0.1", port, timeout=5), functools.partial(json_from, path),
                          broken=(OSError, http.client.HTTPException, ValueError))
        time.sleep(0.1)
    return questions.figures()


def listener(port, until):
    """Counts what the stream brings, and the longest silence."""
    heard = 0
    longest = 0.0
    peer = None
    last = time.monotonic()
    while time.monotonic() < until:
        try:
            if peer is None:
                peer = socket.create_connection(("127.0.0.1", port), timeout=1)
                peer.sendall(EVENTS)
            some = peer.recv(1 << 20)
            if not some:
                raise ConnectionError
        except TimeoutError:
            some = b""
        except OSError:
            if peer:
                peer.close()
            peer = None
            time.sleep(0.1)
            continue
        overviews = some.count(b"event: overview")
        if overviews:
            longest = max(longest, time.monotonic() - last)
            last = time.monotonic()
            heard += overviews
    return {"overviews": heard, "silence ms": 1000 * max(longest, time.monotonic() - last)}


def page_counters(port):
    peer = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    peer.request("GET", "/api/system")
    return json.loads(peer.getresponse().read())["page"]


def wait_for(port, page, limit_s=60):
    """Until the page listens."""
    until = time.monotonic() + limit_s
    while time.monotonic() < until and page.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=5).close()
            return
        except OSError:
            time.sleep(0.05)
    sys.exit(f"the page does not listen at port {port}")


def phase(daemon, page, port, seconds, attackers, clients):
    seen, cpu = page_counters(port), bench_daemon.cpu_s(page.pid)
    crowds = [(act, functools.partial(bench_attack.connect, port, 4096), clients // attackers, seed) for seed in range(attackers)]
    figures = bench_attack.phase(daemon, port, seconds, [good_client, listener], crowds)
    now = page_counters(port)
    return figures | bench_attack.risen(seen, now, ("accepted", "displaced", "turned_away", "timed_out", "refused", "requests")) | {
        "page cpu %": 100 * (bench_daemon.cpu_s(page.pid) - cpu) / seconds, "page MB": bench_daemon.status_kib(page.pid, "VmHWM") / 1024}


def main():
    parser = bench_attack.parser(__doc__)
    parser.add_argument("--page", default=PAGE)
    parser.add_argument("--silence", type=float, default=10.0, help="of the stream, s")
    parser.add_argument("--port", type=int, default=0, help="of the page; any")
    options = parser.parse_args()
    seconds = options.seconds or 60 * options.minutes
    port = options.port or bench_daemon.free_port()
    with bench_daemon.Daemon(options.daemon, "", [(0.1, "")] * options.loops, recording=True) as daemon:
        with open(daemon.folder + "/page.yaml", "w") as file:
            file.write("rate: 10000\n")
        log_name = daemon.folder + "/page.log"
        with open(log_name, "w") as log:
            page = subprocess.Popen([options.page, "--config", daemon.folder + "/page.yaml", "--runtime", daemon.folder,
                                     "--state", daemon.folder, "--port", str(port)], stdout=log, stderr=log)
        wait_for(port, page)
        bench_attack.print_head(options, seconds, daemon)
        quiet = phase(daemon, page, port, seconds, 0, 0)
        loud = phase(daemon, page, port, seconds, options.processes, options.clients)
        bench_attack.print_phases(quiet, loud)
        page.send_signal(signal.SIGTERM)
        page_code = page.wait(timeout=60)
        with open(log_name) as file:
            wrong = bench_attack.crashed("the page", page_code, file.read())
        wrong += bench_attack.end(daemon) + bench_attack.noticed(options, quiet, loud)
    if loud["silence ms"] > 1000 * options.silence:
        wrong.append(f"the stream paused for {loud['silence ms']:.0f} ms")
    print("\n".join(wrong) or "no effect: no additional overrun, the clients were served, no crash")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
