// SPDX-License-Identifier: Apache-2.0
#include "services/notify/store/outbox.hpp"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {
namespace {

using nlohmann::json;
using sqlite::Statement;

constexpr const char* kTables = R"(
CREATE TABLE picture(
  loop TEXT NOT NULL, alarm TEXT NOT NULL, state TEXT NOT NULL, unacknowledged INTEGER NOT NULL,
  times_raised INTEGER NOT NULL, worst_percent REAL, since_ms INTEGER NOT NULL,
  reminded_ms INTEGER NOT NULL, PRIMARY KEY(loop, alarm)) WITHOUT ROWID;
CREATE TABLE waiting(
  id INTEGER PRIMARY KEY AUTOINCREMENT, channel TEXT NOT NULL, since_ms INTEGER NOT NULL,
  event TEXT NOT NULL);
CREATE INDEX waiting_channel ON waiting(channel, id);
CREATE TABLE lost(channel TEXT PRIMARY KEY, events INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE message(
  id INTEGER PRIMARY KEY AUTOINCREMENT, channel TEXT NOT NULL, made_ms INTEGER NOT NULL,
  content TEXT NOT NULL, state INTEGER NOT NULL, attempts INTEGER NOT NULL DEFAULT 0,
  perhaps_twice INTEGER NOT NULL DEFAULT 0, again_ms INTEGER NOT NULL DEFAULT 0,
  at_ms INTEGER NOT NULL DEFAULT 0, result TEXT NOT NULL DEFAULT '');
CREATE INDEX message_state ON message(channel, state, id);
)";

std::string content_of(const Message& message) {
  json events = json::array();
  for (const Event& event : message.events) events.push_back(to_json(event));
  return dump({{"events", events}, {"counts", message.counts}, {"lost", message.lost}});
}

void read_content(const std::string& text, Message& message) {
  const json content = json::parse(text);
  for (const json& event : content.at("events")) message.events.push_back(event_from(event));
  content.at("counts").get_to(message.counts);
  content.at("lost").get_to(message.lost);
}

constexpr sqlite::Schema kSchema{"file of notifications", 0x4C574E31 /* "LWN1" */, 1, kTables};

sqlite::Database opened(const std::filesystem::path& file, sqlite::Access access) {
  try {
    sqlite::Database database(file, access, std::chrono::seconds(5));
    access == sqlite::Access::write ? database.adopt(kSchema, sqlite::Sync::full)
                                    : database.demand_schema(kSchema);
    return database;
  } catch (const sqlite::Error& e) {
    if (e.other_version()) throw;  // it names the file
    throw sqlite::Error(e.kind(), fmt::format("{}: {}", file.string(), e.what()));
  }
}

// Also true if the clock was set back since.
bool is_due(std::int64_t again_ms, std::int64_t now_ms) {
  constexpr std::int64_t kLongestPause = 2LL * 3600 * 1000;  // ms
  return again_ms <= now_ms || again_ms > now_ms + kLongestPause;
}

}  // namespace

const char* to_text(MessageState state) noexcept {
  switch (state) {
    case MessageState::queued: return "queued";
    case MessageState::sending: return "sending";
    case MessageState::sent: return "sent";
    case MessageState::failed: break;
  }
  return "failed";
}

// A transaction under the lock: all or nothing, and no other thread takes part.
class Outbox::Transaction {
 public:
  explicit Transaction(Outbox& outbox) : lock_(outbox.mutex_), transaction_(outbox.database_) {}
  void commit() { transaction_.commit(); }

 private:
  std::lock_guard<std::mutex> lock_;
  sqlite::Transaction transaction_;
};

Outbox::Outbox(const std::filesystem::path& file, sqlite::Access access)
    : database_(opened(file, access)) {
  if (access == sqlite::Access::read) return;
  // Messages that were being sent when the program ended.
  database_.execute(
      "UPDATE message SET state = 0, perhaps_twice = 1, again_ms = 0 WHERE state = 1");
}

Pictures Outbox::pictures() {
  const std::lock_guard lock(mutex_);
  Pictures pictures;
  Statement read(database_, "SELECT * FROM picture");
  while (read.step()) {
    pictures[{read.text(0), read.text(1)}] = {.state = read.text(2),
                                              .unacknowledged = read.integer(3) != 0,
                                              .times_raised = read.integer(4),
                                              .worst_percent = read.number_or_null(5),
                                              .since_ms = read.integer(6),
                                              .reminded_ms = read.integer(7)};
  }
  return pictures;
}

std::vector<Waiting> Outbox::waiting(const std::string& channel) {
  Transaction transaction(*this);
  std::vector<Waiting> all;
  std::vector<std::int64_t> unreadable;
  {
    Statement read(database_,
                   "SELECT id, since_ms, event FROM waiting WHERE channel = ? ORDER BY id",
                   channel);
    while (read.step()) {
      try {
        all.push_back({read.integer(0), read.integer(1), event_from(json::parse(read.text(2)))});
      } catch (const json::exception&) {
        unreadable.push_back(read.integer(0));
      }
    }
  }
  drop_unreadable(channel, unreadable);
  transaction.commit();
  return all;
}

void Outbox::drop_unreadable(const std::string& channel, const std::vector<std::int64_t>& ids) {
  for (const std::int64_t id : ids) {
    Statement(database_, "DELETE FROM waiting WHERE id = ?", id).run();
  }
  if (!ids.empty()) add_lost(channel, static_cast<std::int64_t>(ids.size()));
}

void Outbox::add_lost(const std::string& channel, std::int64_t events) {
  Statement(database_,
            "INSERT INTO lost VALUES(?,?) ON CONFLICT DO UPDATE SET events = events + "
            "excluded.events",
            channel, events)
      .run();
}

std::vector<std::int64_t> Outbox::made_ms(const std::string& channel, std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<std::int64_t> times;
  Statement read(database_,
                 "SELECT made_ms FROM message WHERE channel = ? ORDER BY id DESC LIMIT ?", channel,
                 static_cast<std::int64_t>(most));
  while (read.step()) times.push_back(read.integer(0));
  return times;
}

std::map<std::string, std::vector<Waiting>> Outbox::post(const Step& step, std::int64_t now_ms) {
  Transaction transaction(*this);
  for (const auto& [key, picture] : step.changed) {
    Statement(database_, "INSERT OR REPLACE INTO picture VALUES(?,?,?,?,?,?,?,?)", key.first,
              key.second, picture.state, picture.unacknowledged, picture.times_raised,
              picture.worst_percent, picture.since_ms, picture.reminded_ms)
        .run();
  }
  for (const AlarmKey& key : step.forgotten) {
    Statement(database_, "DELETE FROM picture WHERE loop = ? AND alarm = ?", key.first, key.second)
        .run();
  }
  std::map<std::string, std::vector<Waiting>> added;
  for (const Post& post : step.posts) {
    added[post.channel].push_back({add_waiting(post, now_ms), now_ms, post.event});
  }
  for (const auto& [channel, events] : added) bound_waiting(channel);
  transaction.commit();
  return added;
}

std::int64_t Outbox::add_waiting(const Post& post, std::int64_t now_ms) {
  Statement(database_, "INSERT INTO waiting(channel, since_ms, event) VALUES(?,?,?)", post.channel,
            now_ms, dump(to_json(post.event)))
      .run();
  return database_.last_row();
}

void Outbox::bound_waiting(const std::string& channel) {
  Statement count(database_, "SELECT count(*) FROM waiting WHERE channel = ?", channel);
  count.step();
  const std::int64_t excess = count.integer(0) - static_cast<std::int64_t>(kMostWaiting);
  if (excess <= 0) return;
  Statement(database_,
            "DELETE FROM waiting WHERE id IN "
            "(SELECT id FROM waiting WHERE channel = ? ORDER BY id LIMIT ?)",
            channel, excess)
      .run();
  add_lost(channel, excess);
}

std::int64_t Outbox::take_lost(const std::string& channel) {
  Statement read(database_, "SELECT events FROM lost WHERE channel = ?", channel);
  if (!read.step()) return 0;
  const std::int64_t lost = read.integer(0);
  Statement(database_, "DELETE FROM lost WHERE channel = ?", channel).run();
  return lost;
}

void Outbox::add_message(const Message& message, std::int64_t lost) {
  Message whole = message;
  whole.lost += lost;
  Statement(database_, "INSERT INTO message(channel, made_ms, content, state) VALUES(?,?,?,0)",
            whole.channel, whole.made_ms, content_of(whole))
      .run();
}

void Outbox::queue(std::span<const Message> messages, std::span<const std::int64_t> waiting_ids) {
  if (messages.empty()) return;
  Transaction transaction(*this);
  for (const std::int64_t id : waiting_ids) {
    Statement(database_, "DELETE FROM waiting WHERE id = ?", id).run();
  }
  std::int64_t lost = take_lost(messages.front().channel);
  for (const Message& message : messages) add_message(message, std::exchange(lost, 0));
  Statement(database_,
            "DELETE FROM message WHERE id <= (SELECT max(id) FROM message) - ? AND state >= 2",
            kMostKept)
      .run();
  transaction.commit();
}

std::size_t Outbox::queued(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  Statement count(database_, "SELECT count(*) FROM message WHERE channel = ? AND state < 2",
                  channel);
  count.step();
  return static_cast<std::size_t>(count.integer(0));
}

void Outbox::keep(const Attempt& attempt) {
  Statement(database_,
            "UPDATE message SET state = ?, at_ms = ?, again_ms = ?, result = ? WHERE id = ?",
            static_cast<std::int64_t>(attempt.state), attempt.at_ms, attempt.again_ms,
            attempt.result, attempt.id)
      .run();
}

std::optional<Message> Outbox::next(const std::string& channel, std::int64_t now_ms,
                                    const std::optional<Attempt>& last) {
  Transaction transaction(*this);
  if (last) keep(*last);
  std::optional<Message> message;
  {
    // In the order in which they were made: the changes of one alarm must keep their order.
    Statement read(database_,
                   "SELECT id, made_ms, content, attempts, perhaps_twice, again_ms FROM message "
                   "WHERE channel = ? AND state = 0 ORDER BY id",
                   channel);
    while (!message && read.step() && is_due(read.integer(5), now_ms)) {
      message.emplace();
      message->id = read.integer(0);
      message->channel = channel;
      message->made_ms = read.integer(1);
      message->attempts = read.integer(3) + 1;
      message->perhaps_twice = read.integer(4) != 0;
      try {
        read_content(read.text(2), *message);
      } catch (const json::exception& e) {
        fail_unreadable(message->id, e.what());
        message.reset();
      }
    }
  }
  if (message) {
    Statement(database_, "UPDATE message SET state = 1, attempts = ?, at_ms = ? WHERE id = ?",
              message->attempts, now_ms, message->id)
        .run();
  }
  transaction.commit();
  return message;
}

void Outbox::fail_unreadable(std::int64_t id, const std::string& why) {
  Statement(database_, "UPDATE message SET state = 3, result = ? WHERE id = ?",
            fmt::format("it can't be read: {}", why), id)
      .run();
}

void Outbox::settle(const Attempt& last) {
  Transaction transaction(*this);
  keep(last);
  transaction.commit();
}

void Outbox::give_up_others(const std::vector<std::string>& channels) {
  Transaction transaction(*this);
  std::set<std::string> others;
  Statement read(database_,
                 "SELECT channel FROM waiting UNION SELECT channel FROM message WHERE state = 0");
  while (read.step()) others.insert(read.text(0));
  for (const std::string& channel : channels) others.erase(channel);
  for (const std::string& other : others) {
    Statement(database_, "DELETE FROM waiting WHERE channel = ?", other).run();
    Statement(database_,
              "UPDATE message SET state = 3, result = 'the channel is no longer configured' "
              "WHERE channel = ? AND state = 0",
              other)
        .run();
  }
  transaction.commit();
}

std::optional<std::int64_t> Outbox::due_ms(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  Statement read(database_,
                 "SELECT again_ms FROM message WHERE channel = ? AND state = 0 ORDER BY id LIMIT 1",
                 channel);
  if (!read.step()) return std::nullopt;
  return read.integer(0);
}

std::vector<MessageRow> Outbox::newest(std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<MessageRow> rows;
  Statement read(database_,
                 "SELECT id, channel, made_ms, content, state, attempts, perhaps_twice, at_ms, "
                 "result FROM message ORDER BY id DESC LIMIT ?",
                 static_cast<std::int64_t>(most));
  while (read.step()) {
    MessageRow& row = rows.emplace_back();
    row.message.id = read.integer(0);
    row.message.channel = read.text(1);
    row.message.made_ms = read.integer(2);
    try {
      read_content(read.text(3), row.message);
    } catch (const json::exception&) {
      row.message.events.clear();
      row.message.counts = {};
    }
    row.state = static_cast<MessageState>(read.integer(4));
    row.message.attempts = read.integer(5);
    row.message.perhaps_twice = read.integer(6) != 0;
    row.at_ms = read.integer(7);
    row.result = read.text(8);
  }
  return rows;
}

}  // namespace loopwarden::notify
