// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <string_view>
#include <utility>

#include "fleet/notify/channels/curl_request.hpp"
#include "fleet/notify/channels/email_channel.hpp"
#include "fleet/notify/channels/mail_text.hpp"
#include "fleet/notify/text/one_line.hpp"

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

// What the server said: the newest line, and the refusals.
struct Replies {
  std::string last;
  std::string refusals;
};

std::size_t keep_reply(char* bytes, std::size_t size, std::size_t count, void* replies) {
  auto& kept = *static_cast<Replies*>(replies);
  std::string_view line(bytes, size * count);
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  kept.last = one_line(line, 200);
  const bool refusal = line.starts_with('4') || line.starts_with('5');
  if (refusal && kept.refusals.size() < 400) {
    kept.refusals += (kept.refusals.empty() ? "" : "; ") + kept.last;
  }
  return size * count;
}

std::string url_of(const EmailSettings& settings) {
  const bool v6 = settings.host.find(':') != std::string::npos;
  return fmt::format("{}://{}{}{}:{}",
                     settings.security == EmailSettings::Security::tls ? "smtps" : "smtp",
                     v6 ? "[" : "", settings.host, v6 ? "]" : "", settings.port);
}

// A wrong password is no fault of the message: it is tried again until somebody has seen to it.
bool is_final(CURLcode code, long response) {
  return code != CURLE_LOGIN_DENIED && response >= 500 && response < 600;
}

}  // namespace

SmtpChannel::SmtpChannel(EmailSettings settings, Sender sender)
    : settings_(std::move(settings)), sender_(std::move(sender)) {
  if (!settings_.user.empty()) password_ = read_secret(settings_.password);
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
    return sent(replies.refusals.empty() ? fmt::format("taken by {}", settings_.host)
                                         : fmt::format("taken by {}, but refused: {}",
                                                       settings_.host, replies.refusals));
  }
  const std::string why = fmt::format("{}{}{}", request.error(code),
                                      replies.refusals.empty() ? "" : ": ", replies.refusals);
  return is_final(code, request.response_code()) ? refused(why) : later(why);
}

}  // namespace loopwarden::notify
