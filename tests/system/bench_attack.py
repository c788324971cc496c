# SPDX-License-Identifier: Apache-2.0
"""Common parts of the attacks on a separate daemon: hostile clients in processes, a phase without them and one with, the verdict."""
import argparse
import multiprocessing
import random
import socket
import time

import bench_daemon


def connect(port, receive_buffer=None):
    peer = socket.socket()
    if receive_buffer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    peer.setblocking(False)
    peer.connect_ex(("127.0.0.1", port))
    return peer


def hostile_bytes(chance, seeds, longest):
    """Random bytes, a sound request, or one with some bytes changed, cut or doubled."""
    kind = chance.randrange(4)
    if kind == 0:
        return chance.randbytes(chance.randrange(1, longest))
    request = bytearray(chance.choice(seeds))
    if kind == 1:
        return bytes(request)
    for _ in range(chance.randrange(1, 4)):
        request[chance.randrange(len(request))] = chance.randrange(256)
    return bytes(request[:chance.randrange(1, len(request) + 1)] if kind == 2 else request * 3)


def crowd(act, open_peer, clients, seed, until):
    """act(chance, number, peer, fresh, second) is the next action of client `number`; `second` is passed once a second, otherwise None.
    A client whose connection was closed connects again."""
    chance = random.Random(seed)
    peers = [open_peer() for _ in range(clients)]
    fresh = [True] * clients
    second = 0
    next_turn = time.monotonic()
    while time.monotonic() < until:
        turn = time.monotonic() >= next_turn
        if turn:
            next_turn += 1.0
            second += 1
        for number, peer in enumerate(peers):
            try:
                act(chance, number, peer, fresh[number], second if turn else None)
                fresh[number] = False
            except BlockingIOError:
                continue
            except OSError:
                peer.close()
                peers[number] = open_peer()
                fresh[number] = True
    for peer in peers:
        peer.close()


class Questions:
    """The requests of a client that asks repeatedly. A closed connection is opened again and counted."""

    def __init__(self):
        self.asked = self.answered = self.shut_out = 0
        self.worst_s = 0.0
        self.peer = None

    def ask(self, connected, question, broken=OSError):
        """connected() returns a peer; question(peer) returns whether the answer was right."""
        self.asked += 1
        begin = time.monotonic()
        try:
            if self.peer is None:
                self.peer = connected()
            self.answered += question(self.peer)
            self.worst_s = max(self.worst_s, time.monotonic() - begin)
        except broken:
            self.shut_out += 1
            if self.peer:
                self.peer.close()
            self.peer = None

    def figures(self):
        return {"asked": self.asked, "answered": self.answered, "shut out": self.shut_out, "worst ms": 1000 * self.worst_s}


def _report(client, port, until, result):
    result.put(client(port, until))


def phase(daemon, port, seconds, clients, crowds):
    """`clients`: functions of port and end that return figures; `crowds`: hostile ones. Returns the figures of all, with the
    daemon's late cycles."""
    before = daemon.status()["daemon"]
    until = time.monotonic() + seconds
    results = [multiprocessing.Queue() for _ in clients]
    processes = [multiprocessing.Process(target=_report, args=(client, port, until, result)) for client, result in zip(clients, results)]
    processes += [multiprocessing.Process(target=crowd, args=(*one, until)) for one in crowds]
    for process in processes:
        process.start()
    told = [result.get(timeout=seconds + 60) for result in results]
    for process in processes:
        process.join(timeout=30)
    after = daemon.status()["daemon"]
    figures = {"ticks": after["ticks"] - before["ticks"], "overruns": after["overruns"] - before["overruns"],
               "p99.9 us": after["wake_up_us"]["p99_9"], "worst us": after["wake_up_us"]["worst"]}
    for one in told:
        figures.update(one)
    return figures


def risen(before, after, names):
    return {name: after[name] - before[name] for name in names}


def print_phases(quiet, loud):
    print(f"{'':<12}{'without':>14}{'with':>14}")
    for key in quiet:
        print(f"{key:<12}{quiet[key]:>14.6g}{loud[key]:>14.6g}")


def print_head(options, seconds, daemon):
    print(f"{options.loops} loops at 10 Hz, {options.clients} hostile clients, {seconds:g} s a phase; "
          f"{daemon.status()['daemon']['real_time_missing'] or 'real-time rights'}")


def end(daemon):
    """Stops it; returns the errors during its run and at its end."""
    # Hostile clients may send commands on open ports and change settings, but no loop may have a fault.
    faults = [loop["name"] for loop in daemon.status()["loops"] if loop["fault"] != "none"]
    return crashed("the daemon", daemon.stop(), daemon.log()) + ([f"loops with a fault: {faults}"] if faults else [])


def crashed(name, code, log):
    if code != 0 or "Sanitizer" in log or "runtime error" in log:
        return [f"{name} ended with {code}:\n{log[-3000:]}"]
    return []


def noticed(options, quiet, loud):
    wrong = []
    if loud["overruns"] > quiet["overruns"] + options.allow:
        wrong.append(f"overruns: {quiet['overruns']} without, {loud['overruns']} with")
    # Of few questions a crowded machine may hold up one or two.
    if loud["asked"] - loud["answered"] > max(4, 0.05 * loud["asked"]):
        wrong.append(f"the client got {loud['answered']} of {loud['asked']} answers")
    return wrong


def parser(description):
    options = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--daemon", default=bench_daemon.PROGRAM)
    options.add_argument("--minutes", type=float, default=10.0, help="of each phase")
    options.add_argument("--seconds", type=float, help="of each phase, instead of --minutes")
    options.add_argument("--clients", type=int, default=200, help="hostile ones")
    options.add_argument("--loops", type=int, default=20, help="at 10 Hz")
    options.add_argument("--processes", type=int, default=1, help="that attack")
    options.add_argument("--allow", type=int, default=0, help="overruns beyond those without")
    return options
