#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Loops of another simulator, commissioned from a rough belief and 20 healthy minutes; then a fault, found and explained.

Each case: friction, play and air integrated at 1 ms by code that shares nothing with model/ (bench/hidden_cases, kinds
`later` and `healthy`); `commission` from its first 20 minutes, `replay --twin` over all that comes after. --as-believed
trains on the belief as it is instead. --healthy-hours: as long a record without a fault, after as many minutes.
Seeds below 100000 are for development.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

VALVE_ALARMS = {"stiction", "backlash", "hysteresis", "low_air_supply", "unknown"}
VALVE_FAULTS = {"stiction", "backlash", "hysteresis", "low_air_supply", "positioner_overshoot"}
COMMISSIONED_S = 1200.0
SURE = 0.9
BIN = pathlib.Path(__file__).resolve().parent.parent / "build/release/bin"


def run(*command):
    return subprocess.run(["nice", "-n", "10", *[str(c) for c in command]], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)


def must(*command):
    done = run(*command)
    if done.returncode != 0:
        sys.exit(f"twin_study: {' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def cut(record, upto_s, early, late):
    """Rows before `upto_s` to one file; all from it on to the other, in the record's own time."""
    with open(record, newline="", encoding="utf-8") as source:
        rows = list(csv.reader(source))
    column = rows[0].index("time")
    for path, wanted in ((early, lambda t: t < upto_s), (late, lambda t: t >= upto_s)):
        with open(path, "w", newline="", encoding="utf-8") as target:
            writer = csv.writer(target, lineterminator="\n")
            writer.writerow(rows[0])
            writer.writerows(row for row in rows[1:] if wanted(float(row[column])))


def commission(case, as_believed):
    """What `commission` says, and where specialists and twin are."""
    out = case / "commissioned"
    if as_believed:
        must(BIN / "loopwarden", "train", case / "model.yaml", "--out", out / "specialists", "--windows", 12000)
        return {"verdict": "as believed", "gap": None}, out / "specialists", case / "model.yaml"
    done = run(BIN / "loopwarden", "commission", case / "early.csv", "--model", case / "model.yaml", "--out", out)
    if done.returncode != 0:
        return {"verdict": f"exit code {done.returncode}", "why": done.stderr.strip(), "gap": None}, None, None
    said = json.loads((out / "commission.json").read_text())
    return said, out / "specialists", out / "twin.yaml"


def left_later(case, twin, truth):
    """Gap of the twin on the healthy minutes after those it was made from, over its noise floor."""
    until = truth["from_s"] or 2 * COMMISSIONED_S
    with open(case / "late.csv", newline="", encoding="utf-8") as source:
        rows = list(csv.reader(source))
    column = rows[0].index("time")
    healthy = case / "healthy.csv"
    with open(healthy, "w", newline="", encoding="utf-8") as target:
        writer = csv.writer(target, lineterminator="\n")
        writer.writerow(rows[0])
        writer.writerows(row for row in rows[1:] if float(row[column]) < until)
    done = run(BIN / "loopwarden", "gap", healthy, "--model", twin, "--json", "--out", case / "second")
    if done.returncode != 0:
        return None
    gap = json.loads(done.stdout)["gap"]
    return gap["before"]["holdout_rmse"] / gap["noise_floor_rmse"]


def judge(case, truth, as_believed):
    cut(case / "record.csv", COMMISSIONED_S, case / "early.csv", case / "late.csv")
    said, specialists, twin = commission(case, as_believed)
    result = {"id": truth["id"], "effect": truth["effect"], "note": truth["note"], "verdict": said["verdict"],
              "why": said.get("why", "")}
    if twin is None or not pathlib.Path(twin).exists():
        return result
    result["left"] = None if as_believed else left_later(case, twin, truth)
    replayed = json.loads(must(BIN / "loopwarden", "replay", case / "late.csv", "--specialists", specialists, "--twin",
                               twin, "--jobs", 1, "--json"))
    from_s = truth["from_s"] or float("inf")
    raised = [t for t in replayed["transitions"] if t["to"] == "unacknowledged"]
    result["before"] = [[t["alarm"], t["time_s"]] for t in raised if t["time_s"] < from_s]
    result["raised"] = [{"alarm": t["alarm"], "first": t.get("first_name", t["alarm"]), "after_s": t["time_s"] - from_s,
                         "reason": t["reason"], "names": names(t["explanation"]), "verdict": verdict(t["explanation"])}
                        for t in raised if t["time_s"] >= from_s]
    return result


def verdict(explanation):
    return explanation["verdict"] if explanation else None


def names(explanation):
    """[[name, confidence, names it can't be told from], ...]"""
    return [[e["name"], e["confidence"], e["alternatives"]] for e in explanation["effects"]] if explanation else []


def summary(results, accept):
    """Figures of the table, as (what, value)."""
    done = [r for r in results if "raised" in r]
    lefts = sorted(r["left"] for r in done if r.get("left") is not None)
    rows = [("loops", len(results)), ("commissioned, or taken as believed", len(done))]
    for word, count in collections.Counter(r["verdict"] for r in results if "raised" not in r).items():
        rows.append((f"  {word}", count))
    if lefts:
        rows.append(("gap left on later healthy minutes / floor, median", f"{statistics.median(lefts):.2f}"))
        rows.append(("  worst tenth", f"{lefts[min(len(lefts) - 1, int(0.9 * len(lefts)))]:.2f}"))
    faulty = [r for r in done if r["effect"] != "none"]
    valve = [r for r in faulty if r["effect"] in VALVE_FAULTS]
    outside = [r for r in faulty if r["effect"] not in VALVE_FAULTS]

    def share(part, whole):
        return f"{sum(map(bool, part))} of {len(whole)}"

    if done:
        rows.append(("loops with an alarm before the fault", share([r["before"] for r in done], done)))
    if not faulty:
        return rows
    rows.append(("fault alarmed", share([r["raised"] for r in faulty], faulty)))
    delays = sorted(r["raised"][0]["after_s"] for r in faulty if r["raised"])
    if delays:
        rows.append(("  after, median", f"{statistics.median(delays):.0f} s"))

    def first_valve(r):
        return next((t["first"] for t in r["raised"] if t["first"] in VALVE_ALARMS), None)

    four = [r for r in valve if r["effect"] != "positioner_overshoot"]
    rows.append(("valve fault: its specialist's or routine's first name right",
                 share([first_valve(r) in accept[r["id"]] for r in four], four)))
    rows.append(("  no such alarm", share([first_valve(r) is None for r in four], four)))
    rows.append(("cause outside the valve: a valve alarm after explanation",
                 share([any(t["alarm"] in VALVE_ALARMS for t in r["raised"]) for r in outside], outside)))
    explained = [r for r in faulty if r["raised"]]

    def right(r):
        return any(n[0] in accept[r["id"]] for n in r["raised"][0]["names"])

    sure = [(r["id"], n[0]) for r in explained for t in r["raised"] for n in t["names"] if n[1] >= SURE]
    rows.append(("explanation of the first alarm names it", share([right(r) for r in explained], explained)))
    rows.append(("  says unexplained, or nothing",
                 share([not r["raised"][0]["names"] for r in explained], explained)))
    rows.append(("names at 0.9 that are wrong", share([n not in accept[i] for i, n in sure], sure)))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=13, help="loops; 13 kinds of fault")
    parser.add_argument("--seed", type=int, required=True, help="of the first loop")
    parser.add_argument("--load", action="store_true", help="with an unmeasured random load on PV")
    parser.add_argument("--as-believed", action="store_true", help="specialists and twin from the belief as it is")
    parser.add_argument("--healthy-hours", type=float, default=0.0, help="hours after the 20 minutes, without a fault")
    parser.add_argument("--jobs", type=int, default=1, help="loops at once")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the cases; else they are removed")
    args = parser.parse_args()
    if not (BIN / "loopwarden_hidden_cases").exists():
        print(f"twin_study: no {BIN}/loopwarden_hidden_cases: build the release preset first", file=sys.stderr)
        return 66
    seconds = COMMISSIONED_S + (3600.0 * args.healthy_hours or 2400.0)
    with tempfile.TemporaryDirectory() as name:
        folder = args.keep or pathlib.Path(name)
        must(BIN / "loopwarden_hidden_cases", "--kinds", "healthy" if args.healthy_hours else "later", "--seed",
             args.seed, "--count", args.count, "--samples", round(10 * seconds), "--out", folder,
             *(["--load"] if args.load else []))
        truths = json.loads((folder / "truth.json").read_text())
        results = []
        with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
            for result in pool.map(lambda t: judge(folder / t["id"], t, args.as_believed), truths):
                results.append(result)
                print(json.dumps(result), file=sys.stderr, flush=True)
    accept = {t["id"]: set(t["accept"]) for t in truths}
    for what, value in summary(results, accept):
        print(f"{what:62s} {value}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
