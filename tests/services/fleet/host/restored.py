#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Saves the fleet's database while boxes send, loses it and restores it, by the commands of
docs/how-to/back-up-and-restore.md.

The backup is younger than the edges' resend_window, so the edges still have all later messages.
After the restore each value must be in the database exactly once.
"""
import pathlib
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / 'lab/bench/fleet_kit'))
from measure import compare, rows, settle  # noqa: E402
from plant import Plant, postgres_folder  # noqa: E402


def database_program(plant, name, *words, **more):
    subprocess.run([postgres_folder() / name, '-h', '127.0.0.1', '-p', str(plant.database_port), '-U', 'postgres', *words],
                   check=True, **more)


def save(plant, path):
    with open(path, 'wb') as file:
        database_program(plant, 'pg_dump', '-Fc', 'fleet', stdout=file)


def lose_and_restore(plant, path):
    shutil.rmtree(plant.folder / 'host/spool', ignore_errors=True)
    database_program(plant, 'dropdb', '--if-exists', 'fleet')
    database_program(plant, 'createdb', 'fleet')
    with open(path, 'rb') as file:
        database_program(plant, 'pg_restore', '-d', 'fleet', stdin=file)


def main():
    plant = Plant()
    plant.start_broker()
    plant.start_database()
    plant.start_host()
    settle(lambda: plant.sql('SELECT owner FROM lease'), 'the host has its group')
    boxes = plant.start_boxes(boxes=4, loops=3, period=1, seconds=60, drain=120)
    settle(lambda: (rows(plant) or 0) > 500, 'values')
    backup = plant.folder / 'loopwarden.dump'
    save(plant, backup)
    saved = rows(plant)
    settle(lambda: rows(plant) > saved + 300, 'values after the backup')
    plant.kill('host', signal.SIGTERM)
    last = rows(plant)
    time.sleep(3)
    lose_and_restore(plant, backup)
    restored = rows(plant)
    plant.start_host()
    result = compare(plant, boxes.finish())
    migrations = plant.sql('SELECT count(*), count(DISTINCT number) FROM migration')[0]
    plant.close()
    print(f'rows: {saved} about the time of the backup, {last} when the database was lost, {restored} restored; '
          f'of {result.expected} values lost {result.lost}, twice {result.twice}')
    if result.lost or result.twice or restored >= last or migrations[0] != migrations[1]:
        sys.exit(1)


if __name__ == '__main__':
    main()
