// SPDX-License-Identifier: Apache-2.0
// One YAML document as a tree of nodes with their places. Strict: features that a configuration
// does not need are errors with their place:
//   several documents, anchors, aliases and tags; keys that are not plain text; duplicate keys;
//   tabs in the indentation; bytes that are not UTF-8 text; more than kMostDepth levels or
//   kMostKeys.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"

namespace loopwarden::config {

inline constexpr std::size_t kMostDepth = 32;
inline constexpr std::size_t kMostKeys = 1000;  // of one mapping

struct YamlNode {
  enum class Kind { nothing, scalar, list, map };
  Kind kind = Kind::nothing;
  bool quoted = false;  // scalar in quotes or as a block: always text
  std::string text;     // of a scalar
  Place place;
  std::vector<YamlNode> keys;    // of a map, without duplicates
  std::vector<YamlNode> values;  // of a list or, in the order of `keys`, of a map

  // Map: set by its reader, so that unknown keys can be reported at the end.
  bool visited = false;
  std::vector<std::string> known_keys;

  YamlNode* find(std::string_view key) noexcept;
  const YamlNode* find(std::string_view key) const noexcept;
};

const char* to_text(YamlNode::Kind kind) noexcept;

// Returns nullopt if the text can't be parsed. Throws only if memory runs out.
std::optional<YamlNode> parse_yaml(std::string_view text, Report& report);

// Reports an error for each unknown key of the visited maps. A second call reports no error again.
void report_unknown_keys(YamlNode& node, Report& report);

}  // namespace loopwarden::config
