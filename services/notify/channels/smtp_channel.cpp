// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string_view>
#include <utility>

#include "services/notify/channels/curl_request.hpp"
#include "services/notify/channels/email_channel.hpp"
#include "services/notify/channels/mail_text.hpp"
#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

struct Upload {
  std::string_view rest;
};

std::size_t read_upload(char* buffer, std::size_t size, std::size_t count, void* upload) {
  auto& rest = static_cast<Upload*>(upload)->rest;
  const std::size_t n = std::min(size * count, rest.size());
  std::memcpy(buffer, rest.data(), n);
  rest.remove_prefix(n);
  return n;
}

// Collects the server's refusals.
struct Replies {
  std::string refusals;
  int newest = 0;  // its code
};

std::size_t keep_reply(char* bytes, std::size_t size, std::size_t count, void* replies) {
  auto& kept = *static_cast<Replies*>(replies);
  std::string_view line(bytes, size * count);
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  int code = 0;
  std::from_chars(line.data(), line.data() + std::min<std::size_t>(line.size(), 3), code);
  if (code < 400) return size * count;
  kept.newest = code;
  if (kept.refusals.size() < 400) {
    kept.refusals += (kept.refusals.empty() ? "" : "; ") + one_line(line, 200);
  }
  return size * count;
}

std::string url_of(const EmailSettings& settings) {
  const bool v6 = settings.host.find(':') != std::string::npos;
  return fmt::format("{}://{}{}{}:{}",
                     settings.security == EmailSettings::Security::tls ? "smtps" : "smtp",
                     v6 ? "[" : "", settings.host, v6 ? "]" : "", settings.port);
}

using Outcome = Delivery::Outcome;

// Returns whether the server refused user or password. Such a fault is not the message's, and it
// does not pass by itself (RFC 4954, 6).
bool is_of_login(CURLcode code, int refusal) {
  constexpr std::array kCodes{530, 534, 535, 538};
  return code == CURLE_LOGIN_DENIED ||
         std::find(kCodes.begin(), kCodes.end(), refusal) != kCodes.end();
}

Outcome outcome_of(CURLcode code, int refusal) {
  const bool may_pass = refusal >= 400 && refusal < 500;
  if (is_of_login(code, refusal)) return may_pass ? Outcome::later : Outcome::shut_out;
  return refusal >= 500 && refusal < 600 ? Outcome::refused : Outcome::later;
}

}  // namespace

SmtpChannel::SmtpChannel(EmailSettings settings, Sender sender)
    : settings_(std::move(settings)), sender_(std::move(sender)) {
  if (!settings_.user.empty()) password_ = base::read_secret(settings_.password);
}

Delivery SmtpChannel::send(const Message& message, const std::atomic<bool>& quit) {
  const std::string text = to_crlf(mail_text(message, sender_, settings_));
  Upload upload{text};
  Replies replies;
  CurlRequest request(url_of(settings_), "smtp,smtps", settings_.tls, settings_.time_outs);
  if (settings_.security == EmailSettings::Security::starttls) {
    request.set(CURLOPT_USE_SSL, static_cast<long>(CURLUSESSL_ALL));
  }
  if (!settings_.user.empty()) {
    request.set(CURLOPT_USERNAME, settings_.user);
    request.set(CURLOPT_PASSWORD, password_);
  }
  request.set(CURLOPT_MAIL_FROM, "<" + settings_.from + ">");
  for (const std::string& to : settings_.to) request.append(CURLOPT_MAIL_RCPT, "<" + to + ">");
  request.set(CURLOPT_MAIL_RCPT_ALLLOWFAILS, 1L);
  request.set(CURLOPT_UPLOAD, 1L);
  request.set(CURLOPT_READFUNCTION, &read_upload);
  request.set(CURLOPT_READDATA, &upload);
  request.set(CURLOPT_HEADERFUNCTION, &keep_reply);
  request.set(CURLOPT_HEADERDATA, &replies);
  const CURLcode code = request.perform(quit);
  if (code == CURLE_OK) {
    if (replies.refusals.empty()) return sent(fmt::format("taken by {}", settings_.host));
    return {Outcome::sent_to_some,
            fmt::format("taken by {}, but refused: {}", settings_.host, replies.refusals),
            {}};
  }
  const std::string why = fmt::format("{}{}{}", request.error(code),
                                      replies.refusals.empty() ? "" : ": ", replies.refusals);
  return {outcome_of(code, replies.newest), why, {}};
}

}  // namespace loopwarden::notify
