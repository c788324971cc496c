// SPDX-License-Identifier: Apache-2.0
#include "services/notify/app/channel_worker.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::notify {
namespace {

// Libraries for names and TLS need more than the loops' threads do.
constexpr std::size_t kStackBytes = 1024UL * 1024UL;
constexpr std::int64_t kLongestSleep = 60'000;  // ms
// Pause between two attempts to reach the disk.
constexpr std::chrono::milliseconds kDiskPause{2000};

}  // namespace

Attempt judge(const Delivery& delivery, const Message& message, std::int64_t now_ms,
              double chance) {
  Attempt attempt{.id = message.id, .at_ms = now_ms, .result = delivery.text};
  if (delivery.is_sent()) return attempt;
  if (delivery.outcome == Delivery::Outcome::shut_out) {
    // Due as soon as the program is started again.
    attempt.state = MessageState::queued;
    attempt.result += "; the channel sends again after the next start";
    return attempt;
  }
  attempt.state = MessageState::failed;
  if (delivery.outcome == Delivery::Outcome::refused) return attempt;
  if (now_ms - message.made_ms >= kGiveUp_ms) {
    attempt.result += fmt::format("; given up after {} attempts", message.attempts);
    return attempt;
  }
  attempt.state = MessageState::queued;
  const std::int64_t pause_ms = kBackOff.pause(message.attempts, chance).count();
  attempt.again_ms = now_ms + std::max(pause_ms, delivery.wait_ms.value_or(0));
  return attempt;
}

ChannelWorker::ChannelWorker(std::string name, std::unique_ptr<Channel> channel, Outbox& outbox,
                             PictureMaker* pictures)
    : name_(std::move(name)), channel_(std::move(channel)), outbox_(outbox), pictures_(pictures) {}

void ChannelWorker::start() {
  thread_.start({.name = ("lw-" + name_).substr(0, 15), .stack_bytes = kStackBytes},
                [this] { run(); });
}

void ChannelWorker::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  wake_.notify_all();
}

void ChannelWorker::ask_to_end() {
  quit_ = true;
  wake();
}

bool ChannelWorker::stop_for(std::chrono::milliseconds patience) {
  ask_to_end();
  return thread_.join_for(patience);
}

std::string ChannelWorker::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void ChannelWorker::run() {
  while (!quit_) {
    try {
      std::optional<Message> message = next();
      message ? send(std::move(*message)) : wait();
    } catch (const std::exception& e) {
      spdlog::error("channel {}: {}", name_, e.what());
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kDiskPause, [this] { return quit_.load(); });
    }
  }
  // Stores the last result. Without it the next start would send the message again.
  try {
    if (last_) outbox_.settle(*last_);
  } catch (const std::exception& e) {
    spdlog::error("channel {}: {}", name_, e.what());
  }
}

std::optional<Message> ChannelWorker::next() {
  std::optional<Message> message;
  if (!shut_out_) {
    message = outbox_.next(name_, base::utc_ms(), last_);
  } else if (last_) {
    outbox_.settle(*last_);
  }
  last_.reset();
  return message;
}

void ChannelWorker::wait() {
  const std::optional<std::int64_t> due = shut_out_ ? std::nullopt : outbox_.due_ms(name_);
  const std::int64_t left_ms =
      std::clamp<std::int64_t>(due ? *due - base::utc_ms() : kLongestSleep, 1, kLongestSleep);
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, std::chrono::milliseconds(left_ms), [this] { return woken_; });
  woken_ = false;
}

Delivery ChannelWorker::attempt(const Message& message) {
  try {
    return channel_->send(message, quit_);
  } catch (const std::exception& e) {
    return later(e.what());
  }
}

void ChannelWorker::send(Message message) {
  if (pictures_ != nullptr) message.pictures = pictures_->of(message);
  Delivery delivery = attempt(message);
  if (delivery.outcome == Delivery::Outcome::refused && !message.pictures.empty()) {
    // The message may be too large with its pictures.
    message.pictures.clear();
    delivery = attempt(message);
  }
  const double chance = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
  last_ = judge(delivery, message, base::utc_ms(), chance);
  shut_out_ = delivery.outcome == Delivery::Outcome::shut_out;
  const bool good = delivery.outcome == Delivery::Outcome::sent;
  if (good) {
    spdlog::info("channel {}: message {} sent: {}", name_, message.id, last_->result);
  } else {
    tell(message);
  }
  const std::lock_guard lock(mutex_);
  trouble_ = good ? std::string() : last_->result;
}

// Logs the last result: a fault that may pass as a warning, any other as an error.
void ChannelWorker::tell(const Message& message) const {
  const bool may_pass = last_->state == MessageState::queued && !shut_out_;
  const char* what = last_->state == MessageState::sent     ? "did not go to all"
                     : last_->state == MessageState::failed ? "failed"
                                                            : "waits";
  spdlog::log(may_pass ? spdlog::level::warn : spdlog::level::err, "channel {}: message {} {}: {}",
              name_, message.id, what, last_->result);
}

}  // namespace loopwarden::notify
