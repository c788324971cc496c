// SPDX-License-Identifier: Apache-2.0
// Writes syslog messages as RFC 5424 requires.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {

// Length that every UDP receiver should accept (RFC 5424, 6.1), and the limit for other transports.
inline constexpr std::size_t kMostDatagramBytes = 2048;
inline constexpr std::size_t kMostStreamBytes = 8192;

// Returns header, structured data and text of one event. The text is cut to fit `most_bytes`.
std::string syslog_line(const Event& event, const Message& message, const Sender& sender,
                        const SyslogSettings& settings, std::size_t most_bytes);

// Returns the frame of RFC 6587 (octet counting): the length, a space, the message.
std::string octet_frame(std::string_view line);

}  // namespace loopwarden::notify
