// SPDX-License-Identifier: Apache-2.0
#include "model/effects/learned/learned.hpp"

#include <cmath>
#include <string>
#include <string_view>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::learned {
namespace {

constexpr std::size_t kMostPoints = 64;

LearnedFilter::Coefficients column(const EffectSpec& spec, bool second) {
  LearnedFilter::Coefficients out{};
  for (std::size_t i = 0; i < std::min(spec.table.size(), out.size()); ++i) {
    out[i] = second ? spec.table[i].second : spec.table[i].first;
  }
  return out;
}

void check(const SpecReader& read, const EffectContext&) {
  const EffectSpec& spec = read.spec();
  const std::string_view form = read.option("form");
  const bool dynamic = form == "dynamic";
  const bool hysteretic = form == "hysteretic";
  const char* key = dynamic ? "denominator" : hysteretic ? "thresholds" : "table";
  const std::size_t most = dynamic ? LearnedFilter::kMostOrder + 1 : kMostPoints;
  const std::size_t fewest = dynamic ? 2 : 1;
  if (spec.table.size() < fewest || spec.table.size() > most) {
    throw EffectError(key, std::string(key) + " must have " + std::to_string(fewest) + " to " +
                               std::to_string(most) + " entries (got " +
                               std::to_string(spec.table.size()) + ")");
  }
  for (std::size_t i = 0; i < spec.table.size(); ++i) {
    const auto& [x, y] = spec.table[i];
    if (!std::isfinite(x) || !std::isfinite(y)) {
      throw EffectError(key, std::string(key) + " holds a number that is not finite");
    }
    if (hysteretic && x < 0.0) {
      throw EffectError(key, "thresholds must be at least 0 CO units");
    }
    if (!dynamic && !hysteretic && i > 0 && x <= spec.table[i - 1].first) {
      throw EffectError(
          key, "table must rise in its first column (see point " + std::to_string(i + 1) + ")");
    }
  }
  if (!dynamic) return;
  const LearnedFilter::Coefficients denominator = column(spec, true);
  const std::string fault = effects::check_poles(denominator);
  if (!fault.empty()) throw EffectError(key, fault);
  const LearnedFilter::Coefficients numerator = column(spec, false);
  for (std::size_t i = numerator.size(); i-- > 0 && denominator[i] == 0.0;) {
    if (numerator[i] != 0.0) {
      throw EffectError("numerator", "numerator must not be of higher order than the denominator");
    }
  }
}

Effect make(const SpecReader& read, const EffectContext& context) {
  const EffectSpec& spec = read.spec();
  const std::string_view form = read.option("form");
  if (form == "static") return LearnedCurve(spec.table);
  if (form == "hysteretic") return LearnedPlay(spec.table, read.value("offset"));
  if (form == "gain_profile") {
    return LearnedGain(spec.table, read.option("over") == std::string_view("time"));
  }
  return LearnedFilter(column(spec, false), column(spec, true), context.sample_time_s);
}

}  // namespace

Descriptor describe() {
  return {
      .number = 30,
      .name = "learned",
      .blocks = {Block::valve, Block::process},
      .parameters = {optional(any_value("offset", "CO units", "of form hysteretic"), 0.0)},
      .options = {{"form", {"static", "hysteretic", "dynamic", "gain_profile"}, "what it is"},
                  {"over", {"opening", "time"}, "of gain_profile"}},
      .table = {"[[in, out], ...]",
                "of static: flow asked for and flow, CO units; of gain_profile: CO or s of the "
                "record, and factor. In "
                "its place hysteretic has thresholds (CO units) and weights, dynamic numerator and "
                "denominator by "
                "rising powers of p; a description in words can be added"},
      .is_learned = true,
      .header = "learned/learned.hpp",
      .check = check,
      .make = make,
      .examples = {
          {"learned",
           {"learned", {}, {{"form", "static"}}, {{2.0, 2.0}, {4.0, 3.4}, {6.0, 6.6}, {8.0, 8.0}}},
           Block::valve}}};
}

}  // namespace loopwarden::effects::learned
