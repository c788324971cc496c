// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/kind.hpp"

#include <array>
#include <cstddef>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::array kLoopKinds{LoopKind::unknown, LoopKind::flow, LoopKind::pressure,
                                LoopKind::level, LoopKind::temperature};
constexpr std::size_t kLongestGroup = 5;  // letters

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

LoopKind kind_of_group(std::string_view group) {
  if (group.size() < 2 || group.size() > kLongestGroup) return LoopKind::unknown;
  const std::size_t controls = group.find('C', 1);
  if (controls == std::string_view::npos) return LoopKind::unknown;
  if (group.substr(1, controls - 1).find_first_not_of("DFIQRY") != std::string_view::npos ||
      group.substr(controls + 1).find_first_not_of("SA") != std::string_view::npos) {
    return LoopKind::unknown;
  }
  switch (group.front()) {
    case 'F': return LoopKind::flow;
    case 'P': return LoopKind::pressure;
    case 'L': return LoopKind::level;
    case 'T': return LoopKind::temperature;
    default: return LoopKind::unknown;
  }
}

}  // namespace

const char* to_text(LoopKind kind) noexcept {
  return numeric::enum_name<LoopKind::temperature>(
      kind, {"unknown", "flow", "pressure", "level", "temperature"});
}

std::optional<LoopKind> loop_kind(std::string_view name) noexcept {
  for (const LoopKind kind : kLoopKinds) {
    if (name == to_text(kind)) return kind;
  }
  return std::nullopt;
}

LoopKind kind_from_tag(std::string_view tag) noexcept {
  LoopKind found = LoopKind::unknown;
  for (std::size_t from = 0; from < tag.size();) {
    if (!is_letter(tag[from])) {
      ++from;
      continue;
    }
    std::size_t to = from;
    while (to < tag.size() && is_letter(tag[to])) ++to;
    const LoopKind kind = kind_of_group(tag.substr(from, to - from));
    if (kind != LoopKind::unknown) {
      if (found != LoopKind::unknown && found != kind) return LoopKind::unknown;
      found = kind;
    }
    from = to;
  }
  return found;
}

}  // namespace loopwarden::diagnosis
