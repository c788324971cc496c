// SPDX-License-Identifier: Apache-2.0
#include "model/effects/meter_curve/meter_curve.hpp"

#include <algorithm>
#include <array>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::meter_curve {
namespace {

struct Named {
  const char* name;
  MeterCurve::Curve curve;
};
constexpr std::array kCurves{Named{"root", MeterCurve::Curve::root},
                             Named{"square", MeterCurve::Curve::square},
                             Named{"table", MeterCurve::Curve::table}};

Effect make(const SpecReader& read, const EffectContext& context) {
  MeterCurve::Parameters p;
  for (const Named& named : kCurves) {
    if (read.option("curve") == named.name) p.curve = named.curve;
  }
  p.share = read.value("share");
  p.point_count = read.spec().table.size();
  std::copy(read.spec().table.begin(), read.spec().table.end(), p.points.begin());
  return MeterCurve(p, context.pv_low, context.pv_high);
}

EffectSpec with_curve(const char* curve, double share) {
  return {"meter_curve", {{"share", share}}, {{"curve", curve}}};
}

void candidates(const SearchContext&, std::vector<Candidate>& all) {
  Candidate root{.block = Block::transmitter,
                 .parameters = 1,
                 .prior_nats = 1.0,  // the search has two curves to choose from
                 .search = {{"share", 0.05, 1.0, false, 4}},
                 .spec = [](const Candidate&, Candidate::Values v,
                            Candidate::Values) { return with_curve("root", v[0]); },
                 .bends = true};
  Candidate square = root;
  square.spec = [](const Candidate&, Candidate::Values v, Candidate::Values) {
    return with_curve("square", v[0]);
  };
  all.push_back(std::move(root));
  all.push_back(std::move(square));
}

}  // namespace

Descriptor describe() {
  OptionInfo curve{"curve", {}, "the curve that does not belong there"};
  for (const Named& named : kCurves) curve.values.push_back(named.name);
  return {.number = 36,
          .name = "meter_curve",
          .blocks = {Block::transmitter},
          .parameters = {optional({"share", "-", 0.0, false, 1.0, false, true, 0.0,
                                   "of the curve; the rest reads straight"},
                                  1.0)},
          .options = {curve},
          .takes_table = true,
          .table = {"[[q, y], ...]", "value and reading, PV units, both rising"},
          .header = "meter_curve/meter_curve.hpp",
          .check = [](const SpecReader& read,
                      const EffectContext&) { check_curve(read, MeterCurve::kMostPoints); },
          .make = make,
          .candidates = candidates,
          .examples = {{"meter_curve", with_curve("root", 0.8), Block::transmitter}}};
}

}  // namespace loopwarden::effects::meter_curve
