// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/evidence/evidence_store.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/reports/report_queue.hpp"

namespace loopwarden::daemon::console {

// The daemon's files: journal, evidence of alarms, reports. Any thread; outlives the servers.
struct Archive {
  journal::Journal& journal;
  const EvidenceStore& evidence;
  reports::ReportQueue& reports;
};

}  // namespace loopwarden::daemon::console
