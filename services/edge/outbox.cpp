// SPDX-License-Identifier: Apache-2.0
#include "services/edge/outbox.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>

namespace loopwarden::edge {
namespace {

constexpr std::size_t kMostAtOnce = 500;  // reports per transaction

}  // namespace

void Outbox::sent(Report report, Clock::time_point now) {
  sent_.emplace_back(now, std::move(report));
  if (sent_.size() > kMostInMemory) sent_.pop_front();
}

void Outbox::keep(Report report) {
  for_disk_.push_back(std::move(report));
  if (for_disk_.size() <= kMostInMemory) return;
  for_disk_.pop_front();
  ++dropped_;
}

void Outbox::lost(Clock::time_point now) {
  for (auto& [when, report] : sent_) {
    if (now - when <= window_) keep(std::move(report));
  }
  sent_.clear();
  replayed_.clear();
  replayed_up_to_ = 0;
  flush();
}

// Writes a few reports at a time: a full disk may never regain the room for all of them.
void Outbox::flush() {
  if (for_disk_.empty()) return;
  try {
    while (!for_disk_.empty()) {
      const auto some = static_cast<std::ptrdiff_t>(std::min(kMostAtOnce, for_disk_.size()));
      store_.append({for_disk_.begin(), for_disk_.begin() + some});
      for_disk_.erase(for_disk_.begin(), for_disk_.begin() + some);
    }
    if (disk_refuses_) spdlog::info("store: accepts reports again");
    disk_refuses_ = false;
  } catch (const sqlite::Error& e) {
    if (!disk_refuses_) spdlog::error("store: {}; reports wait in memory", e.what());
    disk_refuses_ = true;
  }
}

void Outbox::tidy(Clock::time_point now) {
  flush();
  while (!sent_.empty() && now - sent_.front().first > window_) sent_.pop_front();
  std::int64_t arrived = 0;
  while (!replayed_.empty() && now - replayed_.front().first > window_) {
    arrived = replayed_.front().second;
    replayed_.pop_front();
  }
  if (arrived == 0) return;
  try {
    store_.remove_up_to(arrived);
  } catch (const sqlite::Error& e) {
    // They are sent once more after the next loss; hosts recognise them by their time.
    spdlog::warn("store: {}; sent reports stay in it", e.what());
  }
}

void Outbox::replay(std::size_t most, Clock::time_point now,
                    const std::function<bool(const Report&)>& send) {
  if (store_.waiting() == 0) return;
  try {
    for (const Store::Row& row : store_.read(replayed_up_to_, most)) {
      if (!send(row.report)) return;
      replayed_up_to_ = row.id;
      replayed_.emplace_back(now, row.id);
    }
  } catch (const sqlite::Error& e) {
    spdlog::error("store: {}", e.what());
  }
}

std::uint64_t Outbox::waiting() const noexcept {
  // The store may have dropped rows that were sent again.
  const std::uint64_t again = std::min<std::uint64_t>(replayed_.size(), store_.waiting());
  return store_.waiting() - again + for_disk_.size();
}

}  // namespace loopwarden::edge
