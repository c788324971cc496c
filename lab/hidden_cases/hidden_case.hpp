// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "lab/hidden_cases/truth_loop.hpp"

namespace loopwarden::hidden_cases {

// Kinds of cases:
// - kOnset: a valve that is healthy until about the middle of the record, for functions that
//   monitor loops.
// - kController: only controller mismatches, which are one in fourteen of kSingle.
// - kFurther: one effect as in kSingle, of the later additions to the catalogue.
// - kLater: a loop to commission, with rough initial values and a valve with the friction and the
//   characteristic of healthy ones. From about the middle of the record it has a fault of any
//   block, two faults or no fault.
// - kHealthy: as kLater without a fault. After the first 20 minutes another day follows, with one
//   to three times the load and set points over the whole range.
enum class Kind {
  kSingle,
  kNone,
  kPair,
  kOutside,
  kOnset,
  kController,
  kFurther,
  kLater,
  kHealthy
};

// Definition of one case. The same request gives the same bits.
struct CaseRequest {
  std::string id;
  Kind kind = Kind::kSingle;
  // One of effect_names(kind).
  std::string effect;
  std::uint64_t seed = 0;
  bool load = false;
  std::size_t samples = 4200;
  Moves test{};  // after the record
};

// The loop as assumed by its engineers.
struct BelievedLoop {
  Tuning tuning;
  double gain;
  double time_constant_s;
  double dead_time_s;
};

struct HiddenCase {
  std::string id;
  std::string effect;
  // Accepted names: any one of them for a single effect, all of them for two at once.
  std::vector<std::string> accept;
  // By the names of the effect catalogue.
  std::map<std::string, double> parameters;
  // Description of the physical cause.
  std::string note;
  BelievedLoop believed;
  LoopRecord record;
  LoopRecord test;  // after the record; empty without moves
  // Time at which the effect begins, s; 0: always present.
  double from_s = 0.0;
  double floor_rmse = 0.0;
};

// Returns "stiction", "stiction+gain_change", "outside:recycle", ...; "none" and its variants
// "none:aggressive_tuning", ... are written as "none".
const std::vector<std::string>& effect_names(Kind kind);

// Throws std::invalid_argument for an effect that is not in effect_names(request.kind), or for
// fewer than 600 samples.
HiddenCase make_case(const CaseRequest& request);

// Returns requests for `count` cases. The requested kinds have the ratio 30 : 4 : 6 : 6 : 30 : 6 :
// 30 : 30 : 30 of single, none, pair, outside, onset, controller, further, later, healthy. All
// effects of a kind are equally frequent, except that every other pair is stiction+gain_change or
// backlash+oscillating_disturbance. Case k has the seed seed + k.
std::vector<CaseRequest> plan_cases(std::size_t count, std::uint64_t seed,
                                    const std::vector<Kind>& kinds, bool load, std::size_t samples);

// Write FOLDER/ID/record.csv and model.yaml of a case, and FOLDER/truth.json of all. Throw
// std::filesystem::filesystem_error if a file can't be written.
void write_case(const std::filesystem::path& folder, const HiddenCase& one);
void write_truth(const std::filesystem::path& folder, const std::vector<HiddenCase>& cases);
// Makes all cases in sequence and writes them.
void write_cases(const std::filesystem::path& folder, const std::vector<CaseRequest>& requests);

}  // namespace loopwarden::hidden_cases
