// SPDX-License-Identifier: Apache-2.0
// A message of e-mail as RFC 5322, 2045 and 2047 want it: whatever stands in a name or a reason, it stays inside its
// field. Lines end with \n; SMTP needs \r\n (to_crlf).
#pragma once

#include <string>
#include <string_view>

#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {

// Where the message has pictures, they follow the text as parts of their own, to be shown with it.
std::string mail_text(const Message& message, const Sender& sender, const EmailSettings& settings);

// A field of unstructured text, folded; encoded words if the text is not short plain ASCII.
std::string header_field(std::string_view name, std::string_view text);
// In one line.
std::string base64(std::string_view bytes);
// Lines of at most 76 characters.
std::string quoted_printable(std::string_view text);
std::string to_crlf(std::string_view text);

// A plain address, local@domain, ASCII: nothing that could end a header or begin an option.
bool is_address(std::string_view text);

}  // namespace loopwarden::notify
