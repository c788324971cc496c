// SPDX-License-Identifier: Apache-2.0
// Setups of loops that have begun and are not done: what `loopwarden setup` keeps of them, for who looks on.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/protocol/message.hpp"

namespace loopwarden::protocol {

struct SetupStepName {
  const char* name;
  const char* title;
};
inline constexpr std::array kSetupSteps{
    SetupStepName{"loop", "the loop"},
    SetupStepName{"devices", "its devices and registers"},
    SetupStepName{"file", "its file, and what the output does when something fails"},
    SetupStepName{"start", "the daemon runs it"},
    SetupStepName{"watchdog", "the device's watchdog, let run out"},
    SetupStepName{"stroke", "stroke of the valve"},
    SetupStepName{"record", "a record while the set point moves"},
    SetupStepName{"commission", "its twin and specialists"},
    SetupStepName{"masters", "register map for masters"}};

struct SetupStep {
  std::string name{}, title{};
  std::string state{};                     // done; open; running: `loopwarden setup` is at it now
  std::optional<std::int64_t> since_ms{};  // UTC, of one that is running
};

struct SetupUnderWay {
  std::string loop{};
  std::optional<std::int64_t> begun_ms{};  // UTC
  std::string command{};                   // goes on with it
  std::vector<SetupStep> steps{};          // all, in their order
};

struct Setups {
  std::vector<SetupUnderWay> setups{};
};

struct SetupsRequest {
  static constexpr const char* kName = "setups";
  using Answer = Setups;
};

}  // namespace loopwarden::protocol
