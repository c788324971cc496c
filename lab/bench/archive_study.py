#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The effect of an archive on verdicts: records thinned by its two rules, filled again like a historian, then judged.

Usage: lab/bench/archive_study.py [--programs build/release/bin] [--cases DIR | --loops N]

1. The labelled windows of ten real loops (examples/routine), at several deviations (% of the CO span; PV: of four times the
   range from 2 to 98 %).
2. A simulated loop at 1 s, healthy and sticky (s 5, j 2): `gap` and `diagnose` on each kind of file.
With --loops: N such loops, each with another noise and load, judged by `diagnose`.
The thinning follows only the rules' description and shares no code with its detection.
"""
import argparse
import bisect
import csv
import json
import math
import pathlib
import re
import subprocess
import tempfile
from collections import Counter

ROOT = pathlib.Path(__file__).resolve().parents[2]

MODEL = """sample_time: 1.0
controller: {{kp: 1.0, ki: 0.12, output: [0, 100]}}
valve:
  effects: [{valve}]
process: {{gain: 0.36, time_constant: 4.0, dead_time: 2.0}}
transmitter: {{range: [0, 40], resolution: 0.001, noise: 0.04}}
{load}"""
LOAD = """disturbances:
  - {effect: random_load, intensity: 0.02, time_constant: 200}
scenario: {duration: 3600, set_point: [[0, 18], [600, 20], [1300, 17], [2000, 19], [2800, 21]], seed: 5}
"""


def read(path):
    with open(path, newline='') as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) if row[name] else math.nan for row in rows] for name in rows[0] if name != 'mode'}


def door(x, deviation):
    kept, low, high = [0], -math.inf, math.inf
    for k in range(1, len(x)):
        slope = (x[k] - x[kept[-1]]) / (k - kept[-1])
        if not low <= slope <= high:
            kept.append(k - 1)
            low, high = x[k] - deviation - x[k - 1], x[k] + deviation - x[k - 1]
        else:
            run = k - kept[-1]
            low = max(low, (x[k] - deviation - x[kept[-1]]) / run)
            high = min(high, (x[k] + deviation - x[kept[-1]]) / run)
    return kept + ([len(x) - 1] if kept[-1] != len(x) - 1 else [])


def exception(x, band):
    kept = [0]
    for k in range(1, len(x)):
        if abs(x[k] - x[kept[-1]]) > band:
            kept.append(k)
    return kept


def held(x, kept):
    return [x[kept[bisect.bisect_right(kept, k) - 1]] for k in range(len(x))]


def lines(x, kept):
    out = list(x)
    for a, b in zip(kept, kept[1:]):
        for k in range(a, b):
            out[k] = x[a] + (x[b] - x[a]) * (k - a) / (b - a)
    return out


KINDS = {'swinging door, lines': (door, lines), 'swinging door, held': (door, held), 'exception, held': (exception, held)}


def thinned(record, kind, pv, co):
    keep, fill = KINDS[kind]
    out = dict(record)
    out['pv'] = fill(record['pv'], keep(record['pv'], pv))
    out['co'] = fill(record['co'], keep(record['co'], co))
    return out


def write(path, record):
    names = [n for n in ('time', 'pv', 'co', 'sp') if n in record]
    with open(path, 'w') as file:
        file.write(','.join(names) + '\n')
        for row in zip(*(record[n] for n in names)):
            file.write(','.join(f'{v:.7g}' if math.isfinite(v) else '' for v in row) + '\n')


def answer(command):
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    return json.loads(ran.stdout) if ran.stdout else {'verdict': 'refused', 'why': ran.stderr.strip()}


def real_loops(programs, folder):
    with open(ROOT / 'examples/routine/labels.csv', newline='') as file:
        labels = {row['file']: row['sticky'] == '1' for row in csv.DictReader(file)}
    print('Real loops (examples/routine), verdicts of diagnose; recognised as compressed\n')
    print(f"{'rule':<22}{'%':>5}  {'sticky loops':<62}{'others':<70}known")
    sums = {True: Counter(), False: Counter()}
    for kind in ('swinging door, lines', 'exception, held'):
        for percent in (0.2, 0.5, 1.0, 2.0):
            counts = {True: Counter(), False: Counter()}
            known = 0
            for name, sticky in labels.items():
                record = read(ROOT / 'examples/routine' / name)
                rows = [k for k in range(len(record['pv'])) if math.isfinite(record['pv'][k]) and math.isfinite(record['co'][k])]
                record = {n: [v[k] for k in rows] for n, v in record.items()}
                order = sorted(record['pv'])
                span = 4.0 * (order[int(0.98 * (len(order) - 1))] - order[int(0.02 * (len(order) - 1))])
                period = record['time'][1] - record['time'][0]
                record['time'] = [period * k for k in range(len(rows))]
                path = folder / 'r.csv'
                write(path, thinned(record, kind, percent / 100.0 * span, percent))
                told = answer([programs / 'loopwarden', 'diagnose', path, '--json'])
                counts[sticky][told['verdict']] += 1
                known += told.get('import', {}).get('compression', {}).get('kind', 'none') != 'none'
            for sticky, count in counts.items():
                sums[sticky].update(count)
            text = {s: ', '.join(f'{n} {v}' for v, n in sorted(c.items())) for s, c in counts.items()}
            print(f'{kind:<22}{percent:>5}  {text[True]:<62}{text[False]:<70}{known}/{len(labels)}')
    print(f"\nsticky: {dict(sums[True])}\nothers: {dict(sums[False])}\n")


def simulated(programs, folder):
    print('Simulated loop, archive of 0.5 %\n')
    model = folder / 'model.yaml'
    model.write_text(MODEL.format(valve='', load=''))
    for name, valve in (('healthy', ''), ('sticky', '{effect: stiction, s: 5, j: 2}')):
        truth = folder / 'truth.yaml'
        truth.write_text(MODEL.format(valve=valve, load=LOAD))
        plain = folder / 'plain.csv'
        subprocess.run([programs / 'loopwarden', 'simulate', truth, '--out', plain], check=True, capture_output=True)
        record = read(plain)
        for kind in ('plain', *KINDS):
            path = folder / 'r.csv'
            write(path, record if kind == 'plain' else thinned(record, kind, 0.2, 0.5))
            told = answer([programs / 'loopwarden', 'diagnose', path, '--json'])
            gap = answer([programs / 'loopwarden', 'gap', path, '--model', model, '--out', folder / 'gap', '--json'])
            effects = ', '.join(f"{e['name']} {e['confidence']:.2f} " +
                                ' '.join(f'{k} {v:.3g}' for k, v in e['parameters'].items() if k in ('s', 'j'))
                                for e in gap.get('effects', []))
            sees = told.get('import', {}).get('sees_from_percent')
            print(f"{name:<8} {kind:<22} diagnose {told['verdict']:<14} gap {gap['verdict']:<15} {effects}"
                  + (f'  (sees from {sees:.2g} %)' if sees else ''))


def many(programs, folder, count):
    print(f'{count} simulated loops of each kind, archive of 0.5 %: verdicts of diagnose\n')
    first_seed = 710000
    for name, valve in (('healthy', ''), ('sticky', '{effect: stiction, s: 5, j: 2}')):
        told = {kind: Counter() for kind in ('plain', *KINDS)}
        for k in range(count):
            truth = folder / 'truth.yaml'
            truth.write_text(MODEL.format(valve=valve, load=LOAD.replace('seed: 5', f'seed: {first_seed + k}')))
            plain = folder / 'plain.csv'
            subprocess.run([programs / 'loopwarden', 'simulate', truth, '--out', plain], check=True, capture_output=True)
            record = read(plain)
            for kind, counts in told.items():
                path = folder / 'r.csv'
                write(path, record if kind == 'plain' else thinned(record, kind, 0.2, 0.5))
                said = answer([programs / 'loopwarden', 'diagnose', path, '--json'])
                counts[said['effects'][0]['name'] if said.get('effects') else said['verdict']] += 1
        for kind, counts in told.items():
            print(f"{name:<8} {kind:<22} " + ', '.join(f'{verdict} {n}' for verdict, n in sorted(counts.items())))


def others(programs, folder, cases):
    print(f'\nCases of the other simulator in {cases}, archive of 0.5 % of both spans: names by gap\n')
    sums = {}
    for truth in json.loads((cases / 'truth.json').read_text()):
        case = cases / truth['id']
        allowed = set(truth['accept']) - {'none'}
        model = (case / 'model.yaml').read_text()
        low, high = map(float, re.search(r'range: *\[([^,]+),([^\]]+)\]', model).groups())
        co_low, co_high = map(float, re.search(r'output: *\[([^,]+),([^\]]+)\]', model).groups())
        record = read(case / 'record.csv')
        for kind in ('plain', *KINDS):
            path = folder / 'r.csv'
            write(path, record if kind == 'plain' else thinned(record, kind, 0.005 * (high - low), 0.005 * (co_high - co_low)))
            gap = answer([programs / 'loopwarden', 'gap', path, '--model', case / 'model.yaml', '--out', folder / 'gap', '--json'])
            count = sums.setdefault(kind, Counter())
            count['cases'] += 1
            names = {e['name']: e['confidence'] for e in gap.get('effects', [])}
            right = set(names) <= allowed and bool(names) == bool(allowed)
            count['right' if right else gap['verdict'] if not names else 'another name'] += 1
            count['another name at 0.9'] += any(c >= 0.9 for n, c in names.items() if n not in allowed)
    for kind, count in sums.items():
        print(f'{kind:<22} ' + ', '.join(f'{n} {c}' for n, c in sorted(count.items())))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--programs', type=pathlib.Path, default=ROOT / 'build/release/bin')
    parser.add_argument('--cases', type=pathlib.Path, help='of loopwarden_hidden_cases, instead of the others')
    parser.add_argument('--loops', type=int, help='so many simulated loops, instead of the others')
    options = parser.parse_args()
    programs = options.programs.resolve()
    with tempfile.TemporaryDirectory() as folder:
        if options.cases:
            others(programs, pathlib.Path(folder), options.cases)
            return
        if options.loops:
            many(programs, pathlib.Path(folder), options.loops)
            return
        real_loops(programs, pathlib.Path(folder))
        simulated(programs, pathlib.Path(folder))


if __name__ == '__main__':
    main()
