// SPDX-License-Identifier: Apache-2.0
// Takes the daemon's parts through start, run, reload and stop. daemon/README.md has the table of
// threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/limited_log.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/assemble.hpp"
#include "config/validation/specialist_files.hpp"
#include "daemon/app/watchdog.hpp"

namespace loopwarden::daemon {

class App {
 public:
  // Makes everything that can fail: backends, channels and sockets. Throws std::runtime_error.
  // `specialists` must outlive this. `log_lines_lost` counts lines that did not fit into the log's
  // queue; it may be empty.
  App(config::Configuration configuration, const std::filesystem::path& config_path,
      const config::Specialists& specialists, std::function<std::uint64_t()> log_lines_lost = {});
  App(const App&) = delete;
  App& operator=(const App&) = delete;
  ~App();

  // Runs until SIGTERM or SIGINT. Returns the exit code. The calling thread must block these
  // signals before it makes the App.
  int run();
  // After run(): false if a thread hangs on the disk. The App must then not be destroyed; end the
  // process directly.
  bool ended() const noexcept { return ended_; }

 private:
  void start();
  void tell_out_of_service();
  void wait_for_first_cycles();
  void watch_threads();
  void supervise();
  void feed_watchdog();
  void show_state();
  void log_events();
  bool is_first_end_of_fault(const rt::Event& event);
  void stop();
  void end_threads();

  ServiceManager service_;
  Assembly parts_;
  ThreadWatch thread_watch_;
  base::LimitedLog missed_;      // cycles; a busy machine can miss one after the other
  std::vector<bool> had_fault_;  // by loop: its log has a fault that is not over
  bool stuck_reported_ = false;
  bool ended_ = false;
};

}  // namespace loopwarden::daemon
