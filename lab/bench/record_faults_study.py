#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Other faults of records: spikes, a stuck transmitter, missing samples, clipping, another sample time, CO logged
before its limit or a sample or two late. Tested on a loop that matches its model, and on one whose valve sticks.

Usage: lab/bench/record_faults_study.py [--count N] [--seed S] [--programs build/release/bin]

Prints the answer of `gap` for each. Wrong: a name with confidence 0.9 or more that is neither an effect in the loop nor the fault of
the record.
"""
import argparse
import csv
import json
import math
import pathlib
import random
import subprocess
import tempfile
from collections import Counter

ROOT = pathlib.Path(__file__).resolve().parents[2]

MODEL = """sample_time: 1.0
controller: {{kp: {kp}, ki: {ki}, output: [0, {high}]}}
valve:
  effects: [{valve}]
process: {{gain: {gain}, time_constant: {tau}, dead_time: {dead}}}
transmitter: {{range: [0, 40], resolution: 0.001, noise: 0.04}}
{rest}"""


def read(path):
    with open(path, newline='') as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) if row[name] else math.nan for row in rows] for name in ('time', 'pv', 'co', 'sp')}


def write(path, record):
    with open(path, 'w') as file:
        file.write('time,pv,co,sp\n')
        for row in zip(*(record[n] for n in ('time', 'pv', 'co', 'sp'))):
            file.write(','.join(f'{v:.7g}' if math.isfinite(v) else '' for v in row) + '\n')


def changed(record, **columns):
    return {**record, **columns}


def spikes(r, rng):
    return changed(r, pv=[v + rng.choice((-1, 1)) * rng.uniform(4, 12) if rng.random() < 0.004 else v for v in r['pv']])


def stuck(r, rng):
    pv = list(r['pv'])
    for at in rng.sample(range(100, len(pv) - 100), 4):
        pv[at:at + 20] = [pv[at]] * 20
    return changed(r, pv=pv)


def missing(r, rng):
    return changed(r, pv=[math.nan if rng.random() < 0.02 else v for v in r['pv']])


def clipped(r, _):
    high = sorted(r['pv'])[int(0.9 * len(r['pv']))]
    return changed(r, pv=[min(v, high) for v in r['pv']])


def slower(r, _):
    return {name: values[::2] for name, values in r.items()}


def late(samples):
    def delay(r, _):
        return changed(r, co=[r['co'][0]] * samples + r['co'][:-samples])
    return delay


def early(r, _):
    return changed(r, co=r['co'][1:] + [r['co'][-1]])


# The controller's request while its limit held it.
def before_the_limit(r, _):
    high = max(r['co'])
    return changed(r, co=[u + (0.8 * max(0.0, w - y) if u >= high - 1e-6 else 0.0) for u, w, y in zip(r['co'], r['sp'], r['pv'])])


CASES = {'as it was': (lambda r, _: r, set()), 'spikes': (spikes, set()), 'stuck for 20 s': (stuck, {'held_measurement'}),
         '2 % missing': (missing, set()), 'clipped': (clipped, {'clipped_measurement'}), 'every other sample': (slower, set()),
         'CO a sample late': (late(1), set()), 'CO two samples late': (late(2), set()),
         'CO a sample early': (early, {'extra_dead_time'}), 'at a limit, as it was': (lambda r, _: r, set()),
         'CO before its limit': (before_the_limit, set())}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--count', type=int, default=4)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--programs', type=pathlib.Path, default=ROOT / 'build/release/bin')
    options = parser.parse_args()
    program = options.programs.resolve() / 'loopwarden'
    wrong, all_runs = 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        said = {}
        for number in range(options.count):
            rng = random.Random(options.seed * 1000 + number)
            loop = {'kp': round(rng.uniform(0.5, 1.0), 3), 'ki': round(rng.uniform(0.06, 0.12), 4), 'gain': round(rng.uniform(0.3, 0.45), 3),
                    'tau': round(rng.uniform(3, 6), 2), 'dead': round(rng.uniform(1.5, 3), 2)}
            moves = ', '.join(f'[{t}, {round(rng.uniform(14, 24), 1)}]' for t in range(0, 1500, 250))
            rest = ('disturbances:\n  - {effect: random_load, intensity: 0.02, time_constant: 200}\n'
                    f'scenario: {{duration: 1500, set_point: [{moves}], seed: {options.seed * 1000 + number}}}\n')
            for state, valve in (('healthy', ''), ('sticky', '{effect: stiction, s: 5, j: 2}')):
                truth, plain, path, model = (folder / n for n in ('truth.yaml', 'plain.csv', 'r.csv', 'model.yaml'))
                for case, (change, allowed) in CASES.items():
                    # Low enough to hold CO for a part of the record.
                    high = round(20.5 / loop['gain'], 1) if 'limit' in case else 100
                    model.write_text(MODEL.format(valve='', rest='', high=high, **loop))
                    truth.write_text(MODEL.format(valve=valve, rest=rest, high=high, **loop))
                    subprocess.run([program, 'simulate', truth, '--out', plain], check=True, capture_output=True)
                    record = read(plain)
                    write(path, change(record, rng))
                    # As the refusal of such a record recommends.
                    more = ['--clip-co'] if 'before' in case else []
                    ran = subprocess.run([program, 'gap', path, '--model', model, '--out', folder / 'out', '--json', *more],
                                         capture_output=True, text=True, check=False)
                    all_runs += 1
                    if not ran.stdout:
                        said.setdefault((state, case), Counter())['refused'] += 1
                        continue
                    result = json.loads(ran.stdout)
                    right = allowed | ({'stiction', 'backlash'} if valve else set())
                    names = [f"{e['name']} {e['confidence']:.2f}" for e in result['effects']]
                    if 'CO was logged' in result['sentence']:
                        names.insert(0, 'LOGGER')
                    bad = [e['name'] for e in result['effects'] if e['confidence'] >= 0.9 and e['name'] not in right]
                    wrong += bool(bad)
                    said.setdefault((state, case), Counter())[((', '.join(names) or '-') if result['effects'] else ' '.join([*names, result['verdict']])) + (' WRONG' if bad else '')] += 1
        for (state, case), counter in said.items():
            print(f'{state:<8} {case:<22}' + '; '.join(f'{n} x {text}' for text, n in counter.most_common()))
    print(f'wrong at 0.9 or more: {wrong} of {all_runs}')


if __name__ == '__main__':
    main()
