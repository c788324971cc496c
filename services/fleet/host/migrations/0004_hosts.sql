-- SPDX-License-Identifier: Apache-2.0
-- Host processes that are there, and the groups that each may serve. Only the database's clock counts.
CREATE TABLE host(
  owner text NOT NULL,                       -- as in lease
  group_name text NOT NULL,
  until timestamptz NOT NULL,
  PRIMARY KEY(owner, group_name));
