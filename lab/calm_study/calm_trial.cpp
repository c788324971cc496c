// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/calm_trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "model/control/simulated_controller.hpp"
#include "model/plant/plant.hpp"
#include "model/numeric/random.hpp"

namespace loopwarden::lab {
namespace {

constexpr double kStemResolution = 0.0005;  // of the span: smaller moves do not count as travel
constexpr double kTroubleLasts = 60.0;      // s, duration of temporary faults
constexpr double kStandstill = 0.02;        // of Ki e: below it the integrator counts as stopped

double swing_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

double rounded(double value, double resolution) {
  return resolution > 0.0 ? resolution * std::nearbyint(value / resolution) : value;
}

// Samples and sums of one set point.
struct Segment {
  std::vector<double> sp, true_pv, stem, co;
  double integral_rate = 0.0;  // sum of Ki e, CO units/s
  double acting_rate = 0.0;    // sum of Ki e + w, CO units/s

  void clear() {
    for (std::vector<double>* values : {&sp, &true_pv, &stem, &co}) values->clear();
    integral_rate = 0.0;
    acting_rate = 0.0;
  }
  bool parked(double stem_resolution) const {
    return swing_of(stem) <= stem_resolution &&
           std::abs(acting_rate) <= kStandstill * std::abs(integral_rate);
  }
};

// `Truth`: plant::Plant or PhysicalPlant.
template <class Truth>
class Trial {
 public:
  Trial(const CalmTrial& trial, Truth truth)
      : trial_(trial),
        plant_(std::move(truth)),
        controller_(trial.model.controller, trial.model.sample_time_s,
                    trial.model.scenario.set_point.front().second, 0.0),
        read_back_noise_(~trial.model.scenario.seed),
        stem_resolution_(kStemResolution * (trial.model.controller.pid.output_high -
                                            trial.model.controller.pid.output_low)) {
    const double start = plant_.output_for(trial.model.scenario.set_point.front().second);
    plant_.reset(start);
    controller_.assume_output(start);
    controller_.request_mode(control::Mode::automatic);
  }

  TrialResult run() {
    std::size_t set_points = 0;
    for (const auto& [time_s, set_point] : trial_.model.scenario.set_point)
      hold(set_point, set_points++ >= trial_.unmeasured);
    const auto holds = static_cast<double>(set_points - trial_.unmeasured);
    analysis::LoopMetrics& m = result_.settled;
    m.rms_error = std::sqrt(m.rms_error / holds);
    for (double* mean : {&m.mean_error, &m.travel_per_hour, &m.reversals_per_hour,
                         &result_.pv_swing, &result_.co_swing}) {
      *mean /= holds;
    }
    if (cycling_holds_ > 0) m.period_s /= cycling_holds_;
    result_.whole_rms_error = std::sqrt(whole_squares_ / static_cast<double>(whole_samples_));
    result_.parked = segment_.parked(stem_resolution_);
    return result_;
  }

 private:
  void hold(double set_point, bool measured) {
    const double period_s = trial_.model.sample_time_s;
    const auto samples = static_cast<std::size_t>(trial_.hold_s / period_s);
    const auto settling = static_cast<std::size_t>(trial_.settling_s / period_s);
    segment_.clear();
    controller_.request_set_point(set_point);
    for (std::size_t k = 0; k < samples; ++k) step(measured, k >= settling);
    if (!measured) return;

    const analysis::LoopMetrics now = analysis::loop_metrics(
        segment_.sp, segment_.true_pv, segment_.stem, period_s, stem_resolution_);
    analysis::LoopMetrics& sum = result_.settled;
    sum.rms_error += now.rms_error * now.rms_error;
    sum.mean_error += now.mean_error;
    if (now.period_s > 0.0) {
      sum.period_s += now.period_s;
      ++cycling_holds_;
    }
    sum.travel_per_hour += now.travel_per_hour;
    sum.reversals_per_hour += now.reversals_per_hour;
    result_.pv_swing += swing_of(segment_.true_pv);
    result_.co_swing += swing_of(segment_.co);
  }

  bool in_trouble(Trouble::Kind kind, double lasts_s) const {
    const double since_s = plant_.time_s() - trial_.trouble.from_s;
    return trial_.trouble.kind == kind && since_s >= 0.0 && since_s < lasts_s;
  }

  // Applies the fault to the read-back and PV that the controller receives. Returns whether the
  // read-back is good.
  bool disturb(double& read_back, double& pv) {
    using Kind = Trouble::Kind;
    constexpr double kForGood = std::numeric_limits<double>::infinity();
    const plant::LoopModel& model = trial_.model;
    if (in_trouble(Kind::read_back_stuck, kForGood)) read_back = stuck_;
    if (in_trouble(Kind::read_back_off, kForGood)) {
      read_back += 0.02 * model.controller.pid.output_span();
    }
    earlier_.push_back(read_back);
    const auto late = static_cast<std::size_t>(5.0 / model.sample_time_s);
    if (in_trouble(Kind::read_back_late, kForGood) && earlier_.size() > late) {
      read_back = earlier_[earlier_.size() - 1 - late];
    }
    if (in_trouble(Kind::pv_frozen, kTroubleLasts)) pv = frozen_;
    if (in_trouble(Kind::reload, model.sample_time_s)) {
      control::ControllerSettings settings = model.controller;
      settings.pid.gains.kp *= 0.9;
      controller_.configure(settings);
    }
    stuck_ = read_back;
    frozen_ = pv;
    return !in_trouble(Kind::read_back_lost, kForGood);
  }

  void step(bool measured, bool settled) {
    const ReadBackErrors& errors = trial_.read_back;
    const double true_pv = plant_.true_process_variable();
    const double stem = plant_.stem();
    if (plant_.time_s() >= next_read_back_s_) {
      read_back_ =
          rounded(stem + errors.bias + errors.noise * read_back_noise_.normal(), errors.resolution);
      next_read_back_s_ =
          errors.renewed_s > 0.0
              ? plant_.time_s() + errors.renewed_s * read_back_noise_.uniform(1.0, 1.5)
              : 0.0;
    }
    double read_back = read_back_;
    double pv = plant_.process_variable();
    const bool read_back_good = disturb(read_back, pv);
    const bool lost = in_trouble(Trouble::Kind::output_lost, kTroubleLasts);
    const control::ControllerOutput out =
        lost ? controller_.step_fallback(control::OutputAction::hold())
             : controller_.step({.process_variable = pv,
                                 .valve_position = read_back,
                                 .valve_position_valid = read_back_good,
                                 .read_back = read_back,
                                 .read_back_valid = read_back_good});
    const double co = rounded(out.output, trial_.output_resolution);
    controller_.applied(co);

    const double error = out.set_point - true_pv;
    if (measured) {
      whole_squares_ += error * error;
      ++whole_samples_;
    }
    if (measured && settled) {
      const double integral_rate =
          trial_.model.controller.pid.gains.ki * (out.set_point - plant_.process_variable());
      segment_.sp.push_back(out.set_point);
      segment_.true_pv.push_back(true_pv);
      segment_.stem.push_back(stem);
      segment_.co.push_back(co);
      segment_.integral_rate += integral_rate;
      segment_.acting_rate += integral_rate + out.jacket_rate;
    }
    plant_.step(co);
  }

  const CalmTrial& trial_;
  Truth plant_;
  control::SimulatedController controller_;
  numeric::Random read_back_noise_;
  double stem_resolution_;         // CO units
  double read_back_ = 0.0;         // CO units
  double next_read_back_s_ = 0.0;  // s
  std::vector<double> earlier_;    // read-backs
  double stuck_ = 0.0;             // CO units
  double frozen_ = 0.0;            // PV units
  Segment segment_;
  double whole_squares_ = 0.0;
  std::size_t whole_samples_ = 0;
  int cycling_holds_ = 0;
  TrialResult result_;
};

}  // namespace

TrialResult run_trial(const CalmTrial& trial) {
  if (trial.physical) return Trial(trial, PhysicalPlant(trial.model, *trial.physical)).run();
  return Trial(trial, plant::Plant(trial.model, trial.model.scenario.seed)).run();
}

}  // namespace loopwarden::lab
