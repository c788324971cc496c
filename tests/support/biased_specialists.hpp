// SPDX-License-Identifier: Apache-2.0
// Specialists without training that give the same answer for every window. For tests of the later
// stages.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "config/specialists/specialist_folder.hpp"

namespace loopwarden::tests {

inline void write_biased_specialists(const std::filesystem::path& folder,
                                     specialist::Condition always, double period_s = 0.1) {
  specialist::Team team;
  team.facts = {.period_s = period_s,
                .gain = 1.2,
                .time_constant_s = 1.7,
                .dead_time_s = 2.6,
                .co_low = 0.0,
                .co_high = 10.0,
                .pv_low = 0.0,
                .pv_high = 10.0};
  team.scale.fill(1.0);
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    specialist::TeamMember& member = team.members[c];
    member.condition = static_cast<specialist::Condition>(c);
    member.name = std::string("T") + std::to_string(c);
    member.network = specialist::Network({specialist::kNetworkInputs, 2, 2, 1});
    member.network.layers[2].bias[0] = member.condition == always ? 12.0 : 0.0;
    member.most_misfit = 100.0;
  }
  config::SpecialistFolder all;
  all.plant = "T";
  all.training.source = "untrained: the same answer for every window";
  all.team = team;
  std::filesystem::create_directories(folder);
  const std::string wrong = config::write_specialists(all, folder);
  if (!wrong.empty()) throw std::runtime_error(wrong);
}

}  // namespace loopwarden::tests
