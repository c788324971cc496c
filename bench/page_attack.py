#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Attacks the page of a daemon of its own and tells whether anyone noticed.

Two phases of the same length, without and with hostile clients: silent connections, half a head, one byte a second, heads
that are none, bodies of a gigabyte, listeners that do not read, and requests for a whole history as fast as they go.
Meanwhile one client asks ten times a second for the session and the alarms, and another listens to the stream of events.
Printed: the daemon's late cycles, the clients' answers, what the page did with the others. Exit code 1 if daemon or page
crashed, the client was not answered, the stream stood still for longer than --silence, or there were more overruns than --allow
beyond the phase without.

Example: bench/page_attack.py --minutes 10
         bench/page_attack.py --seconds 60 --page build/asan/bin/loopwarden-page
"""
import argparse
import http.client
import json
import multiprocessing
import os
import random
import signal
import socket
import subprocess
import sys
import time

import bench_daemon

PAGE = os.path.join(bench_daemon.ROOT, "build/release/bin/loopwarden-page")
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


def free_port():
    with socket.socket() as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


def connect(port):
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    peer.setblocking(False)
    peer.connect_ex(("127.0.0.1", port))
    return peer


def hostile_bytes(chance):
    """Random bytes, a sound request, or one with some bytes changed, cut or doubled."""
    kind = chance.randrange(4)
    if kind == 0:
        return chance.randbytes(chance.randrange(1, 3000))
    text = bytearray(chance.choice(SEEDS))
    if kind == 1:
        return bytes(text)
    for _ in range(chance.randrange(1, 4)):
        text[chance.randrange(len(text))] = chance.randrange(256)
    return bytes(text[:chance.randrange(1, len(text) + 1)] if kind == 2 else text * 3)


def crowd(port, clients, seed, until):
    """By turns: floods, the same without reading, silence, half a head, a byte a second, a gigabyte, deaf listeners."""
    chance = random.Random(seed)
    peers = [connect(port) for _ in range(clients)]
    begun = [False] * clients
    next_turn = time.monotonic()
    while time.monotonic() < until:
        slow_turn = time.monotonic() >= next_turn
        if slow_turn:
            next_turn += 1.0
        for number, peer in enumerate(peers):
            role = number % 8
            try:
                if role < 2:
                    peer.send(hostile_bytes(chance))
                    peer.recv(65536)
                elif role == 2:
                    peer.send(hostile_bytes(chance))
                elif role == 3 and slow_turn:
                    if not peer.recv(1):
                        raise ConnectionError
                elif role == 4 and not begun[number]:
                    peer.send(SEEDS[0][:30])
                elif role == 5 and slow_turn:
                    peer.send(SEEDS[1][int(next_turn) % 40:][:1])
                elif role == 6:
                    peer.send(b"x" * 65536 if begun[number] else HUGE)
                elif role == 7 and not begun[number]:
                    peer.send(EVENTS)
                begun[number] = True
            except BlockingIOError:
                continue
            except OSError:
                peer.close()
                peers[number] = connect(port)
                begun[number] = False
    for peer in peers:
        peer.close()


def good_client(port, until, result):
    """Asks ten times a second; connects again when it is shut out, which counts."""
    asked = answered = shut_out = 0
    worst = 0.0
    peer = None
    while time.monotonic() < until:
        for path in ("/api/session", "/api/alarms"):
            asked += 1
            begin = time.monotonic()
            try:
                if peer is None:
                    peer = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
                peer.request("GET", path)
                answered += json.loads(peer.getresponse().read()) is not None
                worst = max(worst, time.monotonic() - begin)
            except (OSError, http.client.HTTPException, ValueError):
                shut_out += 1
                if peer:
                    peer.close()
                peer = None
        time.sleep(0.1)
    result.put((asked, answered, shut_out, worst))


def listener(port, until, result):
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
    result.put((heard, max(longest, time.monotonic() - last)))


def page_counters(port):
    peer = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    peer.request("GET", "/api/system")
    return json.loads(peer.getresponse().read())["page"]


def cpu_s(pid):
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid):
    with open(f"/proc/{pid}/status") as file:
        for line in file:
            if line.startswith("VmHWM"):
                return int(line.split()[1]) / 1024
    return 0.0


def phase(daemon, page, port, seconds, attackers, clients):
    before = daemon.status()["daemon"]
    seen = page_counters(port)
    cpu = cpu_s(page.pid)
    until = time.monotonic() + seconds
    asking, listening = multiprocessing.Queue(), multiprocessing.Queue()
    processes = [multiprocessing.Process(target=good_client, args=(port, until, asking)),
                 multiprocessing.Process(target=listener, args=(port, until, listening))]
    for seed in range(attackers):
        processes.append(multiprocessing.Process(
            target=crowd, args=(port, clients // attackers, seed, until)))
    for process in processes:
        process.start()
    asked, answered, shut_out, worst = asking.get(timeout=seconds + 60)
    heard, silence = listening.get(timeout=60)
    for process in processes:
        process.join(timeout=30)
    after = daemon.status()["daemon"]
    now = page_counters(port)
    page_did = {key: now[key] - seen[key]
                for key in ("accepted", "displaced", "turned_away", "timed_out", "refused", "requests")}
    return {"ticks": after["ticks"] - before["ticks"],
            "overruns": after["overruns"] - before["overruns"],
            "p99.9 us": after["wake_up_us"]["p99_9"], "worst us": after["wake_up_us"]["worst"],
            "asked": asked, "answered": answered, "shut out": shut_out, "worst ms": 1000 * worst,
            "overviews": heard, "silence ms": 1000 * silence, **page_did,
            "page cpu %": 100 * (cpu_s(page.pid) - cpu) / seconds, "page MB": memory_mb(page.pid)}


def judged(options, quiet, loud, code, log):
    wrong = []
    if code != 0 or "Sanitizer" in log or "runtime error" in log:
        wrong.append(f"it ended with {code}:\n{log[-3000:]}")
    if loud["overruns"] > quiet["overruns"] + options.allow:
        wrong.append(f"overruns: {quiet['overruns']} without, {loud['overruns']} with")
    if loud["answered"] < 0.95 * loud["asked"]:
        wrong.append(f"the client got {loud['answered']} of {loud['asked']} answers")
    if loud["silence ms"] > 1000 * options.silence:
        wrong.append(f"the stream stood still for {loud['silence ms']:.0f} ms")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--page", default=PAGE)
    parser.add_argument("--minutes", type=float, default=10.0, help="of each phase")
    parser.add_argument("--seconds", type=float, help="of each phase, instead of --minutes")
    parser.add_argument("--clients", type=int, default=200, help="hostile ones")
    parser.add_argument("--loops", type=int, default=20, help="at 10 Hz, recorded")
    parser.add_argument("--processes", type=int, default=1, help="that attack")
    parser.add_argument("--allow", type=int, default=0, help="overruns beyond those without")
    parser.add_argument("--silence", type=float, default=10.0, help="of the stream, s")
    parser.add_argument("--port", type=int, default=0, help="of the page; any")
    options = parser.parse_args()
    seconds = options.seconds or 60 * options.minutes
    port = options.port or free_port()
    with bench_daemon.Daemon(options.daemon, "", [(0.1, "")] * options.loops, recording=True) as daemon:
        with open(daemon.folder + "/page.yaml", "w") as file:
            file.write("rate: 10000\n")
        log_name = daemon.folder + "/page.log"
        with open(log_name, "w") as log:
            page = subprocess.Popen([options.page, "--config", daemon.folder + "/page.yaml", "--runtime", daemon.folder,
                                     "--state", daemon.folder, "--port", str(port)], stdout=log, stderr=log)
        time.sleep(2)
        print(f"{options.loops} loops at 10 Hz, {options.clients} hostile clients, "
              f"{seconds:g} s a phase; {daemon.status()['daemon']['real_time_missing'] or 'real-time rights'}")
        rows = [("without", phase(daemon, page, port, seconds, 0, 0)),
                ("with", phase(daemon, page, port, seconds, options.processes, options.clients))]
        print(f"{'':<12}" + "".join(f"{name:>14}" for name, _ in rows))
        for key in rows[0][1]:
            print(f"{key:<12}" + "".join(f"{row[key]:>14.6g}" for _, row in rows))
        page.send_signal(signal.SIGTERM)
        page_code = page.wait(timeout=60)
        with open(log_name) as file:
            page_log = file.read()
        faults = [loop["name"] for loop in daemon.status()["loops"] if loop["fault"] != "none"]
        code = daemon.stop()
        log = daemon.log()
    wrong = judged(options, rows[0][1], rows[1][1], code or page_code, log + page_log)
    if faults:
        wrong.append(f"loops with a fault: {faults}")
    print("\n".join(wrong) or "nobody noticed: no overrun more, the clients were served, no crash")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
