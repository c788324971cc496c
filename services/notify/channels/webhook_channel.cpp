// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/webhook_channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.hpp"
#include "base/digest/digest.hpp"
#include "services/notify/channels/curl_request.hpp"
#include "services/notify/channels/mail_text.hpp"

namespace loopwarden::notify {
namespace {

using nlohmann::json;

constexpr std::int64_t kLongestWait = 3'600'000;  // ms, whatever the other side asks for

// Ignores the body of the answer: only the status code is evaluated.
std::size_t drop_answer(char* bytes, std::size_t size, std::size_t count, void* unused) {
  static_cast<void>(bytes);
  static_cast<void>(unused);
  return size * count;
}

bool is_final(long response) {
  constexpr long kTimeout = 408;
  constexpr long kTooEarly = 425;
  constexpr long kTooMany = 429;
  const bool client_error = response >= 400 && response < 500;
  return client_error && response != kTimeout && response != kTooEarly && response != kTooMany;
}

Delivery judge(long response, CURL* handle) {
  if (response >= 200 && response < 300) return sent(fmt::format("answered {}", response));
  if (is_final(response)) return refused(fmt::format("refused with {}", response));
  Delivery delivery = later(fmt::format("answered {}", response));
  curl_off_t seconds = 0;
  if (curl_easy_getinfo(handle, CURLINFO_RETRY_AFTER, &seconds) == CURLE_OK && seconds > 0) {
    delivery.wait_ms = std::min<std::int64_t>(seconds, kLongestWait / 1000) * 1000;
  }
  return delivery;
}

}  // namespace

std::string webhook_body(const Message& message, const Sender& sender) {
  json events = json::array();
  for (const Event& event : message.events) {
    json one = to_json(event);
    one["time"] = rfc3339(event.utc_ms);
    one["alarm_text"] = alarm_words(event.name());
    const std::string page = page_of(event, sender);
    one["page"] = page.empty() ? json(nullptr) : json(page);
    events.push_back(std::move(one));
  }
  for (const Picture& picture : message.pictures) {
    events.at(picture.event)["picture"] = base64(picture.png);
  }
  json counts = json::object();
  for (std::size_t i = 0; i < message.counts.size(); ++i) {
    counts[to_text(static_cast<Change>(i))] = message.counts.at(i);
  }
  return dump({{"version", 1},
               {"id", message.id},
               {"box", sender.box},
               {"made", rfc3339(message.made_ms)},
               {"text", headline(message, sender)},
               {"count", message.count()},
               {"counts", std::move(counts)},
               {"events", std::move(events)},
               {"lost", message.lost},
               {"attempt", message.attempts},
               {"perhaps_twice", message.perhaps_twice},
               {"test", message.test}});
}

std::string webhook_signature(const std::string& key, std::int64_t unix_s,
                              const std::string& body) {
  return "sha256=" + base::hmac_sha256_hex(key, fmt::format("{}.{}", unix_s, body));
}

WebhookChannel::WebhookChannel(WebhookSettings settings, Sender sender)
    : settings_(std::move(settings)), sender_(std::move(sender)) {
  if (settings_.url_secret.given()) settings_.url = base::read_secret(settings_.url_secret);
  if (settings_.key.given()) key_ = base::read_secret(settings_.key);
}

Delivery WebhookChannel::send(const Message& message, const std::atomic<bool>& quit) {
  const std::string body = webhook_body(message, sender_);
  const std::int64_t now_s = base::utc_ms() / 1000;
  CurlRequest request(settings_.url, "http,https", settings_.tls, settings_.time_outs);
  const auto header = [&](const std::string& line) { request.append(CURLOPT_HTTPHEADER, line); };
  header("Content-Type: application/json");
  header("Expect:");  // the small body is sent at once
  header(fmt::format("X-Loopwarden-Timestamp: {}", now_s));
  header(fmt::format("X-Loopwarden-Delivery: {}.{}.{}", base::sha256_hex(sender_.box).substr(0, 16),
                     message.made_ms, message.id));
  if (!key_.empty()) {
    header("X-Loopwarden-Signature: " + webhook_signature(key_, now_s, body));
  }
  request.set(CURLOPT_USERAGENT, "loopwarden-notify");
  request.set(CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  request.set(CURLOPT_POSTFIELDS, body);
  request.set(CURLOPT_WRITEFUNCTION, &drop_answer);
  const CURLcode code = request.perform(quit);
  if (code != CURLE_OK) return later(request.error(code));
  return judge(request.response_code(), request.handle());
}

}  // namespace loopwarden::notify
