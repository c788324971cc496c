// SPDX-License-Identifier: Apache-2.0
// Passes values from feeders to loops: one slot for each name that a loop reads. One thread writes,
// one thread reads all slots. Any thread may read the counters.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "base/newest_value.hpp"
#include "hal/contract/loop_source.hpp"
#include "hal/feed/feed_settings.hpp"
#include "hal/feed/stamp_watch.hpp"

namespace loopwarden::hal::feed {

// A value as a feeder sends it.
struct FedValue {
  double value = 0.0;    // meaningless while quality is bad
  bool is_word = false;  // value is number_of_word()
  Quality quality = Quality::good;
  Reason reason = Reason::source;  // of a quality that is not good
  // by the source's clock, since 1970; NaN: no stamp
  double stamp_s = std::numeric_limits<double>::quiet_NaN();
  std::string_view source{};  // the lost part, with bad quality; empty: not known
};

// The time of arrival.
struct Arrival {
  std::int64_t now_ns = 0;  // CLOCK_MONOTONIC
  double utc_s = 0.0;       // since 1970
};

struct FeedSlot {
  struct Fed {
    Sample sample;
    std::int64_t late_ns = 0;  // difference of arrival and the time that the value refers to
  };
  base::NewestValue<Fed> newest;

  bool takes_words = false;  // true for a loop's mode; set before the threads start

  std::string source;  // of the newest bad value; guarded by the feeder

  // Writing thread only.
  Fed fed;
  StampWatch stamps;
};

// One feeder. Its counters only grow; the writing thread updates them.
class Feeder {
 public:
  struct Counters {
    using Counter = std::atomic<std::uint64_t>;
    Counter lines{0};
    Counter bad_lines{0};
    Counter values{0};         // accepted
    Counter unknown_names{0};  // values that no loop reads
    Counter doubled{0};
    Counter out_of_order{0};
    Counter connections{0};
    std::atomic<bool> connected{false};
    std::atomic<double> clock_behind_s{std::numeric_limits<double>::quiet_NaN()};  // NaN: no stamps
  };

  enum class Put : std::uint8_t { taken, unknown_name, doubled, out_of_order };
  Put put(std::string_view name, const FedValue& value, const Arrival& arrival);
  // Records that the feeder has sent a valid line.
  void lives(std::int64_t now_ns) noexcept { alive_ns_.store(now_ns, std::memory_order_relaxed); }

  // Returns the source of the newest bad value of that name; empty: not known. Any thread.
  std::string source_of(std::string_view name) const;

  std::int64_t alive_ns() const noexcept { return alive_ns_.load(std::memory_order_relaxed); }
  Counters& counters() noexcept { return counters_; }
  const Counters& counters() const noexcept { return counters_; }

 private:
  friend class FeedTable;
  std::map<std::string, std::unique_ptr<FeedSlot>, std::less<>> slots_;
  mutable std::mutex sources_mutex_;
  std::atomic<std::int64_t> alive_ns_{0};
  Counters counters_;
};

class FeedTable {
 public:
  // Returns the feeder or slot and creates it if missing. Call these before the threads start. The
  // addresses stay valid.
  Feeder& feeder(const std::string& name);
  FeedSlot& slot(const FeedName& name);

  const std::map<std::string, std::unique_ptr<Feeder>, std::less<>>& feeders() const noexcept {
    return feeders_;
  }

 private:
  std::map<std::string, std::unique_ptr<Feeder>, std::less<>> feeders_;
};

class FeedSource final : public LoopSource {
 public:
  // The table must outlive this object.
  FeedSource(const FeedSettings& settings, FeedTable& board);

  void open() override {}
  void close() noexcept override {}
  void read(SourceInputs& inputs) noexcept override;
  IoCounters counters() const noexcept override;

 private:
  struct Point {
    FeedSlot* slot = nullptr;  // null: not fitted
    const Feeder* feeder = nullptr;
    double scale = 1.0;
    double offset = 0.0;
  };
  static Point point_of(const FeedPoint& point, FeedTable& board);
  static SourceSample newest(const Point& point) noexcept;

  Point process_variable_;
  Point output_;
  Point set_point_{};
  Point stem_{};
  Point mode_{};
};

}  // namespace loopwarden::hal::feed
