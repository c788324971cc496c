// SPDX-License-Identifier: Apache-2.0
#include "model/effects/cam_obstruction/cam_obstruction.hpp"

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::cam_obstruction {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (read.value("jump") > read.value("band")) {
    refuse(read, "jump", "at most band = " + number_text(read.value("band")) + " CO units");
  }
}

// Returns whether CO entered the band from above and from below, each time from at least one more
// band away.
bool shows_place(Candidate::Values v, Candidate::Values co) {
  const auto beyond = [&](double u) {
    return u > v[0] + 2.0 * v[1] ? 1 : u < v[0] - 2.0 * v[1] ? -1 : 0;
  };
  bool from_above = false;
  bool from_below = false;
  int side = 0;
  for (const double u : co) {
    if (const int now = beyond(u); now != 0) side = now;
    if (side > 0 && u < v[0] + v[1]) from_above = true;
    if (side < 0 && u > v[0] - v[1]) from_below = true;
  }
  return from_above && from_below;
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  const double middle = c.used_middle();
  const double used = c.used_span();
  all.push_back(
      {.smooth = false,
       .parameters = 3,
       .search = {{"position", middle - 0.35 * used, middle + 0.35 * used, false, 5},
                  {"band", 0.01 * c.span(), 0.5 * c.span(), true, 4},
                  {"ratio", 0.6, 1.0, false, 2}},
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"cam_obstruction", {{"position", v[0]}, {"band", v[1]}, {"jump", v[1] * v[2]}}};
       },
       .deviations =
           [](Candidate::Values v, Candidate::Values spread, const EffectSpec&,
              Candidate::Deviations& named) {
             named["jump"] = numeric::root_sum_square(v[2] * spread[1], v[1] * spread[2]);
           },
       .shows_place = shows_place,
       .friction = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 6,
          .name = "cam_obstruction",
          .blocks = {Block::valve},
          .parameters = {any_value("position", "CO units", "where on the travel"),
                         above_zero("band", "CO units", "CO that it takes to pass"),
                         at_least_zero("jump", "CO units",
                                       "how far the stem then jumps, at most band")},
          .header = "cam_obstruction/cam_obstruction.hpp",
          .check = check,
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return CamObstruction(read.value("position"), read.value("band"), read.value("jump"));
          },
          .candidates = candidates,
          .alarms = {"stiction"},
          .examples = {{"cam_obstruction",
                        {"cam_obstruction", {{"position", 3.8}, {"band", 0.6}, {"jump", 0.5}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::cam_obstruction
