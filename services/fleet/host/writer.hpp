// SPDX-License-Identifier: Apache-2.0
// Batches into the database: everything of a batch, and how far its edges' messages have come, in one transaction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include <pqxx/pqxx>

#include "services/fleet/host/ingest.hpp"

namespace loopwarden::fleet {

struct WriterSettings {
  bool ask_evidence = true;  // of each alarm that is raised, some minutes later
  int evidence_delay_s = 120;
  std::int64_t most_evidence_bytes = 64LL * 1024LL * 1024LL;  // of one file
};

struct Written {
  std::uint64_t values = 0;      // new rows
  std::uint64_t duplicates = 0;  // values that were there before
};

class Writer {
 public:
  // The connection outlives it.
  Writer(pqxx::connection& connection, WriterSettings settings);

  // Throws pqxx's exceptions; then nothing has been written, and the batch must be made anew: it may hold numbers of rows
  // that don't exist.
  Written write(Batch& batch);

 private:
  class Transaction;

  pqxx::connection& connection_;
  WriterSettings settings_;
};

// Tells `ingest` of the edge nodes of a group (empty: of all groups). `with_births`: for what an earlier run left.
void restore(pqxx::connection& connection, const std::string& group, bool with_births,
             Ingest& ingest);

}  // namespace loopwarden::fleet
