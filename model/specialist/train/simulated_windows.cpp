// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/train/simulated_windows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <Eigen/Eigenvalues>

#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::specialist {
namespace {

using effects::Block;
using effects::EffectSpec;
using numeric::chance;
using numeric::log_uniform;
using numeric::Random;

std::size_t choice(Random& random, std::size_t count) {
  return std::min(count - 1,
                  static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}
double either_sign(Random& random, double size) { return chance(random, 0.5) ? size : -size; }

struct Draw {
  plant::LoopModel& model;
  Random& random;
  double co_span;   // CO units
  double pv_span;   // PV units
  double before_s;  // of the run, until the window begins
  double length_s;  // of the whole run
  double window_s;
};

// Draws factors of gain, time constant and dead time within the uncertainty of the twin's record.
void draw_from_covariance(Draw& d) {
  const plant::TwinFit& twin = *d.model.twin;
  const auto n = static_cast<Eigen::Index>(twin.parameters.size());
  Eigen::MatrixXd covariance(n, n);
  Eigen::VectorXd normal(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    normal(i) = d.random.normal();
    for (Eigen::Index j = 0; j < n; ++j) {
      covariance(i, j) = twin.covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(covariance);
  const Eigen::VectorXd moved =
      axes.eigenvectors() *
      axes.eigenvalues().cwiseMax(0.0).cwiseSqrt().cwiseProduct(normal).eval();
  plant::ProcessParameters& p = d.model.process;
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = twin.parameters[static_cast<std::size_t>(i)];
    const double factor = std::exp(std::clamp(moved(i), -0.5, 0.5));
    if (name == "gain") p.gain *= factor;
    if (name == "time_constant") p.time_constant_s *= factor;
    if (name == "dead_time") p.dead_time_s *= factor;
  }
}

bool has(const std::vector<EffectSpec>& effects, std::string_view name) {
  return std::any_of(effects.begin(), effects.end(),
                     [&](const EffectSpec& spec) { return spec.name == name; });
}

void vary_loop(Draw& d, const WindowRequest& request) {
  plant::LoopModel& m = d.model;
  Random& r = d.random;
  const plant::ProcessUncertainty& u = m.uncertainty;
  if (m.twin) draw_from_covariance(d);
  const double actuator_s = r.uniform(0.05, 0.3);
  const double second_s = r.uniform(0.0, 0.05) * m.process.time_constant_s;
  m.process.gain *= 1.0 + 2.0 * u.gain * r.uniform(-1.0, 1.0);
  m.process.time_constant_s *= 1.0 + 2.0 * u.time_constant * r.uniform(-1.0, 1.0);
  m.process.dead_time_s *= 1.0 + 2.0 * u.dead_time * r.uniform(-1.0, 1.0);
  // An identification counts small lags as dead time.
  m.process.dead_time_s = std::max(0.0, m.process.dead_time_s - actuator_s - second_s);
  m.valve_effects.insert(m.valve_effects.begin(),
                         EffectSpec{"positioner_lag", {{"time_constant", actuator_s}}});
  m.process_effects.push_back({"extra_lag", {{"time_constant", second_s}}});

  control::PidGains& gains = m.controller.pid.gains;
  const double slowest = m.twin ? -0.2 : -0.7;
  gains.kp *= std::exp(r.uniform(slowest, 0.2));
  gains.ki *= std::exp(r.uniform(slowest, 0.2));

  if (m.twin && request.noise_percent < 0.0) {
    m.transmitter.noise *= log_uniform(r, 0.8, 1.25);
  } else {
    const double noise =
        request.noise_percent >= 0.0 ? request.noise_percent : log_uniform(r, 0.03, 0.4);
    m.transmitter.noise = 0.01 * noise * d.pv_span;
  }
  if (m.transmitter.resolution == 0.0) m.transmitter.resolution = d.pv_span / 4096.0;
  if (m.twin) return;  // the twin's disturbances include its load
  if (chance(r, 0.25)) {
    m.disturbances.push_back(
        {"random_load", {{"intensity", 0.001 * d.pv_span * r.uniform(0.3, 1.2)}}});
  }
}

// Returns the PV at `co_share` of the CO span, within the transmitter's range less a margin, PV
// units.
double rest_point(const Draw& d, double co_share) {
  const control::PidSettings& pid = d.model.controller.pid;
  const plant::ProcessParameters& process = d.model.process;
  const double pv =
      process.level.value_or(0.0) + process.gain * (pid.output_low + co_share * d.co_span);
  const double margin = 0.08 * d.pv_span;
  return std::clamp(pv, d.model.transmitter.low + margin, d.model.transmitter.high - margin);
}

// Repeats the scenario's moves, with one of them in the first half of the window.
void draw_own_moves(Draw& d) {
  const plant::Scenario own = d.model.scenario;
  auto& profile = d.model.scenario.set_point;
  profile.clear();
  const std::size_t move = 1 + choice(d.random, own.set_point.size() - 1);
  const double in_window_s = d.random.uniform(0.05, 0.5) * d.window_s;
  const double at_window_s = own.set_point[move].first - in_window_s;
  // Position in the repeated scenario at the start of the run.
  double start_s = std::fmod(at_window_s - d.before_s, own.duration_s);
  if (start_s < 0.0) start_s += own.duration_s;
  double standing = own.set_point.back().second;
  for (const auto& [t, v] : own.set_point) {
    if (t <= start_s) standing = v;
  }
  profile.emplace_back(0.0, standing);
  for (double begin_s = -start_s; begin_s < d.length_s; begin_s += own.duration_s) {
    for (const auto& [t, v] : own.set_point) {
      const double at_s = begin_s + t;
      if (at_s > profile.back().first && at_s < d.length_s) profile.emplace_back(at_s, v);
    }
  }
}

void draw_set_points(Draw& d, const WindowRequest& request) {
  Random& r = d.random;
  auto& profile = d.model.scenario.set_point;
  const bool moves = profile.size() > 1 && d.model.scenario.duration_s > 0.0;
  const bool own = request.moves == SetPointMoves::own ||
                   (d.model.twin && request.moves == SetPointMoves::any && chance(r, 2.0 / 3.0));
  if (moves && own) {
    draw_own_moves(d);
    return;
  }
  profile.clear();
  const double per_output = std::abs(d.model.process.gain) * d.co_span;
  const double base = r.uniform(0.25, 0.7);
  const double start = rest_point(d, base);
  const double least = d.model.transmitter.low + 0.05 * d.pv_span;
  const double most = d.model.transmitter.high - 0.05 * d.pv_span;
  profile.emplace_back(0.0, start);
  const double kind = request.moves == SetPointMoves::steps ? 0.0 : r.uniform();
  if (kind < 0.6) {
    // Steps with random pauses, each to a value around the base.
    const double pause_s = d.window_s * log_uniform(r, 0.2, 1.2);
    const double reach = per_output * r.uniform(0.06, 0.3);
    for (double t = r.uniform(0.1, 1.0) * pause_s; t < d.length_s;
         t += pause_s * r.uniform(0.5, 1.5)) {
      profile.emplace_back(t, std::clamp(start + reach * r.uniform(-1.0, 1.0), least, most));
    }
  } else if (kind < 0.75) {
    // A square wave.
    const double half_s = d.window_s * log_uniform(r, 0.15, 0.8);
    const double reach = per_output * r.uniform(0.03, 0.25);
    bool up = true;
    for (double t = r.uniform(0.1, 1.0) * half_s; t < d.length_s; t += half_s) {
      profile.emplace_back(t, std::clamp(start + (up ? reach : 0.0), least, most));
      up = !up;
    }
  } else if (kind < 0.88) {
    // Set points from another controller: small steps that add up to ramps and waves.
    const double step_s = std::max(d.model.sample_time_s, d.window_s / 200.0);
    const double period_s = d.window_s * log_uniform(r, 0.3, 3.0);
    const double reach = per_output * r.uniform(0.03, 0.2);
    const bool ramp = chance(r, 0.5);
    for (double t = step_s; t < d.length_s; t += step_s) {
      const double phase = t / period_s;
      const double wave = ramp ? 4.0 * std::abs(phase - std::floor(phase) - 0.5) - 1.0
                               : std::sin(2.0 * std::numbers::pi * phase);
      profile.emplace_back(t, std::clamp(start + reach * wave, least, most));
    }
  }
  // Otherwise constant.
}

double severity(Draw& d, const WindowRequest& request, double high) {
  return request.severity_percent > 0.0 ? request.severity_percent
                                        : log_uniform(d.random, request.least_percent, high);
}

EffectSpec stick_slip(Draw& d, double s, double j) {
  constexpr std::array kLaws{"he", "choudhury", "karnopp", "inertial"};
  EffectSpec spec{"stiction", {{"s", s}, {"j", j}}};
  const char* law = kLaws[choice(d.random, kLaws.size())];
  spec.options["law"] = law;
  if (spec.options["law"] == "inertial") {
    const double fastest = 0.9 * std::numbers::pi / d.model.sample_time_s;
    spec.parameters["natural_frequency"] = std::min(d.random.uniform(8.0, 25.0), fastest);
    spec.parameters["damping"] = d.random.uniform(0.6, 0.95);
  }
  return spec;
}

// Returns the severity in % of CO span; 0 without one, or if it follows only from the run.
double add_condition(Draw& d, const WindowRequest& request) {
  Random& r = d.random;
  plant::LoopModel& m = d.model;
  const double co_percent = 0.01 * d.co_span;
  const bool rubs =
      m.twin && (has(m.valve_effects, "stiction") || has(m.valve_effects, "backlash"));
  if (request.condition != Condition::stiction && !rubs && chance(r, 0.7)) {
    // A healthy valve has packing friction too.
    const double s = r.uniform(0.06, 0.3) * co_percent;
    m.valve_effects.push_back({"stiction", {{"s", s}, {"j", 0.3 * s}}, {{"law", "he"}}});
  }
  switch (request.condition) {
    case Condition::no_fault:
    case Condition::other: return 0.0;
    case Condition::stiction: {
      const double s = severity(d, request, 20.0);
      m.valve_effects.push_back(
          stick_slip(d, s * co_percent, s * co_percent * r.uniform(0.1, 0.9)));
      return s;
    }
    case Condition::backlash: {
      const double width = severity(d, request, 20.0);
      m.valve_effects.push_back({"backlash", {{"deadband", width * co_percent}}});
      return width;
    }
    case Condition::hysteresis: {
      if (chance(r, 0.3)) {
        const double offset = severity(d, request, 12.0);
        // Before all other effects: the thesis adds it to the controller's output.
        m.valve_effects.insert(m.valve_effects.begin(),
                               EffectSpec{"hysteresis", {{"offset", offset * co_percent}}});
        return offset;
      }
      const double width = severity(d, request, 20.0);
      m.valve_effects.push_back(
          {"hysteresis", {{"width", width * co_percent}, {"knee", r.uniform(-1.0, 0.4)}}});
      return width;
    }
    case Condition::low_air_supply: {
      const double rate =
          request.severity_percent > 0.0 ? request.severity_percent : log_uniform(r, 0.5, 5.0);
      EffectSpec spec{"low_air_supply",
                      {{"rate", rate * co_percent}, {"lag", log_uniform(r, 0.3, 2.5)}}};
      if (chance(r, 0.65)) {
        spec.parameters["travel_limit"] =
            m.controller.pid.output_low + d.co_span * r.uniform(0.4, 0.85);
      }
      if (chance(r, 0.3)) spec.options["filling"] = "one_sided";
      m.valve_effects.push_back(std::move(spec));
      return 0.0;
    }
  }
  return 0.0;
}

// The effects from which `other` is drawn, each with its sizes in training.
struct Other {
  std::string_view name;
  void (*add)(Draw& d);
};

void slow_down(Draw& d, double factor) {
  d.model.controller.pid.gains.kp *= factor;
  d.model.controller.pid.gains.ki *= factor;
}

constexpr std::array kOthers{
    Other{"oscillating_disturbance",
          [](Draw& d) {
            const double response_s = d.model.process.time_constant_s + d.model.process.dead_time_s;
            const double amplitude = d.pv_span * log_uniform(d.random, 0.01, 0.06);
            const double period_s =
                log_uniform(d.random, 1.5 * response_s, 0.8 * d.window_s + 2.0 * response_s);
            d.model.disturbances.push_back({"oscillating_disturbance",
                                            {{"amplitude", amplitude},
                                             {"period", period_s},
                                             {"phase", d.random.uniform(0.0, 6.28)}}});
          }},
    Other{"step_disturbance",
          [](Draw& d) {
            const double size =
                either_sign(d.random, d.pv_span * log_uniform(d.random, 0.02, 0.12));
            const double from_s = d.length_s - d.window_s;
            d.model.disturbances.push_back(
                {"step_disturbance",
                 {{"size", size}, {"time", from_s + d.window_s * d.random.uniform(0.1, 0.85)}}});
          }},
    Other{"extra_dead_time",
          [](Draw& d) {
            d.model.process_effects.push_back(
                {"extra_dead_time",
                 {{"seconds", d.model.process.dead_time_s * d.random.uniform(0.25, 1.0) +
                                  d.model.sample_time_s}}});
            slow_down(d, 0.7);
          }},
    Other{"gain_change",
          [](Draw& d) {
            const double factor =
                chance(d.random, 0.5) ? d.random.uniform(0.5, 0.8) : d.random.uniform(1.2, 1.5);
            d.model.process_effects.push_back({"gain_change", {{"factor", factor}}});
            d.model.controller.pid.gains.kp /= std::max(1.0, factor);
            d.model.controller.pid.gains.ki /= std::max(1.0, factor);
          }},
    Other{
        "extra_lag",
        [](Draw& d) {
          d.model.process_effects.push_back(
              {"extra_lag",
               {{"time_constant", d.model.process.time_constant_s * d.random.uniform(0.4, 1.5)}}});
        }},
    Other{"positioner_overshoot",
          [](Draw& d) {
            const double damping = d.random.uniform(0.1, 0.35);
            d.model.valve_effects.push_back(
                {"positioner_overshoot",
                 {{"damping", damping}, {"natural_frequency", log_uniform(d.random, 0.3, 1.5)}}});
            slow_down(d, 0.7);
          }},
    Other{"valve_characteristic",
          [](Draw& d) {
            EffectSpec spec{"valve_characteristic", {}};
            if (chance(d.random, 0.6)) {
              spec.options["curve"] = "equal_percentage";
              spec.parameters["rangeability"] = d.random.uniform(15.0, 50.0);
            } else {
              spec.options["curve"] = "quick_opening";
            }
            d.model.valve_effects.push_back(std::move(spec));
            slow_down(d, 0.6);
          }},
    Other{"drift",
          [](Draw& d) {
            d.model.transmitter_effects.push_back(
                {"drift",
                 {{"rate", either_sign(d.random, d.pv_span * log_uniform(d.random, 2e-4, 1e-3))}}});
          }},
    Other{"controller_mismatch", [](Draw& d) {
            const double factor =
                chance(d.random, 0.5) ? d.random.uniform(0.2, 0.5) : d.random.uniform(1.1, 1.5);
            d.model.controller.pid.gains.kp *= factor;
            d.model.controller.pid.gains.ki *= chance(d.random, 0.5) ? factor : 1.0;
          }}};
constexpr auto kOtherNames = [] {
  std::array<std::string_view, kOthers.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kOthers[i].name;
  return names;
}();

void add_other(Draw& d, std::string_view name) {
  const auto* found = std::find(kOtherNames.begin(), kOtherNames.end(), name);
  if (found == kOtherNames.end()) {
    throw std::invalid_argument("no other condition is called '" + std::string(name) + "'");
  }
  kOthers[static_cast<std::size_t>(found - kOtherNames.begin())].add(d);
}

}  // namespace

std::span<const std::string_view> other_names() noexcept { return kOtherNames; }

SimulatedWindow simulate_window(const plant::LoopModel& model, const WindowRequest& request,
                                std::uint64_t seed) {
  return simulate_run(model, request, seed, kWindowSamples);
}

SimulatedWindow simulate_run(const plant::LoopModel& believed, const WindowRequest& request,
                             std::uint64_t seed, std::size_t samples) {
  Random random(seed);
  plant::LoopModel model = believed;
  const control::PidSettings& pid = believed.controller.pid;
  const double window_s = believed.sample_time_s * static_cast<double>(kWindowSamples - 1);
  const double response_s = believed.process.time_constant_s + believed.process.dead_time_s;
  const double before_s = 3.0 * response_s + window_s * random.uniform(0.0, 1.0);
  Draw draw{model,
            random,
            pid.output_span(),
            believed.transmitter.span(),
            before_s,
            before_s + believed.sample_time_s * static_cast<double>(samples),
            window_s};
  model.scenario.faults.clear();
  vary_loop(draw, request);
  draw_set_points(draw, request);
  SimulatedWindow window;
  window.condition = request.condition;
  window.severity_percent = add_condition(draw, request);
  if (request.condition == Condition::other) {
    const std::string_view name =
        request.other.empty() ? kOtherNames[choice(random, kOthers.size())] : request.other;
    add_other(draw, name);
    // With another controller, the window's CO and PV still fit the process.
    if (request.other.empty() && name == "controller_mismatch") {
      window.condition = Condition::no_fault;
    }
  }
  model.scenario.seed = random.bits();
  plant::SimulatedLoop loop(model, draw.co_span / 4096.0);
  const auto before = static_cast<std::size_t>(before_s / believed.sample_time_s);
  for (std::size_t k = 0; k < before; ++k) loop.step();
  double lacked = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    const plant::LoopSample s = loop.step();
    window.pv.push_back(s.pv);
    window.co.push_back(s.co);
    window.sp.push_back(s.sp);
    lacked = std::max(lacked, std::abs(s.co - s.stem));
  }
  if (request.condition == Condition::low_air_supply) {
    window.severity_percent = 100.0 * lacked / draw.co_span;
  }
  return window;
}

}  // namespace loopwarden::specialist
