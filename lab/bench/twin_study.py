#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Loops of another simulator, commissioned from a rough model and 20 healthy minutes; then a change, to be detected and named.

Each case: friction, backlash and air integrated at 1 ms by code that shares no code with model/ (lab/hidden_cases, kinds
`later` and `healthy`). `commission` uses its first 20 minutes, `replay --twin` the rest. Half of the loops have
a load. --as-believed trains on the rough model without corrections. --healthy-hours: as long a record without a change, after as
many minutes, with another day's load and set points over the whole range. Seeds below 100000 are for development.

A change is detected by an alarm, or by load_outside if it is a load (bias, step, drift, oscillation); bias and step count as one.
The name is the incident's, ten minutes after the change, or the first alarm's explanation. "Called a valve fault": by the
incident's cause.
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

LOADS = {"output_bias", "step_disturbance", "drift", "oscillating_disturbance"}
AS_ONE = {"output_bias": {"step_disturbance"}, "step_disturbance": {"output_bias"}, "drift": {"ramp_disturbance"}}
VALVE_FAULTS = {"stiction", "backlash", "hysteresis", "low_air_supply", "positioner_overshoot"}
COMMISSIONED_S = 1200.0
SURE = 0.9
BIN = pathlib.Path(__file__).resolve().parents[2] / "build/release/bin"


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
    """Returns the answer of `commission`, and the paths of specialists and twin."""
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
    result["judged"] = replayed["twin"]["judged_share"]
    result["controller_not_watched"] = replayed["twin"]["controller_not_watched"]
    result["incidents"] = [{"name": i["name"], "cause": i["cause"], "alarms": i["alarms"], "after_s": i["raised_s"] - from_s}
                           for i in replayed["incidents"] if i["raised_s"] >= from_s]
    result["loads"] = [t["from_s"] - from_s for t in replayed["twin"]["load_outside"] if t["from_s"] >= from_s]
    result["raised"] = [{"alarm": t["alarm"], "first": t.get("first_name", t["alarm"]), "after_s": t["time_s"] - from_s,
                         "reason": t["reason"], "names": names(t["explanation"]), "verdict": verdict(t["explanation"])}
                        for t in raised if t["time_s"] >= from_s]
    return result


def verdict(explanation):
    return explanation["verdict"] if explanation else None


def names(explanation):
    """[[name, confidence, names that can't be distinguished from it], ...]"""
    return ([[e["name"], e["confidence"], e["alternatives"], e["block"]] for e in explanation["effects"]]
            if explanation else [])


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

    def share(part, whole):
        return f"{sum(map(bool, part))} of {len(whole)}"

    def seen_s(r):
        times = [t["after_s"] for t in r["raised"]] + (r["loads"] if parts(r) & LOADS else [])
        return min(times, default=None)

    def right(r):
        names_given = {n[0] for n in first_names(r)}
        return all(names_given & accepted(r, part, accept) for part in parts(r))

    if done:
        rows.append(("loops with an alarm before the change, or without one", share([r["before"] for r in done], done)))
        rows.append(("judged, share of the time", f"{statistics.mean(r['judged'] for r in done):.2f}"))
        rows.append(("controller not watched", share([r["controller_not_watched"] for r in done], done)))
    if not faulty:
        return rows
    named = [r for r in faulty if r["raised"] and r["incidents"]]
    outside = [r for r in named if not parts(r) & VALVE_FAULTS]

    def incident_right(r):
        return any(r["incidents"][0]["name"] in accepted(r, part, accept) for part in parts(r))

    sure = [(r, n) for r in named for n in first_names(r) if n[1] >= SURE]
    rows += [
        ("change seen", share([seen_s(r) is not None for r in faulty], faulty)),
        ("one change, one incident", share([len(r["incidents"]) == 1 for r in named], named)),
        ("incident's name right", share([incident_right(r) for r in named], named)),
        ("first alarm's explanation names it (both of two)", share([right(r) for r in named], named)),
        ("  names nothing", share([not first_names(r) for r in named], named)),
        ("names at 0.9 that are wrong",
         share([all(n[0] not in accepted(r, part, accept) for part in parts(r)) for r, n in sure], sure)),
        ("cause outside the valve called a valve fault",
         share([r["incidents"][0]["cause"] == "valve" for r in outside], outside)),
    ]
    valve = [seen_s(r) for r in faulty if parts(r) & (VALVE_FAULTS | {"gain_change"}) and seen_s(r) is not None]
    rows += [
        ("time of valve faults and gain, median, s", f"{statistics.median(valve):.0f}" if valve else "-"),
    ]
    for kind in sorted({r["effect"] for r in faulty}):
        of_kind = [r for r in faulty if r["effect"] == kind]
        times = [seen_s(r) for r in of_kind if seen_s(r) is not None]
        after = f", after {statistics.median(times):.0f} s (median)" if times else ""
        rows.append((f"  {kind}", f"seen {share([seen_s(r) is not None for r in of_kind], of_kind)}{after}; "
                     f"named {share([incident_right(r) for r in of_kind if r in named], [r for r in of_kind if r in named])}"))
    return rows


def parts(r):
    return set(r["effect"].split("+"))


def first_names(r):
    return r["raised"][0]["names"]


def accepted(r, part, accept):
    """Names that are right for one of a case's changes."""
    alone = accept[r["id"]] if "+" not in r["effect"] else {part}
    return alone | AS_ONE.get(part, set())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=13, help="loops; 15 kinds of change, and no change")
    parser.add_argument("--seed", type=int, required=True, help="of the first loop")
    parser.add_argument("--as-believed", action="store_true", help="specialists and twin from the belief as it is")
    parser.add_argument("--healthy-hours", type=float, default=0.0, help="hours after the 20 minutes, without a fault")
    parser.add_argument("--jobs", type=int, default=1, help="loops at once")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the cases; default: they are removed")
    args = parser.parse_args()
    if not (BIN / "loopwarden_hidden_cases").exists():
        print(f"twin_study: no {BIN}/loopwarden_hidden_cases: build the release preset first", file=sys.stderr)
        return 66
    seconds = COMMISSIONED_S + (3600.0 * args.healthy_hours or 2400.0)
    with tempfile.TemporaryDirectory() as name:
        folder = args.keep or pathlib.Path(name)
        truths = []
        for load, count in (([], (args.count + 1) // 2), (["--load"], args.count // 2)):
            part = folder / ("load" if load else "still")
            if count == 0:
                continue
            must(BIN / "loopwarden_hidden_cases", "--kinds", "healthy" if args.healthy_hours else "later", "--seed",
                 args.seed + len(truths), "--count", count, "--samples", round(10 * seconds), "--out", part, *load)
            truths += [{**t, "folder": part / t["id"]} for t in json.loads((part / "truth.json").read_text())]
        results = []
        with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
            for result in pool.map(lambda t: judge(t["folder"], t, args.as_believed), truths):
                results.append(result)
                print(json.dumps(result), file=sys.stderr, flush=True)
    accept = {t["id"]: set(t["accept"]) for t in truths}
    for what, value in summary(results, accept):
        print(f"{what:62s} {value}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
