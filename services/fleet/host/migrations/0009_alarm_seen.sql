-- SPDX-License-Identifier: Apache-2.0
-- Each alarm's state at the newest time for which it was reported, also where that changed nothing. A change that is
-- reported later and is older is followed by this state.
CREATE TABLE alarm_seen(
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  name text NOT NULL,
  time timestamptz NOT NULL,
  state text NOT NULL,
  severity double precision,
  PRIMARY KEY(device_id, name))
  WITH (fillfactor = 50);

INSERT INTO alarm_seen SELECT device_id, name, time, state, severity FROM alarm_newest;
