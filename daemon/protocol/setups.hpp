// SPDX-License-Identifier: Apache-2.0
// Unfinished setups of loops, as stored by `loopwarden setup`. The page shows them.
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
  std::string state{};  // done; open; running: `loopwarden setup` executes it now
  std::optional<std::int64_t> since_ms{};  // UTC; only while it is running
};

struct SetupUnderWay {
  std::string loop{};
  std::optional<std::int64_t> begun_ms{};  // UTC
  std::string command{};                   // continues the setup
  std::vector<SetupStep> steps{};          // all steps, in order
};

struct Setups {
  std::vector<SetupUnderWay> setups{};
};

struct SetupsRequest {
  static constexpr const char* kName = "setups";
  using Answer = Setups;
};

}  // namespace loopwarden::protocol
