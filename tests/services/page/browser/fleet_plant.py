# SPDX-License-Identifier: Apache-2.0
"""A plant of 40 boxes in the host's database, as after months of operation, and loopwarden-page on it.

loopwarden-fleet makes the tables. The rows are drawn here from a `seed`, with times counted back
from now. To view the plant, run: tests/services/page/browser/fleet_plant.py [--port PORT] [--minutes N].
"""
import argparse
import datetime
import json
import math
import os
import pathlib
import random
import shutil
import subprocess
import sys
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "lab/bench/fleet_kit"))
from plant import BIN, Plant, free_port, wait_for  # noqa: E402
import psycopg2  # noqa: E402
from psycopg2.extras import execute_values  # noqa: E402

PASSWORD = "correct horse battery"
HOUR, DAY = 3600.0, 86400.0
GROUPS = {"Crude": 16, "Reformer": 14, "Utilities": 10}
LOOPS = 12
HOSTILE = 'PIC-1<img src=x onerror="document.title=1">'
KINDS = ["FIC", "FIC", "LIC", "PIC", "TIC"]
# Place, fault, its size in % of the CO span today, days since it began, its course, acknowledged.
SICK = [
    ("crude-03", 4, "stiction", 11.4, 41, "grows", True), ("reformer-08", 2, "stiction", 8.9, 26, "grows", True),
    ("utilities-02", 7, "low_air_supply", 7.6, 2, "jumps", False), ("crude-11", 1, "backlash", 6.8, 55, "grows", True),
    ("reformer-01", 9, "stiction", 5.7, 12, "jumps", False), ("crude-05", 10, "hysteresis", 5.1, 33, "comes and goes", True),
    ("reformer-12", 3, "backlash", 4.4, 19, "grows", True), ("utilities-06", 5, "stiction", 3.9, 7, "grows", False),
    ("crude-14", 8, "stiction", 3.3, 48, "comes and goes", True), ("reformer-04", 11, "unknown", 2.9, 4, "jumps", True),
    ("crude-09", 6, "backlash", 2.6, 61, "grows", True), ("utilities-09", 1, "hysteresis", 2.2, 15, "grows", True),
]
EXPLANATION = {"alarm": "stiction", "verdict": "missing_effect", "effect": "stiction", "size": 11.2, "low": 10.6, "high": 11.9,
               "confidence": 0.97, "gap_closed": 0.91, "agrees": True,
               "sentence": "After each reversal CO travels 11.2 % of its span before the valve follows, then it slips by 3.8 %.",
               "remedy": "Loosen or renew the packing; until then ask for the jacket."}


def alarms_in_10_minutes(group, hours_ago, hour_of_day):
    """Returns the mean number of raised alarms in a group: a daily rhythm, with disturbances on
    some days."""
    calm = {"Crude": 0.7, "Reformer": 1.5, "Utilities": 0.25}[group] * (1.0 + 0.5 * math.sin((hour_of_day - 8) / 24 * 2 * math.pi))
    trip = {"Crude": (31.0, 32.2), "Reformer": (9.5, 11.2)}.get(group)
    return calm + (16.0 if trip and trip[0] < hours_ago < trip[1] else 0.0)


def poisson(dice, mean):
    limit, k, p = math.exp(-mean), 0, dice.random()
    while p > limit:
        k, p = k + 1, p * dice.random()
    return k


def size_at(days_ago, size, began, how):
    """Returns the severity of a fault, % of the CO span."""
    if days_ago > began:
        return 0.0
    if how == "jumps":
        return size * (1.0 - 0.05 * math.sin(days_ago))
    if how == "grows":
        return size * (0.25 + 0.75 * (1.0 - days_ago / began) ** 1.5)
    return size if days_ago % 9 < 5 else 0.0


class FleetPlant:
    """Database and page in a separate folder; use with `with`."""

    def __init__(self, seed=7, users=False, box=False, port=0, hostile=False, time_zone="Africa/Johannesburg"):
        self.dice = random.Random(seed)
        self.hostile = hostile
        self.now = time.time()
        self.plant = Plant()
        self.port = port or free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.page = None
        self.config = self.plant.folder / "page.yaml"
        (self.plant.folder / "state").mkdir()
        self.users = users
        self.yaml = (f"listen: [{{address: 127.0.0.1, port: {self.port}}}]\nstate_directory: {self.plant.folder}/state\nrate: 1000\n"
                     f"sockets: {{status: {self.plant.folder}/none.sock, page: {self.plant.folder}/none.sock}}\ntime_zone: {time_zone}\n"
                     f"fleet: {{database: \"{self.plant.database}\"}}\n" + (f"users: {self.plant.folder}/users\n" if users else ""))
        self.box = box

    def __enter__(self):
        try:
            self.plant.start_database()
            self._make_tables()
            self._fill()
            if self.users:
                subprocess.run([BIN / "loopwarden-page", "user", "add", "vera", "--users", self.plant.folder / "users", "--stdin"],
                               input=PASSWORD + "\n", text=True, check=True, stdout=subprocess.DEVNULL)
            self.start_page(self.box)
        except BaseException:
            self.plant.close()
            raise
        return self

    def __exit__(self, *_):
        self.plant.close()

    def start_page(self, box):
        """box: a daemon runs on the same machine, or is configured to."""
        if "page" in self.plant.processes:
            self.plant.kill("page")
        self.config.write_text(self.yaml + f"box: {str(box).lower()}\n", encoding="utf-8")
        command = [BIN / "loopwarden-page", "--config", self.config]
        # For work on the site: serves its folder, without building the program.
        if "LOOPWARDEN_PAGE_SITE" in os.environ:
            site = self.plant.folder / "site"
            shutil.copytree(os.environ["LOOPWARDEN_PAGE_SITE"], site, dirs_exist_ok=True)
            shutil.copytree(ROOT / "services/page/third_party/uplot", site / "uplot", dirs_exist_ok=True)
            command += ["--site", site]
        self.plant.start("page", command)
        wait_for(self._answers, "loopwarden-page")

    def _answers(self):
        try:
            return urllib.request.urlopen(self.url + "/api/session", timeout=5).read()
        except OSError:
            return False

    def stop_database(self):
        self.plant.kill("postgresql")

    def start_database(self):
        self.plant.start_database()

    # --- content of the database ---
    def _make_tables(self):
        """Runs the host's migration, which needs no broker."""
        self.plant.start_host()
        wait_for(lambda: (self.plant.sql("SELECT count(*) FROM migration") or [[0]])[0][0] >= 4 and
                 self.plant.sql("SELECT to_regclass('value_rest')")[0][0], "tables")
        self.plant.kill("host")

    def _fill(self):
        connection = psycopg2.connect(self.plant.database)
        with connection, connection.cursor() as self.cursor:
            for days in range(0, 100, 25):
                self.cursor.execute("SELECT make_partition('history_decimated', 'bucket', 'month', now() - %s * interval '1 day')", (days,))
            self._boxes()
            self._loops()
            for sick in SICK:
                self._sick(*sick)
            self._passing_alarms()
            self.cursor.execute("ANALYZE")
        connection.close()

    def _many(self, sql, rows):
        return execute_values(self.cursor, sql, rows, page_size=1000, fetch="RETURNING" in sql)

    def _ago(self, seconds):
        return datetime.datetime.fromtimestamp(self.now - seconds, datetime.timezone.utc)

    def _metrics(self, rows):
        """Inserts metrics with their newest values, given as (device, name, unit, number, text).
        Returns their ids by device and name."""
        ids = {(d, n): i for d, n, i in self._many("INSERT INTO metric(device_id, name, type, unit) VALUES %s RETURNING device_id, name, id",
                                                  [(d, n, "Double" if t is None else "String", u) for d, n, u, _, t in rows])}
        self._many("INSERT INTO latest VALUES %s", [(ids[d, n], self._ago(self.dice.uniform(0, 40)), v, t, False) for d, n, _, v, t in rows])
        return ids

    def _boxes(self):
        # Exceptions: minutes of silence, whether it is connected, clock, name used twice.
        odd = {"crude-07": (186, False, 74, None), "utilities-04": (26, True, 0.1, self._ago(5 * HOUR))}
        names = [(group, f"{group.lower()}-{n + 1:02}") for group, count in GROUPS.items() for n in range(count)]
        rows = []
        for group, name in names:
            silent, online, clock, conflict = odd.get(name, (self.dice.uniform(0, 0.3), True, self.dice.gauss(0, 0.1), None))
            rows.append((group, name, online, self._ago(60 * silent if not online else 20 * DAY), self._ago(20 * DAY), clock, conflict))
        self.boxes = {name: i for name, i in self._many(
            "INSERT INTO edge(group_name, name, online, since, born, clock_offset_s, conflict) VALUES %s RETURNING name, id", rows)}
        self._many("INSERT INTO ingest_position VALUES %s", [
            (self.boxes[name], 0, 0, self._ago(60 * odd.get(name, (0.1,))[0]), self._ago(60 * odd.get(name, (0.1,))[0])) for _, name in names])
        devices = dict(self._many("INSERT INTO device(edge_id, name, tag, online) VALUES %s RETURNING edge_id, id",
                                  [(self.boxes[name], "", "", odd.get(name, (0, True))[1]) for _, name in names]))
        rows = []
        for group, name in names:
            device = devices[self.boxes[name]]
            # The boxes of the utilities are alike, so a different one is noticeable. Elsewhere each
            # has separate loops.
            config = 0x5EC0FFEE if group == "Utilities" and name != "utilities-05" else self.dice.getrandbits(32)
            rows += [(device, "version", None, None, "0.1.9" if name in ("crude-02", "reformer-13") else "0.2.0"),
                     (device, "config_hash", None, float(config), None),
                     (device, "model_hash", None, float(0x1B5C0DE1 if name == "reformer-06" else 0x9D2E44A7), None)]
        ids = self._metrics(rows)
        changed = {"crude-12": 2, "reformer-03": 5, "utilities-05": 1}
        self._many("INSERT INTO value(metric_id, time, number) VALUES %s", [
            (ids[devices[self.boxes[name]], "config_hash"], self._ago(days * DAY), float(self.dice.getrandbits(32)))
            for name, last in changed.items() for days in (last, 40)])

    def _loops(self):
        rows, self.loops = [], {}
        for area, (name, box) in enumerate(self.boxes.items(), 1):
            for n in range(1, LOOPS + 1):
                kind = KINDS[(7 * area + n) % len(KINDS)]
                tag = f"{kind}-{area:02}{n:02}"
                if self.hostile and (name, n) == (SICK[1][0], SICK[1][1]):
                    tag = HOSTILE
                rows.append((box, tag.replace("/", "_"), tag, name != "crude-07"))
                self.loops[name, n] = (box, tag.replace("/", "_"))
        ids = {(b, d): i for b, d, i in self._many("INSERT INTO device(edge_id, name, tag, online) VALUES %s RETURNING edge_id, name, id", rows)}
        self.loops = {key: ids[loop] for key, loop in self.loops.items()}
        sick = {(box, n): size for box, n, _, size, *_ in SICK}
        metrics = []
        for key, device in self.loops.items():
            ill = sick.get(key, 0.0)
            sp = round(self.dice.uniform(20, 80), 1)
            metrics += [(device, "sp", "m³/h", sp, None), (device, "pv", "m³/h", sp + self.dice.gauss(0, 0.3 + 0.1 * ill), None),
                        (device, "co", "%", self.dice.uniform(25, 75), None), (device, "stem", "%", self.dice.uniform(25, 75), None),
                        (device, "variability", "% of PV span", 0.4 + 0.2 * ill + self.dice.random() / 4, None),
                        (device, "travel", "% of CO span/h", self.dice.uniform(80, 400), None), (device, "reversals", "1/h", self.dice.uniform(10, 90), None),
                        (device, "condition/valve", "%", max(0.0, 97 - 7 * ill), None), (device, "condition/control_performance", "%", max(5.0, 93 - 5 * ill), None),
                        (device, "condition/actuator", "%", 96.0, None), (device, "condition/positioner", "%", 91.0, None), (device, "condition/environment", "%", 99.0, None),
                        (device, "detectable/stiction", "% of CO span", 0.9, None), (device, "detectable/backlash", "% of CO span", 1.2, None)]
        self._metrics(metrics)

    def _sick(self, box, n, alarm, size, began, how, acknowledged):
        device = self.loops[box, n]
        ids = self._metrics([(device, f"severity_{alarm}", "% of CO span", size, None), (device, f"alarm/{alarm}/severity", "% of CO span", size, None)])
        history, alarms, was_on = [], [], False
        quarter = 900 * (self.now // 900)
        for k in range(4 * 91, 0, -1):
            days = k / 4
            severity = size_at(days, size, began, how)
            if severity:
                severity = max(0.4, severity + self.dice.gauss(0, 0.03 * size))
            history.append((ids[device, f"severity_{alarm}"], datetime.datetime.fromtimestamp(quarter - days * DAY, datetime.timezone.utc), 1, severity, severity, severity, severity))
            if (severity > 0) != was_on:
                was_on = severity > 0
                alarms.append((device, alarm, self._ago(days * DAY), "unacknowledged" if was_on else "normal", severity if was_on else None))
                if was_on and acknowledged:
                    alarms.append((device, alarm, self._ago(days * DAY - 5 * HOUR), "acknowledged", severity))
        self._many("INSERT INTO history_decimated VALUES %s", history)
        self._many("INSERT INTO alarm VALUES %s", alarms)
        if (box, n) == SICK[0][:2]:
            self._many("INSERT INTO explanation VALUES %s", [(device, self._ago(began * DAY - HOUR), json.dumps(EXPLANATION))])
            self._many("INSERT INTO evidence(device_id, name, sha256, parts, begun, complete) VALUES %s", [
                (device, name, "00", 1, self._ago(began * DAY), self._ago(began * DAY)) for name in ("evidence.json", "record.csv", "explanation.json")])

    def _passing_alarms(self):
        """Inserts alarms that are raised and cleared on healthy valves, as an operator would see
        them."""
        well = {group: [device for (name, n), device in self.loops.items() if name.startswith(group.lower()) and not any(s[:2] == (name, n) for s in SICK)] for group in GROUPS}
        rows = {}
        for k in range(7 * 144):
            end = self.now // 600 * 600 - 600 * k
            for group in GROUPS:
                hour = datetime.datetime.fromtimestamp(end, datetime.timezone.utc).hour + 2
                for _ in range(poisson(self.dice, alarms_in_10_minutes(group, k / 6, hour))):
                    device, name = self.dice.choice(well[group]), self.dice.choice(["stiction", "backlash", "hysteresis", "unknown"])
                    at = end - self.dice.uniform(1, 599)
                    rows[device, name, at] = "unacknowledged"
                    rows[device, name, at + self.dice.uniform(20, 500)] = "normal"
        # In order of time, so that each is raised from normal.
        self._many("INSERT INTO alarm(device_id, name, time, state) VALUES %s", [
            (device, name, datetime.datetime.fromtimestamp(at, datetime.timezone.utc), state) for (device, name, at), state in sorted(rows.items(), key=lambda row: row[0][2])])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=60)
    options = parser.parse_args()
    with FleetPlant(port=options.port) as plant:
        print(plant.url, flush=True)
        time.sleep(60 * options.minutes)


if __name__ == "__main__":
    main()
