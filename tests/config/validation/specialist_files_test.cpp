// SPDX-License-Identifier: Apache-2.0
// Twins that loops' files name. A twin of another loop is refused before the start.
#include "config/validation/specialist_files.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::specialist_files_test {
namespace {

std::string twin_text(const std::string& sample_time, const std::string& pv_range,
                      const std::string& co_range) {
  return "sample_time: " + sample_time + "\ncontroller: {kp: 0.4, ki: 0.15, output: " + co_range +
         "}\nprocess: {gain: 1.0, time_constant: 1.5, dead_time: 0.6}\n"
         "transmitter: {range: " +
         pv_range + "}\n";
}

config::LoopFile loop_with(const std::string& twin) {
  config::LoopFile file;
  config::LoopConfig& loop = file.config;
  loop.name = "FIC-101";
  loop.file = "loops/fic-101.yaml";
  loop.sample_time_s = 0.1;
  loop.pv.low = 0.0;
  loop.pv.high = 10.0;
  loop.controller.pid.output_low = 0.0;
  loop.controller.pid.output_high = 100.0;
  loop.monitor.twin = twin;
  file.twin = {.line = 7, .column = 9};
  return file;
}

// Returns the messages for the loop; `twins` receives the loaded ones.
std::string said_of(const config::LoopFile& loop, config::Specialists* loaded = nullptr) {
  config::SpecialistFiles files;
  config::Report report(loop.config.file);
  std::vector<config::Diagnostic> of_named_files;
  files.check(loop, report, of_named_files);
  if (loaded != nullptr) *loaded = files.take();
  return config::to_text(report.take());
}

}  // namespace

TEST_CASE("a loop's twin is taken where period and ranges are the loop's", "[daemon][twin]") {
  const TemporaryFolder folder;
  const std::string file = (folder / "twin.yaml").string();
  config::Specialists loaded;
  write_file(file, twin_text("0.1", "[0, 10]", "[0, 100]"));
  REQUIRE(said_of(loop_with(file), &loaded).empty());
  CHECK(loaded.twins.at(file).process.gain == 1.0);
  for (const auto& [text, said] :
       {std::pair{twin_text("0.2", "[0, 10]", "[0, 100]"), "sample_time"},
        std::pair{twin_text("0.1", "[0, 12]", "[0, 100]"), "transmitter.range"},
        std::pair{twin_text("0.1", "[0, 10]", "[0, 10]"), "controller.output"},
        std::pair{std::string("process: {}"), "no twin"}}) {
    write_file(file, text);
    const std::string words = said_of(loop_with(file));
    INFO(words);
    CHECK(words.find("fic-101.yaml:7:9: error: monitor.twin: ") != std::string::npos);
    CHECK(words.find(said) != std::string::npos);
  }
  // A twin with the opposite sign of gain would drive planned moves away from the set point.
  for (const auto& [gain, action] :
       {std::pair{"-1.0", control::Action::reverse}, std::pair{"1.0", control::Action::direct}}) {
    std::string text = twin_text("0.1", "[0, 10]", "[0, 100]");
    text.replace(text.find("gain: 1.0"), 9, std::string("gain: ") + gain);
    write_file(file, text);
    config::LoopFile other = loop_with(file);
    other.config.controller.pid.action = action;
    CHECK(said_of(other).find("controller.action") != std::string::npos);
  }
  // Planned moves don't support integrating processes.
  write_file(
      file,
      "sample_time: 0.1\ncontroller: {kp: 0.4, ki: 0.15, output: [0, 100]}\n"
      "process: {kind: integrating, gain: 0.1, dead_time: 0.6}\ntransmitter: {range: [0, 10]}\n");
  config::LoopFile calmed = loop_with(file);
  CHECK(said_of(calmed).empty());
  calmed.config.monitor.corrective = {.enabled = true,
                                      .form = alarm::CorrectiveForm::planned_moves};
  CHECK(said_of(calmed).find("integrating process") != std::string::npos);
  CHECK(said_of(loop_with("/nowhere/twin.yaml")).find("no twin") != std::string::npos);
}

}  // namespace loopwarden::tests::specialist_files_test
