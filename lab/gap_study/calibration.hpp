// SPDX-License-Identifier: Apache-2.0
// Computes the table of confidences of `loopwarden gap` from names that were given correctly and
// wrongly.
//
// Three groups of names are treated separately:
// - controller settings
// - effects whose remaining error is noise and a small load
// - effects with a larger remaining error
//
// In the last two groups the share of correct names is assumed to rise with the lead (nats). Names
// in the order of their lead form groups of at least kLeastGroup, and neighbouring groups are
// joined until the shares rise (pool adjacent violators). A share is (correct + 1) / (names + 2),
// Laplace's rule, so that a small group gets a moderate share.
//
// Limits: the shares apply to the mixture of cases in the input.
//
// Source: pooling: Ayer et al., Ann. Math. Stat. 26 (1955) 641-647; as a calibration: Zadrozny and
// Elkan, KDD 2002, 694-699.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::lab::gap_study {

inline constexpr std::size_t kLeastGroup = 10;  // number of names

// One given name, with the values that determine its confidence.
struct GivenName {
  std::string id;  // of the case: "h", or "l" with load, and its seed
  std::string truth;
  std::string name;
  bool right = false;
  double lead_nats = 0.0;  // NaN: controller
  Rest rest;
};
std::vector<GivenName> names_given(const std::vector<ScoredCase>& cases);

// Returns CSV that begins with the lines of `made_by` as comments.
std::string names_csv(const std::vector<std::string>& made_by, const std::vector<GivenName>& names);

struct NamesFile {
  std::vector<std::string> made_by;
  std::vector<GivenName> names;
};
// Throws std::runtime_error that states the line.
NamesFile parse_names(std::string_view text);

struct Group {
  double from_nats = 0.0;
  std::size_t names = 0;
  std::size_t right = 0;

  double share() const {
    return (static_cast<double>(right) + 1.0) / (static_cast<double>(names) + 2.0);
  }
};

struct Calibration {
  std::vector<Group> rest_is_noise;  // rising leads and shares, the first from 0 nats
  std::vector<Group> rest_is_more;
  Group controller;
};
Calibration calibrate(const std::vector<GivenName>& names);

// Returns the source text of model/gap/confidence_table.cpp.
std::string table_source(const NamesFile& names);
std::string calibration_text(const Calibration& calibration);

}  // namespace loopwarden::lab::gap_study
