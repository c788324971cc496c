#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Faults that begin in the middle of a record of another simulator: the share named, and the share of false names before.

Each case: friction, backlash and air integrated at 1 ms by code that shares no code with model/
(lab/hidden_cases). The specialists are trained only on the case's loop model; every window of the record is classified.
Seeds below 100000 are for development.
"""
import argparse
import collections
import json
import pathlib
import subprocess
import sys
import tempfile

FAULTS = {"stiction", "backlash", "hysteresis", "low_air_supply"}
BIN = pathlib.Path(__file__).resolve().parents[2] / "build/release/bin"


def run(*command):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"onset_study: {' '.join(map(str, command))}: exit code {done.returncode}")
    return done.stdout


def judge(folder, truth, windows):
    """Counts of one case: windows before the onset, of these called a fault, names after it."""
    case = folder / truth["id"]
    run(BIN / "loopwarden", "train", case / "model.yaml", "--out", case / "specialists", "--windows", windows)
    verdicts = json.loads(run(BIN / "loopwarden", "classify", case / "record.csv", "--specialists",
                              case / "specialists", "--json"))["windows"]
    onset_s = truth["from_s"] if truth["effect"] != "none" else float("inf")
    before = [w for w in verdicts if w["to_s"] <= onset_s]
    after = [w["verdict"] for w in verdicts if w["to_s"] > onset_s]
    return {"before": len(before), "false": sum(w["verdict"] in FAULTS for w in before),
            "right": any(v in truth["accept"] for v in after),
            "wrong": sorted({v for v in after if v in FAULTS and v not in truth["accept"]})}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=40, help="records")
    parser.add_argument("--seed", type=int, required=True, help="of the first record")
    parser.add_argument("--load", action="store_true", help="with an unmeasured random load on PV")
    parser.add_argument("--windows", type=int, default=4000, help="training windows of each loop")
    args = parser.parse_args()
    if not (BIN / "loopwarden_hidden_cases").exists():
        print(f"onset_study: no {BIN}/loopwarden_hidden_cases: build the release preset first", file=sys.stderr)
        return 66
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(BIN / "loopwarden_hidden_cases", "--kinds", "onset", "--seed", args.seed, "--count", args.count,
            "--out", folder, *(["--load"] if args.load else []))
        totals = collections.defaultdict(collections.Counter)
        for truth in json.loads((folder / "truth.json").read_text()):
            result = judge(folder, truth, args.windows)
            for group in (truth["effect"], "all"):
                totals[group].update(records=1, right=result["right"], wrong=bool(result["wrong"]),
                                     before=result["before"], false=result["false"])
            print(f"{truth['id']}  {truth['effect']:16s} {'named' if result['right'] else '-':7s}"
                  f"{result['false']} of {result['before']} windows before it called a fault"
                  f"{'; also named: ' + ', '.join(result['wrong']) if result['wrong'] else ''}", flush=True)
    print(f"\n{'fault':16s} {'records':>8s} {'named':>6s} {'another too':>12s} {'before it':>10s} {'called a fault':>15s}")
    for group, t in sorted(totals.items(), key=lambda item: item[0] == "all"):
        print(f"{group:16s} {t['records']:8d} {t['right']:6d} {t['wrong']:12d} {t['before']:10d} {t['false']:15d}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
