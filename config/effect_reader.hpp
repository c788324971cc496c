// SPDX-License-Identifier: Apache-2.0
// Reads effects as they appear in files: {effect: stiction, s: 0.9, j: 0.3}. The catalogue defines
// names, parameters, ranges and options (model/effects/catalogue.hpp).
#pragma once

#include <vector>

#include "config/map_reader.hpp"
#include "model/effects/catalogue.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

// Reads the list at `key` of effects of one block.
std::vector<effects::EffectSpec> read_effects(MapReader& in, std::string_view key,
                                              effects::Block block,
                                              const effects::EffectContext& context,
                                              const char* meaning);

// Reads the list at `faults`: effects with a schedule.
std::vector<plant::ScheduledFault> read_faults(MapReader& in,
                                               const effects::EffectContext& context);

// Returns the catalogue as a Markdown table.
std::string describe_effects();

}  // namespace loopwarden::config
