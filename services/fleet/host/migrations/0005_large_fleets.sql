-- SPDX-License-Identifier: Apache-2.0
-- Views whose cost doesn't grow with the years that are kept, nor with the square of the boxes.

-- Each alarm's newest state. It stays when the change itself is too old to be kept.
CREATE TABLE alarm_newest(
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  name text NOT NULL,
  time timestamptz NOT NULL,
  state text NOT NULL,
  severity double precision,
  PRIMARY KEY(device_id, name));
CREATE INDEX alarm_active ON alarm_newest(device_id) WHERE state IN ('unacknowledged', 'acknowledged');

INSERT INTO alarm_newest
  SELECT DISTINCT ON (device_id, name) device_id, name, time, state, severity
    FROM alarm ORDER BY device_id, name, time DESC;

CREATE FUNCTION keep_newest_alarm() RETURNS trigger
  LANGUAGE plpgsql AS
$$
BEGIN
  INSERT INTO alarm_newest AS n (device_id, name, time, state, severity)
    SELECT DISTINCT ON (device_id, name) device_id, name, time, state, severity
      FROM inserted ORDER BY device_id, name, time DESC
    ON CONFLICT (device_id, name) DO UPDATE
      SET time = excluded.time, state = excluded.state, severity = excluded.severity
      WHERE excluded.time >= n.time;
  RETURN NULL;
END
$$;
CREATE TRIGGER alarm_newest AFTER INSERT ON alarm REFERENCING NEW TABLE AS inserted
  FOR EACH STATEMENT EXECUTE FUNCTION keep_newest_alarm();

CREATE OR REPLACE VIEW alarm_now AS
  SELECT n.device_id, n.name, n.state, n.time AS changed,
         n.state IN ('unacknowledged', 'acknowledged') AS active,
         coalesce(v.number, n.severity) AS severity
    FROM alarm_newest n
      LEFT JOIN metric m ON m.device_id = n.device_id AND m.name = 'alarm/' || n.name || '/severity'
      LEFT JOIN latest v ON v.metric_id = m.id;

-- Of a span of time only that span is read, and before each line the one that came before.
CREATE OR REPLACE VIEW alarm_raised AS
  SELECT a.device_id, a.name, a.time, a.state, a.severity,
         a.state = 'unacknowledged' AND coalesce(
           (SELECT b.state FROM alarm b WHERE b.device_id = a.device_id AND b.name = a.name AND b.time < a.time
              ORDER BY b.time DESC LIMIT 1), 'normal')
           IN ('normal', 'returned_unacknowledged', 'latched_unacknowledged', 'latched_acknowledged') AS raised
    FROM alarm a;

-- config_differs: of a group in which more than half of the boxes have one and the same configuration.
CREATE OR REPLACE VIEW box_version AS
  WITH said AS (
    SELECT e.id AS edge_id, e.group_name, e.name AS edge,
           max(v.text) FILTER (WHERE v.name = 'version') AS version,
           max(coalesce(v.text, v.number::text)) FILTER (WHERE v.name = 'config_hash') AS config_hash,
           max(coalesce(v.text, v.number::text)) FILTER (WHERE v.name = 'model_hash') AS model_hash
      FROM edge e JOIN device d ON d.edge_id = e.id AND d.name = ''
        LEFT JOIN value_now v ON v.device_id = d.id AND v.name IN ('version', 'config_hash', 'model_hash')
      GROUP BY e.id),
  usual AS (
    SELECT group_name, count(*) AS boxes, mode() WITHIN GROUP (ORDER BY version) AS version,
           mode() WITHIN GROUP (ORDER BY config_hash) AS config_hash,
           mode() WITHIN GROUP (ORDER BY model_hash) AS model_hash
      FROM said GROUP BY group_name),
  common AS (
    SELECT u.group_name, u.config_hash FROM usual u JOIN said s USING (group_name, config_hash)
      GROUP BY u.group_name, u.config_hash, u.boxes HAVING 2 * count(*) > u.boxes)
  SELECT s.edge_id, s.group_name, s.edge, s.version, s.config_hash, s.model_hash,
         s.version IS DISTINCT FROM u.version AS version_differs,
         s.model_hash IS DISTINCT FROM u.model_hash AS model_differs,
         c.config_hash IS NOT NULL AND s.config_hash IS DISTINCT FROM c.config_hash AS config_differs
    FROM said s JOIN usual u USING (group_name) LEFT JOIN common c USING (group_name);
