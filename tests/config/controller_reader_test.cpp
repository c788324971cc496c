// SPDX-License-Identifier: Apache-2.0
#include "config/controller_reader.hpp"

#include "config/loop_model_writer.hpp"
#include "tests/config/config_support.hpp"

namespace controller_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kModel;

namespace {

// A model with other gains; CO span 10, PV span 20.
std::string with_gains(const std::string& lines) {
  const std::string wide = test::with(kModel, "range: [0, 10]", "range: [0, 20]");
  return test::with(wide, "  kp: 0.35\n  ki: 0.04\n", lines);
}
std::string said_of(const std::string& lines) { return test::said_of_model(with_gains(lines)); }

control::PidSettings read(const std::string& lines) {
  const auto model = read_model_text("m.yaml", with_gains(lines));
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  return model->controller.pid;
}

}  // namespace

TEST_CASE("Gains of the parallel form are taken as they are", "[config][controller]") {
  const control::PidGains gains =
      read("  kp: 0.5\n  ki: 0.25\n  kd: 0.125\n  derivative_filter: 2\n").gains;
  CHECK(gains == control::PidGains{.kp = 0.5, .ki = 0.25, .kd = 0.125, .derivative_filter_s = 2});
  CHECK(read("  kp: 0.5\n  ki: 0\n").gains.ki == 0.0);
}

TEST_CASE("Gains of the ISA form are converted by the spans", "[config][controller]") {
  // kc is % of 10 CO units per % of 20 PV units.
  const control::PidGains seconds = read("  kc: 2\n  ti: 8\n  td: 0.5\n").gains;
  CHECK(seconds.kp == Approx(1.0));
  CHECK(seconds.ki == Approx(0.125));
  CHECK(seconds.kd == Approx(0.5));
  const control::PidGains minutes = read("  pb: 50\n  ti_min: 0.5\n").gains;
  CHECK(minutes.kp == Approx(1.0));
  CHECK(minutes.ki == Approx(1.0 / 30.0));
}

TEST_CASE("The two forms are never mixed, and each is complete", "[config][controller]") {
  CHECK(said_of("  kp: 1\n  ti: 8\n") ==
        "m.yaml:4:7: error: controller.ti: belongs to the ISA form, but controller.kp (at 3:7) to "
        "the "
        "parallel form. Use one form\n");
  CHECK(said_of("  kc: 1\n  pb: 50\n  ti: 8\n") ==
        "m.yaml:4:7: error: controller.pb: conflicts with kc (at 3:7); give one of them\n");
  CHECK(said_of("  kc: 1\n  ti: 8\n  ti_min: 1\n") ==
        "m.yaml:5:11: error: controller.ti_min: conflicts with ti (at 4:7); give one of them\n");
  CHECK(said_of("  ti: 8\n") ==
        "m.yaml:3:3: error: controller: missing key 'kc' (or pb; the ISA form needs a gain)\n");
  CHECK(
      said_of("  kc: 8\n") ==
      "m.yaml:3:3: error: controller: missing key 'ti' (s per repeat, or ti_min; without integral "
      "action use kp and ki: 0)\n");
  CHECK(said_of("  kp: 8\n") ==
        "m.yaml:3:3: error: controller: missing key 'ki' (the parallel form needs kp and ki; 0 "
        "switches a term off)\n");
  CHECK(said_of("") ==
        "m.yaml:3:3: error: controller: gains are missing: kp and ki, or kc and ti\n");
  CHECK(said_of("  kp: 0\n  ki: 0\n") ==
        "m.yaml:3:7: error: controller.kp: kp and ki (at 4:7) are both 0: the output would never "
        "move\n");
}

TEST_CASE("Gains have no sign and an integral time is above zero", "[config][controller]") {
  CHECK(said_of("  kp: -1\n  ki: 0.1\n") ==
        "m.yaml:3:7: error: controller.kp: must be >= 0 CO units/PV unit (got -1)\n");
  CHECK(said_of("  kc: 1\n  ti: 0\n") ==
        "m.yaml:4:7: error: controller.ti: must be > 0 s (got 0)\n");
  CHECK(said_of("  kc: 1\n  ti: .inf\n") ==
        "m.yaml:4:7: error: controller.ti: must be a finite number (got .inf)\n");
}

TEST_CASE("Anti-windup and jacket have their defaults and their words", "[config][controller]") {
  const control::PidSettings plain = read("  kp: 1\n  ki: 1\n");
  CHECK(plain.anti_windup == control::AntiWindup::integral_clamp);
  CHECK(plain.tracking_time_s == 0.0);
  CHECK(read("  kp: 1\n  ki: 1\n  anti_windup: conditional\n").anti_windup ==
        control::AntiWindup::conditional);
  CHECK(read("  kp: 1\n  ki: 1\n  tracking_time: 7\n").tracking_time_s == 7.0);
  CHECK(said_of("  kp: 1\n  ki: 1\n  anti_windup: clamping\n") ==
        "m.yaml:5:16: error: controller.anti_windup: must be integral_clamp, back_calculation or "
        "conditional (got 'clamping')\n");

  const auto model = read_model_text(
      "m.yaml", with_gains("  kp: 1\n  ki: 1\n  jacket: {form: bounded, shadow: true, ks: 2, "
                           "dead_zone: 0.1, max_mean_error: 3, mean_error_time: 90}\n"));
  REQUIRE(model);
  CHECK(model->controller.jacket == control::JacketSettings{.form = control::JacketForm::bounded,
                                                            .shadow = true,
                                                            .gain_per_s = 2,
                                                            .dead_zone = 0.1,
                                                            .max_mean_error = 3,
                                                            .mean_error_time_s = 90});
}

TEST_CASE("Each compensator has its own keys and names the missing ones", "[config][controller]") {
  const std::string gains = "  kp: 1\n  ki: 0\n";
  const auto read_c = [&](const std::string& keys) {
    const auto model =
        read_model_text("m.yaml", with_gains(gains + "  compensator: {" + keys + "}\n"));
    INFO(to_text(model.diagnostics));
    REQUIRE(model);
    // The written text is read back the same.
    const auto again = read_model_text("again.yaml", write_model(*model));
    INFO(to_text(again.diagnostics));
    REQUIRE(again);
    CHECK(again->controller.compensator == model->controller.compensator);
    return model->controller.compensator;
  };
  using Kind = control::CompensatorKind;
  CHECK(read_c("kind: knocker, amplitude: 0.2, pulse_period: 3, pulse_width: 0.5, limit: 0.3") ==
        control::CompensatorSettings{.kind = Kind::knocker,
                                     .limit = 0.3,
                                     .amplitude = 0.2,
                                     .pulse_period_s = 3.0,
                                     .pulse_width_s = 0.5});
  CHECK(read_c("kind: two_move, stick_band: 0.8, max_mean_error: 0.5, shadow: true") ==
        control::CompensatorSettings{
            .kind = Kind::two_move, .shadow = true, .stick_band = 0.8, .max_mean_error = 0.5});
  CHECK(read_c("kind: backlash, gap: 0.4, noise_band: 0.02").gap == 0.4);
  CHECK(read_c("kind: hysteresis, width: 0.4, knee: -1").knee == -1.0);
  CHECK(read_c("kind: hysteresis, offset: 0.7").offset == 0.7);
  CHECK(read_c("kind: reinforcement, amplitude: 0.4").amplitude == 0.4);

  const std::string moves =
      "kind: planned_moves, process: {gain: 1.5, time_constant: 4, dead_time: 2}, load: 0.01, ";
  CHECK(read_c(moves + "s: 0.6, s_interval: [0.5, 0.8], j: 0.3, max_move: 1, "
                       "max_moves_per_hour: 30, read_back: false") ==
        control::CompensatorSettings{.kind = Kind::planned_moves,
                                     .planned = {.gain = 1.5,
                                                 .time_constant_s = 4.0,
                                                 .dead_time_s = 2.0,
                                                 .load = 0.01,
                                                 .s = 0.6,
                                                 .j = 0.3,
                                                 .s_low = 0.5,
                                                 .s_high = 0.8,
                                                 .j_low = 0.3,
                                                 .j_high = 0.3,
                                                 .max_move = 1.0,
                                                 .max_moves_per_hour = 30.0,
                                                 .read_back = false}});

  const auto said = [&](const std::string& keys) {
    return said_of(gains + "  compensator: {" + keys + "}\n");
  };
  CHECK_THAT(said("kind: knock"), Catch::Contains("must be none, knocker"));
  CHECK_THAT(said("kind: knocker"), Catch::Contains("missing key 'amplitude'"));
  CHECK_THAT(said("kind: knocker, amplitude: 1, gap: 1"), Catch::Contains("gap"));
  CHECK_THAT(said("kind: knocker, amplitude: 1, pulse_width: 5"),
             Catch::Contains("must be below pulse_period = 2 s (got 5)"));
  CHECK_THAT(said("kind: hysteresis"), Catch::Contains("missing key 'width' (or 'offset')"));
  CHECK_THAT(said("kind: hysteresis, width: 1, offset: 1"), Catch::Contains("give one of them"));
  CHECK_THAT(said("kind: backlash, gap: -1"), Catch::Contains("gap"));
  CHECK_THAT(said("kind: planned_moves"), Catch::Contains("missing key 'process'"));
  CHECK_THAT(said(moves + "s: 0.6, j: 0.7"), Catch::Contains("must not exceed s = 0.6 (got 0.7)"));
  CHECK_THAT(said(moves + "s: 0.6, j: 0.3, s_interval: [0.7, 0.8]"),
             Catch::Contains("does not hold s = 0.6"));
  CHECK_THAT(said(moves + "s: 0.6, j: 0.3, limit: 1"), Catch::Contains("Use max_move"));
}

}  // namespace controller_reader_test
