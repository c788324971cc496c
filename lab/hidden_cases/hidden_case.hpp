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

// kOnset: a valve that is healthy until some moment about the middle of the record, for what watches
// loops. kController: controller mismatches alone, of which kSingle holds one in fourteen.
// kFurther: one effect as in kSingle, of those that came to the catalogue later.
// kLater: a loop to commission: believed roughly, valves with the friction and the characteristics that healthy ones have,
// and a fault of any block, two or none from about the middle of the record on. kHealthy: the same without a fault, with another day behind the
// first 20 minutes: a load of one to three times theirs, and set points over the whole range.
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

// What one case is made of. The same request gives the same bits.
struct CaseRequest {
  std::string id;
  Kind kind = Kind::kSingle;
  // One of effect_names(kind).
  std::string effect;
  std::uint64_t seed = 0;
  bool load = false;
  std::size_t samples = 4200;
};

// The loop as its engineers believe it to be.
struct BelievedLoop {
  Tuning tuning;
  double gain;
  double time_constant_s;
  double dead_time_s;
};

struct HiddenCase {
  std::string id;
  std::string effect;
  // Any one of them for a single effect, all of them for two at once.
  std::vector<std::string> accept;
  // Under the names of the effect catalogue.
  std::map<std::string, double> parameters;
  // The physics behind it, in words.
  std::string note;
  BelievedLoop believed;
  LoopRecord record;
  // When the effect begins, s; 0: it was always there.
  double from_s = 0.0;
  double floor_rmse = 0.0;
};

// "stiction", "stiction+gain_change", "outside:recycle", ...; "none" and its variants
// "none:aggressive_tuning", ... are written as "none".
const std::vector<std::string>& effect_names(Kind kind);

// Throws std::invalid_argument for an effect that effect_names(request.kind) doesn't hold, or fewer
// than 600 samples.
HiddenCase make_case(const CaseRequest& request);

// Requests for `count` cases: kinds in the ratio 30 : 4 : 6 : 6 : 30 : 6 : 30 : 30 : 30 of single, none, pair, outside,
// onset, controller, further, later, healthy as far as they are wanted, every effect of a kind as often as the others (of the pairs every other
// one is stiction+gain_change or backlash+oscillating_disturbance). Case k has the seed seed + k.
std::vector<CaseRequest> plan_cases(std::size_t count, std::uint64_t seed,
                                    const std::vector<Kind>& kinds, bool load, std::size_t samples);

// Writes FOLDER/ID/record.csv and model.yaml of a case, and FOLDER/truth.json of all. They throw
// std::filesystem::filesystem_error when a file can't be written.
void write_case(const std::filesystem::path& folder, const HiddenCase& one);
void write_truth(const std::filesystem::path& folder, const std::vector<HiddenCase>& cases);
// Makes the cases one after the other and writes them all.
void write_cases(const std::filesystem::path& folder, const std::vector<CaseRequest>& requests);

}  // namespace loopwarden::hidden_cases
