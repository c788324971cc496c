// SPDX-License-Identifier: Apache-2.0
// Runs the steps from a new loop to a commissioned one. Each step is a function. All effects on the
// outside use the members of Setup, so that a test can replace them.
#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "config/config_reader.hpp"
#include "config/loop_config.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "daemon/protocol/probe.hpp"
#include "daemon/protocol/setups.hpp"
#include "workbench/setup/dialogue.hpp"

namespace loopwarden::workbench::setup {

// Reads registers of devices that do not belong to a loop yet.
class Prober {
 public:
  virtual ~Prober() = default;
  virtual protocol::Probed read(const protocol::Probe& asked) = 0;
};

inline constexpr const char* kDefaultFolder = "/etc/loopwardend";

struct Setup {
  Dialogue& dialogue;
  Prober& prober;
  // Runs this program with other arguments and waits for its end. The output is written to the
  // file, or to the terminal if `output` is empty. Returns the exit code.
  std::function<int(const std::vector<std::string>& words, const std::filesystem::path& output)>
      run;
  std::filesystem::path folder;  // configuration of the daemon
  std::string socket;            // of the daemon
  std::string tag;
  double record_minutes = 20.0;
  std::function<void(double seconds)> wait = [](double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  };

  State& state() const { return dialogue.state(); }
  std::filesystem::path loop_file() const { return folder / "loops.d" / (tag + ".yaml"); }
  bool elsewhere() const { return dialogue.ask("control") == "elsewhere"; }
  // Returns the command that continues this setup, or repeats a step. Like all printed commands it
  // has the folder and the socket of this setup, and runs as printed.
  std::string command(const std::string& again = {}) const;
  std::string config_option() const;  // empty for the default folder
  protocol::Remedies remedies() const;
  // Returns the configuration in the loop's file. Throws CommandError if the file is wrong.
  config::LoopConfig loop() const;
};

// Returns an empty text if the file does not exist. Throws CommandError if it is not readable.
std::string text_of_file(const std::filesystem::path& file);

// Returns whether the daemon would accept its files together with these drafts. Prints the errors.
bool would_be_read(Setup& setup, const config::Drafts& drafts);

// left: the person left the step, which is asked again next time.
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

// Returns which files of the loop are not in force yet, with the action to take; empty: all are in
// force.
std::string what_waits(const Setup& setup);

// The steps of protocol::kSetupSteps, in their order.
using Step = Outcome (*)(Setup& setup);
inline constexpr std::array<Step, protocol::kSetupSteps.size()> kSteps{
    name_loop,    find_devices, write_files, start_loop,     test_watchdog,
    stroke_valve, record_moves, commission,  connect_masters};

// Runs the steps that are not done, in their order. Returns the exit code: 75 if a step was left or
// ended early. Throws Paused and CommandError.
int run_steps(Setup& setup);

}  // namespace loopwarden::workbench::setup
