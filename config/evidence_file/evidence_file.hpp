// SPDX-License-Identifier: Apache-2.0
// Evidence as a folder that says all by itself, for ever:
//
//   evidence.json  alarm, verdict, hashes; of a window every specialist's error and the classical measures, of routine
//                  evidence the numbers that diagnose() weighs, and the sum of nats before and after; of a twin its residual
//   record.csv     the samples, a record like any other (loopwarden gap, diagnose, classify)
//   specialists/   those that judged it, where specialists did
//   twin.yaml      the loop's twin, where it has one: `loopwarden explain` holds the newest minutes against it
//
// The folder gets its name when all of it is on the disk: what has a name is whole.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "config/specialists/specialist_folder.hpp"
#include "record/evidence/evidence.hpp"

namespace loopwarden::evidence {

class EvidenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws EvidenceError with the reason; nothing of it is left then. `folder` must not exist; the one that
// it is in must. `specialists`: null where none found it.
void write_evidence(const Evidence& evidence, const config::SpecialistFolder* specialists,
                    const std::filesystem::path& folder);

// Throws EvidenceError for what is no evidence.
Evidence read_evidence(const std::filesystem::path& folder);

// Where the specialists of this evidence are.
std::filesystem::path specialists_of(const std::filesystem::path& folder);

}  // namespace loopwarden::evidence
