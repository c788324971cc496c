// SPDX-License-Identifier: Apache-2.0
// Every effect by name. Model files, generated documents, the fits and the analyses all go by this
// table; no other place knows effects by name. It is made from the files of this folder.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects {

// Every effect there is a word for, what a model holds and what only a record shows, in the order in
// which guides show them: those that a model holds by number, then the rest.
std::span<const Descriptor> vocabulary() noexcept;
// Those that a model can hold, by number.
std::span<const Descriptor> effect_catalogue() noexcept;
// In the catalogue; null if there is no such effect.
const Descriptor* find_effect(std::string_view name) noexcept;
// In the vocabulary; null if there is no such word.
const Descriptor* find_word(std::string_view name) noexcept;

// Throws EffectError. Does all the checking there is, so that a spec that passes can be stepped.
void check_effect(const EffectSpec& spec, Block block, const EffectContext& context);
// Whether one of them stands in the place of the process's dead time.
bool takes_dead_time(const std::vector<EffectSpec>& specs) noexcept;
// Puts in what is not given and follows from the process: a spec that stands for itself.
void complete(EffectSpec& spec, const EffectContext& context);
// `spec` must have passed check_effect() with the same context.
Effect make_effect(const EffectSpec& spec, const EffectContext& context);

// All that `gap` looks for, in the order of the catalogue.
std::vector<Candidate> candidates(const SearchContext& context);

// Whether the effect explains an alarm of that name.
bool agrees(const Descriptor& effect, std::string_view alarm) noexcept;

}  // namespace loopwarden::effects
