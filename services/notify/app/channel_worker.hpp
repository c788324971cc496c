// SPDX-License-Identifier: Apache-2.0
// Sends the messages of one channel, one after the other, on its own thread.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>

#include "base/back_off.hpp"
#include "services/notify/channels/channel.hpp"
#include "services/notify/picture/picture_maker.hpp"
#include "services/notify/store/outbox.hpp"
#include "base/thread.hpp"

namespace loopwarden::notify {

inline constexpr base::BackOff kBackOff{.first = std::chrono::seconds(2),
                                        .longest = std::chrono::minutes(15)};
inline constexpr std::int64_t kGiveUp_ms = 24LL * 3600 * 1000;  // after the message was made

// Returns the new state of `message` after `delivery`. `chance` from 0 to 1 shortens the pause
// before the next attempt.
Attempt judge(const Delivery& delivery, const Message& message, std::int64_t now_ms, double chance);

class ChannelWorker {
 public:
  // `pictures`: null if the channel's messages have no pictures.
  ChannelWorker(std::string name, std::unique_ptr<Channel> channel, Outbox& outbox,
                PictureMaker* pictures);
  ChannelWorker(const ChannelWorker&) = delete;
  ChannelWorker& operator=(const ChannelWorker&) = delete;
  ~ChannelWorker() { stop_for(std::chrono::milliseconds(0)); }

  void start();
  // Reports a new message to the thread.
  void wake();
  void ask_to_end();
  // Ends an attempt under way. Its message is sent again after the next start. Returns false if the
  // thread still hangs.
  bool stop_for(std::chrono::milliseconds patience);

  const std::string& name() const noexcept { return name_; }
  // Returns why the newest attempt failed, or an empty string if it succeeded.
  std::string trouble() const;

 private:
  void run();
  std::optional<Message> next();
  void wait();
  void send(Message message);
  void tell(const Message& message) const;
  Delivery attempt(const Message& message);

  std::string name_;
  std::unique_ptr<Channel> channel_;
  Outbox& outbox_;
  PictureMaker* pictures_;
  std::mt19937_64 random_{std::random_device{}()};
  std::optional<Attempt> last_;  // not on the disk yet
  bool shut_out_ = false;        // until the next start, which reads user and password again

  std::atomic<bool> quit_{false};
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool woken_ = true;
  std::string trouble_;
  base::Thread thread_;
};

}  // namespace loopwarden::notify
