// SPDX-License-Identifier: Apache-2.0
// A scripted person, fake devices and a separate folder, for tests of setup.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::tests {

namespace setup = workbench::setup;

// Answers each question with the text that the test gives. A question without an answer ends the
// dialogue.
class ScriptedPerson final : public setup::Person {
 public:
  void say(const std::string& text) override {
    said += text + "\n";
    if (hears) hears(text);
  }
  std::optional<std::string> line(const std::string& prompt) override {
    prompts.push_back(prompt);
    if (lines.empty()) return std::nullopt;
    std::string answer = std::move(lines.front());
    lines.pop_front();
    return answer;
  }
  bool has_keys() const override { return keys; }
  void watch_keys(bool on) override { watches = on; }
  std::optional<char> key(std::chrono::milliseconds) override {
    return std::exchange(next_key, {});
  }

  bool told(const std::string& text) const { return said.find(text) != std::string::npos; }

  std::deque<std::string> lines;
  bool keys = true;
  bool watches = false;
  std::optional<char> next_key;
  std::function<void(const std::string&)> hears;  // called with each text that is shown
  std::string said;
  std::vector<std::string> prompts;
};

// Registers by unit, table and address. Other registers give an error, and other units don't
// answer.
class FakeDevices final : public setup::Prober {
 public:
  protocol::Probed read(const protocol::Probe& probe) override {
    asked.push_back(probe);
    if (!refusal.empty()) return {.state = "refused", .why = refusal};
    if (std::find(units.begin(), units.end(), probe.unit) == units.end()) {
      return {.state = "silent", .why = "no reply within 300 ms"};
    }
    const auto found = values.find({probe.table, probe.address});
    if (found == values.end()) return {.state = "error", .why = "illegal data address"};
    // A moving display: each read takes the next value, and the last value stays.
    std::deque<double>& series = found->second;
    const double raw = series.front();
    if (series.size() > 1) series.pop_front();
    return {.state = "read", .why = {}, .registers = {static_cast<std::uint16_t>(raw)}, .raw = raw};
  }

  std::vector<std::uint64_t> units{1};
  std::map<std::pair<std::string, std::uint64_t>, std::deque<double>> values;
  std::string refusal;
  std::vector<protocol::Probe> asked;
};

struct ScriptedSetup {
  explicit ScriptedSetup(setup::Answers answers = {})
      : dialogue(person, std::move(answers), state) {
    state.answer("tag", "FIC-101");
  }

  TemporaryFolder folder;
  ScriptedPerson person;
  FakeDevices devices;
  setup::State state{folder / "setup" / "FIC-101.json"};
  setup::Dialogue dialogue;
  std::vector<std::vector<std::string>> ran;
  setup::Setup all{.dialogue = dialogue,
                   .prober = devices,
                   .run =
                       [this](const std::vector<std::string>& words, const std::filesystem::path&) {
                         ran.push_back(words);
                         return 0;
                       },
                   .folder = folder.path(),
                   .socket = (folder / "control.sock").string(),
                   .tag = "FIC-101",
                   .wait = [](double) {}};
};

}  // namespace loopwarden::tests
