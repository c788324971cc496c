// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/syslog_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

constexpr std::size_t kLongestHostName = 255;
constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";  // marks the text as UTF-8

// Returns printable ASCII without spaces, as the header requires.
std::string header_word(const std::string& text) {
  std::string word;
  for (const char c : text.substr(0, kLongestHostName)) word += c > ' ' && c < '\x7F' ? c : '_';
  return word.empty() ? "-" : word;
}

// Escapes the characters that end a value (RFC 5424, 6.3.3).
std::string parameter(const char* name, std::string_view value) {
  std::string text = fmt::format(" {}=\"", name);
  for (const char c : value) {
    if (c == '"' || c == '\\' || c == ']') text += '\\';
    text += c;
  }
  return text + '"';
}

std::string structured_data(const Event& event, const Message& message, const Sender& sender,
                            std::int64_t enterprise) {
  constexpr std::size_t kMostBytes = 100;  // of each: all of them fit into a datagram, escaped
  std::string data = fmt::format("[loopwarden@{}", enterprise);
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) data += parameter(name, base::cut(value, kMostBytes));
  };
  add("box", sender.box);
  add("notification", fmt::format("{}", message.id));
  add("loop", event.loop);
  add("alarm", event.alarm);
  add("change", to_text(event.change));
  add("state", event.state);
  if (event.severity_percent)
    add("severity_percent", fmt::format("{:.3f}", *event.severity_percent));
  add("peer", event.peer);
  add("reason", event.reason);
  if (message.lost > 0) add("lost", fmt::format("{}", message.lost));
  if (message.perhaps_twice) add("perhaps_twice", "true");
  return data + "]";
}

}  // namespace

std::string syslog_line(const Event& event, const Message& message, const Sender& sender,
                        const SyslogSettings& settings, std::size_t most_bytes) {
  constexpr int kInformation = 6;
  const int severity = message.test ? kInformation : priority_of(event);
  const std::string start =
      fmt::format("<{}>1 {} {} loopwarden-notify - {} {} {}", settings.facility * 8 + severity,
                  rfc3339(event.utc_ms), header_word(sender.box), to_text(event.change),
                  structured_data(event, message, sender, settings.enterprise), kByteOrderMark);
  const std::string text = message.test ? headline(message, sender) : sentence(event, sender);
  return start + std::string(base::cut(text, most_bytes - std::min(most_bytes, start.size())));
}

std::string octet_frame(std::string_view line) { return fmt::format("{} {}", line.size(), line); }

}  // namespace loopwarden::notify
