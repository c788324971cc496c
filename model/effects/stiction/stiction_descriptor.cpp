// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numbers>

#include "model/numeric/root_sum_square.hpp"
#include "model/effects/descriptor.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_closing.hpp"
#include "model/effects/stiction/stiction_he.hpp"
#include "model/effects/stiction/stiction_inertial.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"

namespace loopwarden::effects::stiction {
namespace {

bool differs_on_closing(const SpecReader& read) {
  return read.has("s_closing") || read.has("j_closing");
}

StictionParameters closing(const SpecReader& read) {
  return {read.value(read.has("s_closing") ? "s_closing" : "s"),
          read.value(read.has("j_closing") ? "j_closing" : "j")};
}

void check(const SpecReader& read, const EffectContext& context) {
  if (read.value("j") > read.value("s")) {
    refuse(read, "j", "at most s = " + number_text(read.value("s")) + " CO units");
  }
  for (const char* key : {"s_closing", "j_closing"}) {
    if (read.has(key) && read.option("law") != "choudhury") {
      throw EffectError(key, std::string(key) + " belongs to law choudhury");
    }
  }
  if (const StictionParameters c = closing(read); c.j > c.s) {
    if (read.has("j_closing")) {
      throw EffectError("j_closing", std::string("j_closing must be at most ") +
                                         (read.has("s_closing") ? "s_closing" : "s") + " = " +
                                         number_text(c.s) + " CO units (got " + number_text(c.j) +
                                         ")");
    }
    throw EffectError("s_closing", "s_closing must be at least j = " + number_text(c.j) +
                                       " CO units (got " + number_text(c.s) +
                                       "), or j_closing be given too");
  }
  const bool inertial = read.option("law") == "inertial";
  for (const char* key : {"natural_frequency", "damping"}) {
    if (!inertial && read.has(key)) {
      throw EffectError(key, std::string(key) + " belongs to law inertial");
    }
  }
  const double highest = std::numbers::pi / context.sample_time_s;
  if (inertial && !(read.value("natural_frequency") * context.sample_time_s < std::numbers::pi)) {
    refuse(read, "natural_frequency",
           "below " + number_text(highest) + " rad/s, half the sampling rate");
  }
}

Effect make(const SpecReader& read, const EffectContext& context) {
  const StictionParameters p{read.value("s"), read.value("j")};
  const std::string_view law = read.option("law");
  if (law == "he") return StictionHe(p);
  if (law == "karnopp") return StictionKarnopp(p, context.sample_time_s);
  if (law == "inertial") {
    return StictionInertial(p, {read.value("natural_frequency"), read.value("damping")},
                            context.sample_time_s, {context.output_low, context.output_high});
  }
  if (differs_on_closing(read)) return StictionClosing(p, closing(read));
  return StictionChoudhury(p);
}

// Returns the effect with the law `inertial`: the stem of a real valve has momentum.
EffectSpec with_momentum(EffectSpec effect, double natural_frequency_rad_s, double damping) {
  effect.parameters["natural_frequency"] = natural_frequency_rad_s;
  effect.parameters["damping"] = damping;
  effect.options["law"] = "inertial";
  return effect;
}

// Returns 0 if the slip jump is too small to distinguish stiction from backlash, otherwise 1.
double jumps(Candidate::Values v, Candidate::Values, double) {
  constexpr double kLeastJump = 0.02;  // of s
  return v[1] >= kLeastJump ? 1.0 : 0.0;
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back(
      {.smooth = false,
       .parameters = 2,
       .search = {{"s", 0.005 * c.span(), 0.5 * c.span(), true, 16},
                  {"ratio", 0.0, 1.0, false, 5},
                  {"start", -1.0, 1.0, false, 3}},
       .starts = 4,
       .spec = [](const Candidate&, Candidate::Values v, Candidate::Values) -> EffectSpec {
         return {"stiction", {{"s", v[0]}, {"j", v[0] * v[1]}}};
       },
       .resting_half_band = [](Candidate::Values v) { return v[0] * (1.0 + v[1]) / 2.0; },
       .with_momentum = with_momentum,
       .telling = jumps,
       .deviations =
           [](Candidate::Values v, Candidate::Values spread, const EffectSpec&,
              Candidate::Deviations& named) {
             named["j"] = numeric::root_sum_square(v[1] * spread[0], v[0] * spread[1]);
           },
       .friction = true,
       .slips = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 1,
          .name = "stiction",
          .blocks = {Block::valve},
          .parameters = {at_least_zero("s", "CO units", "deadband + stickband"),
                         at_least_zero("j", "CO units", "slip jump, at most s"),
                         optional(at_least_zero("s_closing", "CO units",
                                                "s on closing, if it differs; otherwise s applies"),
                                  kInfinity),
                         optional(at_least_zero("j_closing", "CO units",
                                                "j on closing, if it differs; otherwise j applies"),
                                  kInfinity),
                         of_the_law(optional(above_zero("natural_frequency", "rad/s",
                                                        "of the actuator, law inertial"),
                                             20.0)),
                         of_the_law(optional({"damping", "-", 0.0, true, 20.0, false, true, 0.0,
                                              "ratio, of the actuator, law inertial"},
                                             0.7))},
          .options = {{"law",
                       {"choudhury", "he", "karnopp", "inertial"},
                       "data-driven (choudhury, he) or physical (karnopp, inertial)"}},
          .header = "stiction/stiction_choudhury.hpp",
          .check = check,
          .make = make,
          .candidates = candidates,
          .valve_rank = 3,
          .more_by = "j",
          .resting_band =
              [](const SpecReader& r) {
                const StictionParameters opening{r.value("s"), r.value("j")};
                return std::max(opening.static_friction(), closing(r).static_friction());
              },
          .healthy_valve =
              [](double friction, double natural_frequency_rad_s, double damping) {
                return with_momentum({"stiction", {{"s", friction}, {"j", 0.0}}},
                                     natural_frequency_rad_s, damping);
              },
          .valve_band =
              [](const SpecReader& r) {
                const StictionParameters c = closing(r);
                return ValveBand{.s = (r.value("s") + c.s) / 2.0, .j = (r.value("j") + c.j) / 2.0};
              },
          .alarms = {"stiction"},
          .examples = {{"stiction", {"stiction", {{"s", 1.0}, {"j", 0.4}}}, Block::valve}}};
}

}  // namespace loopwarden::effects::stiction
