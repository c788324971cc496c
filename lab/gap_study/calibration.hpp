// SPDX-License-Identifier: Apache-2.0
// From names that were given, right and wrong, to the table from which `loopwarden gap` reads its confidence.
//
// Three sorts of names are looked at apart: controller settings; effects where what is left is noise and a
// quiet load; effects where more is left. Within the last two the share of right names is taken to rise
// with the lead (nats): names in the order of their lead are put into groups of at least kLeastGroup, and
// neighbours are joined until the shares rise (pool adjacent violators). A share is (right + 1) / (names + 2),
// Laplace's rule, so that a small group promises little.
//
// What it can't do: the shares are those of the mixture of cases that was asked for.
//
// Source: pooling: Ayer et al., Ann. Math. Stat. 26 (1955) 641-647; as a calibration: Zadrozny and Elkan,
// KDD 2002, 694-699.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::studies::gap_study {

inline constexpr std::size_t kLeastGroup = 10;  // names

// One name that was given, with what its confidence is read from.
struct GivenName {
  std::string id;  // of the case: "h" or, with load, "l", and its seed
  std::string truth;
  std::string name;
  bool right = false;
  double lead_nats = 0.0;  // NaN: controller
  Rest rest;
};
std::vector<GivenName> names_given(const std::vector<ScoredCase>& cases);

// CSV under `made_by`, whose lines stand before it as comments.
std::string names_csv(const std::vector<std::string>& made_by, const std::vector<GivenName>& names);

struct NamesFile {
  std::vector<std::string> made_by;
  std::vector<GivenName> names;
};
// Throws std::runtime_error that names the line.
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

// model/gap/confidence_table.cpp
std::string table_source(const NamesFile& names);
std::string calibration_text(const Calibration& calibration);

}  // namespace loopwarden::studies::gap_study
