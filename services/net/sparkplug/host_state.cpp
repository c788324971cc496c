// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/host_state.hpp"

#include <nlohmann/json.hpp>

namespace loopwarden::sparkplug {
namespace {

// The year 2100, in ms. A state with a later time would block all later states, so it is refused.
constexpr std::uint64_t kLastTime = 4'102'444'800'000;

}  // namespace

std::string to_text(const HostState& state) {
  return nlohmann::json{{"online", state.online}, {"timestamp", state.time_ms}}.dump();
}

std::optional<HostState> parse_host_state(std::string_view text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto online = json.find("online");
  const auto time = json.find("timestamp");
  if (online == json.end() || !online->is_boolean()) return std::nullopt;
  if (time == json.end() || !time->is_number_unsigned()) return std::nullopt;
  const HostState state{online->get<bool>(), time->get<std::uint64_t>()};
  return state.time_ms < kLastTime ? std::optional(state) : std::nullopt;
}

bool HostWatch::hear(const HostState& state) {
  if (known_ && state.time_ms < known_->time_ms) return false;
  known_ = state;
  return true;
}

}  // namespace loopwarden::sparkplug
