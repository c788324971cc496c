// SPDX-License-Identifier: Apache-2.0
// From a valve alarm to what stays of it: evidence on the disk, a line in the journal, and, of a loop with a twin, an
// explanation on the board.
//
//   monitor -> keep() -> EvidenceStore -> journal
//                            -> Explainer (with a twin) -> board
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "config/loop_config.hpp"
#include "config/validation/specialist_files.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/explain/explainer.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/supervision/history.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "model/monitor/loop_monitor.hpp"

namespace loopwarden::daemon {

class EvidenceFlow {
 public:
  struct Dependencies {
    const std::vector<LoopRuntime>& loops;
    supervision::AlarmRegistry& alarms;
    journal::Journal& journal;
    std::function<std::uint32_t()> config_hash;
    // Of a loop with a twin; null: it has none.
    std::function<const supervision::History*(std::size_t loop)> history;
    std::filesystem::path explain = workbench_program();
    // What the explainer does while nothing is to be explained.
    std::function<bool(const StopWork& stop)> spare{};
  };
  // What is referred to outlives this.
  EvidenceFlow(const config::DaemonConfig& config, const config::Specialists& specialists,
               Dependencies dependencies);
  EvidenceFlow(const EvidenceFlow&) = delete;
  EvidenceFlow& operator=(const EvidenceFlow&) = delete;

  // Of alarms that were on before the start: before start() only.
  void remember();
  void start();

  // The monitor's thread, as an alarm is raised (Monitor::Raised).
  void keep(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
            const loopwarden::monitor::LoopMonitor& loop_monitor,
            const loopwarden::monitor::MonitorStep& step, loopwarden::monitor::AlarmReason reason);

  // The file of a loop's twin as text; empty: it has none.
  std::string twin(std::size_t loop) const;

  EvidenceStore& store() noexcept { return store_; }
  const EvidenceStore& store() const noexcept { return store_; }
  Explainer& explainer() noexcept { return explainer_; }
  const Explainer& explainer() const noexcept { return explainer_; }

 private:
  void report_evidence(const evidence::Evidence& evidence, const std::filesystem::path& folder,
                       const std::string& why);
  void report_removal(const std::string& why);
  void have_explained(const evidence::Evidence& evidence, const std::filesystem::path& folder);
  // Of an incident that lasts: when kAgain_s of what has changed have been seen, whatever came of the explanation before.
  void explain_again(const ExplainJob& job);
  bool lasts(const ExplainJob& job) const;
  // The loop's time between two moments, s.
  double since_s(std::int64_t from_ms, std::int64_t to_ms) const;
  // The loop's cycle so long ago; below 0: before the start.
  std::int64_t cycle_before(std::size_t loop, double s) const;
  void tell_not_explained(const ExplainJob& job, const std::string& why);
  // Of what an earlier run of the daemon explained.
  void go_on(std::size_t loop, const Explanation& newest);
  void report_explanation(const ExplainJob& job, const Explanation* explanation,
                          const std::string& why);
  void resume_explanation(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                          const std::filesystem::path& folder);

  Dependencies deps_;
  double accelerate_;
  std::map<std::string, std::uint32_t> specialist_hashes_;  // by folder
  std::map<std::string, std::string> twins_;                // files as text, by name
  std::filesystem::path store_folder_;
  EvidenceStore store_;
  Explainer explainer_;
};

}  // namespace loopwarden::daemon
