-- SPDX-License-Identifier: Apache-2.0
-- Boxes, loops and what they say. Times are UTC by the edge's clock where a comment doesn't say otherwise.

CREATE TABLE edge(
  id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  group_name text NOT NULL,
  name text NOT NULL,
  online boolean NOT NULL DEFAULT false,
  since timestamptz NOT NULL DEFAULT now(),  -- of `online`, by the host's clock
  born timestamptz,                          -- its newest NBIRTH
  births bigint NOT NULL DEFAULT 0,
  clock_offset_s double precision,           -- the edge's clock less the host's, at the newest birth
  conflict timestamptz,                      -- two edges seemed to use the name, by the host's clock
  UNIQUE(group_name, name));

-- Written in the transaction of the values it stands for.
CREATE TABLE ingest_position(
  edge_id integer PRIMARY KEY REFERENCES edge ON DELETE CASCADE,
  bd_seq smallint NOT NULL,
  seq smallint NOT NULL,
  time timestamptz NOT NULL,
  received timestamptz NOT NULL)             -- by the host's clock
  WITH (fillfactor = 50);

CREATE TABLE edge_event(
  edge_id integer NOT NULL REFERENCES edge ON DELETE CASCADE,
  received timestamptz NOT NULL,             -- by the host's clock
  online boolean NOT NULL,
  PRIMARY KEY(edge_id, received));

-- The device '' is the box itself.
CREATE TABLE device(
  id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  edge_id integer NOT NULL REFERENCES edge ON DELETE CASCADE,
  name text NOT NULL,
  tag text NOT NULL,
  online boolean NOT NULL DEFAULT false,
  born timestamptz,
  UNIQUE(edge_id, name));

CREATE TABLE metric(
  id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  name text NOT NULL,
  type text NOT NULL,
  unit text,
  low double precision,
  high double precision,
  alias bigint,
  UNIQUE(device_id, name));

-- The key is what makes a message that comes twice count once. No foreign key: one look-up a value would cost more
-- than all else.
CREATE TABLE value(
  metric_id integer NOT NULL,
  time timestamptz NOT NULL,
  number double precision,
  text text,
  PRIMARY KEY(metric_id, time)) PARTITION BY RANGE(time);
-- What lies outside the partitions: clocks that are wrong, and what is older than is kept.
CREATE TABLE value_rest PARTITION OF value DEFAULT;

CREATE TABLE latest(
  metric_id integer PRIMARY KEY,
  time timestamptz NOT NULL,
  number double precision,
  text text,
  historical boolean NOT NULL)               -- it came late, from an edge's store
  WITH (fillfactor = 50);

-- One row a change of state.
CREATE TABLE alarm(
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  name text NOT NULL,
  time timestamptz NOT NULL,
  state text NOT NULL,
  severity double precision,                 -- % of the CO span
  PRIMARY KEY(device_id, name, time));
CREATE INDEX alarm_time ON alarm(time);

CREATE TABLE explanation(
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  time timestamptz NOT NULL,
  parts jsonb NOT NULL,                      -- by the name behind explanation/
  PRIMARY KEY(device_id, time));

CREATE TABLE evidence(
  id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  name text NOT NULL,
  sha256 text NOT NULL,
  parts integer NOT NULL,
  begun timestamptz NOT NULL DEFAULT now(),  -- by the database's clock
  complete timestamptz,                      -- all parts are here and have that check sum
  damaged boolean NOT NULL DEFAULT false,    -- all parts are here and have another one
  UNIQUE(device_id, name, sha256));

CREATE TABLE evidence_part(
  evidence_id integer NOT NULL REFERENCES evidence ON DELETE CASCADE,
  part integer NOT NULL,
  bytes bytea NOT NULL,
  PRIMARY KEY(evidence_id, part));

-- What a box is to be asked for; sent once by the host that owns its group.
CREATE TABLE request(
  id integer GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  device_id integer NOT NULL REFERENCES device ON DELETE CASCADE,
  metric text NOT NULL,
  value text NOT NULL,
  due timestamptz NOT NULL DEFAULT now(),
  sent timestamptz);
CREATE INDEX request_waiting ON request(due) WHERE sent IS NULL;

CREATE TABLE history_decimated(
  metric_id integer NOT NULL,
  bucket timestamptz NOT NULL,               -- start of the quarter of an hour
  count integer NOT NULL,
  mean double precision NOT NULL,
  low double precision NOT NULL,
  high double precision NOT NULL,
  last double precision NOT NULL,
  PRIMARY KEY(metric_id, bucket)) PARTITION BY RANGE(bucket);
CREATE TABLE history_decimated_rest PARTITION OF history_decimated DEFAULT;

-- Quarters of an hour that have values which their history doesn't know of.
CREATE TABLE history_waiting(
  edge_id integer NOT NULL REFERENCES edge ON DELETE CASCADE,
  bucket timestamptz NOT NULL,
  PRIMARY KEY(edge_id, bucket));

-- One host process a group. Only the database's clock counts.
CREATE TABLE lease(
  group_name text PRIMARY KEY,
  owner text NOT NULL,
  until timestamptz NOT NULL);
