// SPDX-License-Identifier: Apache-2.0
#include "config/interlocks.hpp"

#include <cmath>

namespace loopwarden::config {

Backing backing_of(const Io& io) noexcept {
  const bool simulated = std::holds_alternative<SimIo>(io);
  // What is not known to move nothing is hardware.
  return {.simulated = simulated,
          .hardware = !simulated && !std::holds_alternative<hal::replay::ReplaySettings>(io)};
}

JacketInterlocks interlocks_of(const control::JacketSettings& jacket, Backing backing) noexcept {
  return {.paper = jacket.form == control::JacketForm::paper && !backing.simulated,
          .max_mean_error = backing.hardware && !std::isfinite(jacket.max_mean_error)};
}

bool lacks_limit(const control::CompensatorSettings& compensator, Backing backing) noexcept {
  return compensator.kind != control::CompensatorKind::none && !compensator.shadow &&
         backing.hardware && !std::isfinite(compensator.limit);
}

}  // namespace loopwarden::config
