// SPDX-License-Identifier: Apache-2.0
// The daemon's state as a text file in the format of Prometheus (text exposition format 0.0.4), for a
// collector of files such as node_exporter's.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

// From the parts of protocol::Status, the loops one at a time.
std::string metrics_text(const protocol::DaemonStatus& daemon, std::size_t loops,
                         const std::function<protocol::LoopStatus(std::size_t)>& loop);

// Replaces the file as a whole, readable for everyone. False if the disk refuses.
bool write_metrics(const std::filesystem::path& path, const std::string& text);

}  // namespace loopwarden::daemon
