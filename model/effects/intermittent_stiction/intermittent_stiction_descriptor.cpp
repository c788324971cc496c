// SPDX-License-Identifier: Apache-2.0
#include "model/effects/intermittent_stiction/intermittent_stiction.hpp"

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::intermittent_stiction {
namespace {

void check(const SpecReader& read, const EffectContext&) {
  if (read.value("j") > read.value("s")) {
    refuse(read, "j", "at most s = " + number_text(read.value("s")) + " CO units");
  }
  if (!(read.value("to") > read.value("from"))) {
    refuse(read, "to", "after from = " + number_text(read.value("from")) + " s");
  }
}

// The searched parameters are the beginning and the length, as shares of the fitted part of the
// record.
void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.smooth = false,
       .parameters = 6,    // s, j and two moments that cost two each
       .prior_nats = 3.0,  // permanent stiction is more common
       .search = {{"s", 0.02 * c.span(), 0.4 * c.span(), true, 5},
                  {"ratio", 0.0, 1.0, false, 2},
                  {"from", 0.0, 0.9 * c.duration_s, false, 6, 0.04},
                  {"length", 0.08 * c.duration_s, 0.9 * c.duration_s, true, 4, 0.04}},
       .starts = 3,
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"intermittent_stiction",
                 {{"s", v[0]}, {"j", v[0] * v[1]}, {"from", v[2]}, {"to", v[2] + v[3]}}};
       },
       .deviations =
           [](Candidate::Values v, Candidate::Values spread, const EffectSpec&,
              Candidate::Deviations& named) {
             named["j"] = numeric::root_sum_square(v[1] * spread[0], v[0] * spread[1]);
             named["to"] = numeric::root_sum_square(spread[2], spread[3]);
           },
       .friction = true,
       .at_one_moment = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 28,
          .name = "intermittent_stiction",
          .blocks = {Block::valve},
          .parameters = {at_least_zero("s", "CO units", "deadband + stickband"),
                         at_least_zero("j", "CO units", "slip jump, at most s"),
                         any_value("from", "s", "of the record, when it sets in"),
                         any_value("to", "s", "of the record, when it lets go, after from")},
          .header = "intermittent_stiction/intermittent_stiction.hpp",
          .check = check,
          .make = [](const SpecReader& read, const EffectContext&) -> Effect {
            return IntermittentStiction({read.value("s"), read.value("j")}, read.value("from"),
                                        read.value("to"));
          },
          .candidates = candidates,
          .valve_rank = 3,
          .resting_band = [](const SpecReader& r) { return (r.value("s") + r.value("j")) / 2.0; },
          .alarms = {"stiction"},
          .examples = {{"intermittent_stiction",
                        {"intermittent_stiction",
                         {{"s", 1.0}, {"j", 0.4}, {"from", 120.0}, {"to", 260.0}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::intermittent_stiction
