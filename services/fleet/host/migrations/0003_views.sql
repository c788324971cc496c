-- SPDX-License-Identifier: Apache-2.0
-- What dashboards and pages ask for.

-- A loop by its names.
CREATE VIEW loop AS
  SELECT d.id AS device_id, e.id AS edge_id, e.group_name, e.name AS edge, d.name AS device, d.tag,
         e.online AND d.online AS online
    FROM device d JOIN edge e ON e.id = d.edge_id WHERE d.name <> '';

-- The newest value of each metric of a loop or box.
CREATE VIEW value_now AS
  SELECT d.edge_id, m.device_id, m.id AS metric_id, m.name, m.unit, l.time, l.number, l.text
    FROM metric m JOIN device d ON d.id = m.device_id JOIN latest l ON l.metric_id = m.id;

CREATE VIEW condition AS
  SELECT device_id, substr(name, 11) AS name, time, number AS percent
    FROM value_now WHERE name LIKE 'condition/%';

-- Each alarm's newest state, and since when its fault has been there.
CREATE VIEW alarm_now AS
  SELECT DISTINCT ON (a.device_id, a.name) a.device_id, a.name, a.state, a.time AS changed,
         a.state IN ('unacknowledged', 'acknowledged') AS active,
         coalesce(v.number, a.severity) AS severity
    FROM alarm a
      LEFT JOIN metric m ON m.device_id = a.device_id AND m.name = 'alarm/' || a.name || '/severity'
      LEFT JOIN latest v ON v.metric_id = m.id
    ORDER BY a.device_id, a.name, a.time DESC;

-- Each change of an alarm's state, and whether the alarm was raised by it.
CREATE VIEW alarm_raised AS
  SELECT device_id, name, time, state, severity,
         state = 'unacknowledged' AND coalesce(lag(state) OVER each, 'normal')
           IN ('normal', 'returned_unacknowledged', 'latched_unacknowledged', 'latched_acknowledged') AS raised
    FROM alarm WINDOW each AS (PARTITION BY device_id, name ORDER BY time);

-- The plant's sick valves, worst first where ordered by severity.
CREATE VIEW worst_valve AS
  SELECT l.group_name, l.edge, l.tag, n.name AS alarm, n.state, n.severity,
         coalesce((SELECT max(r.time) FROM alarm_raised r
                     WHERE r.device_id = n.device_id AND r.name = n.name AND r.raised),
                  n.changed) AS since,
         l.online, l.device_id
    FROM alarm_now n JOIN loop l ON l.device_id = n.device_id WHERE n.active;

CREATE VIEW silent_box AS
  SELECT e.group_name, e.name AS edge, e.online, e.since, p.received AS heard, now() - p.received AS silence,
         e.clock_offset_s, e.conflict
    FROM edge e LEFT JOIN ingest_position p ON p.edge_id = e.id
    WHERE NOT e.online OR p.received IS NULL OR p.received < now() - interval '2 minutes';

-- Version and hashes of each box, and whether they are its group's most frequent ones.
CREATE VIEW box_version AS
  WITH said AS (
    SELECT e.id AS edge_id, e.group_name, e.name AS edge,
           max(v.text) FILTER (WHERE v.name = 'version') AS version,
           max(coalesce(v.text, v.number::text)) FILTER (WHERE v.name = 'config_hash') AS config_hash,
           max(coalesce(v.text, v.number::text)) FILTER (WHERE v.name = 'model_hash') AS model_hash
      FROM edge e JOIN device d ON d.edge_id = e.id AND d.name = '' LEFT JOIN value_now v ON v.device_id = d.id
      GROUP BY e.id)
  SELECT s.*, s.version IS DISTINCT FROM
              mode() WITHIN GROUP (ORDER BY o.version) AS version_differs,
         s.model_hash IS DISTINCT FROM
              mode() WITHIN GROUP (ORDER BY o.model_hash) AS model_differs
    FROM said s JOIN said o ON o.group_name = s.group_name
    GROUP BY s.edge_id, s.group_name, s.edge, s.version, s.config_hash, s.model_hash;

-- Boxes whose configuration is no longer what it was: each hash with the time it came.
CREATE VIEW configuration_change AS
  SELECT e.group_name, e.name AS edge, v.time, coalesce(v.text, v.number::text) AS config_hash
    FROM edge e JOIN device d ON d.edge_id = e.id AND d.name = ''
      JOIN metric m ON m.device_id = d.id AND m.name = 'config_hash' JOIN value v ON v.metric_id = m.id;

-- Alarms raised in each 10 minutes of a group that had any. ISA-18.2 on average: about 1 in 10 minutes is acceptable,
-- 2 the most that can be managed; more than 10 in 10 minutes is a flood.
CREATE VIEW alarm_rate AS
  SELECT l.group_name, date_bin('10 minutes', r.time, timestamptz '2000-01-01 00:00+00') AS bucket, count(*) AS raised
    FROM alarm_raised r JOIN loop l ON l.device_id = r.device_id
    WHERE r.raised
    GROUP BY 1, 2;
