// SPDX-License-Identifier: Apache-2.0
// Stores the finished parts of a training run next to its result, so that an interrupted run can
// continue.
//
// Each network and each block of simulated windows has one file, which is written under a temporary
// name first. All files contain the key of the run: a checksum of data, settings and seed. Files of
// another run and unreadable files are ignored.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "model/specialist/train/growing.hpp"
#include "model/specialist/train/team_training.hpp"

namespace loopwarden::workbench {

class TrainingCheckpoint {
 public:
  // If the folder can't be created, the run continues without a checkpoint.
  TrainingCheckpoint(std::filesystem::path folder, std::string key);

  std::optional<specialist::Learned> find_network(const std::string& name) const;
  void keep_network(const std::string& name, const specialist::Learned& learned) const;
  std::optional<std::vector<specialist::Example>> find_examples(const std::string& name,
                                                                std::size_t count) const;
  void keep_examples(const std::string& name,
                     const std::vector<specialist::Example>& examples) const;
  std::optional<specialist::TeamRestart> find_team(const std::string& name) const;
  void keep_team(const std::string& name, const specialist::TeamRestart& restart) const;

  // Deletes the files of a complete run, and the folder if it is empty then.
  static void remove(const std::filesystem::path& folder);

 private:
  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace loopwarden::workbench
