// SPDX-License-Identifier: Apache-2.0
#include "config/interlocks.hpp"

#include <cmath>

namespace loopwarden::config {

Backing backing_of(const Io& io) noexcept {
  return {.simulated = std::holds_alternative<SimIo>(io),
          .hardware = std::holds_alternative<hal::modbus::LoopModbusSettings>(io) ||
                      std::holds_alternative<hal::iio::AnalogSettings>(io)};
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
