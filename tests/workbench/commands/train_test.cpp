// SPDX-License-Identifier: Apache-2.0
// Training and classification as their users call them.
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/training/training_checkpoint.hpp"

namespace loopwarden::tests::train_test {
namespace {

ShellOutcome loopwarden(const std::string& arguments, bool with_errors = true) {
  return run(LOOPWARDEN_CLI " " + arguments + (with_errors ? " 2>&1" : " 2>/dev/null"));
}

const std::string kModel = LOOPWARDEN_SOURCE_DIR "/examples/models/plant1-believed.yaml";
const std::string kSmall = " --windows 1400 --restarts 1 --sizes 3 --epochs 3 --seed 7";

// The modelled loop with backlash from 240 s on, and a set point that keeps moving.
std::string play_model() {
  std::string text = read_file(kModel);
  const std::size_t scenario = text.find("\nscenario:");
  if (scenario != std::string::npos) text.resize(scenario + 1);
  text += "\nscenario:\n  duration: 500\n  set_point: [";
  for (int k = 0; k < 14; ++k) {
    text += (k > 0 ? ", " : "") + std::string("[") + std::to_string(36 * k) + ", " +
            (k % 3 == 0   ? "4.0"
             : k % 3 == 1 ? "6.0"
                          : "5.0") +
            "]";
  }
  return text + "]\n  faults:\n    - {effect: backlash, deadband: 0.8, from: 240}\n  seed: 3\n";
}

}  // namespace

TEST_CASE("specialists trained on a model name the fault in a record, and no fault before it",
          "[workbench]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "specialists").string();
  const ShellOutcome trained =
      loopwarden("train " + kModel + " --out " + out + kSmall + " --form both --json", false);
  INFO(trained.text);
  REQUIRE(trained.exit_code == 0);
  const auto summary = nlohmann::json::parse(trained.text);
  CHECK(summary["specialists"].size() == 11);
  CHECK_FALSE(std::filesystem::exists(folder / "specialists/unfinished"));
  CHECK(read_file(folder / "specialists/training.html").find("P1S3 (chosen)") != std::string::npos);
  CHECK(loopwarden("check " + out).exit_code == 0);

  write_file(folder / "play.yaml", play_model());
  const std::string record = (folder / "play.csv").string();
  const ShellOutcome simulated =
      loopwarden("simulate " + (folder / "play.yaml").string() + " --out " + record);
  INFO(simulated.text);
  REQUIRE(simulated.exit_code == 0);
  const ShellOutcome classified =
      loopwarden("classify " + record + " --specialists " + out + " --json", false);
  REQUIRE(classified.exit_code == 0);
  const auto windows = nlohmann::json::parse(classified.text)["windows"];
  REQUIRE(windows.size() == 9);
  int named = 0;
  for (const auto& w : windows) {
    const std::string verdict = w["verdict"];
    if (w["to_s"].get<double>() < 240.0) {
      CHECK((verdict == "no_fault" || verdict == "not_enough_movement"));
    } else if (w["from_s"].get<double>() > 240.0 && verdict == "backlash") {
      ++named;
      CHECK(w["severity_percent"].get<double>() == Approx(8.0).epsilon(0.2));
      CHECK(w["mse"].size() == 6);
    }
  }
  CHECK(named >= 2);

  // The thesis's form answers too, with its name.
  const ShellOutcome faithful = loopwarden(
      "classify " + record + " --specialists " + out + " --form signature --json", false);
  REQUIRE(faithful.exit_code == 0);
  CHECK(nlohmann::json::parse(faithful.text)["windows"][0]["mse"][0]["specialist"] == "P1N3");
}

TEST_CASE("the same seed trains the same specialists, with any threads and interruptions",
          "[workbench]") {
  const TemporaryFolder folder;
  const auto train = [&](const std::string& name, const std::string& options) {
    const ShellOutcome o = loopwarden("train " + kModel + " --out " + (folder / name).string() +
                                      kSmall + " --form signature" + options);
    INFO(o.text);
    REQUIRE(o.exit_code == 0);
    return o.text;
  };
  train("a", " --jobs 1");
  // The number of threads does not change the result.
  train("b", " --jobs 2");
  CHECK(read_file(folder / "a/manifest.yaml") == read_file(folder / "b/manifest.yaml"));
  CHECK(read_file(folder / "a/P1S3.weights") == read_file(folder / "b/P1S3.weights"));
}

TEST_CASE("a killed training continues with its finished networks", "[workbench]") {
  const TemporaryFolder folder;
  const std::string options = kSmall + " --form signature --jobs 1";
  const auto train = [&](const std::string& name) {
    return loopwarden("train " + kModel + " --out " + (folder / name).string() + options);
  };
  REQUIRE(train("whole").exit_code == 0);
  // The training is killed as soon as the first network is on the disk.
  const std::string out = (folder / "killed").string();
  const std::string kill = std::string(LOOPWARDEN_BIN_DIR) + "/loopwarden train " + kModel +
                           " --out " + out + options + " >/dev/null 2>&1 & p=$!; " +
                           "while kill -0 $p 2>/dev/null; do for f in " + out +
                           "/unfinished/*.json; do [ -e $f ] && kill -9 $p && exit 0; done; done";
  REQUIRE(std::system(kill.c_str()) == 0);
  REQUIRE(std::filesystem::exists(folder / "killed/unfinished"));
  CHECK_FALSE(std::filesystem::exists(folder / "killed/manifest.yaml"));
  std::filesystem::path first;
  for (const auto& f : std::filesystem::directory_iterator(folder / "killed/unfinished")) {
    if (f.path().extension() == ".json") first = f.path();
  }
  const ShellOutcome again = train("killed");
  INFO(again.text);
  REQUIRE(again.exit_code == 0);
  // Networks on the disk were not trained again.
  CHECK(again.text.find(first.stem().string() + ":") == std::string::npos);
  for (const char* file : {"P1N3.weights", "P1S3.weights", "P1L3.weights", "manifest.yaml"}) {
    CHECK(read_file(folder / "killed" / file) == read_file(folder / "whole" / file));
  }
}

TEST_CASE("a checkpoint restores only the network of its own run", "[workbench]") {
  const TemporaryFolder folder;
  specialist::Learned learned;
  learned.network = specialist::random_network({4, 3, 2, 3}, 5);
  learned.epochs = {{0.5, 0.6, 0.7, 0.1, 1e-3}, {0.25, 0.3, 0.35, 0.05, 1e-4}};
  learned.best = 1;
  learned.stop = specialist::Stop::validation;
  workbench::TrainingCheckpoint(folder / "c", "key").keep_network("P1S3-0", learned);
  const auto found = workbench::TrainingCheckpoint(folder / "c", "key").find_network("P1S3-0");
  REQUIRE(found);
  CHECK(found->best == 1);
  CHECK(found->stop == specialist::Stop::validation);
  CHECK(found->epochs[1].validation == 0.3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(found->network.layers[i].weights == learned.network.layers[i].weights);
    CHECK(found->network.layers[i].bias == learned.network.layers[i].bias);
  }
  CHECK_FALSE(workbench::TrainingCheckpoint(folder / "c", "other").find_network("P1S3-0"));
  CHECK_FALSE(workbench::TrainingCheckpoint(folder / "c", "key").find_network("P1B3-0"));
  write_file(folder / "c/P1S3-0.json", "{\"key\": \"key\", \"network\": {}}");
  CHECK_FALSE(workbench::TrainingCheckpoint(folder / "c", "key").find_network("P1S3-0"));
}

TEST_CASE("unsuitable models and records are refused with the place", "[workbench]") {
  const TemporaryFolder folder;
  const std::string out = " --out " + (folder / "o").string();
  CHECK(loopwarden("train" + out).exit_code == 64);
  CHECK(loopwarden("train nothing.yaml" + out).exit_code == 78);
  write_file(folder / "level.yaml",
             "sample_time: 1\ncontroller: {kp: 1, ki: 0.01, output: [0, 100]}\n"
             "process: {kind: integrating, gain: 0.01, dead_time: 2}\n"
             "transmitter: {range: [0, 100]}\n");
  const ShellOutcome level = loopwarden("train " + (folder / "level.yaml").string() + out);
  INFO(level.text);
  CHECK(level.exit_code == 78);
  CHECK(level.text.find("not for integrating ones") != std::string::npos);
  write_file(folder / "s/labels.csv", "file,class,plant,role\nx.csv,sticktion,P1,training\n");
  const ShellOutcome unknown = loopwarden("train --signatures " + (folder / "s").string() + out);
  CHECK(unknown.exit_code == 65);
  CHECK(unknown.text.find("labels.csv:2: unknown class 'sticktion'") != std::string::npos);
  write_file(folder / "s/labels.csv", "file,class,plant\n");
  CHECK(loopwarden("train --signatures " + (folder / "s").string() + out)
            .text.find("no column 'role'") != std::string::npos);
  CHECK(loopwarden("classify x.csv --specialists " + folder.path().string()).exit_code == 78);
}

TEST_CASE("the shipped specialists are complete", "[workbench]") {
  const std::string data = LOOPWARDEN_SOURCE_DIR "/examples/specialists";
  CHECK(loopwarden("check " + data + "/plant1 " + data + "/plant2 " + data + "/plant3").exit_code ==
        0);
}

}  // namespace loopwarden::tests::train_test
