// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::page {

// The daemon's answer to `describe`, unchanged for browsers.
struct BoxState {
  std::string text;  // JSON
  protocol::Description about;
  std::map<std::string, std::size_t, std::less<>> index;  // of its loops, by tag

  const protocol::LoopDescription* find(std::string_view tag) const {
    const auto it = index.find(tag);
    return it == index.end() ? nullptr : &about.loops[it->second];
  }
};

// Reads an answer. Throws protocol::DaemonError if it is malformed.
std::shared_ptr<const BoxState> box_state_of(const nlohmann::json& answer);

}  // namespace loopwarden::page
