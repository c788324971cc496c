// SPDX-License-Identifier: Apache-2.0
// The newest minutes of a loop in automatic, for who wants to look back: the monitor's thread adds, others copy.
//
// Missing cycles are NaN. A longer gap, or manual, begins the history anew: nobody knows what happened meanwhile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

#include "model/alarm/window.hpp"
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

  struct Minutes {
    double period_s = 0.0;
    std::uint64_t end = 0;  // the cycle behind the newest one
    std::vector<double> sp;
    std::vector<double> pv;
    std::vector<double> co;
  };
  Minutes minutes() const;
  // The newest cycle.
  std::uint64_t newest() const;
  // Since when something speaks against the twin, at most the history's length, s.
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
  std::uint64_t quiet_ = 0;  // the newest cycle at which nothing spoke against the twin
};

}  // namespace loopwarden::daemon::supervision
