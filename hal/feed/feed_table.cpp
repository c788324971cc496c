// SPDX-License-Identifier: Apache-2.0
#include "hal/feed/feed_table.hpp"

#include <cmath>

namespace loopwarden::hal::feed {
namespace {

void count(Feeder::Counters::Counter& counter) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

// Sets quality and reason of a value that arrived. A word is bad if a number is required.
void judge(const FedValue& fed, bool takes_words, Sample& sample) noexcept {
  sample.quality = fed.quality;
  sample.reason = fed.quality == Quality::good ? Reason::none : fed.reason;
  const bool usable = std::isfinite(fed.value) && (takes_words || !fed.is_word);
  if (sample.quality == Quality::bad || usable) return;
  sample.quality = Quality::bad;
  sample.reason = Reason::not_finite;
}

}  // namespace

Feeder::Put Feeder::put(std::string_view name, const FedValue& value, const Arrival& arrival) {
  const auto found = slots_.find(name);
  if (found == slots_.end()) {
    count(counters_.unknown_names);
    return Put::unknown_name;
  }
  FeedSlot& slot = *found->second;
  const double now_s = static_cast<double>(arrival.now_ns) * 1e-9;
  Sample fresh = slot.fed.sample;
  judge(value, slot.takes_words, fresh);
  const bool good_enough = fresh.quality != Quality::bad;
  if (good_enough) fresh.value = value.value;
  switch (slot.stamps.order(value.stamp_s, now_s)) {
    case StampWatch::Order::older: count(counters_.out_of_order); return Put::out_of_order;
    case StampWatch::Order::same:
      // A quality may change without a new stamp.
      if (fresh.value == slot.fed.sample.value && fresh.quality == slot.fed.sample.quality &&
          fresh.reason == slot.fed.sample.reason) {
        count(counters_.doubled);
        return Put::doubled;
      }
      break;
    case StampWatch::Order::newer: break;
  }
  const double late_s = slot.stamps.take(value.stamp_s, now_s, arrival.utc_s);
  const std::int64_t late_ns = std::llround(late_s * 1e9);
  if (good_enough) {
    fresh.time_ns = arrival.now_ns - late_ns;
    ++fresh.sequence;
  }
  if (!good_enough && slot.source != value.source) {
    const std::lock_guard lock(sources_mutex_);
    slot.source = value.source;
  }
  slot.fed = {.sample = fresh, .late_ns = late_ns};
  slot.newest.publish(slot.fed);
  count(counters_.values);
  if (const auto behind_s = slot.stamps.clock_behind_s()) {
    counters_.clock_behind_s.store(*behind_s, std::memory_order_relaxed);
  }
  return Put::taken;
}

std::string Feeder::source_of(std::string_view name) const {
  const auto found = slots_.find(name);
  if (found == slots_.end()) return {};
  const std::lock_guard lock(sources_mutex_);
  return found->second->source;
}

Feeder& FeedTable::feeder(const std::string& name) {
  std::unique_ptr<Feeder>& feeder = feeders_[name];
  if (!feeder) feeder = std::make_unique<Feeder>();
  return *feeder;
}

FeedSlot& FeedTable::slot(const FeedName& name) {
  std::unique_ptr<FeedSlot>& slot = feeder(name.feeder).slots_[name.name];
  if (!slot) slot = std::make_unique<FeedSlot>();
  return *slot;
}

FeedSource::FeedSource(const FeedSettings& settings, FeedTable& board)
    : process_variable_(point_of(settings.process_variable, board)),
      output_(point_of(settings.output, board)) {
  if (settings.set_point) set_point_ = point_of(*settings.set_point, board);
  if (settings.stem) stem_ = point_of(*settings.stem, board);
  if (!settings.mode) return;
  mode_ = point_of({.name = *settings.mode}, board);
  board.slot(*settings.mode).takes_words = true;
}

FeedSource::Point FeedSource::point_of(const FeedPoint& point, FeedTable& board) {
  return {.slot = &board.slot(point.name),
          .feeder = &board.feeder(point.name.feeder),
          .scale = point.scale,
          .offset = point.offset};
}

SourceSample FeedSource::newest(const Point& point) noexcept {
  if (point.slot == nullptr) return {};
  const FeedSlot::Fed& fed = point.slot->newest.newest();
  Sample sample = fed.sample;
  sample.value = sample.value * point.scale + point.offset;
  // The age of a late value applies to the feeder's sign of life as well.
  return {.sample = sample, .alive_ns = point.feeder->alive_ns() - fed.late_ns};
}

void FeedSource::read(SourceInputs& inputs) noexcept {
  inputs = {.process_variable = newest(process_variable_),
            .output = newest(output_),
            .set_point = newest(set_point_),
            .stem = newest(stem_),
            .mode = newest(mode_)};
}

IoCounters FeedSource::counters() const noexcept {
  const auto connected = [](const Point& point) {
    return point.feeder == nullptr ||
           point.feeder->counters().connected.load(std::memory_order_relaxed);
  };
  IoCounters counters;
  counters.connected = connected(process_variable_) && connected(output_) &&
                       connected(set_point_) && connected(stem_) && connected(mode_);
  return counters;
}

}  // namespace loopwarden::hal::feed
