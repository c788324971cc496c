// SPDX-License-Identifier: Apache-2.0
// The steps from a new loop to a commissioned one. Each is a function of its own; what they do to the world goes through
// what is in Setup, so that a test can talk to them.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "config/config_reader.hpp"
#include "config/loop_config.hpp"
#include "daemon/protocol/probe.hpp"
#include "daemon/protocol/setups.hpp"
#include "workbench/setup/dialogue.hpp"

namespace loopwarden::workbench::setup {

// Reads registers of devices that no loop has yet.
class Prober {
 public:
  virtual ~Prober() = default;
  virtual protocol::Probed read(const protocol::Probe& asked) = 0;
};

struct Setup {
  Dialogue& dialogue;
  Prober& prober;
  // Runs this program with other words and waits for it; its output goes to the file, or to the terminal where it is
  // empty. Returns its exit code.
  std::function<int(const std::vector<std::string>& words, const std::filesystem::path& output)>
      run;
  std::filesystem::path folder;  // configuration of the daemon
  std::string socket;            // of the daemon
  std::string tag;
  double record_minutes = 20.0;

  State& state() const { return dialogue.state(); }
  std::filesystem::path loop_file() const { return folder / "loops.d" / (tag + ".yaml"); }
  bool elsewhere() const { return dialogue.ask("control") == "elsewhere"; }
  // Of its file. Throws CommandError where that is wrong.
  config::LoopConfig loop() const;
};

// Empty where it is not there. Throws CommandError where it can't be read.
std::string text_of_file(const std::filesystem::path& file);

// Whether the daemon would read its files with these among them; what is wrong is said.
bool would_be_read(Setup& setup, const config::Drafts& drafts);

// left: the person said so; it is asked again next time.
enum class Outcome { done, left, not_needed };

Outcome name_loop(Setup& setup);
Outcome find_devices(Setup& setup);
Outcome write_files(Setup& setup);
Outcome start_loop(Setup& setup);
Outcome test_watchdog(Setup& setup);
Outcome stroke_valve(Setup& setup);
Outcome record_moves(Setup& setup);
Outcome commission(Setup& setup);
Outcome connect_masters(Setup& setup);

// What of its files is not in force yet, and what to do; empty: all is.
std::string what_waits(const Setup& setup);

// Of protocol::kSetupSteps, in their order.
using Step = Outcome (*)(Setup& setup);
inline constexpr std::array<Step, protocol::kSetupSteps.size()> kSteps{
    name_loop,    find_devices, write_files, start_loop,     test_watchdog,
    stroke_valve, record_moves, commission,  connect_masters};

// Those that are not done, in their order. Returns the exit code: 75 where a step was left or ended early. Throws Paused
// and CommandError.
int run_steps(Setup& setup);

}  // namespace loopwarden::workbench::setup
