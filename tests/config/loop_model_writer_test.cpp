// SPDX-License-Identifier: Apache-2.0
#include "config/loop_model_writer.hpp"

#include "tests/config/config_support.hpp"

namespace loop_model_writer_test {

using namespace loopwarden;
using namespace loopwarden::config;

TEST_CASE("A model that is written reads back equal", "[config][model]") {
  const std::string file =
      GENERATE("tests/config/data/model_fast.yaml", "tests/config/data/model_plant1.yaml",
               "tests/config/data/all_effects.yaml", "examples/models/plant1.yaml");
  const auto model = read_model_file(std::string(LOOPWARDEN_SOURCE_DIR "/") + file);
  REQUIRE(model);
  const std::string text = write_model(*model);
  const auto again = read_model_text("again.yaml", text);
  INFO(text << to_text(again.diagnostics));
  REQUIRE(again);
  CHECK(*again == *model);
  CHECK(write_model(*again) == text);
}

TEST_CASE("Numbers are written with all their bits", "[config][model]") {
  auto model = read_model_text("m.yaml", test::kModel);
  REQUIRE(model);
  model->process.gain = 0.1 + 0.2;
  model->process.time_constant_s = 1.0 / 3.0;
  model->process.dead_time_s = 1e-7;
  model->controller.pid.gains.ki = 5e-324;
  const auto again = read_model_text("again.yaml", write_model(*model));
  INFO(to_text(again.diagnostics));
  REQUIRE(again);
  CHECK(*again == *model);
}

TEST_CASE("Integrating processes and second lags are written and read back", "[config][model]") {
  auto model = read_model_text("m.yaml", test::kModel);
  REQUIRE(model);
  model->process = {.gain = -0.02, .dead_time_s = 3.0, .second_time_constant_s = 0.7};
  SECTION("self-regulating") {
    model->process.time_constant_s = 12.0;
    model->process.level = -1.25;
  }
  SECTION("without a valve") { model->has_valve = false; }
  SECTION("integrating") { model->process.kind = plant::ProcessKind::integrating; }
  const auto again = read_model_text("again.yaml", write_model(*model));
  INFO(to_text(again.diagnostics));
  REQUIRE(again);
  CHECK(*again == *model);
}

TEST_CASE("A heading becomes comments", "[config][model]") {
  const auto model = read_model_text("m.yaml", test::kModel);
  REQUIRE(model);
  const std::string text = write_model(*model, "corrected by a gap analysis\nsecond line");
  CHECK(text.starts_with("# corrected by a gap analysis\n# second line\nsample_time: 0.1"));
  const auto again = read_model_text("again.yaml", text);
  REQUIRE(again);
  CHECK(*again == *model);
}

TEST_CASE("A twin's covariance is written and read back, and an invalid one is refused",
          "[config][model]") {
  auto model = read_model_text("m.yaml", test::kModel);
  REQUIRE(model);
  model->twin = plant::TwinFit{.parameters = {"gain", "dead_time"},
                               .covariance = {{1e-4, -3e-5}, {-3e-5, 2e-3}},
                               .largest = 1.25,
                               .seen_low = 3.5,
                               .co_high = 7.5,
                               .load = plant::SeenLoad{-0.25, 0.125, 0.5},
                               .controller = plant::SeenController{0.0625, 0.03125}};
  const std::string text = write_model(*model);
  const auto again = read_model_text("again.yaml", text);
  INFO(text << to_text(again.diagnostics));
  REQUIRE(again);
  CHECK(*again == *model);
  for (const char* bad :
       {"{parameters: [gain], covariance: [[1, 2]]}", "{parameters: [gain], covariance: [[-1]]}",
        "{parameters: [gain, dead_time], covariance: [[1, 0.5], [0.4, 1]]}",
        "{parameters: [gain, gain], covariance: [[1, 0], [0, 1]]}",
        "{parameters: [gian], covariance: [[1]]}", "{parameters: [gain], covariance: [1]}"}) {
    INFO(bad);
    CHECK_FALSE(read_model_text("bad.yaml", std::string(test::kModel) + "twin: " + bad + "\n"));
  }
}

}  // namespace loop_model_writer_test
