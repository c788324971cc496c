-- SPDX-License-Identifier: Apache-2.0
-- Alarms of the valve itself; the others are of its loop.
CREATE FUNCTION is_of_valve(alarm text) RETURNS boolean LANGUAGE sql IMMUTABLE AS
$$ SELECT alarm IN ('stiction', 'backlash', 'hysteresis', 'low_air_supply', 'unknown') $$;

-- A request is open until it is answered: what is asked for comes in messages that nobody confirms.
ALTER TABLE request
  ADD COLUMN tries integer NOT NULL DEFAULT 0,   -- how often it was sent
  ADD COLUMN done timestamptz,                   -- answered, or given up
  ADD COLUMN answer text;                        -- what came of it
UPDATE request SET done = sent, tries = 1 WHERE sent IS NOT NULL;
DROP INDEX request_waiting;
CREATE INDEX request_waiting ON request(due) WHERE done IS NULL;

ALTER TABLE evidence ADD COLUMN folder text;     -- at the box; files of one folder belong together
