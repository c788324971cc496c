// SPDX-License-Identifier: Apache-2.0
// Reads and writes specialists as a folder: manifest.yaml and one file of weights per specialist.
//
// The loader refuses:
// - another format or version
// - files larger than their layers need
// - a wrong checksum
// - layers that don't fit together
// - numbers that are not finite
// - a class that is missing or present twice
//
// Version 1 is read as well. Its explaining networks have one additional input, the last one, which
// was always 0. It is removed, which does not change their output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "model/specialist/judge/ensemble.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::config {

inline constexpr int kSpecialistVersion = 2;

struct SpecialistTraining {
  std::string source;  // description of the training data
  std::uint64_t seed = 1;
  std::size_t windows = 0;  // of the simulated loop
  std::size_t signatures = 0;
};

// Results on data that was not used for training.
struct SpecialistFigures {
  std::size_t windows = 0;
  double named_percent = 0.0;        // of faulty windows, with the correct fault
  double false_alarm_percent = 0.0;  // of windows without a valve fault, but a fault was named
  double undecided_percent = 0.0;    // of all windows, not_enough_movement
  double calibration_error = 0.0;    // mean of |probability - share of correct answers|, over ten
                                     // bins
};

struct SpecialistFolder {
  std::string plant;  // prefix of their names
  SpecialistTraining training;
  std::optional<SpecialistFigures> figures;
  std::optional<specialist::Team> team;                     // form `explaining`
  std::vector<specialist::SignatureSpecialist> signatures;  // form `signature`
};

// Reads the specialists of `folder`, which contains manifest.yaml.
Loaded<SpecialistFolder> read_specialists(const std::filesystem::path& folder);

// Returns the files of weights that a folder's manifest names; empty if it has no manifest.
std::vector<std::string> weight_files(const std::filesystem::path& folder);
// Removes the files of `earlier` that the manifest no longer names.
void remove_weights(const std::filesystem::path& folder, const std::vector<std::string>& earlier);

// Passes each file by name and text to the sink, the manifest last. Weights present in `folder` are
// never overwritten: the old set stays complete until the new manifest exists. If a name is in use,
// the digest is appended to it.
using SpecialistFileSink = std::function<void(const std::string& name, const std::string& text)>;
void write_specialists(const SpecialistFolder& specialists, const std::filesystem::path& folder,
                       const SpecialistFileSink& write);

// Writes each file under a temporary name first, and the manifest last. A folder with a manifest is
// therefore complete, also after a power failure. Returns an error text; empty on success.
std::string write_specialists(const SpecialistFolder& specialists,
                              const std::filesystem::path& folder);

}  // namespace loopwarden::config
