#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Loops of a plant from a generator that shares no code with the project, judged by `diagnose` and `survey`.

  lab/bench/plant_loops.py [--only smooth limits stiction play healthy tuning master] [--loops N]   each loop by `diagnose`
  lab/bench/plant_loops.py --windows         the same loops by `survey --window` 1, 2, 4 and 8
  lab/bench/plant_loops.py --plants 20       the first ten of `survey` of each plant: 200 loops, 20 with a sick valve
  lab/bench/plant_loops.py --save DIR        the records and their true causes (truth.csv), without a judgement
  lab/bench/plant_loops.py --check           the generator against textbooks; exit code 1 if it fails

8 h at 1 s. Kinds, each under a controller with sane tuning (greatest sensitivity up to 2), unless stated otherwise:
  smooth    ideal valve, flow; a sine, triangle or saw swings the supply, half of them with wandering phase and amplitude
  limits    ideal valve, slow loop, 1.2 to 3 times its stability limit: CO cycles between limits, some not CO's ends
  stiction  band 2 to 8 % of CO's span, jump 15 to 90 % of it; flows and levels
  play      2 to 8 %; flows whose set point or load moves, and levels, which cycle
  healthy   ideal valve; flow, level, temperature; loads that wander, set points that step
  tuning    ideal valve; gain so high that the greatest sensitivity is 3 to 8
  master    ideal valve, flow; a master moves the set point all the time
Of stiction and play those count whose CO travels 1 to 3 bands between reversals (median; a reversal is half a band) and is
logged in steps of at most a fifth of the band; more are drawn until there are enough. Intervals: 95 %, Wilson 1927.
Needs Debian's python3-numpy.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
SAMPLES = 28800
WARM_UP = 3600
KINDS = ("smooth", "limits", "stiction", "play", "healthy", "tuning", "master")
FAULTS = ("stiction", "play")
EFFECT = {"stiction": "stiction", "play": "backlash"}
LOOPS = {"smooth": 200}  # else 100
SHAPES = ("sine", "triangle", "saw")
TRAVEL_BANDS = (1.0, 3.0)
STEPS_A_BAND = 5.0
# Of 200 loops. The five swings of a header come from one pump or compressor.
PLANT = {"stiction": 12, "play": 8, "smooth": 25, "limits": 5, "tuning": 20, "master": 40, "healthy": 90}
A_HEADER = 5
FIRST = 10


def log_uniform(random, low, high, n):
    return np.exp(random.uniform(math.log(low), math.log(high), n))


def wilson(k, n):
    """Share and 95 % interval."""
    if n == 0:
        return (math.nan, math.nan, math.nan)
    z = 1.959964
    p = k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (p, max(0.0, middle - half), min(1.0, middle + half))


class Valves:
    """Stems with `band` (dead band and stick band together) and `jump`; jump 0 is backlash, both 0 an ideal valve.

    A resting stem holds against a force of (band + jump)/2 and slips until (band - jump)/2 remains (He, Wang, Pottmann, Qin 2007).
    Those that `keep_moving` then follow the signal until it stops or turns (Choudhury, Thornhill, Shah 2005); the others
    rest after each jump.
    """

    def __init__(self, band, jump, keep_moving, at):
        self.bears, self.left = (band + jump) / 2.0, (band - jump) / 2.0
        self.keep_moving = keep_moving
        self.stem, self.last = at.copy(), at.copy()
        self.way = np.ones_like(at)
        self.moving = np.zeros(len(at), dtype=bool)

    def step(self, signal):
        off = signal - self.stem
        slips = np.abs(off) > self.bears
        goes = slips | (self.moving & (self.way * (signal - self.last) > 0.0))
        self.way = np.where(slips, np.sign(off), self.way)
        self.stem = np.where(goes, signal - self.way * self.left, self.stem)
        self.moving = goes & self.keep_moving
        self.last = signal
        return self.stem


BACK = np.exp(-1j * np.exp(np.linspace(math.log(1e-4), math.log(math.pi), 400)))[:, None]  # z^-1 at 1 s


def response(loop):
    """From CO to PV: dead time and a lag or two, or an integrator."""
    keep, keep2 = np.exp(-1.0 / loop["lag_s"]), np.exp(-1.0 / loop["lag2_s"])
    lag = np.where(loop["integrates"], loop["rate"] * BACK / (1.0 - BACK), loop["gain"] * (1.0 - keep) * BACK / (1.0 - keep * BACK))
    return lag * (1.0 - keep2) / (1.0 - keep2 * BACK) * BACK ** loop["dead_s"]


def greatest_sensitivity(loop, kp, ki):
    return np.max(1.0 / np.abs(1.0 + (kp + ki / (1.0 - BACK)) * response(loop)), axis=0)


def ultimate_gain(loop):
    """At which a controller without integral makes the loop swing for ever."""
    process = response(loop)
    late = np.unwrap(np.angle(process), axis=0) <= -math.pi
    return 1.0 / np.abs(np.take_along_axis(process, late.argmax(0)[None], 0)[0])


def tuned(loop, lambda_s, leans, random):
    """SIMC (Skogestad 2003); those that lean on the integral have a tenth to half of that gain. Less of both until sane."""
    n = len(loop["lag_s"])
    dead = loop["dead_s"] + 0.5 + loop["lag2_s"] / 2.0
    kp = loop["lag_s"] / (loop["gain"] * (lambda_s + dead))
    ti = np.minimum(loop["lag_s"], 4.0 * (lambda_s + dead))
    level_kp = random.uniform(0.7, 1.4, n) * loop["level_kp"]
    kp = np.where(loop["integrates"], level_kp, kp)
    # Damping 0.7 to 1.4 of a level: kp ti rate = 4 damping^2.
    ti = np.where(loop["integrates"], 4.0 * random.uniform(0.7, 1.4, n) ** 2 / (level_kp * loop["rate"]), ti)
    leans = leans & ~loop["integrates"]
    kp = np.where(leans, kp * random.uniform(0.1, 0.5, n), kp)
    ti = np.where(leans, ti * random.uniform(0.1, 0.5, n), ti)
    ki = kp / ti
    for _ in range(60):
        wild = greatest_sensitivity(loop, kp, ki) > 2.0
        if not wild.any():
            break
        kp, ki = np.where(wild, 0.93 * kp, kp), np.where(wild, 0.88 * ki, ki)
    return kp, ki


def too_tight(loop, kp, ki, random):
    """The same ratio of gain and integral, more of both until the sensitivity is 3 to 8."""
    wanted = random.uniform(3.0, 8.0, len(kp))
    for _ in range(200):
        tame = greatest_sensitivity(loop, kp, ki) < wanted
        if not tame.any():
            break
        kp, ki = np.where(tame, 1.04 * kp, kp), np.where(tame, 1.04 * ki, ki)
    return kp, ki


def draw(kind, n, seed):
    """Parameters of n loops. CO in % of its span, PV in % of its range, s."""
    random = np.random.default_rng([seed, KINDS.index(kind)])
    uniform = lambda low, high: random.uniform(low, high, n)
    spread = lambda low, high: log_uniform(random, low, high, n)
    share = lambda p: random.random(n) < p
    zero = np.zeros(n)
    what = np.full(n, "flow")
    if kind in ("healthy", "tuning"):
        what = random.choice(["flow", "level", "temperature"], n, p=[0.7, 0.15, 0.15])
    elif kind == "limits":
        what = np.full(n, "temperature")
    elif kind in FAULTS:
        what = np.where(share(0.35 if kind == "play" else 0.15), "level", "flow")
    level, slow = what == "level", what == "temperature"

    loop = {"what": what, "gain": spread(0.4, 2.0), "integrates": level}
    loop["lag_s"] = np.where(slow, spread(40, 300), spread(1, 20))
    loop["dead_s"] = np.where(slow, np.round(loop["lag_s"] * uniform(0.1, 0.4)), np.round(uniform(0, 1) * np.minimum(loop["lag_s"], 6))).astype(int)
    loop["lag2_s"] = np.where(slow, loop["lag_s"] * uniform(0.05, 0.3), np.where(share(0.5), uniform(0.3, 3), 0.05))
    # A vessel that full flow fills in 1 to 10 minutes, such as a drum; %/s of level for 1 % of CO.
    loop["rate"] = 1.0 / spread(60, 600)
    loop["level_kp"] = spread(0.7, 4.0)
    # For steam into a cooler or out of a vessel, PV falls when CO rises; flows rise.
    loop["sign"] = np.where(~(what == "flow") & share(0.5), -1.0, 1.0)
    loop["lambda_s"] = spread(0.7, 4.0) * (loop["dead_s"] + 1.0 + 0.3 * loop["lag_s"] + loop["lag2_s"] / 2.0)
    loop["kp"], loop["ki"] = tuned(loop, loop["lambda_s"], share(0.35), random)
    loop["low"], loop["high"], loop["windup"] = zero, zero + 100.0, zero
    loop["at_sp"], loop["at_co"] = uniform(35, 65), uniform(35, 65)
    loop["noise"] = np.where(level | slow, spread(0.02, 0.15), spread(0.03, 0.4))
    loop["band"], loop["jump"], loop["keep_moving"] = zero, zero, np.zeros(n, dtype=bool)

    # Loads, in % of CO that would cancel them.
    per_gain = np.where(level, 1.0, 1.0 / loop["gain"])
    loop["wander"], loop["wander_s"] = spread(0.05, 0.6) * per_gain, spread(100, 2000)
    loop["swing"], loop["period_s"], loop["shape"], loop["irregular"] = zero, zero + 1000.0, np.zeros(n, dtype=int), zero
    loop["swing_lag_s"] = np.where(level, 0.05, np.where(share(0.5), loop["lag_s"], spread(1, 10)))
    loop["sp_moves"] = random.choice(["stands", "steps"], n)
    loop["sp_size"], loop["sp_every_s"] = spread(1, 6), spread(300, 3000)
    loop["sp_swing"] = zero

    if kind == "smooth":
        # Flow is proportional to the root of the pressure drop, so 1 to 8 % of flow is a supply that swings by 2 to 16 %.
        loop["swing"] = spread(0.01, 0.08) * loop["at_sp"] / loop["gain"]
        loop["period_s"], loop["shape"] = spread(30, 3000), np.arange(n) % len(SHAPES)
        loop["irregular"] = np.where(np.arange(n) // len(SHAPES) % 2, uniform(0.05, 0.25), 0.0)
        loop["sp_moves"] = np.full(n, "stands")
    elif kind == "limits":
        loop["kp"] = ultimate_gain(loop) * uniform(1.2, 3.0)
        loop["ki"] = loop["kp"] / (loop["dead_s"] * uniform(2, 8))
        inner = share(0.5)
        loop["low"] = np.where(inner, uniform(5, 30), 0.0)
        loop["high"] = np.where(inner, uniform(70, 95), 100.0)
        loop["windup"] = np.where(share(0.5), uniform(5, 40), 0.0)
        loop["sp_moves"] = np.full(n, "stands")
    elif kind in FAULTS:
        band = uniform(2, 8)
        loop["band"] = band
        if kind == "stiction":
            loop["jump"], loop["keep_moving"] = band * uniform(0.15, 0.9), share(0.5)
        # Other causes move CO only in the order of the band, so that its travel stays in that order too.
        moved = uniform(0.0, 1.2) if kind == "stiction" else np.where(level, uniform(0.0, 0.3), uniform(0.2, 1.4))
        loop["wander"], loop["wander_s"] = uniform(0.02, 0.3) * band, spread(300, 3000)
        loop["sp_moves"] = random.choice(["stands", "stands", "steps", "master"], n) if kind == "stiction" else np.where(
            level, "stands", random.choice(["stands", "steps", "master"], n))
        stands = loop["sp_moves"] == "stands"
        loop["swing"] = np.where(stands, moved * band, 0.0)
        loop["period_s"] = np.maximum(spread(100, 4000), 8.0 * loop["lambda_s"])
        loop["irregular"] = uniform(0.05, 0.3)
        loop["sp_size"] = np.where(stands, 0.0, moved * band * loop["gain"])
        loop["sp_every_s"] = spread(200, 1500)
    elif kind == "master":
        loop["sp_moves"], loop["sp_size"], loop["sp_every_s"] = np.full(n, "master"), spread(0.5, 6), spread(60, 2000)
        loop["sp_swing"] = np.where(share(0.4), spread(0.5, 6), 0.0)
        loop["period_s"], loop["irregular"] = spread(100, 3000), np.where(share(0.5), uniform(0.05, 0.25), 0.0)
    elif kind == "tuning":
        loop["kp"], loop["ki"] = too_tight(loop, loop["kp"], loop["ki"], random)

    # In practice PV is filtered until noise no longer shakes the valve; with too high a gain the noise moves it.
    loop["noise"] = np.minimum(loop["noise"], (2.0 if kind == "limits" else 0.3) / loop["kp"])
    loop["co_step"] = np.where(share(0.5), 0.01, spread(0.05, 1.0))
    if kind == "smooth":  # CO is logged finely enough to show the swing
        loop["co_step"] = np.minimum(loop["co_step"], loop["swing"] / 4.0)
    loop["pv_step"] = np.where(share(0.5), 0.001, spread(0.01, 0.3))
    loop["phase"] = random.random(n)
    loop["wave"] = np.arange(n)  # loops with one number share phase and amplitude of their swing
    return loop


def wave(shape, turns):
    p = np.mod(turns, 1.0)
    return np.where(shape == 0, np.sin(2 * np.pi * p), np.where(shape == 1, 4 * np.abs(p - 0.5) - 1, 2 * p - 1))


def simulate(loop, seed, samples=SAMPLES):
    """SP, PV and CO as logged, a row a second and a column a loop."""
    random = np.random.default_rng([seed, 77])
    n = len(loop["gain"])
    keeps = lambda time_s: np.exp(-1.0 / np.maximum(time_s, 0.05))
    kept, kept2, swing_kept = keeps(loop["lag_s"]), keeps(loop["lag2_s"]), keeps(loop["swing_lag_s"])
    wander_kept, sp_kept, wave_kept = keeps(loop["wander_s"]), keeps(loop["sp_every_s"]), keeps(1.5 * loop["period_s"])
    stir = lambda kept_part, size: size * np.sqrt(1.0 - kept_part**2)
    wander_stir, sp_stir, wave_stir = stir(wander_kept, loop["wander"]), stir(sp_kept, loop["sp_size"]), stir(wave_kept, loop["irregular"])
    steps, master = loop["sp_moves"] == "steps", loop["sp_moves"] == "master"
    kp, ki = loop["sign"] * loop["kp"], loop["sign"] * loop["ki"]
    gain, rate = loop["sign"] * loop["gain"], loop["sign"] * loop["rate"]
    low, high = loop["low"], loop["high"]

    co, integral = loop["at_co"].copy(), loop["at_co"].copy()
    valves = Valves(loop["band"], loop["jump"], loop["keep_moving"], loop["at_co"])
    line = np.tile(loop["at_co"], (int(loop["dead_s"].max()) + 1, 1))
    columns = np.arange(n)
    x, filtered, swung, wander, wanted, sp_off, faster, larger = (np.zeros(n) for _ in range(8))
    turns = loop["phase"].copy()
    records = np.zeros((3, samples, n), dtype=np.float32)
    for k in range(-WARM_UP, samples):
        z = random.standard_normal((5, n))
        # A swing of one header is the same for each of its loops.
        faster = wave_kept * faster + wave_stir * z[0, loop["wave"]]
        larger = wave_kept * larger + 2.0 * wave_stir * z[1, loop["wave"]]
        turns += np.exp(faster) / loop["period_s"]
        form = np.exp(larger) * wave(loop["shape"], turns)
        wander = wander_kept * wander + wander_stir * z[2]
        swung = swing_kept * swung + (1.0 - swing_kept) * (loop["swing"] * form + wander)
        stepped = steps & (random.random(n) < 1.0 / loop["sp_every_s"])
        # The request of a master wanders; its own filter makes it smooth.
        wanted = sp_kept * wanted + sp_stir * z[3]
        sp_off = np.where(stepped, loop["sp_size"] * random.uniform(-1, 1, n), np.where(master, sp_off + 0.1 * (wanted - sp_off), sp_off))
        sp = loop["at_sp"] + sp_off + loop["sp_swing"] * form

        line[k % len(line)] = valves.step(np.clip(co, low, high))
        stem = line[(k - loop["dead_s"]) % len(line), columns] - loop["at_co"]
        x = np.where(loop["integrates"], x + rate * (stem + swung), kept * x + (1.0 - kept) * gain * stem)
        filtered = kept2 * filtered + (1.0 - kept2) * (x + np.where(loop["integrates"], 0.0, gain * swung))
        pv = np.clip(loop["at_sp"] + filtered + loop["noise"] * z[4], 0.0, 100.0)
        error = sp - pv
        integral = np.clip(integral + ki * error, low - loop["windup"], high + loop["windup"])
        co = np.clip(integral + kp * error, low, high)
        if k >= 0:
            records[0, k], records[1, k], records[2, k] = sp, pv, co
    records[1] = np.round(records[1] / loop["pv_step"]) * loop["pv_step"]
    records[2] = np.round(records[2] / loop["co_step"]) * loop["co_step"]
    return records


def travel_in_bands(co, band):
    """Median of CO's travel between its reversals of at least half a band, in bands; 0 without reversals."""
    travels, turn, end, way = [], None, co[0], 0
    for c in co.tolist():
        if (c - end) * way > 0:
            end = c
        elif abs(c - end) > band / 2.0:
            if turn is not None:
                travels.append(abs(end - turn))
            turn, end, way = end if way else None, c, 1 if c > end else -1
    return float(np.median(travels)) / band if travels else 0.0


TAGS = {"flow": "FIC", "level": "LIC", "temperature": "TIC"}


def truths_of(kind, loop, records, first, tags):
    """Returns the true cause for each loop, with the name of its file."""
    truths = []
    for i, what in enumerate(loop["what"]):
        number = first + i
        truth = {"kind": kind, "file": f"{TAGS[what] if tags else kind}{number:04d}.csv", "what": str(what)}
        if kind == "smooth":
            truth |= {"shape": SHAPES[loop["shape"][i]], "irregular": bool(loop["irregular"][i] > 0), "period_s": float(loop["period_s"][i])}
        if kind in FAULTS:
            band = float(loop["band"][i])
            truth |= {"band": band, "jump": float(loop["jump"][i]), "steps_a_band": band / float(loop["co_step"][i]),
                      "travel_bands": travel_in_bands(records[2, :, i], band)}
            truth["in_aim"] = TRAVEL_BANDS[0] <= truth["travel_bands"] <= TRAVEL_BANDS[1] and truth["steps_a_band"] >= STEPS_A_BAND
        truths.append(truth)
    return truths


def write(folder, truths, loop, records):
    """Removes SP from every other loop with a constant set point."""
    rows = np.empty((records.shape[1], 4))
    rows[:, 0] = np.arange(records.shape[1])
    for i, truth in enumerate(truths):
        rows[:, 1:] = records[:, :, i].T
        no_sp = i % 2 == 0 and loop["sp_moves"][i] == "stands" and not loop["sp_swing"][i]
        kept = rows[:, [0, 2, 3]] if no_sp else rows
        form = "%d" + ",%.3f" * (kept.shape[1] - 1) + "\n"
        header = "time,pv,co\n" if no_sp else "time,sp,pv,co\n"
        (folder / truth["file"]).write_text(header + (form * len(kept)) % tuple(kept.ravel().tolist()))


def say(text):
    print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)


def generated(folder, kind, count, seed, tags, first=0):
    """`count` loops that the aim is about, with as many of those outside as were met on the way."""
    kept, inside = [], 0
    for batch in range(5):
        say(f"{kind}: {count} loops, seed {seed}, batch {batch}")
        loop = draw(kind, count, seed + 1000 * batch)
        records = simulate(loop, seed + 1000 * batch)
        truths = truths_of(kind, loop, records, first + len(kept), tags)
        within = np.cumsum([t.get("in_aim", True) for t in truths])
        wanted = count - inside
        taken = truths[: int(np.searchsorted(within, wanted)) + 1]
        write(folder, taken, loop, records)
        kept += taken
        inside += int(within[len(taken) - 1])
        if inside == count:
            break
    return kept


def ran(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if not done.stdout:
        sys.exit(f"plant_loops: {' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    return json.loads(done.stdout)


def answer_of(told):
    effects = told["effects"] or []
    return {"verdict": told["verdict"], "grade": told["grade"], "cause": told["cause"], "probability": told["probability"],
            "first": effects[0]["name"] if effects else None, "alternatives": effects[0]["alternatives"] if effects else []}


def diagnosed(program, folder, truths, jobs):
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for truth, told in zip(truths, pool.map(lambda t: ran(program, "diagnose", folder / t["file"], "--json"), truths)):
            truth["answer"] = answer_of(told)


def surveyed(program, folder, jobs, *options):
    """Answers by file, in the order of rank."""
    with tempfile.TemporaryDirectory() as out:
        told = ran(program, "survey", folder, "--out", out, "--jobs", jobs, "--json", *options)
    if told["failed"]:
        sys.exit(f"plant_loops: survey could not read {told['failed'][:3]}")
    return {pathlib.Path(t["files"]).name: answer_of(t) for t in sorted(told["loops"], key=lambda t: t["rank"])}


ANSWERS = {
    "seen": lambda a: a["grade"] == "seen",
    "either grade": lambda a: a["verdict"] == "valve_effect",
    "stiction first": lambda a: a["first"] == "stiction",
    "backlash first": lambda a: a["first"] == "backlash",
    "cant_tell": lambda a: a["verdict"] == "cant_tell",
    "other_cause": lambda a: a["verdict"] == "other_cause",
    "healthy": lambda a: a["verdict"] == "healthy",
}


def shares(truths):
    counted = {name: sum(is_it(t["answer"]) for t in truths) for name, is_it in ANSWERS.items()}
    return {"loops": len(truths)} | {name: {"count": k, "share": wilson(k, len(truths))} for name, k in counted.items()}


def groups_of(kind, truths):
    """(name, loops) of a kind: all, then its parts."""
    if kind in FAULTS:
        aim = [t for t in truths if t["in_aim"]]
        yield f"{kind}, in the aim", aim
        for what in ("flow", "level"):
            yield f"  {what}", [t for t in aim if t["what"] == what]
        for low, high in ((2, 4), (4, 8)):
            yield f"  {low} to {high} %", [t for t in aim if low <= t["band"] < high]
        yield f"{kind}, outside", [t for t in truths if not t["in_aim"]]
        return
    yield kind, truths
    if kind == "smooth":
        for shape in SHAPES:
            for irregular in (False, True):
                yield f"  {shape}, {'ir' if irregular else ''}regular", [t for t in truths if t["shape"] == shape and t["irregular"] == irregular]
    elif kind in ("healthy", "tuning"):
        for what in TAGS:
            yield f"  {what}", [t for t in truths if t["what"] == what]


def percent(counted):
    p, low, high = (100.0 * v for v in counted["share"])
    return f"{counted['count']} = {p:.0f} ({low:.0f} to {high:.0f})"


def print_kind(kind, truths):
    if kind in FAULTS:
        aim = [t for t in truths if t["in_aim"]]
        quarters = lambda key: " ".join(f"{v:.2g}" for v in np.percentile([t[key] for t in aim], [5, 50, 95])) if aim else "-"
        print(f"\n{kind}: {len(aim)} of {len(truths)} drawn are in the aim; travel {quarters('travel_bands')} bands, "
              f"{quarters('steps_a_band')} steps of CO a band (5, 50, 95 %)")
    for name, loops in groups_of(kind, truths):
        if loops:
            told = shares(loops)
            print(f"{name:<24}{len(loops):>5}" + "".join(f"{percent(told[a]):>22}" for a in ANSWERS))


def kinds_study(options, folder):
    result = {}
    print(f"{'% of the loops':<24}{'loops':>5}" + "".join(f"{name:>22}" for name in ANSWERS))
    for kind in options.only:
        own = folder / kind
        own.mkdir(exist_ok=True)
        truths = generated(own, kind, options.loops or LOOPS.get(kind, 100), options.seed, options.tags)
        say(f"{kind}: {options.by}")
        if options.by == "diagnose":
            diagnosed(options.bin, own, truths, options.jobs)
        else:
            told = surveyed(options.bin, own, options.jobs)
            for truth in truths:
                truth["answer"] = told[truth["file"]]
        print_kind(kind, truths)
        sys.stdout.flush()
        result[kind] = {"groups": {name.strip(): shares(loops) for name, loops in groups_of(kind, truths) if loops}, "loops": truths}
        for path in own.iterdir():
            path.unlink()
    return result


RUNGS = {"seen": 3, "likely": 2, "cant_tell": 1}


def rung(answer):
    return RUNGS.get(answer["grade"] or answer["verdict"], 0)


def contradicts(answers):
    """A valve effect with one window and no effect with another. `can't tell` contradicts neither."""
    verdicts = {a["verdict"] for a in answers}
    return "valve_effect" in verdicts and bool(verdicts & {"other_cause", "healthy"})


def windows_study(options, folder):
    hours = ("1", "2", "4", "8")
    count = options.loops or 20
    truths = []
    for kind in options.only:
        truths += generated(folder, kind, count, options.seed, options.tags, len(truths))
    told = {}
    for hour in hours:
        say(f"survey --window {hour} of {len(truths)} loops")
        told[hour] = surveyed(options.bin, folder, options.jobs, "--window", hour)
    for truth in truths:
        truth["answers"] = {hour: told[hour][truth["file"]] for hour in hours}
    print(f"{'survey --window 1, 2, 4, 8':<28}{'loops':>5}{'effect and none':>22}{'grades 2 steps apart':>24}")
    result = {"kinds": {}, "loops": truths}
    for kind in ("all", *options.only):
        of = [t for t in truths if kind in ("all", t["kind"])]
        against = sum(contradicts(t["answers"].values()) for t in of)
        apart = sum(np.ptp([rung(a) for a in t["answers"].values()]) > 1 for t in of)
        row = {name: {"count": int(k), "share": wilson(int(k), len(of))} for name, k in (("contradicts", against), ("apart", apart))}
        result["kinds"][kind] = row | {"loops": len(of)}
        print(f"{kind:<28}{len(of):>5}{percent(row['contradicts']):>22}{percent(row['apart']):>24}")
    return result


def plant(folder, seed, scale):
    """One plant; its tags are numbered at random, so that the order of names doesn't reveal faulty valves."""
    random = np.random.default_rng([seed, 4])
    counts = {kind: max(1, round(count * scale)) for kind, count in PLANT.items()}
    numbers = iter(random.permutation(sum(counts.values())))
    all_truths = []
    for kind, count in counts.items():
        loop = draw(kind, count, seed)
        if kind == "smooth":
            loop["wave"] = np.arange(count) // A_HEADER * A_HEADER
            for key in ("period_s", "shape", "irregular", "phase"):
                loop[key] = loop[key][loop["wave"]]
        records = simulate(loop, seed)
        truths = truths_of(kind, loop, records, 0, True)
        for truth in truths:
            truth["file"] = f"{TAGS[truth['what']]}{1000 + next(numbers)}.csv"
        write(folder, truths, loop, records)
        all_truths += truths
    return {t["file"]: t for t in all_truths}


def is_right(truth, answer):
    wanted = EFFECT.get(truth["kind"])
    return wanted is not None and wanted in [answer["first"], *answer["alternatives"]]


def plants_study(options, folder):
    result = {"plants": []}
    wrong = collections.Counter()
    right = sick = listed = 0
    print(f"{'plant':<12}{'right of first ten':>22}{'sick of first ten':>22}  others")
    for number in range(options.plants):
        seed = options.seed + 100000 * (number + 1)
        own = folder / f"plant{number}"
        own.mkdir()
        say(f"plant {number + 1} of {options.plants}, seed {seed}")
        truths = plant(own, seed, (options.loops or 200) / 200.0)
        say(f"survey of {len(truths)} loops")
        told = surveyed(options.bin, own, options.jobs)
        for path in own.iterdir():
            path.unlink()
        first = list(told.items())[:FIRST]
        row = {"seed": seed, "first": [truths[name] | {"answer": answer} for name, answer in first]}
        row["right"] = sum(is_right(truths[name], answer) for name, answer in first)
        row["sick"] = sum(truths[name]["kind"] in FAULTS for name, _ in first)
        here = collections.Counter(f"{truths[n]['kind']}: {a['first'] or a['cause'] or a['verdict']}" for n, a in first if not is_right(truths[n], a))
        wrong += here
        right, sick, listed = right + row["right"], sick + row["sick"], listed + len(first)
        result["plants"].append(row)
        print(f"{number + 1:<12}{row['right']:>22}{row['sick']:>22}  {dict(here)}", flush=True)
    result |= {name: {"count": k, "share": wilson(k, listed)} for name, k in (("right", right), ("sick", sick))}
    result["wrong"] = dict(wrong)
    print(f"{'all, %':<12}{percent(result['right']):>22}{percent(result['sick']):>22}  {dict(wrong)}")
    return result


def save(options):
    options.save.mkdir(parents=True, exist_ok=True)
    truths = []
    for kind in options.only:
        truths += generated(options.save, kind, options.loops or LOOPS.get(kind, 100), options.seed, options.tags, len(truths))
    names = list(dict.fromkeys(name for truth in truths for name in truth))
    with open(options.save / "truth.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(truths)


def play_cycle(kp_ti_rate):
    """(CO's amplitude over half the band, period over ti) of a level under PI with backlash, by describing function."""
    x = np.linspace(1.001, 20.0, 20000)  # amplitude over half the band
    s = 1.0 - 2.0 / x
    real = (np.pi / 2 + np.arcsin(s) + s * np.sqrt(1 - s * s)) / np.pi
    imaginary = -4.0 / (np.pi * x) * (1.0 - 1.0 / x)
    w_ti = np.tan(-np.angle(real + 1j * imaginary))
    at = np.argmin(np.abs(w_ti**2 / np.sqrt(1 + w_ti**2) / np.hypot(real, imaginary) - kp_ti_rate))
    return float(x[at]), 2.0 * math.pi / float(w_ti[at])


def crossings(x):
    x = x - (x.max() + x.min()) / 2.0
    return np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))


def check():
    """The valve's operator, the tuning and the loops against what textbooks say of them."""
    good = True

    def holds(what, value, low, high):
        nonlocal good
        good = good and low <= value <= high
        print(f"{what:<72}{value:>9.3f}  {low:g} to {high:g}{'' if low <= value <= high else '  WRONG'}")

    # Up by 10 and down again in steps of 0.01, turned just after the stem moved.
    cases = [("ideal valve", 0.0, 0.0, False), ("play 4", 4.0, 0.0, False), ("stiction 4, jump 1.5, rests", 4.0, 1.5, False),
             ("stiction 4, jump 1.5, moves on", 4.0, 1.5, True)]
    for name, band, jump, keep_moving in cases:
        valve = Valves(*(np.array([v]) for v in (band, jump, keep_moving)), np.zeros(1))
        position = lambda u: float(valve.step(np.array([u]))[0])
        up = [position(0.01 * k) for k in range(1000)]
        top = 1000
        while position(0.01 * top) - up[-1] < 1e-9:
            top += 1
        at = float(valve.stem[0])
        down = [position(0.01 * (top - k)) for k in range(1, 1000)]
        moves = -np.diff([at, *down])
        first = int(np.argmax(moves > 1e-9))
        holds(f"{name}: signal reverses by this much before the stem does", 0.01 * (first + 1), band - 0.001, band + 0.021)
        holds(f"{name}: the stem's first move back", moves[first], max(jump, 0.001) - 0.001, jump + 0.021)
        often = 0.01 if jump and not keep_moving else 1.0
        holds(f"{name}: share of samples that move the stem after that", np.mean(moves[first + 1 :] > 1e-9), often - 0.01, often)
    triangle = np.concatenate([np.linspace(0, 10, 1001), np.linspace(10, -10, 2001), np.linspace(-10, 10, 2001), np.linspace(10, -10, 2001)])
    holds("travel of a triangle of +-10, in bands of 4", travel_in_bands(triangle, 4.0), 4.99, 5.01)

    one = lambda **more: {key: np.array([value]) for key, value in ({"lag_s": 100.0, "lag2_s": 0.05, "dead_s": 50, "gain": 1.0,
                                                                     "integrates": False, "rate": 0.0} | more).items()}
    # Skogestad 2003: 1.59 where lambda is the dead time.
    # First order: the gain is lag w over the process's where w dead + atan(w lag) is pi; half a sample is dead, too.
    w = next(w for w in np.arange(0.02, 0.06, 1e-5) if w * 50.5 + math.atan(100.0 * w) >= math.pi)
    holds("ultimate gain over the continuous one's", ultimate_gain(one())[0] / math.hypot(1.0, 100.0 * w), 0.97, 1.03)
    holds("greatest sensitivity of SIMC", greatest_sensitivity(one(), np.array([1.0]), np.array([0.01]))[0], 1.56, 1.64)
    for kind in KINDS:
        loop = draw(kind, 100, 1)
        sensitivity = greatest_sensitivity(loop, loop["kp"], loop["ki"])
        if kind == "tuning":
            holds("tuning: least of greatest sensitivities", sensitivity.min(), 2.9, 8)
        if kind != "limits":
            holds(f"{kind}: greatest sensitivity", sensitivity.max(), 1, 10 if kind == "tuning" else 2.02)

    def quiet(kind, **more):
        loop = draw(kind, 20, 1)
        for key in ("wander", "swing", "sp_swing", "sp_size", "irregular"):
            loop[key] = np.zeros(20)
        return loop | {"noise": np.full(20, 1e-6), "co_step": np.full(20, 1e-6), "pv_step": np.full(20, 1e-6)} | more

    # Levels: damping from 0.7 to 1.4, no dead time.
    loop = quiet("play", integrates=np.ones(20, dtype=bool), dead_s=np.zeros(20, dtype=int), lag2_s=np.full(20, 0.05),
                 band=np.full(20, 4.0), rate=np.full(20, 0.01), kp=np.full(20, 1.0))
    c = np.linspace(2.0, 8.0, 20)
    loop["ki"] = loop["kp"] ** 2 * loop["rate"] / c
    loop["at_co"] = loop["at_co"] + 0.0
    records = simulate(loop | {"at_sp": loop["at_sp"], "wander": np.full(20, 0.05)}, 1, 12000)
    for i in (0, 19):
        amplitude, period = play_cycle(c[i])
        co = records[2, 4000:, i]
        ups = crossings(co)
        holds(f"level with backlash, kp ti rate {c[i]:g}: amplitude over that by describing function",
              np.median([np.ptp(co[a:b]) for a, b in zip(ups, ups[1:])]) / 4.0 / amplitude, 0.8, 1.25)
        holds(f"level with backlash, kp ti rate {c[i]:g}: period over that by describing function",
              np.median(np.diff(ups)) / (period * loop["kp"][i] / loop["ki"][i]), 0.8, 1.25)

    loop = quiet("stiction", keep_moving=np.zeros(20, dtype=bool), wander=np.full(20, 0.05))
    flows = loop["what"] == "flow"
    records = simulate(loop, 1, 8000)
    travel = np.array([travel_in_bands(records[2, :, i], loop["band"][i]) for i in range(20)])
    holds("only stiction, flow: median travel of CO, bands", np.median(travel[flows]), 1.0, 1.6)
    still = quiet("stiction", band=np.zeros(20), jump=np.zeros(20))
    holds("the same without: greatest range of CO", np.ptp(simulate(still, 1, 8000)[2], axis=0).max(), 0, 0.01)
    loop = draw("limits", 20, 1)
    co = simulate(loop, 1, 8000)[2]
    lowest, highest = co.min(0) < loop["low"] + 1, co.max(0) > loop["high"] - 1
    holds("limits: share of loops that reach one", np.mean(lowest | highest), 1, 1)
    holds("limits: share of loops that reach both", np.mean(lowest & highest), 0.7, 1)
    holds("Wilson, 8 of 10: low end", wilson(8, 10)[1], 0.489, 0.491)
    holds("Wilson, 8 of 10: high end", wilson(8, 10)[2], 0.942, 0.944)
    return 0 if good else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin/loopwarden", help="the program loopwarden")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND", help="of the kinds above")
    parser.add_argument("--loops", type=int, help="of each kind, or of a plant; default 100 (smooth 200), --windows 20, a plant 200")
    parser.add_argument("--seed", type=int, default=1, help="default 1, for development")
    parser.add_argument("--by", choices=("diagnose", "survey"), default="diagnose", help="who judges the kinds; survey sees all of a kind")
    parser.add_argument("--without-tags", dest="tags", action="store_false", help="file names that don't reveal the controlled variable")
    parser.add_argument("--windows", action="store_true", help="survey with four windows instead")
    parser.add_argument("--plants", type=int, default=0, help="so many plants instead")
    parser.add_argument("--save", type=pathlib.Path, help="write the records here instead")
    parser.add_argument("--check", action="store_true", help="the generator against textbooks")
    parser.add_argument("--json", type=pathlib.Path, help="write all answers here")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    if options.check:
        return check()
    if options.save:
        save(options)
        return 0
    options.bin = options.bin.resolve()
    if not options.bin.exists():
        parser.error(f"--bin: there is no {options.bin}")
    with tempfile.TemporaryDirectory(prefix="plant_loops.") as folder:
        study = plants_study if options.plants else windows_study if options.windows else kinds_study
        result = study(options, pathlib.Path(folder))
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
