# SPDX-License-Identifier: Apache-2.0
"""A real box among the simulated ones: loopwardend on simulated loops, and loopwarden-edge with a separate disk."""
import importlib
import os
import pathlib
import sqlite3
import subprocess
import sys

import bench_daemon
from plant import BIN, ROOT, wait_for

EDGE = 'real'
METRICS = ('pv', 'output')
ROWS = """
SELECT d.name, m.name, round(extract(epoch FROM v.time) * 1000)::bigint
  FROM edge e JOIN device d ON d.edge_id = e.id JOIN metric m ON m.device_id = d.id JOIN value v ON v.metric_id = m.id
  WHERE e.name = %s AND m.name = ANY(%s)"""
NEWEST = """
SELECT v.number FROM edge e JOIN device d ON d.edge_id = e.id AND d.name = '' JOIN metric m ON m.device_id = d.id
  JOIN latest v ON v.metric_id = m.id WHERE e.name = %s AND m.name = %s"""


class RealBox:
    """Each loop has something new to say five times a second. Use with `with`; needs root, for the disk. `env`: of the edge."""

    def __init__(self, plant, loops, disk_mib, env=None):
        self.env = {**os.environ, **(env or {})}
        self.plant = plant
        self.folder = plant.folder / 'box'
        self.disk = self.folder / 'disk'
        self.disk.mkdir(parents=True)
        self.daemon = bench_daemon.Daemon(str(BIN / 'loopwardend'), 'log_level: warn\nreal_time: {priority: 0}\n', [(0.1, '')] * loops)
        self.disk_mib = disk_mib

    def __enter__(self):
        self._mount(f'size={self.disk_mib}m')
        self.daemon.__enter__()
        config = self.folder / 'edge.yaml'
        config.write_text(
            f'broker: {{url: "{self.plant.broker}", reconnect_min: 0.5, reconnect_max: 5}}\n'
            f'sparkplug: {{group: A, edge: {EDGE}, primary_host: loopwarden-A}}\nruntime_directory: {self.daemon.folder}\n'
            f'store: {{directory: {self.disk}, replay_per_second: 2000}}\ndata: {{interval: 0.2, slow_interval: 1, dead_band: 0}}\n')
        self.plant.start('edge', [BIN / 'loopwarden-edge', '--config', config], env=self.env)
        wait_for(self.rows, 'rows of the box')
        return self

    def __exit__(self, *_):
        if 'edge' in self.plant.processes:
            self.plant.kill('edge')
        self.daemon.__exit__()
        subprocess.run(['umount', self.disk], check=True)

    def _mount(self, options):
        subprocess.run(['mount', '-t', 'tmpfs', '-o', options, 'none', self.disk], check=True)

    def make_room(self):
        self._mount('remount,size=256m')

    def room(self):
        """Bytes that are free."""
        disk = os.statvfs(self.disk)
        return disk.f_bavail * disk.f_bsize

    def on_disk(self):
        """The values that the store holds: device, metric, time in ms."""
        subprocess.run(['protoc', f'--proto_path={ROOT}/fleet/sparkplug', f'--python_out={self.folder}', 'sparkplug_b.proto'],
                       check=True)
        sys.path.insert(0, str(self.folder))
        sparkplug = importlib.import_module('sparkplug_b_pb2')
        store = sqlite3.connect(f'file:{self.disk}/store.sqlite?mode=ro', uri=True)
        try:
            return {(device, metric.name, metric.timestamp)
                    for device, payload in store.execute('SELECT device, payload FROM report')
                    for metric in sparkplug.Payload.FromString(payload).metrics if metric.name in METRICS}
        finally:
            store.close()

    def rows(self):
        """Returns the rows of the same box in the database."""
        return set(self.plant.sql(ROWS, (EDGE, list(METRICS))) or [])

    def newest(self, metric):
        found = self.plant.sql(NEWEST, (EDGE, metric))
        return found[0][0] if found else None

    def gap(self):
        """The longest silence of a loop, s."""
        times = {}
        for device, metric, ms in self.rows():
            if metric == 'output':
                times.setdefault(device, []).append(ms)
        return max(b - a for of_loop in times.values() for a, b in zip(sorted(of_loop), sorted(of_loop)[1:])) / 1000
