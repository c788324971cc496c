// SPDX-License-Identifier: Apache-2.0
#include "model/plant/leakage.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::leakage {
namespace {

void check(const SpecReader& read, const EffectContext& context) {
  const double span = context.output_high - context.output_low;
  if (read.value("flow") > span) {
    throw EffectError("flow", "flow must be at most the output's span, " + number_text(span) +
                                  " CO units (got " + number_text(read.value("flow")) + ")");
  }
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.parameters = 1,
       .prior_nats = 3.0,  // a bias or a gain that explains a record as well is the commoner cause
       .search = {{"flow", 0.002 * c.span(), 0.6 * c.span(), true, 6}},
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"leakage", {{"flow", v[0]}}};
       },
       .shifts_pv = true});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 19,
      .name = "leakage",
      .blocks = {Block::valve},
      .parameters = {at_least_zero("flow", "CO units", "what passes when shut, at most the span")},
      .header = "leakage.hpp",
      .meaning = "the valve passes flow when it is shut",
      .remedy =
          "Check the seat and the travel at CO 0; a valve that must shut has to be lapped or "
          "replaced.",
      .check = check,
      .make = [](const SpecReader& read, const EffectContext& context) -> plant::Effect {
        return plant::Leakage(read.value("flow"), context.output_low, context.output_high);
      },
      .candidates = candidates,
      .valve_rank = 6,
      .alarms = {"unknown"},
      .seen =
          "There is flow at CO 0, and CO rests lower than it should, the more so the less the "
          "valve "
          "is open. The residual is a straight line over CO that ends where the valve is fully "
          "open.",
      .look_alikes = {{"output_bias",
                       "the same at every opening; a leak fades out as the valve opens. A leak of "
                       "a few per cent "
                       "and a bias are told apart only where CO moves over much of its range."},
                      {"gain_change",
                       "goes through zero where the valve is shut, a leak where it is open."},
                      {"valve_characteristic", "bends, and passes nothing when shut."},
                      {"a transmitter that shows flow at rest",
                       "shows it with the block valve shut as well: shut it and look."}},
      .examples = {{"leakage", {"leakage", {{"flow", 1.0}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::leakage
