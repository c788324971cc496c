// SPDX-License-Identifier: Apache-2.0
// The file of a loop that was found: control: elsewhere, backend: feed.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "workbench/discover/found_loops.hpp"

namespace loopwarden::workbench::discover {

struct LoopFileSettings {
  std::string feeder;                     // of loopwardend.yaml
  std::string source;                     // where the tags are from, for the first line
  std::optional<double> sample_time_s{};  // else guessed
};

struct LoopFile {
  std::string text;
  std::vector<std::string> sure;                             // keys: pv, output.range, ...
  std::vector<std::pair<std::string, std::string>> guessed;  // key, why
  std::vector<std::string> missing;  // key and what it is; at the top of the text

  bool is_complete() const noexcept { return missing.empty(); }
};

// Keys that are guesses carry "# guessed: WHY". What `loopwarden check` would refuse counts as missing.
LoopFile loop_file(const FoundLoop& loop, const LoopFileSettings& settings);

// What the feeder asks for, for all signals whose node is known: the key `nodes` of loopwarden-opcua's opcua.yaml, or
// `metrics` of loopwarden-feed's feed.yaml. Empty: none is.
enum class NodeForm { opcua, sparkplug };
std::string node_list(const std::vector<FoundLoop>& loops, NodeForm form);

}  // namespace loopwarden::workbench::discover
