// SPDX-License-Identifier: Apache-2.0
// Writes the state of the daemon as a text file in the Prometheus text exposition format 0.0.4, for
// example for the textfile collector of node_exporter.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

// Returns the text of the metrics. `loop` returns the status of one loop.
std::string metrics_text(const protocol::DaemonStatus& daemon, std::size_t loops,
                         const std::function<protocol::LoopStatus(std::size_t)>& loop);

// Replaces the file, readable for all users. Returns false if the disk fails.
bool write_metrics(const std::filesystem::path& path, const std::string& text);

}  // namespace loopwarden::daemon
