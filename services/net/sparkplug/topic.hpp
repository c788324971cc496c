// SPDX-License-Identifier: Apache-2.0
// Topics of the Sparkplug B namespace:
//   spBv1.0/GROUP/TYPE/EDGE[/DEVICE]     spBv1.0/STATE/HOST
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::sparkplug {

enum class MessageType : std::uint8_t { nbirth, ndeath, ndata, ncmd, dbirth, ddeath, ddata, dcmd };

const char* to_text(MessageType type) noexcept;  // "NBIRTH"
bool is_of_device(MessageType type) noexcept;    // D...: the topic names a device

struct Topic {
  std::string group;
  MessageType type = MessageType::nbirth;
  std::string edge;
  std::string device;  // empty: of the edge node itself
  friend bool operator==(const Topic&, const Topic&) = default;
};

std::string to_text(const Topic& topic);
// Returns nullopt if it is no topic of that form; STATE is not one.
std::optional<Topic> parse_topic(std::string_view text);

std::string state_topic(std::string_view host);
// The host that a STATE topic names; nullopt if it is no STATE topic.
std::optional<std::string> parse_state_topic(std::string_view text);

// What a group, an edge node, a device or a host may be called: UTF-8, not empty, without / + # and control
// characters, at most kMostIdentifierBytes.
inline constexpr std::size_t kMostIdentifierBytes = 200;
bool is_identifier(std::string_view text) noexcept;
// A loop's tag as such a name: what it may not hold becomes '_'.
std::string identifier_of(std::string_view tag);

}  // namespace loopwarden::sparkplug
