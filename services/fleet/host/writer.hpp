// SPDX-License-Identifier: Apache-2.0
// Writes batches to the database. All rows of a batch and the positions of its edges are written in
// one transaction.
#pragma once

#include <cstdint>
#include <string>

#include <pqxx/pqxx>

#include "services/fleet/host/ingest.hpp"

namespace loopwarden::fleet {

struct WriterSettings {
  bool ask_evidence = true;  // for each raised alarm, some minutes later
  int evidence_delay_s = 120;
  std::int64_t most_evidence_bytes = 64LL * 1024LL * 1024LL;  // per file
};

struct Written {
  std::uint64_t values = 0;      // new rows
  std::uint64_t duplicates = 0;  // values that were stored before
};

class Writer {
 public:
  // The connection must outlive the writer.
  Writer(pqxx::connection& connection, WriterSettings settings);

  // Writes a batch. Throws pqxx's exceptions. The batch is then not written and must be prepared
  // again, because it may contain numbers of rows that don't exist.
  Written write(Batch& batch);

 private:
  class Transaction;

  pqxx::connection& connection_;
  WriterSettings settings_;
};

// Passes the edge nodes of a group (empty: of all groups) from the database to `ingest`.
// `with_births`: for messages of an earlier run.
void restore(pqxx::connection& connection, const std::string& group, bool with_births,
             Ingest& ingest);

}  // namespace loopwarden::fleet
