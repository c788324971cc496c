// SPDX-License-Identifier: Apache-2.0
// A syslog message as RFC 5424 wants it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {

// The most that every receiver of UDP should take (RFC 5424, 6.1), and what we send otherwise.
inline constexpr std::size_t kMostDatagramBytes = 2048;
inline constexpr std::size_t kMostStreamBytes = 8192;

// Header, structured data and text of one event; the text is cut where the whole would be longer.
std::string syslog_line(const Event& event, const Message& message, const Sender& sender,
                        const SyslogSettings& settings, std::size_t most_bytes);

// Octet counting of RFC 6587: the length, a space, the message.
std::string octet_frame(std::string_view line);

}  // namespace loopwarden::notify
