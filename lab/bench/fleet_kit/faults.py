# SPDX-License-Identifier: Apache-2.0
"""Faults between a box and its rows, each injected during operation, with lost values and duration.

A fault takes (plant, args) and returns its duration and a comment. If it has separate values, it also returns
how many of them were lost. `took` is measured from the fault's end, or from the fault if it does not end, to the first rows of
newer values.
"""
import importlib
import os
import pathlib
import random
import re
import signal
import struct
import subprocess
import sys
import time

import measure
from plant import Plant, wait_for
from real_box import RealBox


CAMPAIGN = pathlib.Path(__file__).resolve().parents[3] / 'tests/system/fault_campaign'
EDGE_STORE = 1 << 6  # of the shim's files


def newest(plant):
    found = plant.sql("SELECT extract(epoch FROM max(v.time))::float8 FROM value v JOIN metric m ON m.id = v.metric_id "
                      "WHERE m.name = 'pv' AND v.time < now() + interval '1 minute'")
    return found[0][0] if found and found[0][0] is not None else 0.0


def recovery(plant, patience_s=240):
    """Seconds until values of now are rows again."""
    start = time.monotonic()
    since = time.time()
    wait_for(lambda: newest(plant) > since, 'new rows', patience_s)
    return time.monotonic() - start


def broker_killed(plant, _args):
    plant.kill('mosquitto')
    time.sleep(5)
    plant.start_broker()
    return recovery(plant), 'away 5 s'


def host_killed(plant, _args):
    plant.kill('host1')
    time.sleep(2)
    plant.start_host('host1')
    return recovery(plant), 'started again after 2 s'


def host_taken_over(plant, _args):
    plant.start_host('host2')
    time.sleep(4)
    plant.kill('host1')
    return recovery(plant), 'a second host takes over'


def database_stopped(plant, args):
    plant.kill('postgresql', signal.SIGINT)
    time.sleep(args.away)
    spool = sum(f.stat().st_size for f in (plant.folder / 'host1/spool').rglob('*.spool'))
    plant.start_database()
    return recovery(plant), f'away {args.away:g} s, spool {spool / 1048576:.1f} MiB'


def database_stopped_host_killed(plant, args):
    plant.kill('postgresql', signal.SIGINT)
    time.sleep(args.away / 4)
    plant.kill('host1')
    time.sleep(args.away / 4)
    plant.start_host('host1')
    time.sleep(2)
    plant.start_database()
    return recovery(plant), f'away {args.away / 2:g} s, host killed meanwhile'


def clock_set(to, seen):
    """Sets the clock of programs whose clock is in a file, see CLOCKS. Rows count, whatever time they have."""
    def fault(plant, args):
        time.sleep(20)
        (plant.folder / 'clock').write_text(to)
        start = time.monotonic()
        enough = measure.rows(plant) + len(measure.METRICS) * args.boxes * args.loops
        wait_for(lambda: (measure.rows(plant) or 0) >= enough, 'rows of all loops', 240)
        took = time.monotonic() - start
        time.sleep(20)
        return took, seen
    return fault


def disk_full(plant, args):
    """The store of a real edge fills its disk while the broker is away; then there is room again."""
    with RealBox(plant, loops=40, disk_mib=2) as box:
        plant.kill('mosquitto')
        time.sleep(args.away)
        left = box.room()
        stored = box.on_disk()
        box.make_room()
        plant.start_broker()
        took = recovery(plant, 900)
        start = time.monotonic()
        wait_for(lambda: box.newest('store/waiting') == 0, 'all that is stored is sent', 600)
        sent = time.monotonic() - start + took
        time.sleep(5)
        lost = len(stored - box.rows())
        return took, (f'{len(stored)} values on the disk, of which {left / 1024:.0f} KiB were free, lost {lost}; beyond disk and memory '
                      f'{box.newest("store/dropped"):.0f} reports dropped and counted, a gap of {box.gap():.0f} s; '
                      f'all sent after {sent:.0f} s'), lost


def slow_disk(folder, milliseconds):
    """Gives a program the fault campaign's shim: each opening and syncing of an edge's store takes this long."""
    sys.path.insert(0, str(CAMPAIGN))
    switches = importlib.import_module('daemon')
    shim, file = folder / 'shim.so', folder / 'switches'
    subprocess.run(['cc', '-shared', '-fPIC', '-O2', '-o', shim, CAMPAIGN / 'shim.c', '-ldl'], check=True)
    content = bytearray(switches.SWITCHES_BYTES)
    struct.pack_into('qq', content, switches.SLOW_AT, EDGE_STORE, milliseconds)
    file.write_bytes(content)
    return {'LD_PRELOAD': str(shim), 'LOOPWARDEN_FAULTS': str(file)}, lambda: struct.unpack_from(
        'q', file.read_bytes(), switches.SLOW_AT + 16)[0]


def disk_slow(plant, args):
    """Each sync of a real edge's store takes 10 to 500 ms, while the broker is away and when it is back."""
    milliseconds = random.randint(10, 500)
    env, calls = slow_disk(plant.folder, milliseconds)
    with RealBox(plant, loops=40, disk_mib=256, env=env) as box:
        plant.kill('mosquitto')
        time.sleep(args.away)
        stored = box.on_disk()
        plant.start_broker()
        took = recovery(plant, 900)
        wait_for(lambda: box.newest('store/waiting') == 0, 'all that is stored is sent', 600)
        time.sleep(5)
        lost = len(stored - box.rows())
        return took, (f'{milliseconds} ms a call, {calls()} calls; {len(stored)} values on the disk, lost {lost}; '
                      f'{box.newest("store/dropped"):.0f} reports dropped, the longest gap of a loop {box.gap():.1f} s'), lost


def two_edges(plant, args):
    """A second box with the name of the first, a separate client identifier, and other values."""
    twin = plant.start_boxes('twin', boxes=1, loops=args.loops, period=args.period, seconds=40, drain=0, host='',
                             client_suffix='-twin', count_from=measure.TWIN)
    twin.process.wait()
    seen = plant.sql("SELECT count(*) FROM edge WHERE conflict IS NOT NULL")[0][0]
    return recovery(plant), f'named as in conflict: {seen}'


def birth_lost(plant, _args):
    asked = plant.log('host1').count('a rebirth is asked for')
    return recovery(plant), f'rebirths asked for: {asked}'


def garbage(plant, _args):
    """Random bytes, and true payloads with some bytes changed, on the topics of boxes that exist."""
    import paho.mqtt.client as mqtt
    client = mqtt.Client('garbage')
    client.connect('127.0.0.1', plant.broker_port)
    client.loop_start()
    chance = random.Random(1)
    count = 5000
    for n in range(count):
        kind = chance.choice(['DDATA/box9999/FIC-101', 'NBIRTH/box9999', 'NDEATH/box0001', 'DBIRTH/box9999/x', 'NDATA/box9999'])
        client.publish(f'spBv1.0/A/{kind}', bytes(chance.randrange(256) for _ in range(chance.randrange(200))))
        if n % 500 == 0:
            time.sleep(0.1)
    client.disconnect()
    return recovery(plant), f'{count} messages'


class Network:
    """The broker in a separate network, which can be cut in each direction."""

    def __init__(self):
        self.name = f'lwfleet{os.getpid()}'

    def run(self, *words):
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def make(self):
        self.run('ip', 'netns', 'add', self.name)
        self.run('ip', 'link', 'add', 'lwf0', 'type', 'veth', 'peer', 'name', 'lwf1', 'netns', self.name)
        self.run('ip', 'addr', 'add', '10.213.77.1/30', 'dev', 'lwf0')
        self.run('ip', 'link', 'set', 'lwf0', 'up')
        self.inside('ip', 'addr', 'add', '10.213.77.2/30', 'dev', 'lwf1')
        self.inside('ip', 'link', 'set', 'lwf1', 'up')
        self.inside('ip', 'link', 'set', 'lo', 'up')
        self.macs = {device: re.search(r'link/ether (\S+)', subprocess.run(
            [*words, 'ip', 'link', 'show', device], check=True, capture_output=True, text=True).stdout)[1]
            for device, words in (('lwf0', []), ('lwf1', ['ip', 'netns', 'exec', self.name]))}

    def send_to(self, towards_edges, mac):
        """Sends packets of one direction to this hardware address; without an owner of the address they are lost."""
        if towards_edges:
            self.run('ip', 'neigh', 'replace', '10.213.77.2', 'lladdr', mac, 'dev', 'lwf0', 'nud', 'permanent')
        else:
            self.inside('ip', 'neigh', 'replace', '10.213.77.1', 'lladdr', mac, 'dev', 'lwf1', 'nud', 'permanent')

    def inside(self, *words):
        self.run('ip', 'netns', 'exec', self.name, *words)

    def remove(self):
        subprocess.run(['ip', 'netns', 'del', self.name], check=False, stderr=subprocess.DEVNULL)


def network_cut(towards_edges):
    """Drops packets of one direction between host and broker for 40 s; connections stay open on both sides."""
    def fault(plant, _args):
        plant.network.send_to(towards_edges, '02:00:00:00:00:99')
        time.sleep(40)
        plant.network.send_to(towards_edges, plant.network.macs['lwf1' if towards_edges else 'lwf0'])
        return recovery(plant), 'for 40 s'
    return fault


FAULTS = {
    'broker killed': broker_killed,
    'host killed -9': host_killed,
    'host killed -9, another takes over': host_taken_over,
    'database stopped': database_stopped,
    'database stopped, host killed -9': database_stopped_host_killed,
    'network cut, host to broker': network_cut(True),
    'network cut, broker to host': network_cut(False),
    'clock stepped': clock_set('+0', "the boxes' clock an hour late and then corrected"),
    'clock set back, boxes': clock_set('-1h', 'by an hour'),
    'clock set back, host': clock_set('-1h', 'by an hour'),
    'an edge\'s disk full': disk_full,
    'an edge\'s disk slow': disk_slow,
    'two edges of one name': two_edges,
    'a birth lost': birth_lost,
    'garbage payloads': garbage,
}

# Options of the simulated boxes for faults inside them.
OPTIONS = {'a birth lost': {'lose_births': 1}}


# Programs whose clock is in a file, and the clock at the start.
CLOCKS = {'clock stepped': ('boxes', '-1h'), 'clock set back, boxes': ('boxes', '+0'), 'clock set back, host': ('host', '+0')}


def faketime():
    return next((p for p in ('/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1',
                             '/usr/lib/aarch64-linux-gnu/faketime/libfaketimeMT.so.1') if os.path.exists(p)), None)


def faketime_env(plant, at_start):
    """The clock in a file that libfaketime reads again each second."""
    (plant.folder / 'clock').write_text(at_start)
    return {'LD_PRELOAD': faketime(), 'FAKETIME_TIMESTAMP_FILE': str(plant.folder / 'clock'), 'FAKETIME_NO_CACHE': '0',
            'FAKETIME_CACHE_DURATION': '1', 'DONT_FAKE_MONOTONIC': '1'}


def can_run(name):
    if (name.startswith('network') or name.startswith('an edge\'s disk')) and os.getuid() != 0:
        return 'needs root'
    if name in CLOCKS and faketime() is None:
        return 'needs libfaketime (Debian: faketime)'
    if name.startswith('network') and subprocess.run(
            ['unshare', '--net', 'true'], check=False, stderr=subprocess.DEVNULL).returncode != 0:
        return 'needs network namespaces'
    return ''


def run_fault(name, fault, args):
    why = can_run(name)
    if why:
        print(f'  {name:<36} left out: {why}', flush=True)
        return True
    plant = Plant()
    try:
        return observe(plant, name, fault, args)
    finally:
        plant.close()
        if getattr(plant, 'network', None):
            plant.network.remove()


def start_all(plant, name, args):
    plant.start_database()
    boxes = {'boxes': args.boxes, 'loops': args.loops, 'period': args.period, 'drain': 180,
             'seconds': 1e6, **OPTIONS.get(name, {})}
    if name.startswith('network'):
        # The host is on this side of the cable, broker and boxes on the other.
        plant.network = Network()
        plant.network.make()
        inside = ('ip', 'netns', 'exec', plant.network.name)
        config = plant.folder / 'mosquitto.conf'
        config.write_text(f'listener {plant.broker_port} 0.0.0.0\nallow_anonymous true\nuser root\n')
        plant.start('mosquitto', [*inside, 'mosquitto', '-c', config])
        time.sleep(1)
        plant.start_host('host1', broker=f'mqtt://10.213.77.2:{plant.broker_port}')
        return plant.start_boxes(prefix=inside, **boxes)
    plant.start_broker()
    whose, at_start = CLOCKS.get(name, ('', ''))
    env = faketime_env(plant, at_start) if whose else None
    plant.start_host('host1', env=env if whose == 'host' else None)
    return plant.start_boxes(env=env if whose == 'boxes' else None, **boxes)


def observe(plant, name, fault, args):
    boxes = start_all(plant, name, args)
    measure.settle(lambda: boxes.state['live'] == args.boxes and (measure.rows(plant) or 0) > 0, f'{name}: births')
    time.sleep(max(5.0, args.period))
    took, seen, *own = fault(plant, args)
    time.sleep(max(5.0, args.period))
    boxes.process.send_signal(signal.SIGTERM)
    numbers = boxes.finish()
    result = measure.compare(plant, numbers)
    good = result.lost == 0 and result.twice == 0 and not any(own)
    print(f'  {name:<36} values {result.expected:8}, lost {result.lost}, twice {result.twice}; rows of now after '
          f'{took:5.1f} s; {seen}', flush=True)
    return good
