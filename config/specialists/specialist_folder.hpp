// SPDX-License-Identifier: Apache-2.0
// Specialists as a folder: manifest.yaml and a file of weights for each.
//
// The loader refuses what it can't trust: another format or version, files larger than their layers can
// need, a checksum that differs, layers that don't fit, numbers that are not finite, a class that is
// missing or there twice.
//
// Version 1 is read as well: its explaining networks have one input more, the last, that was always 0. It is left
// out, and what is left answers as before.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "model/specialist/judge/ensemble.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::config {

inline constexpr int kSpecialistVersion = 2;

struct SpecialistTraining {
  std::string source;  // what they were trained on, in words
  std::uint64_t seed = 1;
  std::size_t windows = 0;  // of the simulated loop
  std::size_t signatures = 0;
};

// On data that training never saw.
struct SpecialistFigures {
  std::size_t windows = 0;
  double named_percent = 0.0;        // of faulty windows, by their own name
  double false_alarm_percent = 0.0;  // of windows without a valve fault, called one
  double undecided_percent = 0.0;    // of all, not_enough_movement
  double calibration_error = 0.0;    // mean of |probability - share right|, over ten bins
};

struct SpecialistFolder {
  std::string plant;  // what their names begin with
  SpecialistTraining training;
  std::optional<SpecialistFigures> figures;
  std::optional<specialist::Team> team;                     // form `explaining`
  std::vector<specialist::SignatureSpecialist> signatures;  // form `signature`
};

// `folder` holds manifest.yaml.
Loaded<SpecialistFolder> read_specialists(const std::filesystem::path& folder);

// The files of weights that a folder's manifest names; none where it has no manifest.
std::vector<std::string> weight_files(const std::filesystem::path& folder);
// Removes those of `earlier` that the manifest does not name any more.
void remove_weights(const std::filesystem::path& folder, const std::vector<std::string>& earlier);

// Hands each file over by name and text, the manifest last. No weights that `folder` has are
// written over: a set that is replaced stays whole until the new manifest is there. A name that is
// taken gets the digest behind it.
using SpecialistFileSink = std::function<void(const std::string& name, const std::string& text)>;
void write_specialists(const SpecialistFolder& specialists, const std::filesystem::path& folder,
                       const SpecialistFileSink& write);

// Each file under a temporary name first, the manifest last: a folder with a manifest is whole,
// also after a power failure. Returns what went wrong, empty for nothing.
std::string write_specialists(const SpecialistFolder& specialists,
                              const std::filesystem::path& folder);

}  // namespace loopwarden::config
