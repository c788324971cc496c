#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Attacks the Modbus server of a separate daemon and reports whether it had an effect.

Two phases of the same length, without and with hostile clients: silent connections, half-closed connections in the
middle of a frame, one byte a second, and fast random and mutated frames. Meanwhile one client
requests the test constant ten times a second. Printed: late control cycles, that client's answers, the server's
handling of the others. Exit code 1 if the daemon crashed, left automatic, did not answer the client, or had more
overruns than --allow beyond the phase without.

Example: tests/system/modbus_attack.py --minutes 10
         tests/system/modbus_attack.py --seconds 60 --daemon build/asan/bin/loopwardend
"""
import functools
import pathlib
import socket
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import bench_attack  # noqa: E402
import bench_daemon  # noqa: E402

READ_TEST = struct.pack(">HHHBBHH", 1, 0, 6, 1, 4, 14, 2)
SEEDS = [READ_TEST,
         struct.pack(">HHHBBHH", 2, 0, 6, 1, 3, 0, 64),
         struct.pack(">HHHBBHH", 3, 0, 6, 1, 2, 0, 32),
         struct.pack(">HHHBBHH", 4, 0, 6, 1, 5, 16, 0xFF00),
         struct.pack(">HHHBBHHBHH", 5, 0, 11, 1, 16, 34, 2, 4, 0x4090, 0),
         struct.pack(">HHHBBBBB", 6, 0, 5, 1, 43, 14, 1, 0)]


def act(chance, number, peer, _, second):
    """Half of them flood; the rest are silent, half a frame, or one byte a second."""
    role = number % 6
    if role < 3:
        peer.send(bench_attack.hostile_bytes(chance, SEEDS, 300))
        peer.recv(4096)
    elif second is None:
        return
    elif role == 3:
        peer.send(READ_TEST[second % 12:][:1])
    elif role == 4:
        peer.send(READ_TEST[:5])
        peer.shutdown(socket.SHUT_WR)
    elif not peer.recv(1):
        raise ConnectionError


def test_constant(peer):
    peer.sendall(READ_TEST)
    answer = b""
    while len(answer) < 13:
        some = peer.recv(13 - len(answer))
        if not some:
            raise ConnectionError
        answer += some
    return struct.unpack(">f", answer[9:])[0] == 123456.0


def good_client(port, until):
    """Asks ten times a second."""
    questions = bench_attack.Questions()
    while time.monotonic() < until:
        questions.ask(lambda: socket.create_connection(("127.0.0.1", port), timeout=5), test_constant)
        time.sleep(0.1)
    return questions.figures()


def phase(daemon, port, seconds, attackers, clients):
    before = daemon.status()["daemon"]["modbus_server"]
    crowds = [(act, functools.partial(bench_attack.connect, port), clients // attackers, seed) for seed in range(attackers)]
    figures = bench_attack.phase(daemon, port, seconds, [good_client], crowds)
    after = daemon.status()["daemon"]["modbus_server"]
    return figures | bench_attack.risen(before, after, ("accepted", "displaced", "malformed", "requests"))


def main():
    options = bench_attack.parser(__doc__).parse_args()
    seconds = options.seconds or 60 * options.minutes
    port = bench_daemon.free_port()
    yaml = (f"modbus_server:\n  port: {port}\n  writes: true\n  request_rate: 10000\n"
            "  clients: [{peer: 127.0.0.1, writes: true}]\n")
    with bench_daemon.Daemon(options.daemon, yaml, [(0.1, "")] * options.loops) as daemon:
        bench_attack.print_head(options, seconds, daemon)
        quiet = phase(daemon, port, seconds, 0, 0)
        loud = phase(daemon, port, seconds, options.processes, options.clients)
        bench_attack.print_phases(quiet, loud)
        wrong = bench_attack.end(daemon) + bench_attack.noticed(options, quiet, loud)
    print("\n".join(wrong) or "no effect: no additional overrun, the client was served, no crash")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
