#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the Grafana dashboard's queries on a database filled by a host, and lets a real Prometheus
scrape the host.

Grafana is not in Debian, so this program replaces its macros. Exit code 77: Prometheus is not
installed.
"""
import datetime
import json
import pathlib
import shutil
import subprocess
import sys
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / 'lab/bench/fleet_kit'))
from plant import Plant, free_port, wait_for  # noqa: E402

DASHBOARD = ROOT / 'services/fleet/grafana/loopwarden-fleet.json'
RULES = ROOT / 'services/fleet/prometheus'
# Data that simulated boxes lack: an alarm with its course, an explanation, evidence and a history
# of weeks.
PLANT = """
INSERT INTO alarm SELECT device_id, 'stiction', now() - n * interval '7 hours' + CASE WHEN s.state = 'normal' THEN interval '1 hour' ELSE interval '0' END, s.state, 6.1
  FROM loop, generate_series(0, 20) n, (VALUES('unacknowledged'), ('normal')) s(state) WHERE device = 'FIC-101' AND NOT (n = 0 AND s.state = 'normal');
INSERT INTO alarm SELECT device_id, 'bad_pv', now() - interval '1 hour', 'unacknowledged', NULL FROM loop WHERE device = 'FIC-101';
INSERT INTO metric(device_id, name, type) SELECT device_id, 'severity_stiction', 'Double' FROM loop ON CONFLICT DO NOTHING;
INSERT INTO history_decimated SELECT id, date_bin('15 minutes', now(), 'epoch') - n * interval '15 minutes', 9, 5, 4, 6, 5
  FROM metric, generate_series(1, 96) n WHERE name IN ('severity_stiction', 'pv');
INSERT INTO explanation SELECT device_id, now(), '{"alarm": "stiction", "effect": "stiction", "size": 6.0}' FROM loop WHERE device = 'FIC-101';
INSERT INTO evidence(device_id, name, sha256, parts) SELECT device_id, 'evidence.csv', '00', 1 FROM loop WHERE device = 'FIC-101';
UPDATE edge SET online = false, since = now() WHERE name = 'box0001';
"""


def expanded(query, plant):
    """Replaces the macros as Grafana's PostgreSQL data source does."""
    end = datetime.datetime.now(datetime.timezone.utc)
    begin = end - datetime.timedelta(days=7)
    for name, sql in (('$group', 'SELECT DISTINCT group_name FROM edge'), ('$loop', 'SELECT tag FROM loop')):
        values = ','.join(f"'{row[0]}'" for row in plant.sql(sql))
        query = query.replace(name, values)
    while '$__timeFilter(' in query:
        before, rest = query.split('$__timeFilter(', 1)
        column, rest = rest.split(')', 1)
        query = f"{before}{column} BETWEEN '{begin.isoformat()}' AND '{end.isoformat()}'{rest}"
    return query.replace('$__timeFrom()', f"'{begin.isoformat()}'").replace('$__timeTo()', f"'{end.isoformat()}'")


def check_dashboard(plant):
    dashboard = json.loads(DASHBOARD.read_text())
    queries = [(variable['name'], variable['query']) for variable in dashboard['templating']['list']]
    queries += [(panel['title'], target['rawSql']) for panel in dashboard['panels'] for target in panel['targets']]
    for name, query in queries:
        start = time.monotonic()
        rows = plant.sql(expanded(query, plant))
        print(f'  {name:<36} {len(rows):5} rows, {1e3 * (time.monotonic() - start):6.1f} ms')
        if not rows:
            sys.exit(f'{name}: no rows')


def ask(port, path):
    with urllib.request.urlopen(f'http://127.0.0.1:{port}{path}', timeout=10) as answer:
        return json.loads(answer.read())


def check_prometheus(plant, metrics_port):
    for words in (['check', 'rules', 'loopwarden-fleet.rules.yml'], ['check', 'config', 'prometheus.yml'],
                  ['test', 'rules', 'loopwarden-fleet.test.yml']):
        subprocess.run(['promtool', *words], cwd=RULES, check=True, stdout=subprocess.DEVNULL)
    with urllib.request.urlopen(f'http://127.0.0.1:{metrics_port}/metrics', timeout=10) as answer:
        # Style notes, such as a missing help text, give another exit code, as errors do.
        subprocess.run(['promtool', 'check', 'metrics'], input=answer.read(), check=True)
    config = plant.folder / 'prometheus.yml'
    shutil.copy(RULES / 'loopwarden-fleet.rules.yml', plant.folder)
    config.write_text((RULES / 'prometheus.yml').read_text().replace('9470', str(metrics_port)).replace('15s', '1s'))
    port = free_port()
    plant.start('prometheus', ['prometheus', f'--config.file={config}', f'--storage.tsdb.path={plant.folder}/tsdb',
                               f'--web.listen-address=127.0.0.1:{port}'])

    def online():
        try:
            result = ask(port, '/api/v1/query?query=loopwarden_fleet_edges_online')['data']['result']
        except OSError:
            return False
        return result and float(result[0]['value'][1]) == 4
    wait_for(online, 'Prometheus has scraped the host')
    rules = ask(port, '/api/v1/rules')['data']['groups'][0]['rules']
    wait_for(lambda: all(rule['health'] == 'ok' for rule in ask(port, '/api/v1/rules')['data']['groups'][0]['rules']),
             'all rules evaluated')
    print(f'  Prometheus scrapes the host and evaluates {len(rules)} rules')


def main():
    if shutil.which('prometheus') is None:
        print('prometheus is not installed (tools/debian-packages.txt, all)')
        sys.exit(77)
    plant = Plant()
    plant.start_broker()
    plant.start_database()
    metrics_port = free_port()
    plant.start_host(metrics=metrics_port)
    boxes = plant.start_boxes(boxes=4, loops=3, period=1, seconds=1e6)
    wait_for(lambda: boxes.state['sent'] > 30, 'values')
    time.sleep(2)
    check_prometheus(plant, metrics_port)
    plant.sql(PLANT)
    check_dashboard(plant)
    plant.close()


if __name__ == '__main__':
    main()
