// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/loop_type.hpp"

#include <array>
#include <cstddef>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::array kLoopTypes{LoopType::unknown, LoopType::flow, LoopType::pressure,
                                LoopType::level, LoopType::temperature};
constexpr std::size_t kLongestGroup = 5;  // letters

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

LoopType type_of_group(std::string_view group) {
  if (group.size() < 2 || group.size() > kLongestGroup) return LoopType::unknown;
  const std::size_t controls = group.find('C', 1);
  if (controls == std::string_view::npos) return LoopType::unknown;
  if (group.substr(1, controls - 1).find_first_not_of("DFIQRY") != std::string_view::npos ||
      group.substr(controls + 1).find_first_not_of("SA") != std::string_view::npos) {
    return LoopType::unknown;
  }
  switch (group.front()) {
    case 'F': return LoopType::flow;
    case 'P': return LoopType::pressure;
    case 'L': return LoopType::level;
    case 'T': return LoopType::temperature;
    default: return LoopType::unknown;
  }
}

}  // namespace

const char* to_text(LoopType type) noexcept {
  return numeric::enum_name<LoopType::temperature>(
      type, {"unknown", "flow", "pressure", "level", "temperature"});
}

std::optional<LoopType> loop_type(std::string_view name) noexcept {
  for (const LoopType type : kLoopTypes) {
    if (name == to_text(type)) return type;
  }
  return std::nullopt;
}

LoopType loop_type_from_tag(std::string_view tag) noexcept {
  LoopType found = LoopType::unknown;
  for (std::size_t from = 0; from < tag.size();) {
    if (!is_letter(tag[from])) {
      ++from;
      continue;
    }
    std::size_t to = from;
    while (to < tag.size() && is_letter(tag[to])) ++to;
    const LoopType type = type_of_group(tag.substr(from, to - from));
    if (type != LoopType::unknown) {
      if (found != LoopType::unknown && found != type) return LoopType::unknown;
      found = type;
    }
    from = to;
  }
  return found;
}

}  // namespace loopwarden::diagnosis
