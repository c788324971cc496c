# SPDX-License-Identifier: Apache-2.0
"""Compares the contents of the database with the counts of the simulated boxes."""
import collections
import time

TWIN = 10 ** 9  # values of another box with the name of one are above
METRICS = ('pv', 'sp', 'co', 'stem', 'variability', 'travel')
Result = collections.namedtuple('Result', 'expected lost twice')

# The number of each value is counted once: a metric of a loop has 1 .. n, whatever its time.
COUNTS = """
SELECT l.group_name || '/' || l.edge, l.device, count(*), count(DISTINCT v.number)
  FROM loop l JOIN metric m ON m.device_id = l.device_id AND m.name = ANY(%s) JOIN value v ON v.metric_id = m.id
  WHERE v.number <= 1000000000 GROUP BY l.group_name, l.edge, l.device, m.id"""


def settle(condition, what, patience_s=90):
    end = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f'{what}: not within {patience_s} s')
        time.sleep(0.25)


def rows(plant):
    found = plant.sql('SELECT count(*) FROM value')
    return found[0][0] if found else None


def quiet(plant, seconds=4, patience_s=300):
    """Waits until no more rows come."""
    end = time.monotonic() + patience_s
    last, since = rows(plant), time.monotonic()
    while time.monotonic() - since < seconds and time.monotonic() < end:
        time.sleep(0.5)
        now = rows(plant)
        if now != last:
            last, since = now, time.monotonic()


def compare(plant, numbers):
    quiet(plant)
    result = counted(plant, numbers)
    if result.lost > 0:
        # A host or a database that was kept waiting for a processor is no loss.
        quiet(plant, seconds=30)
        result = counted(plant, numbers)
    return result


def counted(plant, numbers):
    expected = len(METRICS) * sum(sum(loops) for loops in numbers.values())
    stored = different = 0
    for box, _, count, distinct in plant.sql(COUNTS, (list(METRICS),)):
        if box not in numbers:
            continue
        stored += count
        different += distinct
    return Result(expected, expected - different, stored - different)


def delays(plant, births_s):
    """Median, 99th percentile and maximum, s. First for the first `births_s` seconds, in which all boxes send their births at once,
    then for the later ones. Births, whose values may be older, are those with other names."""
    return plant.sql("""
        SELECT percentile_cont(0.5) WITHIN GROUP (ORDER BY delay), percentile_cont(0.99) WITHIN GROUP (ORDER BY delay), max(delay)
          FROM (SELECT extract(epoch FROM pg_xact_commit_timestamp(v.xmin) - v.time)::float8 AS delay,
                       v.time > min(v.time) OVER () + %s * interval '1 second' AS later
                  FROM value v JOIN metric m ON m.id = v.metric_id WHERE m.name = 'pv') d
          GROUP BY later ORDER BY later""", (births_s,))
