// SPDX-License-Identifier: Apache-2.0
// Evidence as a complete folder, readable without other files:
//
//   evidence.json  alarm, verdict, hashes; of a window each specialist's error and the classical
//                  measures; of routine evidence the numbers that diagnose() weighs, and the sum of
//                  nats before and after; of a twin its residual
//   record.csv     the samples, a normal record (loopwarden gap, diagnose, classify)
//   specialists/   the specialists used, if any
//   twin.yaml      the loop's twin, if any: compared by `loopwarden explain`
//
// The folder gets its name after all files are on the disk, so a folder with a name is complete.
#pragma once

#include <filesystem>
#include <stdexcept>

#include "config/specialists/specialist_folder.hpp"
#include "record/evidence/evidence.hpp"

namespace loopwarden::evidence {

class EvidenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws EvidenceError with the reason and removes all its files. `folder` must not exist, but its
// parent must. `specialists`: null if none was used.
void write_evidence(const Evidence& evidence, const config::SpecialistFolder* specialists,
                    const std::filesystem::path& folder);

// Throws EvidenceError if the folder is no evidence.
Evidence read_evidence(const std::filesystem::path& folder);

// Returns the folder of the specialists of this evidence.
std::filesystem::path specialists_of(const std::filesystem::path& folder);

}  // namespace loopwarden::evidence
