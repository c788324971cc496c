// SPDX-License-Identifier: Apache-2.0
#include "model/gap/other_unit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "model/gap/model_run.hpp"
#include "model/gap/record_check.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::gap {
namespace {

constexpr double kFalls = 0.3;                   // of the law and of the misfit
constexpr double kFallsAlone = 0.1;              // of the misfit where there is no set point
constexpr double kOutOfRange = 0.02;             // of a range
constexpr double kTiny = 0.0105;                 // of the CO range, in which a share of it stands
constexpr std::size_t kLookedAt = 5000;          // samples that are looked at
constexpr std::size_t kFewestOutputMoves = 100;  // moves of CO
constexpr double kTwoAtOnce = 0.2;
constexpr double kLawHolds = 0.05;  // as it stands: nothing to ask

struct UnitScale {
  const char* name;
  double factor;
  double offset;
};
// What a value of the model's unit is in the other one.
constexpr std::array kScales{UnitScale{"thousandths", 1000.0, 0.0},
                             UnitScale{"thousands", 0.001, 0.0},
                             UnitScale{"hundredths", 100.0, 0.0},
                             UnitScale{"hundreds", 0.01, 0.0},
                             UnitScale{"tenths", 10.0, 0.0},
                             UnitScale{"tens", 0.1, 0.0},
                             UnitScale{"a minute for a second", 60.0, 0.0},
                             UnitScale{"a second for a minute", 1.0 / 60.0, 0.0},
                             UnitScale{"m3/h for l/s", 3.6, 0.0},
                             UnitScale{"l/s for m3/h", 1.0 / 3.6, 0.0},
                             UnitScale{"psi for bar", 14.5038, 0.0},
                             UnitScale{"bar for psi", 1.0 / 14.5038, 0.0},
                             UnitScale{"kelvin for \xC2\xB0"
                                       "C",
                                       1.0, 273.15},
                             UnitScale{"\xC2\xB0"
                                       "C for kelvin",
                                       1.0, -273.15},
                             UnitScale{"\xC2\xB0"
                                       "F for \xC2\xB0"
                                       "C",
                                       1.8, 32.0},
                             UnitScale{"\xC2\xB0"
                                       "C for \xC2\xB0"
                                       "F",
                                       1.0 / 1.8, -32.0 / 1.8}};

bool same_range(const SignalUnit& a, const SignalUnit& b) {
  const double near = 1e-6 * (b.high - b.low);
  return std::abs(a.low - b.low) < near && std::abs(a.high - b.high) < near;
}

// The model's own first.
std::vector<SignalUnit> pv_units(const plant::LoopModel& model) {
  const SignalUnit own{"", model.transmitter.low, model.transmitter.high};
  std::vector<SignalUnit> units{own};
  for (const SignalUnit& unit : {SignalUnit{"% of the PV range", 0.0, 100.0},
                                 SignalUnit{"a share of the PV range", 0.0, 1.0}}) {
    if (!same_range(unit, own)) units.push_back(unit);
  }
  for (const UnitScale& s : kScales) {
    units.push_back({s.name, own.low * s.factor + s.offset, own.high * s.factor + s.offset});
  }
  return units;
}

std::vector<SignalUnit> co_units(const plant::LoopModel& model) {
  const SignalUnit own{"", model.controller.pid.output_low, model.controller.pid.output_high};
  std::vector<SignalUnit> units{own};
  for (const SignalUnit& unit :
       {SignalUnit{"CO as a share of its range", 0.0, 1.0}, SignalUnit{"CO in %", 0.0, 100.0},
        SignalUnit{"CO in mA", 4.0, 20.0}}) {
    if (!same_range(unit, own)) units.push_back(unit);
  }
  return units;
}

bool within(const numeric::Range& span, const SignalUnit& range) {
  const double room = kOutOfRange * (range.high - range.low);
  return span.low >= range.low - room && span.high <= range.high + room;
}

// What the model's own law leaves of the moves of CO, as a share of their squares; NaN where it
// can't be told.
double left_by_models_law(const LoopRecord& r, const control::PidSettings& pid) {
  const double side = pid.action == control::Action::reverse ? 1.0 : -1.0;
  const double margin = 0.005 * pid.output_span();
  double left = 0.0;
  double moves = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 1; k < r.size() && k < r.sp.size(); ++k) {
    const double e = side * (r.sp[k] - r.pv[k]);
    const double change = e - side * (r.sp[k - 1] - r.pv[k - 1]);
    const double move = r.co[k] - r.co[k - 1];
    const bool inside = r.co[k] > pid.output_low + margin && r.co[k] < pid.output_high - margin;
    if (!inside || !std::isfinite(change) || !std::isfinite(move)) continue;
    const double missed = move - pid.gains.kp * change - pid.gains.ki * r.period_s * e;
    left += missed * missed;
    moves += move * move;
    ++count;
  }
  return count < kFewestOutputMoves || !(moves > 0.0) ? std::numeric_limits<double>::quiet_NaN()
                                                      : left / moves;
}

struct ModelMisfit {
  double rmse = 0.0;  // PV units
  double share =
      // of PV or of what the model makes of it, whichever is larger, above the end of the range
      1.0;
};

ModelMisfit misfit_in(const LoopRecord& r, const plant::LoopModel& model) {
  std::vector<bool> measured(r.size());
  for (std::size_t k = 0; k < r.size(); ++k) measured[k] = std::isfinite(r.pv[k]);
  const std::vector<double> pv = held(r.pv);
  const std::vector<double> simulated = free_run(model, held(r.co), pv, measured);
  const std::vector<double> low(r.size(), model.transmitter.low);
  const SampleRange all{0, r.size()};
  const double rmse = rms_between(pv, simulated, measured, all);
  const double size =
      std::max(rms_between(pv, low, measured, all), rms_between(simulated, low, measured, all));
  return {rmse, size > 0.0 ? rmse / size : 1.0};
}

LoopRecord first_part(LoopRecord r) {
  for (std::vector<double>* column : {&r.pv, &r.sp, &r.co, &r.stem}) {
    if (column->size() > kLookedAt) column->resize(kLookedAt);
  }
  return r;
}

void convert(std::vector<double>& column, const SignalUnit& from, double low, double high) {
  for (double& v : column) v = low + (v - from.low) * (high - low) / (from.high - from.low);
}

// How much of its range a signal makes use of: what was shrunk by a wrong unit lies at the lower
// end.
double reach(const numeric::Range& span, const SignalUnit& range) {
  return std::clamp((span.high - range.low) / (range.high - range.low), 1e-6, 1.0);
}

}  // namespace

LoopRecord in_models_units(LoopRecord record, const plant::LoopModel& model, const SignalUnit& pv,
                           const SignalUnit& co) {
  const auto& pid = model.controller.pid;
  convert(record.pv, pv, model.transmitter.low, model.transmitter.high);
  convert(record.sp, pv, model.transmitter.low, model.transmitter.high);
  convert(record.co, co, pid.output_low, pid.output_high);
  convert(record.stem, co, pid.output_low, pid.output_high);
  return record;
}

std::optional<OtherUnit> other_unit(const LoopRecord& given, const plant::LoopModel& model) {
  if (!given.has_co() || !LoopRecord::has_value(given.pv)) return std::nullopt;
  const LoopRecord record = first_part(given);
  const bool has_sp = record.has_sp();
  const double law = has_sp ? left_by_models_law(record, model.controller.pid)
                            : std::numeric_limits<double>::quiet_NaN();
  const numeric::Range pv = numeric::range_of(record.pv);
  const numeric::Range co = numeric::range_of(record.co);
  const std::vector<SignalUnit> of_pv = pv_units(model);
  const std::vector<SignalUnit> of_co = co_units(model);
  const bool strange = !within(pv, of_pv[0]) || !within(co, of_co[0]) ||
                       co.high - of_co[0].low < kTiny * (of_co[0].high - of_co[0].low);
  if (!strange && (!has_sp || law < kLawHolds)) return std::nullopt;

  const auto law_speaks_for_it = [&](const LoopRecord& converted) {
    const double left = left_by_models_law(converted, model.controller.pid);
    return left < kFalls * law || std::max(left, law) < kLawHolds;
  };
  std::optional<ModelMisfit> as_it_stands;
  std::optional<OtherUnit> best;
  double best_reach = 0.0;
  for (const SignalUnit& y : of_pv) {
    for (const SignalUnit& u : of_co) {
      if (y.name.empty() && u.name.empty()) continue;
      if (!within(pv, y) || !within(co, u)) continue;
      // Two units at once must say much more than one.
      const double both =
          reach(pv, y) * reach(co, u) * (y.name.empty() || u.name.empty() ? 1.0 : kTwoAtOnce);
      if (both <= best_reach) continue;
      const LoopRecord converted = in_models_units(record, model, y, u);
      if (has_sp && !law_speaks_for_it(converted)) continue;
      if (!as_it_stands) as_it_stands = misfit_in(record, model);
      const ModelMisfit misfit = misfit_in(converted, model);
      if (!(misfit.share < (has_sp ? kFalls : kFallsAlone) * as_it_stands->share)) continue;
      best = OtherUnit{y, u, as_it_stands->rmse, misfit.rmse};
      best_reach = both;
    }
  }
  return best;
}

}  // namespace loopwarden::gap
