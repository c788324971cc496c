// SPDX-License-Identifier: Apache-2.0
// The daemon's state as a text file in the format of Prometheus (text exposition format 0.0.4), for a
// collector of files such as node_exporter's.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace loopwarden::daemon {

// From what the control socket answers to {"request": "status"}.
std::string metrics_text(const nlohmann::json& status);

// Replaces the file as a whole, readable for everyone. False if the disk refuses.
bool write_metrics(const std::filesystem::path& path, const std::string& text);

}  // namespace loopwarden::daemon
