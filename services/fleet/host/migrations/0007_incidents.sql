-- SPDX-License-Identifier: Apache-2.0
-- A box that tells incidents has one line for each, whatever alarms of the loop it raised.

CREATE VIEW incident_now AS
  SELECT m.device_id,
         max(l.text) FILTER (WHERE m.name = 'incident/id') AS id,
         max(l.text) FILTER (WHERE m.name = 'incident/name') AS name,
         max(l.text) FILTER (WHERE m.name = 'incident/cause') AS cause,
         max(l.number) FILTER (WHERE m.name = 'incident/confidence') AS confidence,
         coalesce(max(l.number) FILTER (WHERE m.name = 'incident/active'), 0) > 0 AS active,
         coalesce(max(l.number) FILTER (WHERE m.name = 'incident/unacknowledged'), 0) > 0 AS unacknowledged,
         to_timestamp(max(l.number) FILTER (WHERE m.name = 'incident/raised') / 1000) AS raised
    FROM metric m JOIN latest l ON l.metric_id = m.id
    WHERE m.name IN ('incident/id', 'incident/name', 'incident/cause', 'incident/confidence', 'incident/active',
                     'incident/unacknowledged', 'incident/raised')
    GROUP BY m.device_id;

-- What is on: incidents, and alarms that belong to none. of_valve: the valve is sick; not where the incident is explained
-- by a cause outside of it.
CREATE OR REPLACE VIEW worst_valve AS
  WITH standing AS (
    SELECT l.group_name, l.edge, l.tag, l.online, n.device_id, n.name, n.state, n.severity, n.changed, is_of_valve(n.name) AS of_valve,
           i.id, i.name AS incident, i.cause, i.unacknowledged, i.raised
      FROM alarm_now n JOIN loop l ON l.device_id = n.device_id
        LEFT JOIN LATERAL (
          SELECT * FROM incident_now o
            WHERE o.device_id = n.device_id AND o.active AND o.name <> '' AND (is_of_valve(n.name) OR n.name = 'model_gap')) i ON true
      WHERE n.active)
  SELECT s.group_name, s.edge, s.tag, s.name AS alarm, s.state, s.severity,
         coalesce((SELECT max(r.time) FROM alarm_raised r
                     WHERE r.device_id = s.device_id AND r.name = s.name AND r.raised),
                  s.changed) AS since,
         s.online, s.device_id, s.of_valve
    FROM standing s WHERE s.id IS NULL
  UNION ALL
  SELECT s.group_name, s.edge, s.tag, s.incident, CASE WHEN s.unacknowledged THEN 'unacknowledged' ELSE 'acknowledged' END,
         max(s.severity) FILTER (WHERE s.of_valve AND s.cause IN ('valve', 'unknown')), coalesce(s.raised, min(s.changed)), s.online, s.device_id,
         CASE s.cause WHEN 'valve' THEN true WHEN 'unknown' THEN bool_or(s.of_valve) ELSE false END
    FROM standing s WHERE s.id IS NOT NULL
    GROUP BY s.group_name, s.edge, s.tag, s.incident, s.unacknowledged, s.cause, s.raised, s.online, s.device_id;
