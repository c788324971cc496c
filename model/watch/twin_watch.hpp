// SPDX-License-Identifier: Apache-2.0
// Detects whether the loop still behaves as commissioned: the likelihood of each of six changes,
// compared with no change. Stepped by the caller. Equations: docs/math/twin-watch.md.
//
// Errors: the constructor throws effects::EffectError for a twin that can't be stepped.
// Limits: it can't name the change (the leading change is only the nearest of six), or see changes
// of a loop whose CO doesn't move. load_watch.hpp evaluates the load.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/plant/plant.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::watch {

// The changes: gain by a tenth, time constants by a fifth, dead time by a fifth (0.3 s or 3 samples
// at least), another lag of a fifth of the answer, backlash and stiction of 2 % of the CO span.
enum class TwinChange : std::uint8_t { gain, time_constant, dead_time, lag, play, stick };
inline constexpr std::size_t kTwinChanges = 6;
const char* to_text(TwinChange change) noexcept;

class TwinWatch {
 public:
  explicit TwinWatch(const plant::LoopModel& twin);

  // Adds a cycle of the loop: PV as read (NaN if it is not good) and the CO that followed from it.
  // Returns true if z was computed. No allocation.
  bool add(double pv, double co) noexcept;
  // Restarts the comparison: CO until now is unknown.
  void restart() noexcept { started_ = false; }
  // Restores the condition from before a restart of the program.
  void restore(bool on) noexcept { on_ = on; }

  bool on() const noexcept { return on_; }
  // Returns whether the twin shows no sign of a change.
  bool quiet() const noexcept { return largest_ < Limits::kQuietShare * limit_; }
  double largest() const noexcept { return largest_; }  // z of the leading change
  double limit() const noexcept { return limit_; }
  TwinChange leading() const noexcept { return leading_; }
  // False outside of the healthy record, or too soon after a start.
  bool judged_here() const noexcept { return counts_; }
  bool inside() const noexcept { return inside_; }
  // Returns the time in s since the change was last tested, or since the first sample if it never
  // was.
  double untested_s(TwinChange change) const noexcept;
  bool tested(TwinChange change) const noexcept {
    return tested_[static_cast<std::size_t>(change)];
  }
  double load() const noexcept { return residual_; }  // PV - y, PV units
  bool load_known() const noexcept { return inside_ && since_reset_ > warm_up_; }
  // Values of the newest sample for a change: n s/v and s^2/v. Both are 0 if the sample doesn't
  // count.
  struct Sample {
    double up = 0.0;
    double down = 0.0;
  };
  Sample newest(TwinChange change) const noexcept;

 private:
  static constexpr std::size_t kFilters = 3;
  static constexpr std::size_t kScales = 2;
  static constexpr std::size_t kSeries = kTwinChanges + 1;  // r, then y_i - y

  // A filter that follows a load at one K.
  struct Filter {
    double gain = 0.0;  // K
    double friction2 =
        0.0;  // friction of a healthy valve in n, over its time of correlation, PV units squared
    std::array<double, kSeries> level{};
    std::array<double, kSeries> slope{};
    double variance = 0.0;               // v less friction2
    std::array<double, kSeries> left{};  // n, s_i
  };
  struct Sums {
    std::array<double, kTwinChanges> up{};                                // w n s/v
    std::array<double, kTwinChanges> squares{};                           // w^2 s^2/v
    std::array<std::array<double, kTwinChanges>, kTwinChanges> gram{};    // w s_i s_j/v, lower half
    std::array<std::array<double, kTwinChanges>, kTwinChanges> unsure{};  // w f s_i s_j/v, the same
    double of(std::size_t i, std::size_t j) const noexcept {
      return i > j ? gram[i][j] : gram[j][i];
    }
    double unsure_of(std::size_t i, std::size_t j) const noexcept {
      return i > j ? unsure[i][j] : unsure[j][i];
    }
  };

  void start(double co) noexcept;
  void follow(Filter& filter, const std::array<double, kSeries>& series, double least) noexcept;
  void count(Filter& filter, std::array<Sums, kScales>& sums) noexcept;
  double variance_of(const Sums& sums, std::size_t change) const noexcept;
  bool load_jumps() noexcept;
  void judge() noexcept;

  std::vector<plant::Plant> plants_;           // as commissioned, then with each change
  std::array<double, kTwinChanges> spread_{};  // c
  double sample_time_s_;
  bool integrating_;
  std::array<Filter, kFilters> filters_{};
  std::array<std::array<Sums, kScales>, kFilters> sums_{};
  std::array<double, kScales> keep_{};  // factor of the sums per sample
  double noise2_;                       // least v, PV units squared
  double variance_gain_;                // of the running mean of n^2
  std::size_t warm_up_;                 // samples from a start until the first that counts
  std::size_t again_;                   // from a return or a jump
  std::size_t answer_;                  // samples
  std::size_t block_;                   // samples from one z to the next
  std::size_t most_quiet_;              // samples
  double limit_;
  // Range of the healthy record: least, greatest, width.
  struct Shown {
    double low, high, range;
    double beyond(double x) const noexcept;  // d
  };
  Shown pv_;  // PV units
  Shown co_;  // CO units

  bool started_ = false;
  double beyond_ = 0.0;  // d
  bool inside_ = true;
  bool counts_ = false;
  std::size_t since_start_ = 0;
  std::size_t since_reset_ = 0;  // of the plants
  std::size_t jumped_ = 0;       // samples in a row
  std::size_t in_block_ = 0;
  std::size_t quiet_samples_ = 0;
  std::array<std::size_t, kTwinChanges> untested_{};  // samples
  std::array<bool, kTwinChanges> tested_{};
  std::array<double, kSeries> predicted_{};  // y, y_i
  double residual_ = 0.0;
  double largest_ = 0.0;
  TwinChange leading_ = TwinChange::gain;
  bool on_ = false;
};

}  // namespace loopwarden::watch
