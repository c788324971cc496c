// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/deciding_test.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/diagnosis/limits.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kSamples = 50;          // of each explanation
constexpr double kSlow = 8.0;                 // response times between which the error is compared
constexpr double kStepsPerAnswer = 10.0;      // samples of the simulation per response time
constexpr double kDeviationQuantile = 0.683;  // of the absolute value: one deviation
constexpr double kLeastNats = -300.0;         // of a likelihood that is summed
// Bands in the span of CO of the planner, whose sizes are then 0.13 to 2.7 bands, one of them 1.6.
constexpr double kBandsOfSpan = Limits::kCrossedBands / 0.03;
constexpr double kByHand_s = 10.0;  // least sample time: steps by hand last at least three
// Span of PV if its range is unknown: the least of these, and of gain times the span of CO.
constexpr double kMostMoves = 20.0;      // times PV's movement, which a test then hardly exceeds
constexpr double kMostMagnitudes = 2.0;  // times the highest PV, if PV has one sign
constexpr double kLongest_s = 1800.0;
constexpr double kSlowest = 6.5;           // response times of the longest test of a slow loop
constexpr std::size_t kLastSamples = 200;  // that give PV and CO at the start of the test

// Deviation of x(k + lag) - x(k), robust against slips.
double difference(const Series& x, std::size_t lag) {
  Series moves;
  for (std::size_t k = lag; k < x.size(); ++k) moves.push_back(std::abs(x[k] - x[k - lag]));
  return moves.empty() ? 0.0 : numeric::quantile_in_place(moves, kDeviationQuantile);
}

double mean_of_last(const Series& x) {
  const std::size_t count = std::min(x.size(), kLastSamples);
  return numeric::mean(std::span(x).last(count));
}

class TestPlanner {
 public:
  TestPlanner(const Diagnosis& d, const TestedLoop& loop)
      : d_(d), loop_(loop), pv_(d.prepared.raw_pv), co_(d.prepared.raw_co) {
    plan_.band = Limits::kSizeScale * tested_band(d.band);
    plan_.pv = mean_of_last(pv_);
    model_ = believed();
  }

  DecidingTest plan(const numeric::ParallelFor& parallel) {
    const estimator::TestStart start = start_of();
    const auto with = [&](std::vector<estimator::Explanation> explanations) {
      plan_.explanations = std::move(explanations);
      plan_.planned = estimator::propose_test(plan_.explanations, start, parallel);
      const auto& plan = plan_.planned.plan;
      return plan && plan->probability_right >= estimator::kWanted;
    };
    plan_.names_effect = with({stiction(), backlash(), good()});
    if (plan_.names_effect) return std::move(plan_);
    estimator::Explanation band = stiction();
    const estimator::Explanation other = backlash();
    // Both laws in turn.
    for (std::size_t i = 1; i < band.samples.size(); i += 2) band.samples[i] = other.samples[i];
    with({std::move(band), good()});
    return std::move(plan_);
  }

 private:
  // The process that the search for a band has found.
  plant::LoopModel believed() {
    const double block_s = loop_.period_s * static_cast<double>(d_.band.factor);
    const double most =
        *std::max_element(d_.band.log_likelihood.begin(), d_.band.log_likelihood.end());
    const estimator::BandProcess& found = most > 0.0 ? d_.band.process : d_.band.without;
    const bool integrates = found.pole >= 1.0;
    plant::LoopModel m;
    plant::ProcessParameters& p = m.process;
    p.kind = integrates ? plant::ProcessKind::integrating : plant::ProcessKind::self_regulating;
    p.gain = integrates ? found.gain / block_s : found.gain;
    // A lag below the sample time can't be seen.
    p.time_constant_s =
        block_s * (integrates || found.pole <= 0.0 ? 0.5 : -1.0 / std::log(found.pole));
    p.dead_time_s = block_s * static_cast<double>(found.delay - 1);
    if (!integrates) p.level = plan_.pv - p.gain * mean_of_last(co_);
    // The planner's sizes are shares of this range.
    const double co = mean_of_last(co_);
    m.controller.pid.output_low = co - 0.5 * kBandsOfSpan * plan_.band;
    m.controller.pid.output_high = co + 0.5 * kBandsOfSpan * plan_.band;
    m.controller.pid.action = p.gain > 0.0 ? control::Action::reverse : control::Action::direct;
    const double gain = std::abs(p.gain);
    // Settings that are tight enough to be at rest before the move.
    const auto tune = [&](double lag_s) {
      control::PidGains& pid = m.controller.pid.gains;
      pid.kp = integrates ? 1.0 / (gain * 2.0 * (lag_s + p.dead_time_s))
                          : lag_s / (gain * 2.0 * (lag_s + p.dead_time_s));
      pid.ki = pid.kp / (integrates ? 8.0 * (lag_s + p.dead_time_s) : lag_s);
    };
    tune(p.time_constant_s);
    const double step_s = std::max(kByHand_s, plant::answer_s(m) / kStepsPerAnswer);
    m.sample_time_s = loop_.period_s * std::max(1.0, std::floor(step_s / loop_.period_s));
    tune(std::max(p.time_constant_s, m.sample_time_s));
    const numeric::Range seen = numeric::range_of(pv_);
    plan_.pv_span_known = loop_.pv_range.has_value();
    if (plan_.pv_span_known) {
      m.transmitter.low = (*loop_.pv_range)[0];
      m.transmitter.high = (*loop_.pv_range)[1];
    } else {
      const double moved = seen.high - seen.low;
      double span = kMostMoves * moved;
      if (seen.low > 0.0) span = std::min(span, kMostMagnitudes * seen.high);
      if (!integrates) span = std::min(span, gain * (loop_.outputs[1] - loop_.outputs[0]));
      span = std::max(span, moved);
      m.transmitter.low = plan_.pv - 0.5 * span;
      m.transmitter.high = plan_.pv + 0.5 * span;
    }
    plan_.pv_span = m.transmitter.span();
    m.controller.set_point.low = m.transmitter.low;
    m.controller.set_point.high = m.transmitter.high;
    return m;
  }

  estimator::TestStart start_of() const {
    // Of the whole record, with the band.
    plant::LoopModel model = with_effect("backlash", {{"deadband", d_.band.band}});
    model.sample_time_s = loop_.period_s;
    plant::Plant plant(model, 1);
    plant.reset(co_.front());
    Series error(pv_.size());
    for (std::size_t k = 0; k < pv_.size(); ++k) {
      error[k] = pv_[k] - plant.process_variable();
      plant.step(co_[k]);
    }
    const auto slow =
        static_cast<std::size_t>(std::clamp(kSlow * plant::answer_s(model_) / loop_.period_s, 4.0,
                                            static_cast<double>(pv_.size()) / 4.0));
    const double fast = difference(error, 1);
    const double far = difference(error, slow);
    const double intensity_squared =
        std::max(0.0, (far * far - fast * fast) / (loop_.period_s * static_cast<double>(slow - 1)));
    const double noise =
        std::sqrt(0.5 * std::max(0.0, fast * fast - intensity_squared * loop_.period_s));
    const double averaged = model_.sample_time_s / loop_.period_s;
    return {.set_point = plan_.pv,
            .output = mean_of_last(co_),
            .set_points = {plan_.pv, plan_.pv},
            .outputs = loop_.outputs,
            .noise_rms = noise / std::sqrt(averaged),
            .disturbance = std::sqrt(intensity_squared),
            .longest_s = std::max(kLongest_s, kSlowest * plant::answer_s(model_))};
  }

  plant::LoopModel with_effect(const char* name, std::map<std::string, double> parameters) const {
    plant::LoopModel model = model_;
    model.valve_effects = {{name, std::move(parameters)}};
    return model;
  }

  // Sizes of the band: 90 % of them within the factor of the diagnosis.
  double size_of(numeric::Random& random) const {
    constexpr double kDeviations = 1.645;
    return plan_.band * std::exp(std::log(Limits::kSizeFactor) / kDeviations * random.normal());
  }
  estimator::Explanation stiction() const {
    numeric::Random random(1);
    estimator::Explanation e{{"stiction"}, 1.0, {}};
    for (std::size_t i = 0; i < kSamples; ++i) {
      const double s = size_of(random);
      e.samples.push_back(with_effect("stiction", {{"s", s}, {"j", s * random.uniform(0.2, 0.8)}}));
    }
    return e;
  }
  estimator::Explanation backlash() const {
    numeric::Random random(1);
    estimator::Explanation e{{"backlash"}, 1.0, {}};
    for (std::size_t i = 0; i < kSamples; ++i) {
      e.samples.push_back(with_effect("backlash", {{"deadband", size_of(random)}}));
      random.uniform(0.0, 1.0);  // keeps the sizes equal to those of stiction
    }
    return e;
  }
  estimator::Explanation good() const { return {{}, 1.0, {model_}}; }

  const Diagnosis& d_;
  const TestedLoop& loop_;
  const Series& pv_;
  const Series& co_;
  DecidingTest plan_;
  plant::LoopModel model_;
};

}  // namespace

double tested_band(const estimator::BandEvidence& found) {
  using Grid = estimator::BandGrid;
  if (!(found.share > 0.0)) return 0.0;
  const double most = *std::max_element(found.log_likelihood.begin(), found.log_likelihood.end());
  double sum = 0.0;
  double total = 0.0;
  for (std::size_t i = 0; i < Grid::kBands.size(); ++i) {
    if (Grid::kBands[i] < Grid::kLarge) continue;
    const double weight = std::exp(std::max(found.log_likelihood[i] - most, kLeastNats));
    sum += weight * Grid::kBands[i];
    total += weight;
  }
  return sum / total * found.band / found.share;
}

std::optional<DecidingTest> plan_deciding_test(const Diagnosis& d, const TestedLoop& loop,
                                               const numeric::ParallelFor& parallel) {
  if (!d.judged() || !(d.band.band > 0.0) || d.band.process.gain == 0.0 ||
      d.band.without.gain == 0.0)
    return std::nullopt;
  return TestPlanner(d, loop).plan(parallel);
}

}  // namespace loopwarden::diagnosis
