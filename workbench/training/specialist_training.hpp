// SPDX-License-Identifier: Apache-2.0
// Trains the specialists of one plant in both forms, on several threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/specialists/specialist_folder.hpp"
#include "model/specialist/train/growing.hpp"
#include "model/specialist/train/team_training.hpp"

namespace loopwarden::workbench {

struct TrainingJob {
  std::string plant = "P1";
  std::string source;  // recorded in the manifest
  std::optional<plant::LoopModel>
      model;  // for the explaining form; also simulates signatures if `signatures` is empty
  std::vector<specialist::Signature> signatures;
  bool explaining = true;
  bool signature = true;
  // Conditions of the signature form. If `signatures` is not empty, the conditions of those.
  std::vector<specialist::Condition> conditions{
      specialist::Condition::no_fault, specialist::Condition::backlash,
      specialist::Condition::low_air_supply, specialist::Condition::stiction,
      specialist::Condition::hysteresis};
  specialist::TeamTrainingSettings team;
  specialist::GrowingSettings growing;
  std::size_t held_out = 150;  // windows per condition for the figures
  unsigned threads = 2;
  std::optional<std::filesystem::path> checkpoint;  // folder
};

struct TrainedSize {
  std::string specialist;  // P1S10
  std::size_t size = 0;
  bool chosen = false;
  std::vector<specialist::Epoch> epochs;
  std::size_t best = 0;
  specialist::Stop stop = specialist::Stop::epochs;
  double half_span = 1.0;  // PV units of one unit of error
};

struct TrainingResult {
  config::SpecialistFolder folder;
  std::vector<TrainedSize> sizes;
  std::vector<specialist::TeamEpoch> team_epochs;
};

// `say` receives a text at each start and end, `live` one for every epoch. Calls are serialised.
struct TrainingListener {
  std::function<void(const std::string&)> say;
  std::function<void(const std::string&)> live;
};

TrainingResult train_specialists(const TrainingJob& job, const TrainingListener& listener);

// Judges `count` new windows of each condition.
config::SpecialistFigures measure_team(const specialist::Team& team, const plant::LoopModel& model,
                                       std::size_t count, std::uint64_t seed, unsigned threads);

// Returns P1S10 for P1, S and 10. The name of the explaining form ends with x.
std::string specialist_name(const std::string& plant, specialist::Condition condition,
                            std::size_t hidden, bool explaining);

}  // namespace loopwarden::workbench
