// SPDX-License-Identifier: Apache-2.0
// Processes a valve alarm: stores evidence on the disk and writes a line to the journal. For a loop
// with a twin it also stores an explanation in the alarm registry.
//
//   monitor -> keep() -> EvidenceStore -> journal
//                            -> Explainer (with a twin) -> registry
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "daemon/supervision/alarm_registry.hpp"
#include "config/loop_config.hpp"
#include "config/validation/specialist_files.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/explain/explainer.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/supervision/history.hpp"
#include "model/watch/loop_monitor.hpp"

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
    // Work of the explainer's thread while no explanation is due.
    std::function<bool(const StopWork& stop)> spare{};
  };
  // The referenced objects must outlive this.
  EvidenceFlow(const config::DaemonConfig& config, const config::Specialists& specialists,
               Dependencies dependencies);
  EvidenceFlow(const EvidenceFlow&) = delete;
  EvidenceFlow& operator=(const EvidenceFlow&) = delete;

  // Restores the alarms that were on before the start. Call it before start().
  void remember();
  void start();

  // Keeps the evidence of an alarm that is raised (Monitor::Raised). Called by the monitor's
  // thread.
  void keep(std::size_t loop, alarm::AlarmKind alarm, const watch::LoopMonitor& loop_monitor,
            const watch::MonitorStep& step, alarm::AlarmReason reason);

  // Returns the text of the file of a loop's twin; empty: no twin.
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
  // Queues a repeat for a lasting incident when kAgain_s of time since the change have been seen,
  // whatever the result of the previous explanation was.
  void explain_again(const ExplainJob& job);
  bool lasts(const ExplainJob& job) const;
  // Returns the loop's time between two moments, s.
  double since_s(std::int64_t from_ms, std::int64_t to_ms) const;
  // Returns the loop's cycle `s` ago; negative if that is before the start.
  std::int64_t cycle_before(std::size_t loop, double s) const;
  void tell_not_explained(const ExplainJob& job, const std::string& why);
  // Continues with a loop whose alarm an earlier run of the daemon has explained.
  void go_on(std::size_t loop, const Explanation& newest);
  void report_explanation(const ExplainJob& job, const Explanation* explanation,
                          const std::string& why);
  // The explanation with the state of its slip in `next_test`.
  Explanation with_slip(Explanation explanation, std::size_t loop) const;
  // Queues the next search for the move of a slip that is open, if the loop is recorded.
  void search_move(std::size_t loop, const Explanation& explanation, const std::string& trouble);
  void report_search(const ExplainJob& job, const Explanation* explanation, const std::string& why);
  void journal_slip(const ExplainJob& job, const TestSlip& slip, const TestSlip& before);
  void resume_explanation(std::size_t loop, alarm::AlarmKind alarm,
                          const std::filesystem::path& folder);

  Dependencies deps_;
  double accelerate_;
  std::map<std::string, std::uint32_t> specialist_hashes_;  // by folder
  std::map<std::string, std::string> twins_;                // files as text, by name
  std::filesystem::path state_directory_;
  std::filesystem::path store_folder_;
  EvidenceStore store_;
  Explainer explainer_;
};

}  // namespace loopwarden::daemon
