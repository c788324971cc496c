#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that two masters read the same values of one map, except the moving ones.
Usage: compare.py ONE OTHER, each JSON, or lines of a name and a value"""
import json
import math
import sys

# A simulated loop moves between two readings.
MOVES = {"heartbeat", "uptime", "utc_seconds", "utc_milliseconds", "sequence_head", "sequence_tail", "pv", "co", "stem",
         "pv_scaled", "co_scaled", "stem_scaled", "output", "output_scaled", "pv_age", "overruns", "wake_up_worst",
         "wake_up_p99", "clients", "window_number", "windows_judged", "hours_automatic", "hours_manual",
         "hours_at_limit", "records_dropped", "monitor_dropped", "window_backlog", "journal_waiting", "window_state",
         "loop_bits", "at_low", "at_high", "jacket_rate", "jacket_rate_shadow", "compensator", "compensator_shadow", "ne107",
         # of the newest window
         "variability", "mean_error", "oscillation_index", "oscillation_period", "travel", "reversals", "stick",
         "stick_source", "saturated", "window_severity", "window_valid"}


def moves(name):
    short = name.rsplit(".", 1)[-1].rsplit("/", 1)[-1]
    return short in MOVES or short.startswith(("condition_", "p_", "severity_"))


def compare(one, other, tolerance=1e-9):
    if one.keys() != other.keys():
        sys.exit(f"other names: {sorted(one.keys() ^ other.keys())[:5]}")
    wrong = [f"{name}: {one[name]} and {other[name]}" for name in one
             if not moves(name) and not math.isclose(one[name], other[name], rel_tol=tolerance)]
    if wrong:
        sys.exit("\n".join(wrong[:20]))
    print(f"{len(one)} values are the same")


def values_of(path):
    """And how exact they are."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if text.startswith("{"):
        return json.loads(text), 1e-9
    # mbpoll prints six digits.
    return {name.rstrip(): float(value) for name, value in (line.rsplit(" ", 1) for line in text.splitlines())}, 1e-5


if __name__ == "__main__":
    (one, exact), (other, less_exact) = values_of(sys.argv[1]), values_of(sys.argv[2])
    compare(one, other, max(exact, less_exact))
