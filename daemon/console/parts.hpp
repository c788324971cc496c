// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/host/box_board.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/gateway/map_values.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/supervision/watch_board.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/reports/report_desk.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::console {

// What the sockets show, and what they give orders to. All of it outlives them, and may be used by any thread but for
// the loops' orders, which are lw-control's. The loops may come after the sockets, before they are served.
struct Parts {
  std::vector<LoopRuntime>& loops;
  Historian& historian;
  supervision::WatchBoard& board;
  host::BoxBoard& box_alarms;
  journal::Journal& journal;
  const EvidenceStore& evidence;
  reports::ReportDesk& reports;
  double severe_percent;  // % of the CO span
  std::function<protocol::DaemonStatus()> daemon_status;
  std::function<protocol::Description()> box_description;  // without the loops
  std::function<protocol::Links()> links;
  std::filesystem::path configuration;         // its folder, absolute
  std::function<std::uint32_t()> config_hash;  // of what is in force
  // A number to ask for, or std::runtime_error; what has become of it, nothing: there is no such.
  std::function<std::uint64_t(const std::string& peer, bool dry_run, bool take_file)> reload;
  std::function<std::optional<protocol::ReloadState>(std::uint64_t number)> reload_state;
  std::function<std::string(std::size_t loop)> twin;    // its file's text; empty: it has none
  std::function<gateway::BoxReading()> box;             // for the registers
  std::function<gateway::ServerState()> modbus_server;  // the same
  // Whether what the loop goes by is kept for the next start; empty: nothing is kept.
  std::function<bool(std::size_t loop)> order_kept{};
};

}  // namespace loopwarden::daemon::console
