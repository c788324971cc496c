// SPDX-License-Identifier: Apache-2.0
// Stores in one SQLite database the alarms as last reported, events that wait for their message,
// and messages with their results.
//
// Each call is one transaction that is on the disk when it returns (WAL, synchronous=FULL). A
// message is marked before it is sent and again afterwards. If the program is killed in between,
// the message may or may not have left. It is then sent again under its old number, and states
// that. Every other message is sent exactly once.
//
// A message or waiting event that can't be read is not sent and reports so. No other is affected.
//
// Limits: at most kMostWaiting events per channel (the oldest are dropped and counted), kMostQueued
// messages per channel (the caller makes no more) and kMostKept finished messages.
//
// Any thread may call it. Calls wait for each other and for the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/notify/rules/dispatch.hpp"
#include "services/notify/rules/watch_rules.hpp"
#include "base/sqlite/sqlite.hpp"

namespace loopwarden::notify {

enum class MessageState : std::uint8_t { queued, sending, sent, failed };
const char* to_text(MessageState state) noexcept;

// The result of one attempt.
struct Attempt {
  std::int64_t id = 0;
  MessageState state = MessageState::sent;  // queued: to be tried again
  std::int64_t at_ms = 0;
  std::int64_t again_ms = 0;  // when it is tried again, if it is
  std::string result;         // in words
};

struct MessageRow {
  Message message;
  MessageState state = MessageState::queued;
  std::int64_t at_ms = 0;  // of the last attempt
  std::string result;
};

class Outbox {
 public:
  static constexpr std::size_t kMostWaiting = 10'000;
  static constexpr std::size_t kMostQueued = 100;
  static constexpr std::int64_t kMostKept = 20'000;

  // Opens or makes the file. With `read`, it opens a file that another process writes. All
  // functions throw sqlite::Error.
  explicit Outbox(const std::filesystem::path& file, sqlite::Access access = sqlite::Access::write);
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  Pictures pictures();
  // Returns the waiting events of the channel, oldest first.
  std::vector<Waiting> waiting(const std::string& channel);
  // Returns when its newest messages were made.
  std::vector<std::int64_t> made_ms(const std::string& channel, std::size_t most);

  // Stores a step. Returns the events that now wait in addition, by channel. If a channel has too
  // many, its oldest are dropped.
  std::map<std::string, std::vector<Waiting>> post(const Step& step, std::int64_t now_ms);
  // Turns these waiting events into those messages of one channel. The first message states how
  // many events were lost before.
  void queue(std::span<const Message> messages, std::span<const std::int64_t> waiting_ids);
  std::size_t queued(const std::string& channel);

  // Stores the result of the last attempt and returns the next due message. Its attempts include
  // the one that now begins.
  std::optional<Message> next(const std::string& channel, std::int64_t now_ms,
                              const std::optional<Attempt>& last);
  // Stores the result of the last attempt before the end.
  void settle(const Attempt& last);
  // Returns when the channel's next message is due; nullopt if no message is queued.
  std::optional<std::int64_t> due_ms(const std::string& channel);

  // Gives up messages and events of all channels except these.
  void give_up_others(const std::vector<std::string>& channels);

  // Returns the newest messages, newest first.
  std::vector<MessageRow> newest(std::size_t most);

 private:
  class Transaction;
  std::int64_t add_waiting(const Post& post, std::int64_t now_ms);
  void bound_waiting(const std::string& channel);
  std::int64_t take_lost(const std::string& channel);
  void keep(const Attempt& attempt);
  void fail_unreadable(std::int64_t id, const std::string& why);
  void add_lost(const std::string& channel, std::int64_t events);
  void drop_unreadable(const std::string& channel, const std::vector<std::int64_t>& ids);
  void add_message(const Message& message, std::int64_t lost);

  std::mutex mutex_;
  sqlite::Database database_;
};

}  // namespace loopwarden::notify
