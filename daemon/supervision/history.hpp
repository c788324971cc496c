// SPDX-License-Identifier: Apache-2.0
// Stores the newest minutes of a loop in automatic. The monitor's thread adds, other threads copy.
//
// Missing cycles are NaN. A longer gap, or manual, clears the history, because the loop was not
// observed meanwhile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

#include "model/alarm/window.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/watch/window_builder.hpp"

namespace loopwarden::daemon::supervision {

class History {
 public:
  static constexpr std::size_t kMost = 240'000;  // cycles; 24 bytes each
  static constexpr double kLongestGap_s = 10.0;

  History(double longest_s, double period_s);

  void add(const watch::Cycle& cycle);
  // Nothing speaks against the loop's twin at the newest cycle.
  void quiet();

  struct Minutes : numeric::LoopRecord {
    std::uint64_t end = 0;  // index after the newest cycle
  };
  Minutes minutes() const;
  // Returns the index of the newest cycle.
  std::uint64_t newest() const;
  // Returns the time since the last cycle that agreed with the twin, s; at most the history's
  // length.
  double unquiet_s() const;

 private:
  void put(double sp, double pv, double co);

  struct Row {
    double sp;
    double pv;
    double co;
  };
  double period_s_;
  std::size_t longest_gap_;  // cycles
  mutable std::mutex mutex_;
  std::vector<Row> rows_;  // a ring
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::uint64_t end_ = 0;
  std::uint64_t quiet_ = 0;  // newest cycle that agreed with the twin
};

}  // namespace loopwarden::daemon::supervision
