// SPDX-License-Identifier: Apache-2.0
// How to recognise each effect: what an engineer sees, and what tells it from its look-alikes.
#pragma once

#include <span>
#include <string_view>

namespace loopwarden::workbench {

struct LookAlike {
  const char* name;  // another effect, or a cause that is none
  const char* tell;  // what tells them apart
};

struct EffectGuide {
  const char* name;
  const char* seen;
  std::span<const LookAlike> look_alikes;
};

// In the order of the catalogue, controller_mismatch last.
std::span<const EffectGuide> effect_guides() noexcept;
// Null if there is none.
const EffectGuide* find_guide(std::string_view name) noexcept;

}  // namespace loopwarden::workbench
