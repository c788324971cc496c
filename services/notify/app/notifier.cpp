// SPDX-License-Identifier: Apache-2.0
#include "services/notify/app/notifier.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <span>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::notify {
namespace {

using std::chrono::milliseconds;

std::vector<Message> messages_of(const ChannelRule& rule, std::span<const Event> events,
                                 std::int64_t now_ms) {
  if (!rule.one_each) return {message_of(rule.name, events, now_ms)};
  std::vector<Message> messages;
  for (std::size_t i = 0; i < events.size(); ++i) {
    messages.push_back(message_of(rule.name, events.subspan(i, 1), now_ms));
  }
  return messages;
}

// `which`: positions in rising order.
void take_out(std::vector<Waiting>& waiting, const std::vector<std::size_t>& which) {
  std::vector<Waiting> kept;
  kept.reserve(waiting.size() - which.size());
  auto next = which.begin();
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (next != which.end() && *next == i) {
      ++next;
    } else {
      kept.push_back(std::move(waiting[i]));
    }
  }
  waiting = std::move(kept);
}

}  // namespace

std::string outbox_file(const std::string& state_directory) {
  return (std::filesystem::path(state_directory) / "notifications.sqlite").string();
}

std::unique_ptr<Outbox> open_outbox(const std::string& state_directory) {
  const std::string file = outbox_file(state_directory);
  return sqlite::open_or_replace(
      file, base::utc_ms(), [&] { return std::make_unique<Outbox>(file); },
      [](const sqlite::Error& e, const std::filesystem::path& aside) {
        spdlog::error("{}; kept as {}. A new file is used: active alarms are reported again",
                      e.what(), aside.string());
      });
}

Notifier::Notifier(NotifyConfig config)
    : config_(std::move(config)),
      outbox_(open_outbox(config_.state_directory)),
      rules_(config_.rules, outbox_->pictures()),
      pictures_(config_.socket, config_.zone),
      watcher_(config_.socket) {
  open_lines();
}

void Notifier::open_lines() {
  const Sender sender{config_.box, config_.zone, config_.page_url};
  std::vector<std::string> names;
  for (const ChannelRule& rule : config_.rules.channels) names.push_back(rule.name);
  outbox_->give_up_others(names);
  for (std::size_t i = 0; i < config_.channels.size(); ++i) {
    const ChannelRule& rule = config_.rules.channels[i];
    Line& line = lines_[rule.name];
    line.rule = rule;
    line.waiting = outbox_->waiting(rule.name);
    std::vector<std::int64_t> made =
        outbox_->made_ms(rule.name, static_cast<std::size_t>(rule.most_per_hour));
    line.made_ms.assign(made.rbegin(), made.rend());
    line.worker = std::make_unique<ChannelWorker>(
        rule.name, open_channel(config_.channels[i], sender), *outbox_,
        config_.channels[i].picture ? &pictures_ : nullptr);
  }
}

void Notifier::start() {
  for (auto& [name, line] : lines_) line.worker->start();
  watcher_.start();
}

void Notifier::step() {
  const std::int64_t now_ms = base::utc_ms();
  try {
    look(now_ms);
    for (auto& [name, line] : lines_) make_messages(line, now_ms);
    if (!trouble_.empty()) spdlog::warn("the disk takes it again");
    trouble_.clear();
  } catch (const sqlite::Error& e) {
    // The snapshot is kept. Its changes are reported once they can be stored.
    if (trouble_ != e.what()) spdlog::error("not stored: {}", e.what());
    trouble_ = e.what();
  }
}

void Notifier::look(std::int64_t now_ms) {
  if (std::optional<Snapshot> snapshot = watcher_.take()) {
    if (unstored_) keep_reasons(*snapshot, std::move(*unstored_));
    unstored_ = std::move(snapshot);
  }
  if (unstored_) {
    store(rules_.read(unstored_->alarms, unstored_->journal, now_ms), now_ms);
    newest_ = std::move(unstored_->alarms);
    unstored_.reset();
  }
  store(rules_.silence(watcher_.silent().count(), now_ms), now_ms);
}

void Notifier::store(const Step& step, std::int64_t now_ms) {
  if (step.empty()) return;
  for (auto& [channel, events] : outbox_->post(step, now_ms)) {
    std::vector<Waiting>& waiting = lines_.at(channel).waiting;
    std::move(events.begin(), events.end(), std::back_inserter(waiting));
    if (waiting.size() > Outbox::kMostWaiting) {
      const auto excess = static_cast<std::ptrdiff_t>(waiting.size() - Outbox::kMostWaiting);
      waiting.erase(waiting.begin(), waiting.begin() + excess);
    }
  }
  rules_.accept(step);
}

void Notifier::make_messages(Line& line, std::int64_t now_ms) {
  if (line.waiting.empty()) return;
  const std::vector<std::int64_t> made(line.made_ms.begin(), line.made_ms.end());
  std::vector<std::size_t> which =
      ready(line.rule, config_.rules.quiet_hours, line.waiting, made, now_ms);
  if (which.empty()) return;
  // While a message is being sent, or waits for a dead channel, events gather for the next one.
  const std::size_t queued = outbox_->queued(line.rule.name);
  const std::size_t most = line.rule.one_each ? Outbox::kMostQueued : 1;
  if (queued >= most) return;
  if (line.rule.one_each) which.resize(std::min(which.size(), most - queued));

  std::vector<Event> events;
  std::vector<std::int64_t> ids;
  for (const std::size_t i : which) {
    events.push_back(line.waiting[i].event);
    if (!line.rule.one_each) bring_up_to_date(events.back(), newest_);
    ids.push_back(line.waiting[i].id);
  }
  const std::vector<Message> messages = messages_of(line.rule, events, now_ms);
  outbox_->queue(messages, ids);
  take_out(line.waiting, which);
  line.made_ms.insert(line.made_ms.end(), messages.size(), now_ms);
  while (line.made_ms.size() > static_cast<std::size_t>(line.rule.most_per_hour)) {
    line.made_ms.pop_front();
  }
  line.worker->wake();
}

bool Notifier::stop_for(milliseconds patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  const auto left = [&] {
    return std::max(milliseconds(0), std::chrono::duration_cast<milliseconds>(
                                         until - std::chrono::steady_clock::now()));
  };
  for (auto& [name, line] : lines_) line.worker->ask_to_end();
  bool ended = watcher_.stop_for(left());
  for (auto& [name, line] : lines_) ended = line.worker->stop_for(left()) && ended;
  ended = pictures_.stop_for(left()) && ended;
  return ended;
}

std::string Notifier::status() const {
  const std::string error = watcher_.error();
  std::string text = error.empty() ? "watches the daemon" : error;
  for (const auto& [name, line] : lines_) {
    const std::string trouble = line.worker->trouble();
    if (!trouble.empty()) text += fmt::format("; {}: {}", name, trouble);
    if (!line.waiting.empty()) text += fmt::format("; {}: {} wait", name, line.waiting.size());
  }
  if (!trouble_.empty()) text += fmt::format("; not stored: {}", trouble_);
  return text;
}

}  // namespace loopwarden::notify
