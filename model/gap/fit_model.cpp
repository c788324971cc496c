// SPDX-License-Identifier: Apache-2.0
#include "model/gap/fit_model.hpp"

#include <algorithm>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::gap {
namespace {

// Where PV's ends are taken, so that its noise is left out.
constexpr double kEndQuantile = 0.01;

Level level_of(const CheckedRecord& r, const SearchOptions& options) {
  if (r.closed_loop) return Level::of_nobody;
  // An integrating process has no level but the one it starts at.
  if (r.model.process.integrating()) return Level::of_model;
  const bool left_out = std::find(options.without.begin(), options.without.end(), kLevelName) !=
                        options.without.end();
  if (left_out && !options.level_of_record) return Level::of_model;
  return options.level_of_record || !r.model.process.level ? Level::of_record : Level::of_model;
}

std::vector<Candidate> candidates_for(const CheckedRecord& r, const SearchOptions& options) {
  const control::PidSettings& pid = r.model.controller.pid;
  const auto [co_low, co_high] =
      std::minmax_element(r.co.begin(), r.co.begin() + static_cast<std::ptrdiff_t>(r.training_end));
  std::vector<double> pv;
  for (std::size_t k = 0; k < r.training_end; ++k) {
    if (r.used[k]) pv.push_back(r.pv[k]);
  }
  std::vector<Candidate> all = effects::candidates(
      {.output_low = pid.output_low,
       .output_high = pid.output_high,
       .output_used_low = *co_low,
       .output_used_high = *co_high,
       .pv_low = numeric::quantile(pv, kEndQuantile),
       .pv_high = numeric::quantile(pv, 1.0 - kEndQuantile),
       .period_s = r.record.period_s,
       .duration_s = r.record.seconds_at(r.training_end),
       .time_constant_s = plant::answer_s(r.model) - r.model.process.dead_time_s,
       .dead_time_s = r.model.process.dead_time_s});
  std::erase_if(all, [&](const Candidate& candidate) {
    return std::find(options.without.begin(), options.without.end(), candidate.name) !=
           options.without.end();
  });
  if (*co_high - *co_low < kLeastMovement * pid.output_span()) {
    // A valve that is never moved shows nothing of itself, nor of the process.
    std::erase_if(all, [](const Candidate& candidate) {
      return candidate.block == effects::Block::valve || candidate.block == effects::Block::process;
    });
  }
  if (!r.model.has_valve) {
    std::erase_if(all, [](const Candidate& c) { return c.block == effects::Block::valve; });
  }
  if (level_of(r, options) != Level::of_model) {
    std::erase_if(all, [](const Candidate& c) { return c.is_level; });
  }
  return all;
}

double pv_span(const CheckedRecord& r) { return r.model.transmitter.span(); }

// What a healthy valve leaves, PV units.
double healthy_valve_rms(const CheckedRecord& r) {
  if (!r.model.has_valve) return 0.0;
  const double friction = kHealthyValveLeaves * r.model.controller.pid.output_span();  // CO units
  // An integrating process turns an offset of the valve into a slope, for as long as the loop lets
  // it.
  const double gain =
      std::abs(r.model.process.gain) *
      (r.model.process.integrating() ? std::max(plant::answer_s(r.model), r.record.period_s) : 1.0);
  return friction * gain;
}

// A healthy valve's friction and momentum.
bool allows(const CheckedRecord& r, const SearchOptions& options) {
  return options.allowances && r.model.has_valve;
}

AllowedWander allowed_wander(const CheckedRecord& r, const SearchOptions& options,
                             double largest_load) {
  const double noise = r.quality.noise_rms;
  if (!options.load || !(noise > 0.0)) return {};
  return {.load = largest_load * pv_span(r) * std::sqrt(r.record.period_s) / noise,
          .valve = allows(r, options) ? healthy_valve_rms(r) / noise : 0.0};
}

}  // namespace

ModelFit::ModelFit(const CheckedRecord& record, const SearchOptions& options, double largest_load)
    : run(record.model, record.co, level_of(record, options)),
      searched(candidates_for(record, options)),
      least_rms(
          std::max(kLeastEffect * pv_span(record), kLeastEffectNoise * record.quality.noise_rms)),
      valve_rms(healthy_valve_rms(record)),
      largest_load_rms(largest_load * pv_span(record) * std::sqrt(LoadFilter::kReturnTime_s / 2.0)),
      record_(record),
      options_(options),
      allowed_(allowed_wander(record, options, largest_load)),
      fitter(run, record.pv, record.training, allowed_, allows(record, options)) {}

Fitter ModelFit::over_whole_record() const {
  return {run, record_.pv, record_.measured, allowed_, allows(record_, options_)};
}

}  // namespace loopwarden::gap
