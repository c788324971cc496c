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
  std::string device;  // empty: the edge node itself
  friend bool operator==(const Topic&, const Topic&) = default;
};

std::string to_text(const Topic& topic);
// Returns nullopt if the text is not a topic of that form. STATE topics are not.
std::optional<Topic> parse_topic(std::string_view text);

std::string state_topic(std::string_view host);
// Returns the host of a STATE topic; nullopt for other topics.
std::optional<std::string> parse_state_topic(std::string_view text);

// Most bytes in the name of a group, an edge node, a device or a host. is_identifier() also
// requires UTF-8 that is not empty and has no / + # or control characters.
inline constexpr std::size_t kMostIdentifierBytes = 200;
bool is_identifier(std::string_view text) noexcept;
// Converts a loop's tag into such a name. Each invalid character becomes '_'.
std::string identifier_of(std::string_view tag);

}  // namespace loopwarden::sparkplug
