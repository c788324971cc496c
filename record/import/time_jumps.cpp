// SPDX-License-Identifier: Apache-2.0
#include "record/import/time_jumps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace loopwarden::record {
namespace {

constexpr double kYear = 365.0 * 86400.0;
constexpr double kBefore = 631152000.0;   // 1990-01-01
constexpr double kBehind = 4102444800.0;  // 2100-01-01
constexpr double kMostRows = 0.8;         // of the stretch that is kept
constexpr double kWrongStamps = 0.01;     // of the rows
constexpr double kFarOff = 7200.0;        // s
constexpr double kHour = 3600.0;
constexpr double kSummerTime = 120.0;  // s, about an hour
constexpr std::size_t kFewRuns = 12;

// Rows from `from` to before `to` with rising times.
struct Run {
  std::size_t from = 0;
  std::size_t to = 0;
};

class JumpFinder {
 public:
  JumpFinder(const std::vector<double>& time_s, const TimeContext& context)
      : t_(time_s), context_(context) {}

  TimeFinding find() {
    if (is_plain()) return {};
    rows_.resize(t_.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) rows_[k] = k;
    leave_out_far();
    if (found_.problem.empty()) leave_out_wrong_stamps();
    if (found_.problem.empty()) look_for_set_back();
    return std::move(found_);
  }

 private:
  bool is_plain() const {
    for (std::size_t k = 1; k < t_.size(); ++k) {
      if (!(t_[k] >= t_[k - 1] && t_[k] - t_[k - 1] < kYear)) return false;
    }
    return true;
  }

  void leave_out(std::size_t row) {
    if (found_.left_out.empty()) found_.left_out.assign(t_.size(), false);
    found_.left_out[row] = true;
  }

  void forget_left_out() {
    if (found_.left_out.empty()) return;
    std::erase_if(rows_, [&](std::size_t row) { return found_.left_out[row]; });
  }

  bool is_credible(double time_s) const {
    const double at = context_.epoch_s + time_s;
    return !context_.is_absolute || (at > kBefore && at < kBehind);
  }

  struct Stretch {
    double from_s = 0.0;
    double to_s = 0.0;
    std::size_t rows = 0;
  };

  // Keeps stretches of time with less than a year between neighbours.
  void leave_out_far() {
    std::vector<double> sorted = t_;
    std::sort(sorted.begin(), sorted.end());
    std::vector<Stretch> stretches;
    for (const double at : sorted) {
      if (stretches.empty() || at - stretches.back().to_s > kYear) stretches.push_back({at, at, 0});
      stretches.back().to_s = at;
      ++stretches.back().rows;
    }
    if (stretches.size() < 2) return;
    const auto most =
        std::max_element(stretches.begin(), stretches.end(),
                         [](const Stretch& a, const Stretch& b) { return a.rows < b.rows; });
    const Stretch* kept = nullptr;
    if (static_cast<double>(most->rows) >= kMostRows * static_cast<double>(t_.size()))
      kept = &*most;
    std::size_t credible = 0;
    for (const Stretch& one : stretches) credible += is_credible(one.from_s) ? 1U : 0U;
    for (const Stretch& one : stretches) {
      if (kept == nullptr && context_.is_absolute && credible == 1 && is_credible(one.from_s))
        kept = &one;
    }
    if (kept == nullptr) {
      const Stretch& first = stretches[0];
      const Stretch& next = stretches[1];
      found_.row = static_cast<std::size_t>(
          std::find_if(t_.begin(), t_.end(), [&](double at) { return at >= next.from_s; }) -
          t_.begin());
      found_.problem = fmt::format(
          "{} rows have times up to {}, and {} rows times from {} on: export them as two files",
          first.rows, context_.text(first.to_s), next.rows, context_.text(next.from_s));
      return;
    }
    for (std::size_t k = 0; k < t_.size(); ++k) {
      if (t_[k] < kept->from_s || t_[k] > kept->to_s) leave_out(k);
    }
    for (const Stretch& one : stretches) {
      if (&one == kept) continue;
      const bool single = one.from_s == one.to_s;
      found_.remarks.push_back(fmt::format(
          "{} {} left out: {} {}, more than a year from the other {} rows; the clock "
          "was not set or the times are wrong",
          one.rows, one.rows == 1 ? "row is" : "rows are", single ? "time" : "times from",
          single ? context_.text(one.from_s)
                 : context_.text(one.from_s) + " to " + context_.text(one.to_s),
          kept->rows));
    }
    forget_left_out();
  }

  std::vector<Run> runs() const {
    std::vector<Run> runs;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (k == 0 || t_[rows_[k]] < t_[rows_[k - 1]]) runs.push_back({k, k});
      runs.back().to = k + 1;
    }
    return runs;
  }

  // Returns rows outside the longest sequence of rising times.
  std::vector<std::size_t> rows_off() const {
    std::vector<std::size_t> tails;  // indices in rows_: the last one of a sequence of each length
    std::vector<std::size_t> before(rows_.size(), rows_.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const auto at = std::upper_bound(
          tails.begin(), tails.end(), t_[rows_[k]],
          [this](double value, std::size_t place) { return value < t_[rows_[place]]; });
      if (at != tails.begin()) before[k] = *(at - 1);
      if (at == tails.end()) {
        tails.push_back(k);
      } else {
        *at = k;
      }
    }
    std::vector<bool> kept(rows_.size(), false);
    for (std::size_t k = tails.empty() ? rows_.size() : tails.back(); k < rows_.size();
         k = before[k])
      kept[k] = true;
    std::vector<std::size_t> off;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (!kept[k]) off.push_back(k);
    }
    return off;
  }

  void leave_out_wrong_stamps() {
    if (runs().size() < 2) return;
    const std::vector<std::size_t> off = rows_off();
    if (static_cast<double>(off.size()) > kWrongStamps * static_cast<double>(rows_.size())) return;
    std::vector<bool> is_off(rows_.size(), false);
    for (const std::size_t k : off) is_off[k] = true;
    for (const std::size_t k : off) {
      std::size_t before = k;
      while (before > 0 && is_off[before]) --before;
      std::size_t after = k;
      while (after + 1 < rows_.size() && is_off[after]) ++after;
      const double at = t_[rows_[k]];
      const bool far = (is_off[before] || std::abs(at - t_[rows_[before]]) > kFarOff) &&
                       (is_off[after] || std::abs(at - t_[rows_[after]]) > kFarOff);
      if (!far) return;
    }
    found_.remarks.push_back(fmt::format(
        "{} {} left out: the time of the first, {}, is hours off the rows around it", off.size(),
        off.size() == 1 ? "row is" : "rows are", context_.text(t_[rows_[off.front()]])));
    for (const std::size_t k : off) leave_out(rows_[k]);
    forget_left_out();
  }

  // Returns whether the times of `run` overlap those of an earlier run with other values.
  bool overlaps(const std::vector<Run>& all, std::size_t which) const {
    const Run& run = all[which];
    const double from = t_[rows_[run.from]];
    const double to = t_[rows_[run.to - 1]];
    for (std::size_t other = 0; other < which; ++other) {
      const Run& earlier = all[other];
      if (t_[rows_[earlier.to - 1]] < from || t_[rows_[earlier.from]] > to) continue;
      std::size_t at = earlier.from;
      for (std::size_t k = run.from; k < run.to; ++k) {
        while (at < earlier.to && t_[rows_[at]] < t_[rows_[k]]) ++at;
        if (at == earlier.to) break;
        if (at == earlier.from && t_[rows_[at]] > t_[rows_[k]]) continue;
        const bool same = t_[rows_[at]] == t_[rows_[k]] && context_.same_value &&
                          context_.same_value(rows_[at], rows_[k]);
        if (!same) return true;
      }
    }
    return false;
  }

  // Returns whether one row has a wrong time and its place between its neighbours is free.
  bool is_one_row_off() const {
    const std::vector<std::size_t> off = rows_off();
    if (off.size() != 1 || off[0] < 2 || off[0] + 1 >= rows_.size()) return false;
    const auto time = [&](std::size_t place) { return t_[rows_[place]]; };
    const double step = time(off[0] - 1) - time(off[0] - 2);
    return time(off[0] + 1) - time(off[0] - 1) > 1.5 * step;
  }

  void look_for_set_back() {
    const std::vector<Run> all = runs();
    if (all.size() < 2) return;
    const std::size_t most = std::max(
        kFewRuns, static_cast<std::size_t>(kWrongStamps * static_cast<double>(rows_.size())));
    if (context_.may_be_sorted && all.size() > most) return;
    std::size_t first = 1;
    bool mixed = false;
    for (std::size_t k = 1; k < all.size() && all.size() <= most && !mixed; ++k) {
      if (!overlaps(all, k)) continue;
      first = k;
      mixed = true;
    }
    if (context_.may_be_sorted && !mixed) return;
    const std::size_t at = all[first].from;
    const double back = t_[rows_[at - 1]] - t_[rows_[at]];
    found_.row = rows_[at];
    std::string cause;
    if (all.size() > most) {
      cause = fmt::format(", as in {} more places: sort the rows by time", all.size() - 2);
    } else if (is_one_row_off()) {
      cause = ": one row is out of place; correct its time or remove it";
    } else if (context_.local && std::abs(back - kHour) < kSummerTime) {
      cause = ": local times at the end of summer time? Export in UTC";
    } else if (!context_.is_absolute) {
      cause = fmt::format(
          ": the count starts again from {}. Give the rows before and from here on "
          "as two files",
          context_.text(t_[rows_[at]]));
    } else if (mixed) {
      cause = fmt::format(
          " and continues from {}, so that two stretches have the same times: the clock was set "
          "back. Give the rows before and from here on as two files",
          context_.text(t_[rows_[at]]));
    } else {
      cause = fmt::format(
          " to {}: the clock was set back, or the parts of "
          "the file are in the wrong order. Give the rows before and from here on "
          "as two files",
          context_.text(t_[rows_[at]]));
    }
    found_.problem = fmt::format("the time decreases by {:.6g} s{}", back, cause);
  }

  const std::vector<double>& t_;
  const TimeContext& context_;
  std::vector<std::size_t> rows_;  // rows that are kept
  TimeFinding found_;
};

}  // namespace

TimeFinding find_time_jumps(const std::vector<double>& time_s, const TimeContext& context) {
  return JumpFinder(time_s, context).find();
}

}  // namespace loopwarden::record
