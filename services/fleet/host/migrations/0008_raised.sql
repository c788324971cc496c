-- SPDX-License-Identifier: Apache-2.0
-- Counted as the box counts: an alarm that comes has come, also where it was suppressed before; not what was acknowledged or
-- on the shelf.

CREATE OR REPLACE VIEW alarm_raised AS
  SELECT a.device_id, a.name, a.time, a.state, a.severity,
         a.state = 'unacknowledged' AND coalesce(
           (SELECT b.state FROM alarm b WHERE b.device_id = a.device_id AND b.name = a.name AND b.time < a.time
              ORDER BY b.time DESC LIMIT 1), 'normal')
           NOT IN ('unacknowledged', 'acknowledged', 'shelved') AS raised
    FROM alarm a;
