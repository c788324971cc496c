// SPDX-License-Identifier: Apache-2.0
// What a training run has finished, kept beside its result so that a killed run goes on from there.
//
// One file for each network and each block of simulated windows, written under a temporary name first. All carry the key of the run: checksum of
// data, settings and seed. A file of another run, or one that can't be read, counts as not there.
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
  // Nothing is kept where the folder can't be made: training goes on without.
  TrainingCheckpoint(std::filesystem::path folder, std::string key);

  std::optional<specialist::Learned> find_network(const std::string& name) const;
  void keep_network(const std::string& name, const specialist::Learned& learned) const;
  std::optional<std::vector<specialist::Example>> find_examples(const std::string& name,
                                                                std::size_t count) const;
  void keep_examples(const std::string& name,
                     const std::vector<specialist::Example>& examples) const;
  std::optional<specialist::TeamRestart> find_team(const std::string& name) const;
  void keep_team(const std::string& name, const specialist::TeamRestart& restart) const;

  // The run is complete: its files go, and the folder where nothing else is in it.
  static void remove(const std::filesystem::path& folder);

 private:
  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace loopwarden::workbench
