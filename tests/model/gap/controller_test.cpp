// SPDX-License-Identifier: Apache-2.0
#include "model/gap/controller.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/model/gap/gap_support.hpp"

namespace controller_test {

using namespace loopwarden;

namespace {

// CO is at its upper limit for a good part of the record.
plant::LoopModel limited_model() {
  plant::LoopModel model = test::believed_model();
  model.controller.output.high = 10.0;
  model.process.gain = 0.55;
  return model;
}

// PV falls when CO rises.
plant::LoopModel direct_model() {
  plant::LoopModel model = test::believed_model();
  model.controller.output.high = 10.0;
  model.controller.pid.action = control::Action::direct;
  model.process.gain = -1.1;
  model.transmitter_effects = {{"output_bias", {{"bias", 10.0}}}};
  return model;
}

// From rest, without noise and a converter's rounding.
numeric::LoopRecord exact_record(plant::LoopModel truth) {
  truth.transmitter.low = -10.0;
  truth.controller.set_point.low = -10.0;
  const double side = truth.process.gain < 0.0 ? -1.0 : 1.0;
  truth.scenario.set_point = {
      {0.0, 3.0 * side}, {5.0, 5.0 * side}, {25.0, 6.5 * side}, {45.0, 4.0 * side}};
  plant::SimulatedLoop loop(truth);
  numeric::LoopRecord record{.period_s = truth.sample_time_s, .pv = {}, .sp = {}, .co = {}};
  for (int k = 0; k < 700; ++k) {
    const plant::LoopSample s = loop.step();
    record.pv.push_back(s.pv);
    record.sp.push_back(s.sp);
    record.co.push_back(s.co);
  }
  return record;
}

// CO of a PI with `kp` times the model's gain on a square wave of SP, plus `beside`, which no PI
// gives.
gap::ControllerFinding square_wave(double kp, double amplitude, double beside = 0.0) {
  plant::LoopModel model = test::believed_model();
  model.controller.pid.gains.kp = 0.9;
  model.controller.pid.gains.ki = 0.02;
  numeric::LoopRecord record{.period_s = model.sample_time_s, .pv = {}, .sp = {}, .co = {}};
  for (int k = 0; k < 1200; ++k) {
    record.sp.push_back(5.0 + (k / 50 % 2 == 0 ? amplitude : -amplitude));
    record.pv.push_back(5.0 + 0.05 * std::sin(0.3 * k));
  }
  control::PidSettings settings = model.controller.pid;
  settings.gains.kp *= kp;
  record.co = gap::replay_controller(settings, record.period_s, record.sp, record.pv, 5.0);
  for (std::size_t k = 0; k < record.co.size(); ++k) {
    record.co[k] += beside * std::sqrt(2.0) * std::sin(0.9 * static_cast<double>(k));
  }
  return gap::compare_controller(record, model);
}

}  // namespace

TEST_CASE("a record that begins at a limit of CO shows no other settings", "[gap][controller]") {
  plant::LoopModel model = test::believed_model();
  model.controller.pid.gains.kp = 0.9;
  model.controller.pid.gains.ki = 0.02;
  numeric::LoopRecord record{.period_s = model.sample_time_s, .pv = {}, .sp = {}, .co = {}};
  for (int k = 0; k < 1300; ++k) {
    const double wave = k / 50 % 2 == 0 ? 1.5 : -1.5;
    record.sp.push_back(k >= 50 && k < 150 ? -1.0 : 5.0 + wave);
    record.pv.push_back(5.0 + 0.05 * std::sin(0.3 * k));
  }
  record.co =
      gap::replay_controller(model.controller.pid, record.period_s, record.sp, record.pv, 5.0);
  record = record.part(100, record.size());
  REQUIRE(record.co.front() == 0.0);
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  REQUIRE(found.compared);
  CHECK_FALSE(found.mismatch);
  CHECK_FALSE(found.unexplained);
  CHECK(found.before_rmse < 0.02);
}

TEST_CASE("settings nearer than 3 % are the model's own", "[gap][controller]") {
  CHECK_FALSE(square_wave(1.02, 1.5).mismatch);
  CHECK(square_wave(1.045, 1.5).mismatch);
}

TEST_CASE("a difference of CO of less than 0.2 % of its span does not matter",
          "[gap][controller]") {
  const gap::ControllerFinding small = square_wave(1.05, 0.32);
  CHECK(small.training_rmse_before == Approx(0.015).epsilon(0.1));
  CHECK_FALSE(small.mismatch);
  CHECK_FALSE(small.unexplained);
  const gap::ControllerFinding larger = square_wave(1.05, 0.64);
  CHECK(larger.training_rmse_before == Approx(0.03).epsilon(0.1));
  CHECK(larger.mismatch);
}

TEST_CASE("other settings must leave less than three tenths of the difference",
          "[gap][controller]") {
  const double explained = square_wave(1.2, 1.5).training_rmse_before;
  CHECK(square_wave(1.2, 1.5, 0.25 * explained).mismatch);
  const gap::ControllerFinding more = square_wave(1.2, 1.5, 0.43 * explained);
  CHECK_FALSE(more.mismatch);
  CHECK(more.unexplained);
}

TEST_CASE("replayed on what it measured, the controller repeats itself", "[gap][controller]") {
  plant::LoopModel model = GENERATE(test::believed_model(), limited_model(), direct_model());
  model.transmitter_effects.clear();
  model.controller.pid.anti_windup =
      GENERATE(control::AntiWindup::integral_clamp, control::AntiWindup::back_calculation,
               control::AntiWindup::conditional);
  const numeric::LoopRecord record = exact_record(model);
  const std::vector<double> co = gap::replay_controller(model.controller.pid, record.period_s,
                                                        record.sp, record.pv, record.co[0]);
  for (std::size_t k = 0; k < co.size(); ++k) {
    CAPTURE(k);
    REQUIRE(co[k] == Approx(record.co[k]).margin(1e-9));
  }
}

TEST_CASE("settings are found in spite of stretches at the limit, and in direct action",
          "[gap][controller]") {
  const bool direct = GENERATE(false, true);
  const plant::LoopModel model = direct ? direct_model() : limited_model();
  plant::LoopModel truth = model;
  truth.controller.pid.gains.kp = 0.3;
  truth.controller.pid.gains.ki = 0.22;
  const numeric::LoopRecord record = test::record_of(truth, 120.0);
  if (!direct) CHECK(std::count(record.co.begin(), record.co.end(), 10.0) > 100);
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  REQUIRE(found.mismatch);
  CHECK(found.kp == Approx(0.3).epsilon(0.02));
  CHECK(found.ki == Approx(0.22).epsilon(0.02));
  CHECK(std::abs(found.kp - 0.3) < 6.0 * found.kp_spread);
  CHECK(found.kp_spread > 0.0);
}

TEST_CASE("a CO that no PI law gives is left unexplained", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 120.0);
  for (std::size_t k = 0; k < record.size(); ++k) {
    record.co[k] = 5.0 + std::sin(0.05 * static_cast<double>(k));
  }
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  CHECK_FALSE(found.mismatch);
  CHECK(found.unexplained);
}

TEST_CASE("missing samples of SP, PV and CO are bridged", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 120.0);
  for (std::size_t k = 0; k < record.size(); k += 97) {
    record.sp[k] = std::numeric_limits<double>::quiet_NaN();
    record.co[k] = std::numeric_limits<double>::quiet_NaN();
  }
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  CHECK_FALSE(found.mismatch);
  CHECK_FALSE(found.unexplained);
  CHECK(std::isfinite(found.before_rmse));
}

TEST_CASE("the model's own controller replays the record to its rounding", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = test::record_of(model, 120.0);
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  CHECK(found.compared);
  CHECK_FALSE(found.mismatch);
  CHECK_FALSE(found.unexplained);
  CHECK(found.before_rmse < 2.0 * 10.0 / 4096.0);
}

TEST_CASE("other settings are found as they are", "[gap][controller]") {
  plant::LoopModel truth = test::believed_model();
  truth.controller.pid.gains.kp = 0.6;
  truth.controller.pid.gains.ki = 0.11;
  const gap::ControllerFinding found =
      gap::compare_controller(test::record_of(truth, 120.0), test::believed_model());
  REQUIRE(found.mismatch);
  CHECK(found.kp == Approx(0.6).epsilon(0.01));
  CHECK(found.ki == Approx(0.11).epsilon(0.01));
  CHECK(found.after_rmse < 0.1 * found.before_rmse);
}

TEST_CASE("a different anti-windup is never reported as different settings", "[gap][controller]") {
  plant::LoopModel truth = test::believed_model();
  truth.controller.pid.anti_windup = control::AntiWindup::conditional;
  truth.controller.output.high = 10.0;
  truth.process.gain = 0.5;  // the upper set points can't be reached: CO is at its limit
  plant::LoopModel model = truth;
  model.controller.pid.anti_windup = control::AntiWindup::integral_clamp;
  const gap::ControllerFinding found =
      gap::compare_controller(test::record_of(truth, 120.0), model);
  CHECK_FALSE(found.mismatch);
  CHECK_FALSE(found.unexplained);
  CHECK(found.anti_windup == "conditional");
}

TEST_CASE("after a stretch that was not recorded the controller restarts", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 120.0);
  const std::size_t from = GENERATE(0U, 100U);
  for (std::size_t k = from; k < from + 130; ++k) {
    record.pv[k] = std::numeric_limits<double>::quiet_NaN();
  }
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  CHECK(found.compared);
  CHECK_FALSE(found.mismatch);
  CHECK_FALSE(found.unexplained);
  CHECK(found.before_rmse < 2.0 * 10.0 / 4096.0);
}

TEST_CASE("a column without a value is a column that was not measured", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 60.0);
  std::vector<double>& column = GENERATE(true, false) ? record.sp : record.co;
  std::fill(column.begin(), column.end(), std::numeric_limits<double>::quiet_NaN());
  CHECK_FALSE(gap::compare_controller(record, model).compared);
}

TEST_CASE("without CO or SP no controller is compared", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 30.0);
  record.co.clear();
  CHECK_FALSE(gap::compare_controller(record, model).compared);
}

TEST_CASE("a filter on PV is found with its time, other gains are not", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 130.0);
  std::vector<double> filtered = record.pv;
  for (std::size_t k = 1; k < filtered.size(); ++k)
    filtered[k] = filtered[k - 1] + (1.0 - std::exp(-0.1 / 2.0)) * (record.pv[k] - filtered[k - 1]);
  record.co = gap::replay_controller(model.controller.pid, 0.1, record.sp, filtered, record.co[0]);
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  REQUIRE(found.mismatch);
  CHECK(found.filter_s == Approx(2.0).epsilon(0.1));
  CHECK(found.dead_band == 0.0);
  CHECK(found.kp == Approx(0.4).epsilon(0.05));
  CHECK(found.after_rmse < 0.1 * found.before_rmse);
}

TEST_CASE("a dead band of the error is found with its width", "[gap][controller]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 130.0);
  std::vector<double> seen = record.pv;
  for (std::size_t k = 0; k < seen.size(); ++k)
    seen[k] += std::clamp(record.sp[k] - record.pv[k], -0.3, 0.3);
  record.co = gap::replay_controller(model.controller.pid, 0.1, record.sp, seen, record.co[0]);
  const gap::ControllerFinding found = gap::compare_controller(record, model);
  REQUIRE(found.mismatch);
  CHECK(found.dead_band == Approx(0.3).epsilon(0.1));
  CHECK(found.filter_s == 0.0);
}

TEST_CASE("different gains have neither filter nor dead band", "[gap][controller]") {
  plant::LoopModel truth = test::believed_model();
  truth.controller.pid.gains.kp = 0.6;
  const gap::ControllerFinding found =
      gap::compare_controller(test::record_of(truth, 130.0), test::believed_model());
  REQUIRE(found.mismatch);
  CHECK(found.filter_s == 0.0);
  CHECK(found.dead_band == 0.0);
}

}  // namespace controller_test
