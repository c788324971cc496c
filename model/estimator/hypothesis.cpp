// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/hypothesis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "model/estimator/constants.hpp"

namespace loopwarden::estimator {
namespace {

std::size_t bin_of(double z, std::size_t bins) noexcept {
  const auto bin = static_cast<std::size_t>(std::clamp(z, 0.0, 1.0) * static_cast<double>(bins));
  return std::min(bin, bins - 1);
}

// Up to the fastest that sampling shows, rad/s.
double fastest_actuator(const plant::LoopModel& model) {
  return 0.9 * std::numbers::pi / model.sample_time_s;
}

double slowest_actuator(const plant::LoopModel& model) {
  const double slow_s = std::max(plant::answer_s(model), model.sample_time_s);
  return 1.0 / std::min(effects::kFastActuator_s, effects::kFastActuator * slow_s);
}

effects::SearchRange actuator_frequency(const plant::LoopModel& model) {
  const double fastest = fastest_actuator(model);
  return {"natural_frequency", std::min(slowest_actuator(model), 0.5 * fastest), fastest, true, 1};
}

// An actuator that is faster than the sampling shows no ringing.
effects::SearchRange actuator_damping(const plant::LoopModel& model) {
  const bool shown = slowest_actuator(model) < 0.5 * fastest_actuator(model);
  return {"damping", shown ? 0.05 : 0.6, 2.0, true, 1};
}

// Standard deviation of the random disturbances that a model states, PV units.
double random_level(const plant::LoopModel& model) {
  double square = 0.0;
  for (const effects::EffectSpec& spec : model.disturbances) {
    if (spec.name != "random_load") continue;
    const double intensity = spec.parameters.at("intensity");
    square += 0.5 * intensity * intensity * spec.parameters.at("time_constant");
  }
  return std::sqrt(square);
}

bool is_linear_dynamics(std::string_view name) {
  constexpr std::array<std::string_view, 5> kNames{"extra_lag", "extra_dead_time",
                                                   "inverse_response", "oscillatory_process",
                                                   "positioner_overshoot"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

}  // namespace

LoopFacts::LoopFacts(const plant::LoopModel& given, bool level_known, double disturbance)
    : model(plant::without_noise(given)),
      wide(!given.process.integrating() && (given.uncertainty.gain > kLimits.wide ||
                                            given.uncertainty.time_constant > kLimits.wide)),
      level_free(wide || given.process.integrating() || !level_known),
      answer_s(std::max(plant::answer_s(given), given.sample_time_s)),
      pv_span(given.transmitter.span()),
      co_span(given.controller.pid.output_span()),
      largest_disturbance(disturbance * pv_span),
      level_deviation(random_level(given)),
      damping(actuator_damping(given)),
      frequency(actuator_frequency(given)),
      friction{"friction", 1e-4 * co_span, kLimits.healthy_friction * co_span, true, 1},
      time_factor{"time_constant", 0.25, 4.0, true, 1},
      dead_factor{"dead_time", 0.1, 4.0, true, 1} {}

Hypothesis::Hypothesis(const LoopFacts& loop, Terms terms)
    : loop_(&loop), terms_(std::move(terms)) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    next += terms_[i]->coordinates();
    if (terms_[i]->slips) sticking_ = i;
    jumps_ = jumps_ || (terms_[i]->block == effects::Block::valve && !terms_[i]->smooth);
  }
  layout_.own = next;
  layout_.process = next;
  if (loop.wide) next += 2;
  layout_.actuator = next;
  if (loop.model.has_valve) next += 3;
  layout_.jitter = next;
  if (jumps_) next += 1;
  layout_.error = next;
  layout_.size = next + 2;
}

bool Hypothesis::changes_gain() const noexcept {
  return std::any_of(terms_.begin(), terms_.end(), [](const Law* t) { return t->solves_gain; });
}

bool Hypothesis::bends_reading() const noexcept {
  return std::any_of(terms_.begin(), terms_.end(), [](const Law* t) { return t->shown(); });
}

Hypothesis Hypothesis::law_only() const {
  Hypothesis out = *this;
  if (!jumps()) return out;
  out.by_law_ = true;
  --out.layout_.error;
  --out.layout_.size;
  return out;
}

std::vector<double> Hypothesis::without_slips(std::vector<double> z) const {
  if (jumps()) z.erase(z.begin() + static_cast<std::ptrdiff_t>(layout_.jitter));
  return z;
}

std::vector<double> Hypothesis::with_law_slips(std::vector<double> z) const {
  const std::size_t bins = kLimits.jitters.size();
  if (jumps()) {
    z.insert(z.begin() + static_cast<std::ptrdiff_t>(layout_.jitter), middle(bins - 1, bins));
  }
  return z;
}

Point Hypothesis::at(std::span<const double> z) const {
  Point p;
  std::size_t next = 0;
  for (const Law* term : terms_) {
    std::vector<double> values;
    values.reserve(term->search.size());
    for (const effects::SearchRange& range : term->search) values.push_back(range.value(z[next++]));
    if (term->starts_offset()) p.start_offset += values.back() * term->resting_half_band(values);
    const bool since = term->timing == Law::Timing::since;
    p.schedules.push_back(term->schedule(since ? term->moment.value(z[next++]) : 0.0));
    p.searched.push_back(std::move(values));
  }
  const plant::ProcessParameters& process = loop_->model.process;
  p.time_constant_s = process.time_constant_s;
  p.dead_time_s = process.dead_time_s;
  if (loop_->wide) {
    p.time_constant_s *= loop_->time_factor.value(z[layout_.process]);
    p.dead_time_s *= loop_->dead_factor.value(z[layout_.process + 1]);
  }
  if (loop_->model.has_valve) {
    p.actuator_damping = loop_->damping.value(z[layout_.actuator]);
    // An overdamped actuator must be stiffer to be as fast.
    p.actuator_frequency = std::min(
        loop_->frequency.value(z[layout_.actuator + 1]) * std::max(1.0, 2.0 * p.actuator_damping),
        loop_->frequency.high);
    p.friction = loop_->friction.value(z[layout_.actuator + 2]);
    // The measured dead time contains the delay of the actuator.
    p.dead_time_s = std::max(0.0, p.dead_time_s - 2.0 * p.actuator_damping / p.actuator_frequency);
  }
  if (jumps()) p.jitter = kLimits.jitters[bin_of(z[layout_.jitter], kLimits.jitters.size())];
  p.disturbance = bin_of(z[layout_.error], kLimits.disturbances.size());
  p.law = bin_of(z[layout_.error + 1], kLimits.law_errors.size());
  return p;
}

std::size_t Hypothesis::first_of(std::size_t term) const noexcept {
  std::size_t first = 0;
  for (std::size_t i = 0; i < term; ++i) first += terms_[i]->coordinates();
  return first;
}

double Hypothesis::parameters() const noexcept {
  double count = 0.0;
  for (const Law* term : terms_) count += term->parameters;
  return count;
}

double Hypothesis::handicap() const noexcept {
  double nats = 0.0;
  for (const Law* term : terms_) nats += term->prior_nats;
  return nats;
}

std::vector<std::string> Hypothesis::names() const {
  std::vector<std::string> names;
  for (const Law* term : terms_) names.emplace_back(term->name);
  return names;
}

std::string Hypothesis::title() const {
  std::string text;
  for (const Law* term : terms_) {
    text += (text.empty() ? "" : "+") + (term->named ? term->name : term->description());
  }
  return text.empty() ? "none" : text;
}

bool Hypothesis::named() const noexcept {
  return std::all_of(terms_.begin(), terms_.end(), [](const Law* t) { return t->named; });
}

bool Hypothesis::contains(std::string_view name) const noexcept {
  return std::any_of(terms_.begin(), terms_.end(), [&](const Law* t) { return name == t->name; });
}

bool compatible(const Law& a, const Law& b) {
  if (std::string_view(a.name) == b.name) return false;
  // Two of these have the form of a third one.
  if (is_linear_dynamics(a.name) && is_linear_dynamics(b.name)) return false;
  if (a.friction && b.friction) return false;
  // Friction for a stretch of the record follows what another effect leaves there.
  if ((a.friction && a.at_one_moment) || (b.friction && b.at_one_moment)) return false;
  const auto is = [&](std::string_view x, std::string_view y) {
    return (x == a.name && y == b.name) || (x == b.name && y == a.name);
  };
  // A band and steps of the stem together have the form of stiction.
  if (is("backlash", "resolution") && a.block == b.block) return false;
  // Two shapes of the same curve of PV over CO.
  return !is("valve_characteristic", "gain_change") && !is("valve_characteristic", "output_bias") &&
         !is("valve_characteristic", "leakage") && !is("leakage", "output_bias") &&
         !is("leakage", "gain_change") && !is("varying_gain", "gain_change") &&
         !is("drift", "ramp_disturbance") && !is("step_disturbance", "ramp_disturbance") &&
         !is("oscillating_disturbance", "square_disturbance");
}

}  // namespace loopwarden::estimator
