// SPDX-License-Identifier: Apache-2.0
// The catalogue of all effects by name, built from the files of this folder. Model files, generated
// documents, fits and analyses use this table; it is the only place that defines the names of
// effects.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects {

// Returns every named effect, including those that only a record can show. The order is that of the
// guides: effects of models by number, then the others.
std::span<const Descriptor> vocabulary() noexcept;
// Returns the effects that a model can contain, by number.
std::span<const Descriptor> effect_catalogue() noexcept;
// Returns the effect of that name in the catalogue; null if the name is unknown.
const Descriptor* find_effect(std::string_view name) noexcept;
// Returns the effect of that name in the vocabulary; null if the name is unknown.
const Descriptor* find_word(std::string_view name) noexcept;

// Checks a spec completely: a spec that passes can be stepped. Throws EffectError.
void check_effect(const EffectSpec& spec, Block block, const EffectContext& context);
// Returns whether one of the effects replaces the dead time of the process.
bool takes_dead_time(const std::vector<EffectSpec>& specs) noexcept;
// Adds missing parameters whose values follow from the process, so that the spec is complete by
// itself.
void complete(EffectSpec& spec, const EffectContext& context);
// Returns the effect of a spec that has passed check_effect() with the same context.
Effect make_effect(const EffectSpec& spec, const EffectContext& context);

// Returns all candidates of `gap`, in the order of the catalogue.
std::vector<Candidate> candidates(const SearchContext& context);

// Returns whether the effect explains an alarm of that name.
bool agrees(const Descriptor& effect, std::string_view alarm) noexcept;

}  // namespace loopwarden::effects
