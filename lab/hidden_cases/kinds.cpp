// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/kinds.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace loopwarden::hidden_cases {
namespace {

Kind parse_kind(std::string_view word) {
  if (word == "single") return Kind::kSingle;
  if (word == "none") return Kind::kNone;
  if (word == "pair") return Kind::kPair;
  if (word == "outside") return Kind::kOutside;
  if (word == "onset") return Kind::kOnset;
  if (word == "controller") return Kind::kController;
  if (word == "further") return Kind::kFurther;
  if (word == "later") return Kind::kLater;
  if (word == "healthy") return Kind::kHealthy;
  throw std::invalid_argument(
      fmt::format("unknown kind of case '{}'. Use single, none, pair, outside, onset, controller, "
                  "further, later or healthy",
                  word));
}

}  // namespace

std::vector<Kind> parse_kinds(std::string_view list) {
  std::vector<Kind> kinds;
  while (true) {
    const std::size_t comma = list.find(',');
    kinds.push_back(parse_kind(list.substr(0, comma)));
    if (comma == std::string_view::npos) return kinds;
    list.remove_prefix(comma + 1);
  }
}

}  // namespace loopwarden::hidden_cases
