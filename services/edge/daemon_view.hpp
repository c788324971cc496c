// SPDX-License-Identifier: Apache-2.0
// The view of the daemon through status.sock: its model, and the newest values of all metrics.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/edge/box_model.hpp"
#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::edge {

class DaemonView {
 public:
  // `commissions`: folder with TAG/commission.json; empty if there is no such folder.
  DaemonView(const std::filesystem::path& runtime_directory, DeadBands dead_bands,
             std::filesystem::path commissions);

  // Asks for all values again. Returns true if the model has changed. Throws protocol::DaemonError.
  bool look();

  const BoxModel& model() const noexcept { return model_; }
  Reading node_reading(const Extras& own) const;
  Reading loop_reading(std::size_t loop) const;
  // Returns the unacknowledged alarms of a loop.
  std::vector<std::string> unacknowledged(std::size_t loop) const;
  // Returns the folder of an alarm's newest evidence, or the evidence folder of that name; nullopt
  // if there is no such folder. Throws as look().
  std::optional<std::filesystem::path> evidence(std::size_t loop, const std::string& wanted);

 private:
  bool describe();
  BoxModel::Detectable detectable(const protocol::Description& describe) const;
  void note_columns();
  void look_at_alarms();
  void look_at_explanations();
  std::vector<double> values(std::size_t loop, const std::vector<std::size_t>& columns) const;

  protocol::DaemonClient daemon_;
  DeadBands dead_bands_;
  std::filesystem::path commissions_;

  BoxModel model_;
  bool described_ = false;
  std::optional<double> config_hash_;
  std::filesystem::path state_directory_;
  std::string version_;
  protocol::Registers registers_;
  std::vector<Extras> extras_;  // of each loop

  // Columns that change with alarms or explanations, and their values when these were last read.
  std::vector<std::size_t> alarm_columns_;
  std::vector<std::size_t> explanation_columns_;
  std::vector<double> alarms_seen_;
  std::vector<std::optional<std::vector<double>>> explanations_seen_;
};

}  // namespace loopwarden::edge
