// SPDX-License-Identifier: Apache-2.0
#include "model/effects/clipped_measurement/clipped_measurement.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::clipped_measurement {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (!read.has("low") && !read.has("high")) {
    throw EffectError("", "effect 'clipped_measurement' needs low or high, or both");
  }
  if (!(read.value("low") < read.value("high"))) {
    refuse(read, "high", "above low = " + number_text(read.value("low")) + " PV units");
  }
}

// The search covers ends in the outer half of the range of PV. Ends at which PV is exactly flat are
// found without a search (model/gap/reading.hpp).
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  constexpr int kPlaces = 24;
  const double middle = (c.pv_low + c.pv_high) / 2.0;
  const double beyond = 0.1 * (c.pv_high - c.pv_low);
  for (const bool high : {true, false}) {
    const SearchRange range = high ? between("high", middle, c.pv_high + beyond, false, kPlaces)
                                   : between("low", c.pv_low - beyond, middle, false, kPlaces);
    all.push_back({.block = Block::transmitter,
                   .parameters = 1,
                   .prior_nats = 1.0,  // the search has two ends to choose from
                   .search = {range},
                   .hides = true});
  }
}

}  // namespace

Descriptor describe() {
  return {
      .number = 20,
      .name = "clipped_measurement",
      .blocks = {Block::transmitter},
      .parameters = {optional(any_value("low", "PV units", "no reading is below"), -kInfinity),
                     optional(any_value("high", "PV units", "no reading is above"), kInfinity)},
      .header = "clipped_measurement/clipped_measurement.hpp",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext&) -> Effect {
        return ClippedMeasurement(read.value("low"), read.value("high"));
      },
      .candidates = candidates,
      .examples = {
          {"clipped_measurement", {"clipped_measurement", {{"high", 5.2}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::clipped_measurement
