// SPDX-License-Identifier: Apache-2.0
// Effects as they stand in files: {effect: stiction, s: 0.9, j: 0.3}. Names, parameters, ranges
// and options are those of the catalogue (model/effects/catalogue.hpp).
#pragma once

#include <optional>
#include <vector>

#include "config/map_reader.hpp"
#include "model/effects/catalogue.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

// The list at `key` of effects of one block.
std::vector<effects::EffectSpec> read_effects(MapReader& in, std::string_view key, effects::Block block,
                                            const effects::EffectContext& context,
                                            const char* meaning);

// The list at `faults`: effects with a schedule.
std::vector<plant::ScheduledFault> read_faults(MapReader& in,
                                               const effects::EffectContext& context);

// The catalogue as a Markdown table.
std::string describe_effects();

}  // namespace loopwarden::config
