// SPDX-License-Identifier: Apache-2.0
// The daemon as a whole: owns every thread and channel, and takes them through start, run, reload
// and stop. daemon/README.md has the table of threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/backend_factory.hpp"
#include "daemon/console/control_server.hpp"
#include "daemon/console/status_server.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/explain/explainer.hpp"
#include "daemon/gateway/gateway.hpp"
#include "daemon/app/gateway_loops.hpp"
#include "daemon/app/reloader.hpp"
#include "daemon/app/watchdog.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/monitor/monitor.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "daemon/rt/cyclic_runner.hpp"
#include "daemon/app/specialist_files.hpp"
#include "base/clock.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

class App {
 public:
  // Makes everything that can fail: backends, channels, sockets. Throws std::runtime_error.
  // `log_lines_lost` counts what the log had no room for; may be empty.
  App(config::Configuration configuration, std::filesystem::path config_path,
      const Specialists& specialists, std::function<std::uint64_t()> log_lines_lost = {});
  App(const App&) = delete;
  App& operator=(const App&) = delete;
  ~App();

  // Runs until SIGTERM or SIGINT; returns the exit code. The signals must be blocked in the calling
  // thread before the App is made.
  int run();
  // After run(): false if a thread hangs on the disk. Then the App must not be destroyed: the process
  // ends without.
  bool ended() const noexcept { return ended_; }

 private:
  void start();
  void supervise();
  void stop();
  void feed_watchdog();
  void drive_to_stop(LoopRuntime& loop);
  ReloaderEnds reloader_ends();
  void end_threads();
  std::string rights_missing() const;
  void log_events();
  void watch_threads();
  void make_gateway();
  void keep_evidence(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                     const loopwarden::monitor::LoopMonitor& monitor,
                     const loopwarden::monitor::MonitorStep& step,
                     loopwarden::monitor::AlarmReason reason);
  void have_explained(const evidence::Evidence& evidence, const std::filesystem::path& folder);
  void report_explanation(const ExplainJob& job, const Explanation* explanation,
                          const std::string& why);
  void remember_explanations();
  void resume_explanation(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                          const std::filesystem::path& folder);
  void report_evidence_stays(const std::string& why);
  void report_evidence(const evidence::Evidence& evidence, const std::filesystem::path& folder,
                       const std::string& why);
  protocol::DaemonStatus status() const;
  protocol::Description description() const;  // without the loops
  // What the sockets show and order; of now only the references, the rest is asked for when it is needed.
  console::Parts console_parts();
  gateway::BoxReading box_reading() const;
  void publish_runner_status();

  config::Configuration configuration_;
  std::filesystem::path config_path_;
  BackendFactory backends_;
  std::vector<LoopRuntime> loops_;
  base::SpscRing<rt::Event> events_{4096};
  base::MonotonicClock clock_;
  std::int64_t started_ns_;
  std::int64_t started_ms_;  // UTC
  std::unique_ptr<rt::CyclicRunner> runner_;
  Historian historian_;
  journal::Journal journal_;
  monitor::WatchBoard board_;
  std::map<std::string, std::unique_ptr<loopwarden::monitor::WindowJudge>> judges_;  // by folder
  std::uint32_t model_hash_;                                // of the specialists; 0: none
  std::map<std::string, std::uint32_t> specialist_hashes_;  // by folder
  std::map<std::string, std::string> twins_;                // files as text, by name
  EvidenceStore evidence_;
  std::deque<orders::OrderDesk> monitor_desks_;  // one for each loop
  std::unique_ptr<monitor::Monitor> monitor_;
  Explainer explainer_;
  Reloader reloader_;
  ControlServer control_;
  StatusServer readers_;
  std::unique_ptr<GatewayLoops> plant_;
  std::unique_ptr<gateway::Gateway> gateway_;  // null: no Modbus server is configured
  health::ThreadWatch thread_watch_;
  health::ServiceManager service_;
  std::atomic<bool> stop_{false};  // outputs go to their stop action
  std::atomic<bool> quit_{false};  // the real-time thread ends
  base::Thread real_time_thread_;
  bool stuck_reported_ = false;
  bool ended_ = false;
  std::function<std::uint64_t()> log_lines_lost_;
  mutable std::mutex status_mutex_;  // for what the sockets' threads read
  rt::RunnerStatus runner_status_;
  std::string rights_missing_;  // what real-time rights were refused, in words; empty: none
};

// Drives every output to its stop action once, without starting the loops: `loopwardend --safe`.
// Returns the exit code.
int drive_to_stop_actions(const config::Configuration& configuration);

}  // namespace loopwarden::daemon
