// SPDX-License-Identifier: Apache-2.0
#include "model/gap/model_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/gap/record.hpp"
#include "model/numeric/two_columns.hpp"
#include "model/plant/plant.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::gap {
namespace {

double deviation(const std::vector<double>& v, const std::vector<bool>& used, SampleRange range) {
  double mean = 0.0;
  double count = 0.0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (!used[k]) continue;
    mean += v[k];
    count += 1.0;
  }
  mean /= std::max(count, 1.0);
  double sum = 0.0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (used[k]) sum += (v[k] - mean) * (v[k] - mean);
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

// How far from CO the stem of the model's valve can rest, CO units.
double resting_band(const plant::LoopModel& model) {
  double band = 0.0;
  for (const effects::EffectSpec& spec : model.valve_effects) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info == nullptr || info->resting_band == nullptr) continue;
    band += info->resting_band(effects::SpecReader(*info, spec));
  }
  return band;
}

// PV of the plant from rest at `below_co` under the first CO.
std::vector<double> simulated(const plant::LoopModel& model, const std::vector<double>& co,
                              double below_co) {
  plant::Plant plant(model, 1);
  plant.reset(co.front() - below_co);
  if (below_co != 0.0) plant.step(co.front());
  std::vector<double> pv;
  for (const double u : co) {
    pv.push_back(plant.process_variable());
    plant.step(u);
  }
  return pv;
}

// Adds the unknown state at the first sample, which the lags of the process forget: two columns,
// fitted to the samples that remember it. An integrating process keeps a level and a slope.
void add_start(const plant::LoopModel& model, const std::vector<double>& measured_pv,
               const std::vector<bool>& measured, std::vector<double>& pv) {
  const plant::ProcessParameters& process = model.process;
  const std::size_t fitted = training_samples(pv.size());
  const double lag = std::max(process.time_constant_s, process.second_time_constant_s) /
                     std::max(model.sample_time_s, 1e-12);
  constexpr double kRemembered = 5.0;  // time constants
  const double end = process.integrating()
                         ? static_cast<double>(fitted)
                         : kRemembered * lag + process.dead_time_s / model.sample_time_s + 2.0;
  const auto column = [&](std::size_t i, std::size_t k) {
    const auto t = static_cast<double>(k);
    if (process.integrating()) return i == 0 ? 1.0 : t / static_cast<double>(pv.size());
    const double at = lag > 0.0 ? t / lag : t;
    return (i == 0 ? 1.0 : at) * std::exp(-at);
  };
  numeric::TwoColumns sums;
  for (std::size_t k = 0; k < fitted && static_cast<double>(k) < end; ++k) {
    if (measured[k]) sums.add(column(0, k), column(1, k), measured_pv[k] - pv[k]);
  }
  if (sums.count < 2 || sums.depends(1e-9)) return;
  const double a = sums.p();
  const double b = sums.q();
  for (std::size_t k = 0; k < pv.size(); ++k) pv[k] += a * column(0, k) + b * column(1, k);
}

}  // namespace

double rms_between(const std::vector<double>& a, const std::vector<double>& b,
                   const std::vector<bool>& used, SampleRange range) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (!used[k]) continue;
    sum += (a[k] - b[k]) * (a[k] - b[k]);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : kNone;
}

Misfit misfit_of(const std::vector<double>& pv, const std::vector<double>& simulated,
                 const std::vector<bool>& used, std::size_t fitted, double floor) {
  const SampleRange all{0, pv.size()};
  const SampleRange training{0, fitted};
  const SampleRange holdout{fitted, pv.size()};
  Misfit m;
  m.rmse = rms_between(pv, simulated, used, all);
  m.training_rmse = rms_between(pv, simulated, used, training);
  m.holdout_rmse = rms_between(pv, simulated, used, holdout);
  const double moves = deviation(pv, used, all);
  const double holdout_moves = deviation(pv, used, holdout);
  if (moves >= kFewestFloors * floor) m.fit_percent = 100.0 * (1.0 - m.rmse / moves);
  if (holdout_moves >= kFewestFloors * floor) {
    m.holdout_fit_percent = 100.0 * (1.0 - m.holdout_rmse / holdout_moves);
  }
  return m;
}

std::vector<double> closed_loop(const plant::LoopModel& model, const std::vector<double>& sp,
                                double first_pv) {
  const plant::LoopModel quiet = plant::without_noise(model);
  plant::Plant plant(quiet, 1);
  const double start = plant.output_for(first_pv);
  plant.reset(start);
  const control::PidSettings& settings = quiet.controller.pid;
  control::Pid pid(settings, quiet.sample_time_s);
  pid.initialise(start, first_pv, first_pv);
  std::vector<double> pv;
  double co = start;
  for (const double set_point : sp) {
    pv.push_back(plant.process_variable());
    co = std::clamp(pid.step(set_point, pv.back(), co, 0.0), settings.output_low,
                    settings.output_high);
    plant.step(co);
  }
  return pv;
}

std::vector<double> free_run(const plant::LoopModel& given, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& measured) {
  plant::LoopModel model = plant::without_noise(given);
  const SampleRange training{0, training_samples(co.size())};
  // A range that the record exceeds is not that of the transmitter.
  const auto [low, high] = std::minmax_element(pv.begin(), pv.end());
  if (*low < model.transmitter.low) model.transmitter.low = -1e300;
  if (*high > model.transmitter.high) model.transmitter.high = 1e300;
  std::vector<double> best;
  double least = 0.0;
  const double band = resting_band(model);
  constexpr int kPlaces = 12;  // to each side of CO
  for (int i = -kPlaces; i <= kPlaces; ++i) {
    if (band <= 0.0 && i != 0) continue;
    std::vector<double> tried = simulated(model, co, band * i / kPlaces);
    add_start(model, pv, measured, tried);
    const double left = rms_between(pv, tried, measured, training);
    if (!best.empty() && !(left < least)) continue;
    least = left;
    best = std::move(tried);
  }
  return best;
}

}  // namespace loopwarden::gap
