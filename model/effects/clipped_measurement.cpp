// SPDX-License-Identifier: Apache-2.0
#include "model/plant/clipped_measurement.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::clipped_measurement {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (!read.has("low") && !read.has("high")) {
    throw EffectError("", "effect 'clipped_measurement' needs low or high, or both");
  }
  if (!(read.value("low") < read.value("high"))) {
    throw EffectError("high", "high must be above low = " + number_text(read.value("low")) +
                                  " PV units (got " + number_text(read.value("high")) + ")");
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
      .header = "clipped_measurement.hpp",
      .meaning = "the measurement ends inside its range",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext&) -> plant::Effect {
        return plant::ClippedMeasurement(read.value("low"), read.value("high"));
      },
      .seen =
          "PV stops at one value and lies there flat, without noise, while CO goes on; with a "
          "set point beyond it CO winds up to its stop. Compare the transmitter's span with "
          "the scaling in the control system, and look for what saturates in between.",
      .look_alikes = {{"low_air_supply", "ends the stem's travel: PV lies there with its noise."},
                      {"stiction", "PV rests at other values each time, with its noise."},
                      {"a range that ends there",
                       "is no fault: the model's transmitter range says so."}},
      .examples = {
          {"clipped_measurement", {"clipped_measurement", {{"high", 5.2}}}, Block::transmitter}}};
}

}  // namespace loopwarden::effects::clipped_measurement
