// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/topic.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace loopwarden::sparkplug {
namespace {

constexpr std::string_view kNamespace = "spBv1.0";
constexpr std::string_view kState = "STATE";
constexpr std::array<const char*, 8> kTypes{"NBIRTH", "NDEATH", "NDATA", "NCMD",
                                            "DBIRTH", "DDEATH", "DDATA", "DCMD"};

std::vector<std::string_view> levels_of(std::string_view text) {
  std::vector<std::string_view> levels;
  for (;;) {
    const std::size_t slash = text.find('/');
    levels.push_back(text.substr(0, slash));
    if (slash == std::string_view::npos) return levels;
    text.remove_prefix(slash + 1);
  }
}

bool is_forbidden(char c) noexcept {
  return c == '/' || c == '+' || c == '#' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

}  // namespace

const char* to_text(MessageType type) noexcept { return kTypes[static_cast<std::size_t>(type)]; }

bool is_of_device(MessageType type) noexcept { return type >= MessageType::dbirth; }

std::string to_text(const Topic& topic) {
  std::string text(kNamespace);
  text += '/' + topic.group + '/' + to_text(topic.type) + '/' + topic.edge;
  return topic.device.empty() ? text : text + '/' + topic.device;
}

std::optional<Topic> parse_topic(std::string_view text) {
  const std::vector<std::string_view> levels = levels_of(text);
  if (levels.size() < 4 || levels.size() > 5 || levels[0] != kNamespace) return std::nullopt;
  const auto* const type = std::find(kTypes.begin(), kTypes.end(), levels[2]);
  if (type == kTypes.end()) return std::nullopt;
  Topic topic{.group = std::string(levels[1]),
              .type = static_cast<MessageType>(type - kTypes.begin()),
              .edge = std::string(levels[3]),
              .device = levels.size() == 5 ? std::string(levels[4]) : std::string()};
  if (is_of_device(topic.type) != (levels.size() == 5)) return std::nullopt;
  const bool named = is_identifier(topic.group) && is_identifier(topic.edge) &&
                     (levels.size() == 4 || is_identifier(topic.device));
  return named ? std::optional(std::move(topic)) : std::nullopt;
}

std::string state_topic(std::string_view host) {
  return std::string(kNamespace) + '/' + std::string(kState) + '/' + std::string(host);
}

std::optional<std::string> parse_state_topic(std::string_view text) {
  const std::vector<std::string_view> levels = levels_of(text);
  const bool is_state = levels.size() == 3 && levels[0] == kNamespace && levels[1] == kState;
  if (!is_state || !is_identifier(levels[2])) return std::nullopt;
  return std::string(levels[2]);
}

bool is_identifier(std::string_view text) noexcept {
  return !text.empty() && text.size() <= kMostIdentifierBytes &&
         std::none_of(text.begin(), text.end(), is_forbidden);
}

std::string identifier_of(std::string_view tag) {
  std::string name(tag.substr(0, kMostIdentifierBytes));
  std::replace_if(name.begin(), name.end(), is_forbidden, '_');
  return name.empty() ? "_" : name;
}

}  // namespace loopwarden::sparkplug
