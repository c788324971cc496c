-- SPDX-License-Identifier: Apache-2.0
-- Partitions of value (a day each) and history_decimated (a month each), aligned to UTC.

CREATE FUNCTION partition_start(step text, moment timestamptz) RETURNS timestamptz
  LANGUAGE sql STABLE AS
$$ SELECT date_trunc(step, moment, 'UTC') $$;

-- Makes the partition that holds `moment`, if it is missing. Rows of the rest that belong there move.
CREATE FUNCTION make_partition(parent text, time_column text, step text, moment timestamptz) RETURNS void
  LANGUAGE plpgsql AS
$$
DECLARE
  low timestamptz := partition_start(step, moment);
  high timestamptz := partition_start(step, low + ('1 ' || step)::interval + interval '12 hours');
  part text := parent || to_char(low AT TIME ZONE 'UTC', '_YYYYMMDD');
BEGIN
  IF to_regclass(part) IS NOT NULL THEN RETURN; END IF;
  EXECUTE format('LOCK TABLE %I IN ACCESS EXCLUSIVE MODE', parent);
  EXECUTE format('CREATE TABLE %I (LIKE %I)', part, parent);
  EXECUTE format('WITH moved AS (DELETE FROM %1$I WHERE %2$I >= $1 AND %2$I < $2 RETURNING *) '
                 'INSERT INTO %3$I SELECT * FROM moved', parent || '_rest', time_column, part)
    USING low, high;
  EXECUTE format('ALTER TABLE %I ATTACH PARTITION %I FOR VALUES FROM (%L) TO (%L)', parent, part, low, high);
END
$$;

-- Drops the partitions that end before `oldest`, and rows of the rest that are older.
CREATE FUNCTION drop_partitions(parent text, time_column text, step text, oldest timestamptz) RETURNS integer
  LANGUAGE plpgsql AS
$$
DECLARE
  part record;
  dropped integer := 0;
BEGIN
  FOR part IN
    SELECT child.relname AS name FROM pg_inherits
      JOIN pg_class child ON child.oid = inhrelid
      WHERE inhparent = parent::regclass AND child.relname ~ ('^' || parent || '_[0-9]{8}$')
  LOOP
    IF to_timestamp(right(part.name, 8) || '+00', 'YYYYMMDDTZH') + ('1 ' || step)::interval <= oldest THEN
      EXECUTE format('DROP TABLE %I', part.name);
      dropped := dropped + 1;
    END IF;
  END LOOP;
  EXECUTE format('DELETE FROM %I WHERE %I < $1', parent || '_rest', time_column) USING oldest;
  RETURN dropped;
END
$$;

-- Makes the partitions of the next days; called often, does little.
CREATE FUNCTION make_partitions(days integer) RETURNS void
  LANGUAGE plpgsql AS
$$
BEGIN
  FOR day IN -1 .. days LOOP
    PERFORM make_partition('value', 'time', 'day', now() + day * interval '1 day');
    PERFORM make_partition('history_decimated', 'bucket', 'month', now() + day * interval '1 day');
  END LOOP;
END
$$;

-- The history of an edge's quarter of an hour, made anew from its values.
CREATE FUNCTION decimate(the_edge integer, the_bucket timestamptz) RETURNS void
  LANGUAGE sql AS
$$
  INSERT INTO history_decimated
    SELECT v.metric_id, the_bucket, count(*), avg(v.number), min(v.number), max(v.number),
           (array_agg(v.number ORDER BY v.time DESC))[1]
      FROM device d JOIN metric m ON m.device_id = d.id
        JOIN value v ON v.metric_id = m.id AND v.time >= the_bucket AND v.time < the_bucket + interval '15 minutes'
      WHERE d.edge_id = the_edge AND v.number IS NOT NULL
      GROUP BY v.metric_id
    ON CONFLICT (metric_id, bucket) DO UPDATE
      SET count = excluded.count, mean = excluded.mean, low = excluded.low, high = excluded.high,
          last = excluded.last
$$;
