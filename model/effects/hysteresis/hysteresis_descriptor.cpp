// SPDX-License-Identifier: Apache-2.0
#include "model/effects/descriptor.hpp"
#include "model/effects/hysteresis/hysteresis_offset.hpp"
#include "model/effects/hysteresis/hysteresis_width.hpp"

namespace loopwarden::effects::hysteresis {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (read.has("offset") == read.has("width")) {
    throw EffectError("", "hysteresis takes either offset or width");
  }
  if (read.has("knee") && !read.has("width")) {
    throw EffectError("knee", "knee belongs to width");
  }
}

Effect make(const SpecReader& read, const EffectContext&) {
  if (read.has("width")) return HysteresisWidth(read.value("width"), read.value("knee"));
  return HysteresisOffset(read.value("offset"));
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.smooth = false,
                 .parameters = 2,
                 .search = {{"width", 0.005 * c.span(), 0.8 * c.span(), true, 8},
                            {"knee", -4.0, 0.3, false, 4},
                            kStart},
                 .resting_half_band = [](Candidate::Values v) { return v[0] / 2.0; },
                 .friction = true});
  all.push_back({.smooth = false,
                 .parameters = 1,
                 .search = {{"offset", 0.005 * c.span(), 0.4 * c.span(), true, 8}},
                 .friction = true});
}

}  // namespace

Descriptor describe() {
  return {
      .number = 3,
      .name = "hysteresis",
      .blocks = {Block::valve},
      .parameters = {optional(any_value("offset", "CO units", "added while the output falls"), 0.0),
                     optional(at_least_zero("width", "CO units",
                                            "distance between the branches of a gradual loop"),
                              0.0),
                     optional({"knee", "-", -4.0, false, 1.0, false, true, 0.0,
                               "with width: how sharply the new branch begins; 1 is backlash"},
                              0.0)},
      .header = "hysteresis/hysteresis_width.hpp",
      .check = check,
      .make = make,
      .candidates = candidates,
      .resting_band = [](const SpecReader& r) { return r.value("width") / 2.0; },
      .alarms = {"hysteresis", "backlash"},
      .examples = {{"hysteresis-width", {"hysteresis", {{"width", 1.0}}}, Block::valve},
                   {"hysteresis-offset", {"hysteresis", {{"offset", 0.7}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::hysteresis
