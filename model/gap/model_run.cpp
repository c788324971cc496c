// SPDX-License-Identifier: Apache-2.0
#include "model/gap/model_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/gap/free_run.hpp"
#include "model/gap/record.hpp"
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

// As the transmitter shows it; its range ends nothing where the record goes beyond.
std::vector<double> shown(const FreeRun& run, const std::vector<double>& measured,
                          std::vector<double> pv) {
  run.show({}, {}, pv);
  const plant::TransmitterParameters& range = run.model().transmitter;
  const auto [low, high] = std::minmax_element(measured.begin(), measured.end());
  for (double& v : pv) {
    if (*low >= range.low) v = std::max(v, range.low);
    if (*high <= range.high) v = std::min(v, range.high);
  }
  return pv;
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
                 const std::vector<bool>& used, double floor) {
  const SampleRange all{0, pv.size()};
  const SampleRange training{0, training_samples(pv.size())};
  const SampleRange holdout{training.end, pv.size()};
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

std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& measured,
                             double start_offset, Level level) {
  const FreeRun run(model, co, level);
  const SampleRange training{0, training_samples(co.size())};
  std::vector<std::vector<double>> columns;
  // From a stem that rests `below_co` below CO.
  const auto from = [&](double below_co) {
    Point point;
    point.time_constant_s = model.process.time_constant_s;
    point.dead_time_s = model.process.dead_time_s;
    point.start_offset = below_co;
    run.columns({}, point, columns);
    return run.with_past(point, columns, pv, measured, training.end);
  };
  std::vector<double> best = from(0.0);
  const double band = resting_band(model);
  if (band <= 0.0) return shown(run, pv, std::move(best));
  double best_rms = rms_between(pv, best, measured, training);
  double best_place = 0.0;
  const auto offer = [&](double place) {
    std::vector<double> tried = from(band * place);
    const double tried_rms = rms_between(pv, tried, measured, training);
    if (!(tried_rms < best_rms)) return;
    best_rms = tried_rms;
    best_place = place;
    best = std::move(tried);
  };
  offer(start_offset / band);
  constexpr int kPlaces = 12;  // to each side of CO
  for (int i = -kPlaces; i <= kPlaces; ++i) offer(static_cast<double>(i) / kPlaces);
  for (double step = 0.5 / kPlaces; step > 0.02 / kPlaces; step /= 2.0) {
    const double around = best_place;
    if (around - step >= -1.0) offer(around - step);
    if (around + step <= 1.0) offer(around + step);
  }
  return shown(run, pv, std::move(best));
}

}  // namespace loopwarden::gap
