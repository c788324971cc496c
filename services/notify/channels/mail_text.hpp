// SPDX-License-Identifier: Apache-2.0
// Writes e-mails as RFC 5322, 2045 and 2047 require. The text of a name or a reason can't leave its
// field. Lines end with \n; SMTP needs \r\n (to_crlf).
#pragma once

#include <string>
#include <string_view>

#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {

// Pictures of the message follow the text as separate parts, to be displayed with it.
std::string mail_text(const Message& message, const Sender& sender, const EmailSettings& settings);

// Returns a folded field of unstructured text, as encoded words unless it is short plain ASCII.
std::string header_field(std::string_view name, std::string_view text);
// Returns base64 in one line.
std::string base64(std::string_view bytes);
// Returns lines of at most 76 characters.
std::string quoted_printable(std::string_view text);
std::string to_crlf(std::string_view text);

// Returns whether `text` is a plain ASCII address, local@domain, without characters that could end
// a header or begin an option.
bool is_address(std::string_view text);

}  // namespace loopwarden::notify
