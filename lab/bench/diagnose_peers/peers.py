#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Published detectors of sticking valves and `diagnose`, on the same records, in one table.

  peers.py --study build/release/bin/loopwarden-study --records examples/routine examples/isdb [--cases 300 --seed 3]
  peers.py --check     each method on two textbook loops: one that sticks, one that a sine moves

Each method is our own implementation of the paper named above it, with the published threshold; a score above it accuses the
valve. Columns: AUC by window, balanced accuracy by window and by loop (mean score of its windows), and our AUC minus that of
the best other one. Intervals are 95 % bootstrap over loops. The best one is chosen once, not in each draw.
Needs Debian's python3-numpy.
"""
import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

FEWEST = 10  # loops that stick, and that don't, for a kind of process to have a column
RESAMPLES = 1000


def detrended(x):
    t = np.arange(len(x))
    return x - np.polyval(np.polyfit(t, x, 1), t)


def autocorrelation(x):
    n = len(x)
    f = np.fft.rfft(x, 2 * n)
    a = np.fft.irfft(np.abs(f) ** 2)[:n]
    return a / a[0] if a[0] > 0 else a


def period_of(co, pv):
    """Four times the first zero of the autocorrelation, the shorter of the two, samples."""
    periods = []
    for x in (co, pv):
        below = np.flatnonzero(autocorrelation(detrended(x)) <= 0)
        if len(below):
            periods.append(4.0 * below[0])
    return min(max(min(periods, default=len(co) / 2), 8.0), len(co) / 2)


def high_passed(x, window):
    kernel = np.ones(window) / window
    padded = np.pad(x, (window // 2, window - 1 - window // 2), mode="edge")
    return x - np.convolve(padded, kernel, mode="valid")


def half_cycles(x):
    """Stretches between zero crossings, at least 6 samples."""
    crossings = np.flatnonzero(np.diff(np.signbit(x))) + 1
    return [x[a:b] for a, b in zip(crossings[:-1], crossings[1:]) if b - a >= 6]


def cross_correlation(pv, co, period):
    """A. Horch, Control Engineering Practice 7 (1999): the function is odd if the valve sticks; 2/3 and above accuse it."""
    x, y = detrended(co), detrended(pv)
    n = len(x)
    full = np.correlate(y, x, "full") / (n * x.std() * y.std() + 1e-300)
    longest = min(int(period), n - 1)
    lags = np.arange(-longest, longest + 1)
    r = full[n - 1 + lags]
    peak, zero = np.max(np.abs(r)), abs(r[longest])
    right = np.flatnonzero(np.diff(np.signbit(r[longest:])))
    left = np.flatnonzero(np.diff(np.signbit(r[: longest + 1][::-1])))
    a = float(right[0]) if len(right) else float(longest)
    b = float(left[0]) if len(left) else float(longest)
    in_lag = abs(a - b) / (a + b) if a + b > 0 else 0.0
    in_size = (peak - zero) / (peak + zero) if peak + zero > 0 else 0.0
    return (in_lag + in_size) / 2.0


def fit_sine(part):
    t = np.linspace(0.0, np.pi, len(part))
    s = np.sin(t)
    return np.mean((part - (s @ part) / (s @ s) * s) ** 2)


def fit_triangle(part):
    best = np.inf
    n = len(part)
    t = np.arange(n, dtype=float)
    for peak in range(1, n - 1):
        shape = np.where(t <= peak, t / peak, (n - 1 - t) / (n - 1 - peak))
        best = min(best, np.mean((part - (shape @ part) / (shape @ shape) * shape) ** 2))
    return best


def curve_shape(pv, co, period):
    """Q. P. He, J. Wang, M. Pottmann, S. J. Qin, Ind. Eng. Chem. Res. 46 (2007): CO a triangle rather than a sine; above 0.6."""
    parts = half_cycles(high_passed(co, max(3, int(2.5 * period))))
    sine = triangle = 0.0
    for part in parts:
        sine += fit_sine(part)
        triangle += fit_triangle(part)
    return sine / (sine + triangle) if sine + triangle > 0 else 0.5


def relay(pv, co, period):
    """M. Rossi, C. Scali, J. Process Control 15 (2005): PV a relay's answer or a triangle rather than a sine; above 0.21."""
    parts = half_cycles(high_passed(pv, max(3, int(2.5 * period))))
    sine = other = 0.0
    for part in parts:
        n = len(part)
        t = np.arange(n, dtype=float)
        best = fit_triangle(part)
        for lag in (0.02, 0.05, 0.1, 0.2, 0.4):
            # A first-order answer to a relay that switches at the half cycle's ends.
            shape = 1.0 - 2.0 * np.exp(-t / (lag * n)) / (1.0 + np.exp(-1.0 / lag))
            best = min(best, np.mean((part - (shape @ part) / (shape @ shape) * shape) ** 2))
        sine += fit_sine(part)
        other += best
    return (sine - other) / (sine + other) if sine + other > 0 else 0.0


def symbols(x):
    d = np.diff(x)
    deviation = d.std()
    if deviation <= 0:
        return np.zeros(len(d), dtype=int)
    z = (d - d.mean()) / deviation
    return np.where(z > 1.0, 1, np.where(z < -1.0, -1, 0))


def qualitative(pv, co, period):
    """Y. Yamashita, Control Engineering Practice 14 (2006), index rho 3: above 0.25."""
    block = max(1, int(period / 20))
    n = len(pv) // block
    u = symbols(co[: n * block].reshape(n, block).mean(1))
    y = symbols(pv[: n * block].reshape(n, block).mean(1))
    moving = np.count_nonzero((u != 0) | (y != 0))
    if moving == 0:
        return 0.0
    stuck = (u != 0) & (y == 0)
    share = np.count_nonzero(stuck) / moving
    against = 0
    for k in range(len(u) - 1):
        if not stuck[k]:
            continue
        follows = (u[k + 1] == u[k] and y[k + 1] in (0, u[k])) or (u[k + 1] == 0 and y[k + 1] in (0, u[k]))
        against += 0 if follows else 1
    return share - against / moving


def still_intervals(pv, co, period):
    """M. Kano, H. Maruta, H. Kugemoto, K. Shimizu, IFAC DYCOPS (2004), method A with PV in the place of the stem: above 0.25."""
    length = max(2, int(period / 8))
    n = len(pv) // length
    u = co[: n * length].reshape(n, length)
    y = pv[: n * length].reshape(n, length)
    moves = np.ptp(u, axis=1) > 0.1 * np.ptp(co)
    still = np.ptp(y, axis=1) < 0.1 * np.ptp(pv)
    return np.count_nonzero(moves & still) / n


def bicoherence(x, length=64):
    segments = [x[k : k + length] for k in range(0, len(x) - length + 1, length // 2)]
    if len(segments) < 4:
        return 0.0, 0.0
    f = np.array([np.fft.fft((s - s.mean()) * np.hanning(length)) for s in segments])
    half = length // 4
    values = []
    for a in range(1, half):
        for b in range(a, half):
            product = f[:, a] * f[:, b]
            above = abs(np.mean(product * np.conj(f[:, a + b]))) ** 2
            below = np.mean(np.abs(product) ** 2) * np.mean(np.abs(f[:, a + b]) ** 2)
            values.append(above / below if below > 0 else 0.0)
    values = np.array(values)
    bound = 5.99 / (2 * len(segments))  # 95 % of chi square, two degrees
    large = values[values > bound]
    gaussian = values.mean() - bound
    linear = abs(values.max() - (values.mean() + 2 * values.std())) if len(large) else 0.0
    return gaussian, linear


def ellipse(pv, co, period):
    """M. A. A. S. Choudhury, S. L. Shah, N. F. Thornhill, D. S. Shook, Control Engineering Practice 14 (2006). If bicoherence of
    the error shows nonlinearity, PV over CO fills an ellipse. Score: its width along CO over CO's range, above 0.1 if nonlinear."""
    block = max(1, int(period / 16))
    n = len(pv) // block
    y = detrended(pv[: n * block].reshape(n, block).mean(1))
    u = detrended(co[: n * block].reshape(n, block).mean(1))
    gaussian, linear = bicoherence(y)
    r = np.corrcoef(u, y)[0, 1] if u.std() > 0 and y.std() > 0 else 0.0
    width = np.sqrt(max(0.0, 1.0 - r * r))
    return width if gaussian > 0.001 and linear > 0.01 else 0.09 * width


def play_of(u, band):
    x = np.empty_like(u)
    at = u[0]
    for k, value in enumerate(u):
        at = min(max(at, value - band / 2), value + band / 2)
        x[k] = at
    return x


def arx_error(y, v, delays):
    best = np.inf
    rows = np.arange(delays[-1] + 3, len(y))
    for d in delays:
        columns = [y[rows - 1], y[rows - 2], v[rows - d - 1], v[rows - d - 2], np.ones(len(rows))]
        a = np.stack(columns, 1)
        theta = np.linalg.lstsq(a, y[rows], rcond=None)[0]
        best = min(best, np.mean((y[rows] - a @ theta) ** 2))
    return best


def hammerstein(pv, co, period):
    """R. Srinivasan et al., Ind. Eng. Chem. Res. 44 (2005), and M. Jelali, J. Process Control 18 (2008): ARX after a valve of one
    parameter, the best band named; a band above zero accuses. Score: log of the errors without and with it, above 0.02."""
    block = max(1, int(period / 20))
    n = len(pv) // block
    y = pv[: n * block].reshape(n, block).mean(1)
    u = co[: n * block].reshape(n, block).mean(1)
    if n < 40 or np.ptp(u) <= 0 or y.std() <= 0:
        return 0.0
    delays = range(0, 6)
    straight = arx_error(y, u, delays)
    best = min(arx_error(y, play_of(u, b * np.ptp(u)), delays) for b in (0.1, 0.25, 0.4, 0.6, 0.8))
    return float(np.log((straight + 1e-12) / (best + 1e-12)))


METHODS = [
    ("cross-correlation (Horch)", cross_correlation, 2.0 / 3.0),
    ("curve shape (He)", curve_shape, 0.6),
    ("qualitative (Yamashita)", qualitative, 0.25),
    ("relay (Rossi, Scali)", relay, 0.21),
    ("still intervals (Kano)", still_intervals, 0.25),
    ("bicoherence and ellipse", ellipse, 0.1),
    ("Hammerstein (Srinivasan, Jelali)", hammerstein, 0.02),
]


def read_record(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    values = np.array([[float(r["pv"] or "nan"), float(r["co"] or "nan")] for r in rows])
    values = values[np.all(np.isfinite(values), axis=1)]
    return values[:, 0], values[:, 1]


def auc(scores, sticky):
    positive, negative = scores[sticky], scores[~sticky]
    if len(positive) == 0 or len(negative) == 0:
        return float("nan")
    d = positive[:, None] - negative[None, :]
    return float(np.mean(d > 0) + 0.5 * np.mean(d == 0))


def balanced(called, sticky):
    if sticky.all() or not sticky.any():
        return float("nan")
    return float((called[sticky].mean() + (~called[~sticky]).mean()) / 2.0)


def rows_of(loops):
    return [np.flatnonzero(loops == name) for name in sorted(set(loops))]


def interval(figure, loops):
    random = np.random.default_rng(1)
    rows = rows_of(loops)
    drawn = []
    for _ in range(RESAMPLES):
        of = [rows[i] for i in random.integers(0, len(rows), len(rows))]
        value = figure(np.concatenate(of))
        if np.isfinite(value):
            drawn.append(value)
    return np.quantile(drawn, [0.025, 0.975]) if drawn else (float("nan"), float("nan"))


def with_interval(figure, loops):
    low, high = interval(figure, loops)
    return f"{figure(np.arange(len(loops))):.2f} ({low:.2f} to {high:.2f})"


# `methods`: name, score of each window, whether it is called sticky, and the same of each loop. The last one is ours.
def table(title, methods, sticky, loops, kinds=None):
    several = len(set(loops)) < len(loops)
    print(f"\n{title}: {len(sticky)} windows of {len(set(loops))} loops, {int(sticky.sum())} windows sticky")
    print(f"{'method':<34} {'AUC, windows':>20} {'balanced, windows':>20}" + (f" {'balanced, loops':>20}" if several else ""))
    loop_sticky = np.array([sticky[r[0]] for r in rows_of(loops)])
    for name, scores, called, loop_called in methods:
        print(
            f"{name:<34} {with_interval(lambda i: auc(scores[i], sticky[i]), loops):>20} "
            f"{with_interval(lambda i: balanced(called[i], sticky[i]), loops):>20}"
            + (
                f" {with_interval(lambda i: balanced(loop_called[i], loop_sticky[i]), np.arange(len(loop_sticky))):>20}"
                if several
                else ""
            )
        )
    best = max(methods[:-1], key=lambda m: auc(m[1], sticky))
    ours = methods[-1][1]
    print(
        f"AUC of ours less that of {best[0]}: "
        + with_interval(lambda i: auc(ours[i], sticky[i]) - auc(best[1][i], sticky[i]), loops)
    )
    if kinds is None:
        return
    shown = [k for k in sorted(set(kinds)) if min(sticky[kinds == k].sum(), (~sticky[kinds == k]).sum()) >= FEWEST]
    of = [np.flatnonzero(kinds == k) for k in shown]
    print(f"{'AUC by kind of process':<34}" + "".join(f" {k:>20}" for k in shown))
    for name, scores, _, _ in methods:
        print(f"{name:<34}" + "".join(f" {with_interval(lambda i, r=r: auc(scores[r[i]], sticky[r[i]]), r):>20}" for r in of))
    print(f"{'loops, of them sticky':<34}" + "".join(f" {f'{len(r)}, {int(sticky[r].sum())}':>20}" for r in of))


def textbook_loop(band, load, samples=2500):
    """PI on a lag of 6 samples with dead time 4, after a valve that sticks in `band` and then moves 0.7 of it."""
    random = np.random.default_rng(1)
    keep = np.exp(-1.0 / 6.0)
    pv, co = np.zeros(samples + 500), np.zeros(samples + 500)
    y = stem = integral = 0.0
    line = [0.0] * 4
    for k in range(len(pv)):
        pv[k] = y + 0.005 * random.normal()
        integral -= 0.05 * pv[k]
        co[k] = integral - 0.35 * pv[k]
        if abs(co[k] - stem) > band:
            stem = co[k] - (0.3 * band * np.sign(co[k] - stem))
        line.append(stem)
        y = keep * y + (1.0 - keep) * (line.pop(0) + load(k))
    return pv[500:], co[500:]


def check():
    """Each method must find the sticking loop more sticky than the one that a sine moves."""
    sticks = textbook_loop(2.0, lambda k: 0.6)
    swings = textbook_loop(0.0, lambda k: 2.0 * np.sin(2.0 * np.pi * k / 70.0))
    good = True
    print(f"{'method':<34} {'sticks':>8} {'sine':>8} {'called from':>12}")
    for name, method, threshold in METHODS:
        high, low = (method(pv, co, period_of(co, pv)) for pv, co in (sticks, swings))
        good = good and high > low
        print(f"{name:<34} {high:>8.2f} {low:>8.2f} {threshold:>12.2f}")
    return 0 if good else 1


def published(records, loops):
    periods = [period_of(co, pv) for pv, co in records]
    methods = []
    for name, method, threshold in METHODS:
        scores = np.array([method(pv, co, p) for (pv, co), p in zip(records, periods)])
        loop_called = np.array([scores[r].mean() > threshold for r in rows_of(loops)])
        methods.append((name, scores, scores > threshold, loop_called))
    return methods


# As answered: `can't tell` does not count as sticky.
def answered(results):
    return np.array([r["verdict"] == "valve_effect" for r in results])


# A gate that is shut is no opinion of the valve, and the published methods have no gates.
def judged(results):
    return [i for i, r in enumerate(results) if r["verdict"] != "not_enough_data"]


def probability(results):
    return np.array([r["probability"] for r in results])


def study(program, *arguments):
    return subprocess.run([program, "diagnose", *arguments], check=True, capture_output=True, text=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--check", action="store_true", help="each method on textbook loops; exit code 1 if one fails")
    parser.add_argument("--study", help="the program loopwarden-study")
    parser.add_argument("--records", nargs="+", help="folders with labels.csv")
    parser.add_argument("--cases", type=int, default=0, help="simulated loops, too")
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    if options.check:
        return check()
    if not options.study or not options.records:
        parser.error("needs --study and --records, or --check")

    answer = json.loads(study(options.study, "--json", "--records", *options.records))
    kept = judged(answer["records"])
    print(f"open records left out, not enough data: {len(answer['records']) - len(kept)}")
    ours = [answer["records"][i] for i in kept]
    paths = {}
    for folder in options.records:
        for path in pathlib.Path(folder).glob("*.csv"):
            paths[path.name] = path
    sticky = np.array([r["sticky"] for r in ours])
    loops = np.array([r["loop"] for r in ours])
    methods = published([read_record(paths[r["record"]]) for r in ours], loops)
    of_loops = answered(sorted((v for v in answer["loops"] if v["loop"] in loops), key=lambda v: v["loop"]))
    methods.append(("diagnose (open loops had a say)", probability(ours), answered(ours), of_loops))
    table("open records", methods, sticky, loops)
    if options.cases == 0:
        return 0
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["--cases", str(options.cases), "--seed", str(options.seed)]
        study(options.study, *arguments, "--save", folder)
        cases = json.loads(study(options.study, *arguments, "--json"))
        files = sorted(pathlib.Path(folder).glob("c*.csv"))
        kept = [i for i in judged(cases) if cases[i]["truth"] != "backlash"]
        print(f"\nsimulated loops left out, not enough data: {len(cases) - len(judged(cases))}")
        loops = np.array([f"{i:06d}" for i in kept])
        methods = published([read_record(files[i]) for i in kept], loops)
    ours = [cases[i] for i in kept]
    sticky = np.array([c["truth"] == "stiction" for c in ours])
    methods.append(("diagnose", probability(ours), answered(ours), answered(ours)))
    table(f"simulated loops, seed {options.seed}", methods, sticky, loops, np.array([c["kind"] for c in ours]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
