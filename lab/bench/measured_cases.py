#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes measured loops of examples/ as cases for loopwarden_estimator_study, each with a rough model.

Usage: lab/bench/measured_cases.py --out FOLDER

Gain: the range of PV over that of CO, its sign from the lag at which PV follows CO best.
Time constant: two samples, at least 2 s (temperatures: 60 s); dead time: two samples.
The model states an uncertainty of 1 for all three.
"""
import argparse
import csv
import json
import pathlib
import statistics

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
STICKING = ["isdb/CHEM1", "isdb/CHEM2", "isdb/CHEM24", "measured/rse_0412_fcv711", "measured/rse_0412_fcv721",
            "routine/r21", "routine/r22", "routine/r24", "routine/r26"]
HEALTHY = ["routine/r00", "routine/r03", "routine/r06", "routine/r15", "routine/r18", "measured/ntnu_drto_t2_pump"]
FRICTION = ["stiction", "backlash", "deadband_drive", "hysteresis"]
MOST_LAG = 12  # samples
FOLLOWS = 0.9  # correlation that gives the sign

MODEL = """sample_time: {period:g}
controller: {{kp: 0.5, ki: 0.05, output: [0, 100]}}
valve: {{effects: []}}
process:
  gain: {gain:.5g}
  time_constant: {lag:g}
  dead_time: {dead_time:g}
  uncertainty: {{gain: 1.0, time_constant: 1.0, dead_time: 1.0}}
transmitter: {{range: [{low:.5g}, {high:.5g}]}}
"""


def correlation(pv: list, co: list) -> float:
    """Returns the correlation of PV with CO at the lag where it is largest."""
    found = 0.0
    for lag in range(MOST_LAG):
        a, b = co[:len(co) - lag], pv[lag:]
        if len(set(a)) > 1 and len(set(b)) > 1:
            found = max(found, statistics.correlation(a, b), key=abs)
    return found


def write_case(name: str, folder: pathlib.Path) -> None:
    with open(EXAMPLES / (name + ".csv"), encoding="utf-8") as file:
        rows = [[float(row[key]) for key in ("time", "pv", "co")] for row in csv.DictReader(file)]
    time, pv, co = (list(column) for column in zip(*rows))
    period = (time[-1] - time[0]) / (len(time) - 1)
    span = max(pv) - min(pv)
    sign = -1.0 if correlation(pv, co) < -FOLLOWS else 1.0
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.yaml").write_text(MODEL.format(
        period=period, gain=sign * span / (max(co) - min(co)), lag=60.0 if "tcv" in name else max(2.0 * period, 2.0),
        dead_time=2.0 * period, low=min(pv) - 0.5 * span, high=max(pv) + 0.5 * span), encoding="utf-8")
    with open(folder / "record.csv", "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", "pv", "co"])
        writer.writerows(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    out = parser.parse_args().out
    truth = []
    for name in STICKING + HEALTHY:
        case = name.split("/")[1]
        write_case(name, out / case)
        sticks = name in STICKING
        truth.append({"id": case, "effect": "stiction" if sticks else "none",
                      "accept": FRICTION if sticks else ["none"], "par": {}, "note": "", "floor_rmse": 0.0})
    (out / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
    print(f"{len(truth)} cases in {out}")


if __name__ == "__main__":
    main()
