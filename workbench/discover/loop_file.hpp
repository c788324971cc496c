// SPDX-License-Identifier: Apache-2.0
// Writes the file of a found loop, with control: elsewhere and backend: feed.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "workbench/discover/found_loops.hpp"

namespace loopwarden::workbench::discover {

struct LoopFileSettings {
  std::string feeder;                     // its name in loopwardend.yaml
  std::string source;                     // origin of the tags, for the first line
  std::optional<double> sample_time_s{};  // empty: guessed
};

struct LoopFile {
  std::string text;
  std::vector<std::string> sure;                             // keys: pv, output.range, ...
  std::vector<std::pair<std::string, std::string>> guessed;  // key, why
  std::vector<std::string> missing;  // key and its meaning; listed at the top of the text

  bool is_complete() const noexcept { return missing.empty(); }
};

// Returns the text of the file. Guessed keys have a comment "# guessed: WHY". Keys that
// `loopwarden check` would refuse count as missing.
LoopFile loop_file(const FoundLoop& loop, const LoopFileSettings& settings);

// Returns the requests of the feeder for all signals whose node is listed. This is the key `nodes`
// of opcua.yaml (loopwarden-opcua) or `metrics` of feed.yaml (loopwarden-feed). Empty: no node is
// listed.
enum class NodeForm { opcua, sparkplug };
std::string node_list(const std::vector<FoundLoop>& loops, NodeForm form);

}  // namespace loopwarden::workbench::discover
