// SPDX-License-Identifier: Apache-2.0
// The daemon as a whole: owns every thread and channel, and takes them through start, run, reload
// and stop. daemon/README.md has the table of threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/loop_config.hpp"
#include "daemon/backend_factory.hpp"
#include "daemon/control_server.hpp"
#include "daemon/health/watchdog.hpp"
#include "daemon/historian.hpp"
#include "daemon/loop_runtime.hpp"
#include "daemon/rt/cyclic_runner.hpp"
#include "hal/os/clock.hpp"
#include "hal/os/thread.hpp"

namespace loopwarden::daemon {

class App {
 public:
  // Makes everything that can fail: backends, channels, sockets. Throws std::runtime_error.
  App(config::Configuration configuration, std::filesystem::path config_path);
  App(const App&) = delete;
  App& operator=(const App&) = delete;
  ~App();

  // Runs until SIGTERM or SIGINT; returns the exit code. The signals must be blocked in the calling
  // thread before the App is made.
  int run();

 private:
  void start();
  void supervise();
  void stop();
  void reload();
  void log_events();
  void watch_threads();
  nlohmann::json status() const;
  void publish_runner_status();

  config::Configuration configuration_;
  std::filesystem::path config_path_;
  std::string rights_missing_;  // what real-time rights were refused, in words; empty: none
  BackendFactory backends_;
  std::vector<LoopRuntime> loops_;
  hal::os::SpscRing<rt::Event> events_{4096};
  hal::os::MonotonicClock clock_;
  std::int64_t started_ns_;
  std::unique_ptr<rt::CyclicRunner> runner_;
  Historian historian_;
  ControlServer control_;
  health::ThreadWatch thread_watch_;
  health::ServiceManager service_;
  std::atomic<bool> stop_{false};  // outputs go to their stop action
  std::atomic<bool> quit_{false};  // the real-time thread ends
  hal::os::Thread real_time_thread_;
  bool stuck_reported_ = false;
  mutable std::mutex status_mutex_;
  rt::RunnerStatus runner_status_;  // copy for the control thread
};

// Drives every output to its stop action once, without starting the loops: `loopwardend --safe`.
// Returns the exit code.
int drive_to_stop_actions(const config::Configuration& configuration);

}  // namespace loopwarden::daemon
