#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Speed of reading exports, compared with pandas' C engine on the same file in the same run; speed of ranking a plant.

Usage: lab/bench/import_speed.py [--rows N] [--loops N] [--programs build/release/bin]

Needs python3-pandas. Each is run three times and the best time counts. Only pandas' start time is subtracted.
`import --check` reads the whole file onto a constant period and looks for values that an archive left out; `--out` also writes.
"""
import argparse
import pathlib
import random
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]


def best_of(run, times=3):
    best = float('inf')
    for _ in range(times):
        begin = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - begin)
    return best


def export(path, rows, stamp):
    random.seed(1)
    pv, co = 50.0, 40.0
    with open(path, 'w') as file:
        file.write('Timestamp,FIC1.PV,FIC1.OP,FIC1.SP\n')
        for k in range(rows):
            pv += random.gauss(0, 0.01)
            co += random.gauss(0, 0.01)
            file.write(f'{stamp(k)},{pv:.4f},{co:.4f},50\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rows', type=int, default=2_000_000)
    parser.add_argument('--loops', type=int, default=60, help='loop-days of 10 s for the survey; 0: off')
    parser.add_argument('--programs', type=pathlib.Path, default=ROOT / 'build/release/bin')
    options = parser.parse_args()
    program = options.programs.resolve() / 'loopwarden'
    import pandas  # noqa: its start is not what is timed
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        forms = {'times in s': (lambda k: k, None),
                 'ISO 8601': (lambda k: f'2026-03-{1 + k // 86400:02}T{k // 3600 % 24:02}:{k // 60 % 60:02}:{k % 60:02}Z', ['Timestamp'])}
        for form, (stamp, dates) in forms.items():
            path = folder / 'e.csv'
            export(path, options.rows, stamp)
            size = path.stat().st_size / 1e6
            theirs = best_of(lambda: pandas.read_csv(path, engine='c', parse_dates=dates))
            ours = best_of(lambda: subprocess.run([program, 'import', path, '--out', folder / 'out'], check=True, capture_output=True))
            reading = best_of(lambda: subprocess.run([program, 'import', path, '--check'], check=True, capture_output=True))
            for who, s in (('pandas read_csv', theirs), ('loopwarden, reading', reading), ('loopwarden, reading and writing', ours)):
                print(f'{form:<12} {who:<34} {size / s:8.1f} MB/s {3e-6 * options.rows / s:8.2f} million values/s')
        if options.loops:
            survey(program, folder, options.loops)


def survey(program, folder, loops):
    exports = folder / 'exports'
    exports.mkdir()
    for k in range(loops):
        sticky = k % 5 == 0
        model = folder / 'm.yaml'
        model.write_text(f"""sample_time: 10
controller: {{kp: 0.8, ki: 0.012, output: [0, 100]}}
valve: {{effects: [{'{effect: stiction, s: 4, j: 1.5}' if sticky else ''}]}}
process: {{gain: 0.4, time_constant: 30, dead_time: 20}}
transmitter: {{range: [0, 40], resolution: 0.001, noise: 0.03}}
disturbances:
  - {{effect: random_load, intensity: 0.01, time_constant: 900}}
scenario: {{duration: 86400, set_point: [[0, 18], [20000, 20], [50000, 17]], seed: {k + 1}}}
""")
        subprocess.run([program, 'simulate', model, '--out', exports / f'FIC{k:04}.csv'], check=True, capture_output=True)
    for jobs in (1, 2):
        out = folder / f'survey{jobs}'
        begin = time.perf_counter()
        subprocess.run([program, 'survey', exports, '--out', out, '--jobs', str(jobs)], check=True, capture_output=True)
        s = time.perf_counter() - begin
        print(f'survey, {jobs} thread{"s" if jobs > 1 else " "}: {loops} loop-days of 10 s in {s:.1f} s: {loops / s:.1f} loop-days/s, '
              f'5000 in {5000 * s / loops / 60:.1f} min')


if __name__ == '__main__':
    main()
