// SPDX-License-Identifier: Apache-2.0
#include "model/gap/archived.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

double gain_of(const plant::LoopModel& model) {
  return model.process.integrating() ? 0.0 : std::abs(model.process.gain);
}

// Widest parameter that is a band in CO units; 0: the effect has none.
double band_of(const effects::EffectSpec& spec) {
  constexpr std::array<std::string_view, 8> kBands{"s",    "deadband", "width",     "offset",
                                                   "step", "jump",     "s_closing", "band"};
  double widest = 0.0;
  for (const auto& [name, value] : spec.parameters) {
    if (std::find(kBands.begin(), kBands.end(), name) != kBands.end())
      widest = std::max(widest, std::abs(value));
  }
  return widest;
}

}  // namespace

double sees_from(const plant::LoopModel& model, const Deviations& deviations) {
  const double gain = gain_of(model);
  return 2.0 * std::max(deviations.co, gain > 0.0 ? deviations.pv / gain : 0.0);
}

double archive_error(const plant::LoopModel& model, const Deviations& deviations) {
  return std::hypot(deviations.pv, gain_of(model) * deviations.co) / std::sqrt(3.0);
}

bool doubtful(const effects::EffectSpec& spec, effects::Block block, const plant::LoopModel& model,
              const Deviations& deviations) {
  const double band = band_of(spec);
  return spec.name == "held_measurement" || spec.name == "clipped_measurement" ||
         spec.name == "resolution" ||
         (block == effects::Block::valve && band > 0.0 && band < sees_from(model, deviations));
}

std::string archive_note(const plant::LoopModel& model, const Deviations& deviations) {
  if (!deviations.known) {
    return "An archive kept only a part of the samples, by an unknown rule: no effect can be named "
           "from this record.";
  }
  const double narrowest = sees_from(model, deviations);
  if (narrowest == 0.0) {
    return "An archive kept only a part of the samples, by an unknown rule: PV is compared at its "
           "stored values, and CO is held in between.";
  }
  return numeric::text(
      "An archive kept PV to about %.2g and CO to about %.2g of their units: effects narrower than "
      "%.2g CO units are not visible in this record.",
      deviations.pv, deviations.co, narrowest);
}

}  // namespace loopwarden::gap
