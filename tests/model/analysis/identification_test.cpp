// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/identification.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/analysis/loop_frequency.hpp"
#include "model/analysis/step_metrics.hpp"
#include "model/analysis/tuning_rules.hpp"
#include "model/numeric/random.hpp"

namespace identification_test {

using namespace loopwarden;
using namespace loopwarden::analysis;

namespace {

// Plant 1 as the thesis identified it.
constexpr plant::ProcessParameters kPlant1{
    .gain = 1.2264, .time_constant_s = 1.694, .dead_time_s = 2.626};
constexpr double kPeriod = 0.1;  // s

struct StepRecord {
  std::vector<double> co, pv;
};

StepRecord step_record(double second_lag_s, double noise, std::uint64_t seed) {
  StepRecord r;
  numeric::Random random(seed);
  plant::Process process(kPlant1, kPeriod);
  process.reset(2.0);
  double pv = 2.0 * kPlant1.gain;
  double lagged = pv;
  constexpr int kFiner = 100;  // the second lag by small steps
  plant::Process fine(kPlant1, kPeriod / kFiner);
  fine.reset(2.0);
  for (int k = 0; k < 600; ++k) {
    const double co = k < 50 ? 2.0 : 4.0;
    r.co.push_back(co);
    r.pv.push_back((second_lag_s > 0.0 ? lagged : pv) + noise * random.normal());
    if (second_lag_s > 0.0) {
      for (int i = 0; i < kFiner; ++i) {
        lagged += (fine.step(co) - lagged) * kPeriod / kFiner / second_lag_s;
      }
    } else {
      pv = process.step(co);
    }
  }
  return r;
}

bool covers(const Estimate& e, double truth) { return std::abs(e.value - truth) <= e.margin; }

}  // namespace

TEST_CASE("a clean step record gives its process back", "[analysis][identification]") {
  const StepRecord r = step_record(0.0, 0.0, 1);
  const ProcessFit fit = identify(r.co, r.pv, kPeriod);
  CHECK(fit.gain.value == Approx(1.2264).epsilon(1e-6));
  CHECK(fit.time_constant_s.value == Approx(1.694).epsilon(1e-6));
  CHECK(fit.dead_time_s.value == Approx(2.626).epsilon(1e-6));
  CHECK(fit.rest_pv == Approx(2.0 * 1.2264).epsilon(1e-6));
  CHECK(fit.fit_percent > 99.999);
}

TEST_CASE("the intervals of noisy step records hold the truth as often as they say",
          "[analysis][identification]") {
  int gain = 0, lag = 0, dead = 0;
  constexpr int kRecords = 40;
  for (std::uint64_t seed = 1; seed <= kRecords; ++seed) {
    const StepRecord r = step_record(0.0, 0.05, seed);
    const ProcessFit fit = identify(r.co, r.pv, kPeriod);
    CHECK(fit.gain.value == Approx(1.2264).epsilon(0.01));
    CHECK(fit.time_constant_s.value == Approx(1.694).epsilon(0.12));
    CHECK(fit.dead_time_s.value == Approx(2.626).epsilon(0.06));
    CHECK(fit.dead_time_s.margin < 0.15);
    CHECK(fit.rmse == Approx(0.05).epsilon(0.15));
    gain += covers(fit.gain, 1.2264) ? 1 : 0;
    lag += covers(fit.time_constant_s, 1.694) ? 1 : 0;
    dead += covers(fit.dead_time_s, 2.626) ? 1 : 0;
  }
  // 38 of 40 expected; fewer than 34 happens once in a hundred.
  CHECK(gain >= 34);
  CHECK(lag >= 34);
  CHECK(dead >= 34);
}

TEST_CASE("a second lag is found where there is one", "[analysis][identification]") {
  const StepRecord two = step_record(0.8, 0.005, 3);
  const ProcessFit one_lag = identify(two.co, two.pv, kPeriod, 1);
  const ProcessFit two_lags = identify(two.co, two.pv, kPeriod, 2);
  CHECK(two_lags.criterion < one_lag.criterion - 10.0);
  CHECK(two_lags.time_constant_s.value == Approx(1.694).epsilon(0.1));
  CHECK(two_lags.second_lag_s.value == Approx(0.8).epsilon(0.2));
  CHECK(two_lags.dead_time_s.value == Approx(2.626).epsilon(0.03));
  CHECK(two_lags.gain.value == Approx(1.2264).epsilon(0.002));

  const StepRecord one = step_record(0.0, 0.005, 3);
  CHECK(identify(one.co, one.pv, kPeriod, 2).criterion >
        identify(one.co, one.pv, kPeriod, 1).criterion - 10.0);
}

TEST_CASE("the tangent finds the dead time, and a lag that is too long by its averaging",
          "[analysis][identification]") {
  const StepRecord r = step_record(0.0, 0.0, 1);
  const Tangent t = tangent_method(r.co, r.pv, kPeriod);
  CHECK(t.process.gain == Approx(1.2264).epsilon(1e-3));
  CHECK(t.process.dead_time_s == Approx(2.62).epsilon(0.01));
  // 1.694 is true; the thesis drew 1.78.
  CHECK(t.process.time_constant_s > 1.694);
  CHECK(t.process.time_constant_s < 1.12 * 1.694);
}

TEST_CASE("what can't be identified is said", "[analysis][identification]") {
  std::vector<double> co(100, 2.0), pv(100, 3.0);
  CHECK_THROWS_WITH(identify(co, pv, kPeriod), Catch::Contains("CO never moves"));
  co.back() = 5.0;
  CHECK_THROWS_WITH(identify(co, pv, kPeriod), Catch::Contains("PV never moves"));
  pv.assign(100, std::nan(""));
  CHECK_THROWS_WITH(identify(co, pv, kPeriod), Catch::Contains("missing"));
  const StepRecord r = step_record(0.0, 0.0, 1);
  std::vector<double> two_steps = r.co;
  for (std::size_t k = 300; k < 600; ++k) two_steps[k] = 3.0;
  CHECK_THROWS_WITH(tangent_method(two_steps, r.pv, kPeriod), Catch::Contains("one step"));
}

TEST_CASE("step metrics are those of a second-order system", "[analysis][step]") {
  // Thesis, equations 6.1 to 6.4.
  constexpr double kZeta = 0.4, kNatural = 2.0, kFine = 0.001;
  const double damped = kNatural * std::sqrt(1.0 - kZeta * kZeta);
  std::vector<double> y;
  for (int k = 0; k < 12'000; ++k) {
    const double t = k * kFine;
    y.push_back(3.0 + 2.0 * (1.0 - std::exp(-kZeta * kNatural * t) *
                                       (std::cos(damped * t) +
                                        kZeta * kNatural / damped * std::sin(damped * t))));
  }
  const StepMetrics m = step_metrics(y, 3.0, 5.0, kFine);
  CHECK(m.peak_time_s == Approx(std::numbers::pi / damped).margin(0.002));
  CHECK(m.overshoot ==
        Approx(std::exp(-kZeta * std::numbers::pi / std::sqrt(1 - kZeta * kZeta))).epsilon(1e-3));
  CHECK(m.rise_0_100_s == Approx((std::numbers::pi - std::acos(kZeta)) / damped).margin(0.06));
  CHECK(m.settling_2_s == Approx(4.0 / (kZeta * kNatural)).epsilon(0.2));
  CHECK(m.settling_5_s < m.settling_2_s);
  CHECK(m.final_error == Approx(0.0).margin(1e-3));
  // A pure lag: half after T ln 2, 10 to 90 % in T ln 9.
  std::vector<double> lag;
  for (int k = 0; k < 3000; ++k) lag.push_back(1.0 - std::exp(-0.01 * k / 2.0));
  const StepMetrics l = step_metrics(lag, 0.0, 1.0, 0.01);
  CHECK(l.delay_s == Approx(2.0 * std::log(2.0)).epsilon(1e-3));
  CHECK(l.rise_10_90_s == Approx(2.0 * std::log(9.0)).epsilon(1e-3));
  CHECK(l.overshoot == 0.0);
  CHECK(std::isinf(step_metrics(std::vector<double>(50, 0.5), 0.0, 1.0, 0.1).settling_2_s));
}

TEST_CASE("tuning rules give the figures of their sources", "[analysis][tuning]") {
  const auto gains = [](TuningRule rule, const plant::ProcessParameters& p,
                        ControllerForm form = ControllerForm::pi) {
    return *tune(rule, p, {.form = form});
  };
  // The thesis, with its tangent's figures and the process gain left out.
  const plant::ProcessParameters drawn{1.2264, 1.78, 2.62};
  CHECK(gains(TuningRule::zn_thesis, drawn).kp == Approx(0.61145038).epsilon(1e-6));
  CHECK(gains(TuningRule::zn_thesis, drawn).ki == Approx(0.070013402).epsilon(1e-4));
  CHECK(gains(TuningRule::zn, drawn).kp == Approx(0.61145038 / 1.2264).epsilon(1e-6));
  const plant::ProcessParameters p{2.0, 4.0, 1.0};
  CHECK(gains(TuningRule::zn, p, ControllerForm::pid).kp == Approx(2.4));
  CHECK(gains(TuningRule::zn, p, ControllerForm::pid).kd == Approx(2.4 * 0.5));
  CHECK(gains(TuningRule::cohen_coon, p).kp == Approx(2.0 * (0.9 + 1.0 / 48.0)));
  CHECK(gains(TuningRule::cohen_coon, p).ki ==
        Approx(gains(TuningRule::cohen_coon, p).kp / (30.75 / 14.0)));
  CHECK(gains(TuningRule::simc, p).kp == Approx(1.0));
  CHECK(gains(TuningRule::simc, p).ki == Approx(0.25));
  CHECK(gains(TuningRule::lambda, p).kp == Approx(4.0 / (2.0 * 5.0)));
  CHECK(gains(TuningRule::amigo, p).kp == Approx(0.075 + (0.35 - 0.16) * 2.0));
  CHECK(gains(TuningRule::amigo, p).ki ==
        Approx(gains(TuningRule::amigo, p).kp / (0.35 + 13.0 * 16.0 / (16.0 + 48.0 + 7.0))));
  CHECK(gains(TuningRule::amigo, p, ControllerForm::pid).kd ==
        Approx(1.0 * 0.5 * 4.0 / (0.3 + 4.0)));
  CHECK_FALSE(tune(TuningRule::zn, {1.0, 1.0, 0.0}).has_value());
  CHECK_FALSE(tune(TuningRule::simc, p, {.form = ControllerForm::pid}).has_value());
  for (const TuningRule rule : kTuningRules) {
    const double factor = gains(rule, p).kp / gains(rule, {6.0, 4.0, 1.0}).kp;
    CHECK((std::abs(factor - 3.0) < 1e-9) == scales_with_gain(rule));
  }
}

TEST_CASE("margins are those of loops that can be worked out by hand", "[analysis][margins]") {
  // Integral control of a fast process behind dead time D: phase -90 - w D, gain ki K / w.
  LinearLoop loop{.gains = {.kp = 0.0, .ki = 0.5},
                  .gain = 1.0,
                  .dead_time_s = 1.0,
                  .lags_s = {},
                  .sample_time_s = 1e-4,
                  .left_out = {}};
  const Margins m = margins(loop);
  CHECK(m.gain_margin == Approx(std::numbers::pi).epsilon(2e-3));
  CHECK(m.phase_margin_deg == Approx(90.0 - 0.5 * 180.0 / std::numbers::pi).epsilon(2e-3));
  CHECK(m.delay_margin_s == Approx((std::numbers::pi / 2.0 - 0.5) / 0.5).epsilon(2e-3));
  CHECK(m.stable);
  loop.gains.ki = 2.0;
  CHECK_FALSE(margins(loop).stable);
}

}  // namespace identification_test
