// SPDX-License-Identifier: Apache-2.0
#include "config/loop_model_reader.hpp"

#include <cmath>

#include "model/plant/simulated_loop.hpp"
#include "tests/config/config_support.hpp"

namespace loop_model_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kModel;
using test::said_of_model;
using test::with;

TEST_CASE("A model of the fixed format is read whole", "[config][model]") {
  const auto model = read_model_file(LOOPWARDEN_SOURCE_DIR "/tests/config/data/model_fast.yaml");
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  CHECK(model.diagnostics.empty());
  CHECK(model->sample_time_s == 0.1);
  const control::PidSettings& pid = model->controller.pid;
  CHECK(pid.gains.kp == 0.98216);
  CHECK(pid.gains.ki == 0.227437);
  CHECK(pid.action == control::Action::reverse);
  CHECK(pid.anti_windup == control::AntiWindup::integral_clamp);
  CHECK(pid.output_low == 0.0);
  CHECK(pid.output_high == 10.0);
  CHECK(model->controller.output == control::OutputLimits{.low = 0.0, .high = 10.0});
  CHECK(model->valve_effects.empty());
  CHECK(model->process == plant::ProcessParameters{
                              .gain = 0.88249, .time_constant_s = 3.87086, .dead_time_s = 1.47196});
  CHECK(model->uncertainty.gain == 0.03);
  CHECK(model->uncertainty.time_constant == 0.06);
  CHECK(model->transmitter ==
        plant::TransmitterParameters{.low = 0, .high = 10, .resolution = 0.00244140625});
  CHECK(read_model_file(LOOPWARDEN_SOURCE_DIR "/tests/config/data/model_plant1.yaml"));
}

TEST_CASE("Keys that a model omits have their default", "[config][model]") {
  const auto model = read_model_text("m.yaml", kModel);
  REQUIRE(model);
  CHECK(model->uncertainty == plant::ProcessUncertainty{0.03, 0.06, 0.03});
  CHECK(model->transmitter.noise == 0.0);
  CHECK(model->scenario == plant::Scenario{});
  CHECK(model->controller.jacket == control::JacketSettings{});
  CHECK(model->controller.set_point.high == 10.0);  // up to the transmitter's range
  CHECK(std::isinf(model->controller.output.rate_per_s));
}

TEST_CASE("A process integrates, or has a second lag, if its keys are set", "[config][model]") {
  const std::string integrating =
      with(with(kModel, "gain: 1.2264", "kind: integrating\n  gain: 0.02"),
           "  time_constant: 1.7\n", "");
  const auto level = read_model_text("m.yaml", integrating);
  INFO(to_text(level.diagnostics));
  REQUIRE(level);
  CHECK(level->process.integrating());
  CHECK(level->process.gain == 0.02);
  const auto two = read_model_text(
      "m.yaml", with(kModel, "dead_time: 2.6", "dead_time: 2.6\n  second_time_constant: 0.4"));
  REQUIRE(two);
  CHECK(two->process.second_time_constant_s == 0.4);
  CHECK_FALSE(two->process.integrating());

  const std::string both = with(kModel, "gain: 1.2264", "kind: integrating\n  gain: 0.02");
  CHECK_THAT(said_of_model(both), Catch::Contains("time_constant") &&
                                      Catch::Contains("does not go with `kind: integrating`"));
  CHECK_THAT(said_of_model(with(kModel, "gain: 1.2264", "kind: integratin\n  gain: 0.02")),
             Catch::Contains("integrating"));
  CHECK_THAT(
      said_of_model(with(kModel, "dead_time: 2.6", "dead_time: 2.6\n  second_time_constant: -1")),
      Catch::Contains("second_time_constant"));
}

TEST_CASE("PV at CO 0 is stated by `level`, only for a self-regulating process",
          "[config][model]") {
  const auto without = read_model_text("m.yaml", kModel);
  REQUIRE(without);
  CHECK_FALSE(without->process.level.has_value());
  const auto stated =
      read_model_text("m.yaml", with(kModel, "gain: 1.2264", "gain: 1.2264\n  level: -3.5"));
  REQUIRE(stated);
  CHECK(stated->process.level == -3.5);
  const std::string integrating =
      with(with(kModel, "gain: 1.2264", "kind: integrating\n  gain: 0.02\n  level: 3"),
           "  time_constant: 1.7\n", "");
  CHECK_THAT(said_of_model(integrating), Catch::Contains("process.level: does not go with"));
  CHECK_THAT(said_of_model(with(kModel, "gain: 1.2264", "gain: 1.2264\n  level: warm")),
             Catch::Contains("process.level"));
}

TEST_CASE("`valve: none` states that no valve can stick", "[config][model]") {
  const std::string with_valve = with(kModel, "process:\n", "valve:\n  effects: []\nprocess:\n");
  const std::string none = with(kModel, "process:\n", "valve: none\nprocess:\n");
  REQUIRE(read_model_text("m.yaml", with_valve));
  CHECK(read_model_text("m.yaml", with_valve)->has_valve);
  const auto model = read_model_text("m.yaml", none);
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  CHECK_FALSE(model->has_valve);
  CHECK_THAT(said_of_model(with(kModel, "process:\n", "valve: nothing\nprocess:\n")),
             Catch::Contains("valve"));
  const std::string fault =
      none + "scenario:\n  faults:\n    - {effect: backlash, deadband: 1, block: valve}\n";
  CHECK_THAT(said_of_model(fault), Catch::Contains("valve: none"));
}

TEST_CASE("Keys of a model reach their place", "[config][model]") {
  const auto model = read_model_file(LOOPWARDEN_SOURCE_DIR "/tests/config/data/all_effects.yaml");
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  CHECK(model->controller.pid.action == control::Action::direct);
  CHECK(model->controller.pid.gains.kp == Approx(0.8 * 100 / 200));
  CHECK(model->controller.output.rate_per_s == 5.0);
  CHECK(model->controller.output.deadband == 0.1);
  CHECK(model->controller.pid.tolerance == 0.1);  // CO that the deadband holds back is no windup
  CHECK(model->process.gain == -1.5);
  CHECK(model->uncertainty == plant::ProcessUncertainty{0.05, 0.1, 0.02});
  CHECK(model->transmitter.noise == 0.1);
  CHECK(model->scenario.duration_s == 900.0);
  CHECK(model->scenario.seed == 77);
  CHECK(model->scenario.set_point ==
        std::vector<std::pair<double, double>>{{0, 40}, {100.5, 55}, {400, 45}});
  CHECK(model->scenario.faults.size() == 2);
  // An accepted model can be simulated.
  plant::SimulatedLoop loop(*model);
  for (int i = 0; i < 100; ++i) CHECK(std::isfinite(loop.step().pv));
}

TEST_CASE("Errors of a model name place, key and the expected value", "[config][model]") {
  CHECK(said_of_model(with(kModel, "sample_time: 0.1", "sample_time: 0")) ==
        "m.yaml:1:14: error: sample_time: must be >= 0.001 and <= 3600 s (got 0)\n");
  CHECK(said_of_model(with(kModel, "gain: 1.2264", "gain: 0")) ==
        "m.yaml:7:9: error: process.gain: must not be 0\n");
  CHECK(said_of_model(with(kModel, "time_constant: 1.7", "time_constant: -1")) ==
        "m.yaml:8:18: error: process.time_constant: must be > 0 s (got -1)\n");
  CHECK(
      said_of_model(with(kModel, "dead_time: 2.6", "dead_time: 1e6")) ==
      "m.yaml:9:14: error: process.dead_time: must be at most 1000000 sample times (sample_time at "
      "1:14)\n");
  CHECK(
      said_of_model(with(kModel, "range: [0, 10]\n", "range: [0, 10]\n  resolution: 11\n")) ==
      "m.yaml:12:15: error: transmitter.resolution: must be at most the span of range, 10 PV units "
      "(at 11:10) (got 11)\n");
  CHECK(said_of_model(with(kModel, "range: [0, 10]\n", "range: [0, 10]\n  resolution: 1e-13\n")) ==
        "m.yaml:12:15: error: transmitter.resolution: is too fine for range (at 11:10)\n");
  CHECK(said_of_model(with(kModel, "  gain: 1.2264\n", "  gian: 1.2264\n")) ==
        "m.yaml:7:3: error: missing key 'gain' in 'process' (number, PV units/CO unit)\n"
        "m.yaml:7:3: error: unknown key 'gian'; did you mean 'gain'?\n");
  CHECK(said_of_model("sample_time: 0.1\n") ==
        "m.yaml:1:1: error: missing key 'controller' (mapping)\n"
        "m.yaml:1:1: error: missing key 'process' (mapping)\n"
        "m.yaml:1:1: error: missing key 'transmitter' (mapping)\n");
}

TEST_CASE("A scenario's set points begin at zero, rise in time and lie in range",
          "[config][model]") {
  const auto said_of = [](const std::string& points) {
    return said_of_model(kModel + "scenario: {set_point: " + points + "}\n");
  };
  CHECK(said_of("[[0, 5], [60, 6]]").empty());
  CHECK(said_of("[]") == "m.yaml:12:23: error: scenario.set_point: must begin at t = 0\n");
  CHECK(said_of("[[1, 5]]") == "m.yaml:12:23: error: scenario.set_point: must begin at t = 0\n");
  CHECK(said_of("[[0, 5], [9, 6], [9, 7]]") ==
        "m.yaml:12:23: error: scenario.set_point: t must rise (see point 3)\n");
  CHECK(
      said_of("[[0, 11]]") ==
      "m.yaml:12:23: error: scenario.set_point: must lie within transmitter.range (at 11:10) (got "
      "11)\n");
}

TEST_CASE("A missing model file is an error, not an exception", "[config][model]") {
  const auto model = read_model_file("/nonexistent/model.yaml");
  CHECK_FALSE(model);
  CHECK(to_text(model.diagnostics) ==
        "/nonexistent/model.yaml: error: can't be read: No such file or directory\n");
}

}  // namespace loop_model_reader_test
