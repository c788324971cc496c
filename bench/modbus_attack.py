#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Attacks the Modbus server of a daemon of its own and tells whether anyone noticed.

Two phases of the same length, without and with hostile clients: silent connections, connections closed for
writing in the middle of a frame, one byte a second, and random and mutated frames as fast as they go. Meanwhile one client
asks ten times a second for the test constant. Printed: late control cycles, that client's answers, what the
server did with the others. Exit code 1 if the daemon crashed, left automatic, did not answer the client, or had more
overruns than --allow beyond the phase without.

Example: bench/modbus_attack.py --minutes 10
         bench/modbus_attack.py --seconds 60 --daemon build/asan/bin/loopwardend
"""
import argparse
import multiprocessing
import random
import socket
import struct
import sys
import time

import bench_daemon

READ_TEST = struct.pack(">HHHBBHH", 1, 0, 6, 1, 4, 14, 2)
SEEDS = [READ_TEST,
         struct.pack(">HHHBBHH", 2, 0, 6, 1, 3, 0, 64),
         struct.pack(">HHHBBHH", 3, 0, 6, 1, 2, 0, 32),
         struct.pack(">HHHBBHH", 4, 0, 6, 1, 5, 16, 0xFF00),
         struct.pack(">HHHBBHHBHH", 5, 0, 11, 1, 16, 34, 2, 4, 0x4090, 0),
         struct.pack(">HHHBBBBB", 6, 0, 5, 1, 43, 14, 1, 0)]


def free_port():
    with socket.socket() as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


def connect(port):
    peer = socket.socket()
    peer.setblocking(False)
    peer.connect_ex(("127.0.0.1", port))
    return peer


def hostile_bytes(chance):
    """Random bytes, a sound request, or one with some bytes changed, cut or doubled."""
    kind = chance.randrange(4)
    if kind == 0:
        return chance.randbytes(chance.randrange(1, 300))
    frame = bytearray(chance.choice(SEEDS))
    if kind == 1:
        return bytes(frame)
    for _ in range(chance.randrange(1, 4)):
        frame[chance.randrange(len(frame))] = chance.randrange(256)
    return bytes(frame[:chance.randrange(1, len(frame) + 1)] if kind == 2 else frame * 3)


def crowd(port, clients, seed, until):
    """Half of them flood; the rest are silent, half a frame, or one byte a second."""
    chance = random.Random(seed)
    peers = [connect(port) for _ in range(clients)]
    next_byte = time.monotonic()
    while time.monotonic() < until:
        slow_turn = time.monotonic() >= next_byte
        if slow_turn:
            next_byte += 1.0
        for number, peer in enumerate(peers):
            role = number % 6
            try:
                if role < 3:
                    peer.send(hostile_bytes(chance))
                    peer.recv(4096)
                elif role == 3 and slow_turn:
                    peer.send(READ_TEST[int(next_byte) % 12:][:1] or b"\0")
                elif role == 4 and slow_turn:
                    peer.send(READ_TEST[:5])
                    peer.shutdown(socket.SHUT_WR)
                elif role == 5 and slow_turn:
                    if not peer.recv(1):
                        raise ConnectionError
            except BlockingIOError:
                continue
            except OSError:
                peer.close()
                peers[number] = connect(port)
    for peer in peers:
        peer.close()


def good_client(port, until, result):
    """Asks ten times a second; connects again when it is shut out, which counts."""
    asked = answered = shut_out = 0
    worst = 0.0
    peer = None
    while time.monotonic() < until:
        asked += 1
        begin = time.monotonic()
        try:
            if peer is None:
                peer = socket.create_connection(("127.0.0.1", port), timeout=5)
            peer.sendall(READ_TEST)
            answer = b""
            while len(answer) < 13:
                some = peer.recv(13 - len(answer))
                if not some:
                    raise ConnectionError
                answer += some
            answered += struct.unpack(">f", answer[9:])[0] == 123456.0
            worst = max(worst, time.monotonic() - begin)
        except OSError:
            shut_out += 1
            if peer:
                peer.close()
            peer = None
        time.sleep(0.1)
    result.put((asked, answered, shut_out, worst))


def phase(daemon, port, seconds, attackers, clients):
    before = daemon.status()["daemon"]
    until = time.monotonic() + seconds
    result = multiprocessing.Queue()
    processes = [multiprocessing.Process(target=good_client, args=(port, until, result))]
    for seed in range(attackers):
        processes.append(multiprocessing.Process(
            target=crowd, args=(port, clients // attackers, seed, until)))
    for process in processes:
        process.start()
    figures = result.get(timeout=seconds + 60)
    for process in processes:
        process.join(timeout=30)
    after = daemon.status()["daemon"]
    server = {key: after["modbus_server"][key] - before["modbus_server"][key]
              for key in ("accepted", "displaced", "malformed", "requests")}
    asked, answered, shut_out, worst = figures
    return {"ticks": after["ticks"] - before["ticks"],
            "overruns": after["overruns"] - before["overruns"],
            "p99.9 us": after["wake_up_us"]["p99_9"], "worst us": after["wake_up_us"]["worst"],
            "asked": asked, "answered": answered, "shut out": shut_out,
            "worst ms": 1000 * worst, **server}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--daemon", default=bench_daemon.PROGRAM)
    parser.add_argument("--minutes", type=float, default=10.0, help="of each phase")
    parser.add_argument("--seconds", type=float, help="of each phase, instead of --minutes")
    parser.add_argument("--clients", type=int, default=200, help="hostile ones")
    parser.add_argument("--loops", type=int, default=20, help="at 10 Hz")
    parser.add_argument("--processes", type=int, default=1, help="that attack")
    parser.add_argument("--allow", type=int, default=0, help="overruns beyond those without")
    options = parser.parse_args()
    seconds = options.seconds or 60 * options.minutes
    port = free_port()
    yaml = (f"modbus_server:\n  port: {port}\n  writes: true\n  request_rate: 10000\n"
            "  clients: [{peer: 127.0.0.1, writes: true}]\n")
    with bench_daemon.Daemon(options.daemon, yaml, [(0.1, "")] * options.loops) as daemon:
        print(f"{options.loops} loops at 10 Hz, {options.clients} hostile clients, "
              f"{seconds:g} s a phase; {daemon.status()['daemon']['real_time_missing'] or 'real-time rights'}")
        rows = [("without", phase(daemon, port, seconds, 0, 0)),
                ("with", phase(daemon, port, seconds, options.processes, options.clients))]
        for key in rows[0][1]:
            print(f"{key:<12}" + "".join(f"{row[key]:>14.6g}" for _, row in rows))
        # The crowd may write: what it has set is its own, but no loop may have a fault.
        faults = [loop["name"] for loop in daemon.status()["loops"] if loop["fault"] != "none"]
        code = daemon.stop()
        log = daemon.log()
    quiet, loud = rows[0][1], rows[1][1]
    wrong = []
    if code != 0 or "Sanitizer" in log or "runtime error" in log:
        wrong.append(f"the daemon ended with {code}:\n{log[-3000:]}")
    if faults:
        wrong.append(f"loops with a fault: {faults}")
    if loud["overruns"] > quiet["overruns"] + options.allow:
        wrong.append(f"overruns: {quiet['overruns']} without, {loud['overruns']} with")
    if loud["answered"] < 0.95 * loud["asked"]:
        wrong.append(f"the client got {loud['answered']} of {loud['asked']} answers")
    print("\n".join(wrong) or "nobody noticed: no overrun more, the client was served, no crash")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
