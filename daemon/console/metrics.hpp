// SPDX-License-Identifier: Apache-2.0
// The daemon's state as a text file in the format of Prometheus (text exposition format 0.0.4), for a
// collector of files such as node_exporter's.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace loopwarden::daemon {

// From what the control socket answers to {"request": "status"}: `daemon`, and one of `loops` at a time, since all of
// them as a tree take some 30 kB a loop.
std::string metrics_text(const nlohmann::json& daemon, std::size_t loops,
                         const std::function<nlohmann::json(std::size_t)>& loop);

// Replaces the file as a whole, readable for everyone. False if the disk refuses.
bool write_metrics(const std::filesystem::path& path, const std::string& text);

}  // namespace loopwarden::daemon
