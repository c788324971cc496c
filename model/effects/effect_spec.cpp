// SPDX-License-Identifier: Apache-2.0
#include "model/effects/effect_spec.hpp"

#include "model/numeric/enum_name.hpp"

namespace loopwarden::effects {

const char* to_text(Block block) noexcept {
  return numeric::enum_name<Block::disturbance>(
      block, {"controller", "valve", "process", "transmitter", "disturbance"});
}

}  // namespace loopwarden::effects
