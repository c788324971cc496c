# SPDX-License-Identifier: Apache-2.0
"""A fleet on this machine: Mosquitto, PostgreSQL, hosts and simulated boxes, each a separate process, in a temporary folder."""
import atexit
import json
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

import psycopg2

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.append(str(ROOT / "tests/support"))
from bench_daemon import free_port  # noqa: E402

BIN = pathlib.Path(os.environ.get('LOOPWARDEN_BIN_DIR', ROOT / 'build/release/bin'))


def postgres_folder():
    """Where Debian keeps the programs of the newest PostgreSQL that is installed."""
    versions = sorted(pathlib.Path('/usr/lib/postgresql').glob('*/bin/initdb'), key=lambda p: float(p.parts[4]))
    if not versions:
        raise SystemExit('PostgreSQL is not installed (tools/debian-packages.txt)')
    return versions[-1].parent


class Usage:
    """Processor time and peak memory of a process and its children, from /proc."""

    def __init__(self):
        self.ticks = os.sysconf('SC_CLK_TCK')

    def of(self, pid):
        cpu = rss = 0
        for child in [pid, *self.children(pid)]:
            try:
                stat = pathlib.Path(f'/proc/{child}/stat').read_text().rsplit(')', 1)[1].split()
                pss = pathlib.Path(f'/proc/{child}/smaps_rollup').read_text()
            except OSError:
                continue
            # Children that have ended count too: a database has one process a connection.
            cpu += sum(int(stat[i]) for i in (11, 12, 13, 14))
            rss += next(int(line.split()[1]) for line in pss.splitlines() if line.startswith('Pss:'))
        return cpu / self.ticks, rss / 1024

    @staticmethod
    def children(pid):
        found = []
        for child in filter(str.isdigit, os.listdir('/proc')):
            try:
                fields = pathlib.Path(f'/proc/{child}/stat').read_text().rsplit(')', 1)[1].split()
            except OSError:
                continue  # it has ended
            if int(fields[1]) == pid:
                found.append(int(child))
        return found


class Plant:
    def __init__(self, prefix=()):
        # Prefix of the services' commands, such as `ip netns exec NAME`.
        self.prefix = list(prefix)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix='loopwarden-fleet-'))
        self.folder.chmod(0o755)
        self.processes = {}
        self.logs = {}
        atexit.register(self.close)
        # Ends as usual, so that everything is removed.
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        self.broker_port = free_port()
        self.database_port = free_port()
        self.broker_address = '127.0.0.1'

    # --- processes ---
    def start(self, name, command, **more):
        log = open(self.folder / f'{name}.log', 'ab')
        self.processes[name] = subprocess.Popen([str(c) for c in command], stdout=more.pop('stdout', log),
                                                stderr=log, start_new_session=True, **more)
        return self.processes[name]

    def kill(self, name, how=signal.SIGKILL, wait=True):
        process = self.processes.pop(name)
        process.send_signal(how)
        if wait:
            process.wait()

    def log(self, name):
        return (self.folder / f'{name}.log').read_text(errors='replace')

    def close(self):
        for process in self.processes.values():
            process.kill()
            process.wait()
        self.processes = {}
        shutil.rmtree(self.folder, ignore_errors=True)

    # --- broker ---
    def start_broker(self):
        config = self.folder / 'mosquitto.conf'
        config.write_text(f'listener {self.broker_port} 127.0.0.1\nallow_anonymous true\n'
                          f'persistence true\npersistence_location {self.folder}/\nmax_queued_messages 100000\n'
                          'user root\nlog_type error\nlog_type warning\n')
        self.start('mosquitto', ['mosquitto', '-c', config])
        wait_for(lambda: answers(self.broker_port), 'mosquitto')

    @property
    def broker(self):
        return f'mqtt://{self.broker_address}:{self.broker_port}'

    # --- database ---
    def start_database(self):
        programs = postgres_folder()
        data = self.folder / 'postgresql'
        self.as_postgres = ['runuser', '-u', 'postgres', '--'] if os.getuid() == 0 else []
        if not data.exists():
            data.mkdir(mode=0o700)
            if os.getuid() == 0:
                shutil.chown(data, 'postgres', 'postgres')
            subprocess.run([*self.as_postgres, programs / 'initdb', '-D', data, '-A', 'trust', '-U', 'postgres',
                            '-E', 'UTF8', '--locale=C.UTF-8', '--no-sync'], check=True, stdout=subprocess.DEVNULL)
            with open(data / 'postgresql.conf', 'a', encoding='ascii') as f:
                # So that a row's commit has a time: the delay from edge to row is measured by it.
                f.write(f"port = {self.database_port}\nlisten_addresses = '127.0.0.1'\n"
                        f"unix_socket_directories = '{data}'\ntrack_commit_timestamp = on\nmax_connections = 50\n"
                        'max_wal_size = 4GB\nshared_buffers = 256MB\n')
        uid = pwd.getpwnam('postgres').pw_uid if os.getuid() == 0 else os.getuid()
        self.start('postgresql', [programs / 'postgres', '-D', data], user=uid, cwd=data)
        wait_for(lambda: self.sql('SELECT 1', name='postgres'), 'postgresql')
        if not self.sql("SELECT 1 FROM pg_database WHERE datname = 'fleet'", name='postgres'):
            self.sql('CREATE DATABASE fleet', name='postgres')

    @property
    def database(self):
        return f'postgresql://postgres@127.0.0.1:{self.database_port}/fleet'

    def sql(self, text, values=None, name='fleet'):
        try:
            connection = psycopg2.connect(host='127.0.0.1', port=self.database_port, user='postgres', dbname=name,
                                          connect_timeout=3)
        except psycopg2.OperationalError:
            return None
        connection.autocommit = True
        try:
            with connection.cursor() as cursor:
                cursor.execute(text, values)
                return cursor.fetchall() if cursor.description else []
        except psycopg2.errors.UndefinedTable:
            return None  # not yet
        finally:
            connection.close()

    # --- hosts ---
    def start_host(self, name='host', groups=('A',), metrics=0, broker=None, database=None, prefix=(), env=None):
        config = self.folder / f'{name}.yaml'
        config.write_text(f'state_directory: {self.folder}/{name}\nmetrics: {{port: {metrics}}}\nlog_level: info\n')
        return self.start(name, [*prefix, BIN / 'loopwarden-fleet', '--broker', broker or self.broker, '--database',
                                 database or self.database, '--groups', ','.join(groups), '--config', config],
                          env={**os.environ, **(env or {})})

    # --- boxes ---
    def start_boxes(self, name='boxes', groups=('A',), env=None, prefix=(), **options):
        command = [*prefix, BIN / 'loopwarden_fleet_boxes', '--groups', ','.join(groups)]
        for key, value in {'broker': self.broker, **options}.items():
            command += [f"--{key.replace('_', '-')}", value]
        return Boxes(self.start(name, command, stdout=subprocess.PIPE, env={**os.environ, **(env or {})}))


class Boxes:
    """Returns the status of the simulated boxes."""

    def __init__(self, process):
        self.process = process
        self.state = {'live': 0, 'sent': 0, 'again': 0, 'stored': 0, 'births': 0}
        self.numbers = None
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        for line in self.process.stdout:
            self.state = json.loads(line)
            self.numbers = self.state.pop('numbers', None)

    def finish(self):
        """Waits for the end; the numbers that each loop counted to, by group/box."""
        self.process.wait()
        self.thread.join(5)
        if self.numbers is None:
            raise SystemExit('the simulated boxes ended without a result')
        return self.numbers


def answers(port):
    with socket.socket() as s:
        s.settimeout(1)
        return s.connect_ex(('127.0.0.1', port)) == 0


def wait_for(condition, what, patience_s=60):
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.1)
    raise SystemExit(f'{what}: not there after {patience_s} s')
