#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Proves by the call graph that the real-time path neither allocates, locks, throws nor logs.

Disassembles a linked loopwardend and follows every call from the real-time roots. Fails with the
call path if one reaches a function outside the program that is not on the short list below.
Calls through pointers are allowed only if the program calls an interface (Clock, LoopIo, a plant's
effects). Every implementation of these interfaces is also a root.

Usage: rt_gate.py build/release/bin/loopwardend      (every build has -fno-jump-tables)
x86-64 and arm64; the other architecture needs its binutils (Debian: binutils-aarch64-linux-gnu).
"""
import re
import subprocess
import sys

ROOTS = [
    r"loopwarden::daemon::rt::CyclicRunner::run\(",
    r"loopwarden::base::MonotonicClock::(now_ns|sleep_until_ns)\(",
    r"loopwarden::hal::\w+::\w+LoopIo::(read|write)\(",
    r"loopwarden::effects::Effect::Held<.*>::(reset|step|set_severity)\(",
]
# Functions that may call through a pointer, and why.
INTERFACE_CALLERS = [
    r"loopwarden::daemon::rt::CyclicRunner::",  # Clock
    r"loopwarden::daemon::rt::ControlCycle::",  # LoopIo
    r"(double )?loopwarden::(effects::EffectChain|plant::Plant)::",  # Effect
]
# Functions outside the program that may be called: arithmetic, copying, the two calls of the clock, and in a package's program
# the abort after a stack overflow.
ALLOWED = {
    "memcpy", "memmove", "memset", "exp", "expm1", "log", "cos", "sin", "sincos", "atan2", "atanh", "pow", "sqrt", "floor", "ceil",
    "nearbyint", "lround", "round", "fmod", "fmin", "fmax", "clock_gettime", "clock_nanosleep",
    "__stack_chk_fail",
}
MANDATORY_ROOTS = ["CyclicRunner::run", "SimLoopIo::read", "SimLoopIo::write", "ModbusLoopIo::read",
                   "ModbusLoopIo::write", "AnalogLoopIo::read", "AnalogLoopIo::write",
                   "ReplayLoopIo::read", "ReplayLoopIo::write", "Held<loopwarden::effects::Backlash>::step"]

FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
TARGET = r"[0-9a-f]+ <(.*?)(?:\+0x[0-9a-f]+)?>\s*(?://.*)?$"
# By the machine in the ELF header: its objdump, and its calls and jumps, direct and through a pointer.
# An unknown machine must not pass as correct.
MACHINES = {
    62: ("x86_64-linux-gnu-objdump", re.compile(r"\s(?:call|jmp|j[a-z]+)\s+" + TARGET),
         re.compile(r"\s(?:notrack )?(?:call|jmp)\s+\*")),
    183: ("aarch64-linux-gnu-objdump",
          re.compile(r"\s(?:bl?|b\.[a-z]+|cbn?z\s+\w+,|tbn?z\s+\w+, #\w+,)\s+" + TARGET),
          re.compile(r"\s(?:blr|br)[a-z]*\s+x")),
}


def call_graph(binary):
    with open(binary, "rb") as file:
        machine = int.from_bytes(file.read(20)[18:], "little")
    if machine not in MACHINES:
        sys.exit(f"rt_gate: {binary} is no program of a machine that is known here (ELF machine {machine})")
    objdump, call, through_pointer = MACHINES[machine]
    text = subprocess.run([objdump, "-d", "-C", "--no-show-raw-insn", binary], check=True,
                          capture_output=True, text=True).stdout
    calls, indirect, current = {}, set(), None
    for line in text.splitlines():
        if match := FUNCTION.match(line):
            current = match.group(1)
            calls.setdefault(current, set())
        elif current is None:
            continue
        elif through_pointer.search(line):
            indirect.add(current)
        elif match := call.search(line):
            if match.group(1) != current:
                calls[current].add(match.group(1))
    return calls, indirect


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 64
    calls, indirect = call_graph(sys.argv[1])
    roots = [f for f in calls if any(re.match(r, f) for r in ROOTS)]
    missing = [m for m in MANDATORY_ROOTS if not any(m + "(" in f for f in roots)]
    if missing:
        print("rt_gate: not found in the program: " + ", ".join(missing), file=sys.stderr)
        return 1

    path = {root: None for root in roots}
    queue, problems = list(roots), []

    def trace(function):
        steps = []
        while function is not None:
            steps.append(function)
            function = path[function]
        return "\n    called by ".join(steps)

    while queue:
        function = queue.pop()
        if function in indirect and not any(re.match(r, function) for r in INTERFACE_CALLERS):
            problems.append("calls through a pointer: " + trace(function))
        for callee in sorted(calls.get(function, ())):
            if callee in path:
                continue
            path[callee] = function
            if callee.endswith("@plt"):
                if callee[:-4] not in ALLOWED:
                    problems.append("calls outside: " + trace(callee))
            else:
                queue.append(callee)

    if problems:
        print("rt_gate: the real-time path reaches what it must not:", file=sys.stderr)
        for problem in problems:
            print("  " + problem, file=sys.stderr)
        return 1
    outside = sorted(f[:-4] for f in path if f.endswith("@plt"))
    inside = len(path) - len(outside)
    print(f"rt_gate: {inside} functions on the real-time path from {len(roots)} roots; "
          f"outside the program they call only: {', '.join(outside)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
