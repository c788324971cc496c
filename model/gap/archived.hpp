// SPDX-License-Identifier: Apache-2.0
// Limits of a record of which an archive kept only a part (analysis/archive.hpp).
//
// Between stored values PV and CO are intervals, so even a perfect model misses PV by
//
//   c = sqrt((d_PV^2 + (K d_CO)^2) / 3)        PV units
//
//   d_PV, d_CO  deviations or dead bands, within a factor of two
//   K           gain of the model; 0 for an integrating process
//   1/3         errors are equally likely anywhere in the interval
//
// c counts as noise of the transmitter. Effects that are narrower than 2 max(d_CO, d_PV / K), and
// effects that an archive itself produces, are not named. If the deviations are unknown, no effect
// is named.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::gap {

struct Deviations {
  double pv = 0.0;    // PV units
  double co = 0.0;    // CO units
  bool known = true;  // false: at least one of them is larger by an unknown amount
};

// Width of the narrowest visible effect, CO units.
double sees_from(const plant::LoopModel& model, const Deviations& deviations);
// c, PV units.
double archive_error(const plant::LoopModel& model, const Deviations& deviations);
// Whether the archive may have produced what looks like this effect.
bool doubtful(const effects::EffectSpec& spec, effects::Block block, const plant::LoopModel& model,
              const Deviations& deviations);
// For the notes of a result.
std::string archive_note(const plant::LoopModel& model, const Deviations& deviations);

}  // namespace loopwarden::gap
