// SPDX-License-Identifier: Apache-2.0
// The state of a loop in one cycle: mode, fault and form of the jacket. Records and the register
// map store the numbers of the enumerators: they never change.
#pragma once

#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::control {

// loop_controller.hpp describes the modes.
enum class Mode : std::uint8_t { manual, automatic, fallback };

constexpr const char* to_text(Mode mode) noexcept {
  return numeric::enum_name<Mode::fallback>(mode, {"MAN", "AUTO", "FALLBACK"});
}

// supervisor.hpp describes the faults.
enum class Fault : std::uint8_t {
  none,
  starting,
  bad_pv,
  output_lost,
  late_cycle,
  not_finite,
  enable_open,
  stop,
  output_unknown
};

constexpr const char* to_text(Fault fault) noexcept {
  return numeric::enum_name<Fault::output_unknown>(
      fault, {"none", "starting", "bad PV", "output lost", "late cycle", "not finite",
              "enable open", "stop", "output unknown"});
}

// stickband_jacket.hpp describes the forms.
enum class JacketForm : std::uint8_t { off, paper, bounded, dwell };

}  // namespace loopwarden::control
