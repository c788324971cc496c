// SPDX-License-Identifier: Apache-2.0
// Routine evidence on a running loop: what diagnose() says of the last minutes and hours. It needs no model and no
// specialists, and sees the slow and wide dead band that no window of 96 s shows.
//
//   cycles -> kLevels of samples, each four times as long -> full: diagnose() -> logit -> CUSUM -> condition
//
//   S <- min(kMost, max(0, S + ln(p / (1 - p)) + w - kDrift))      once for each full window of a level
//   off -> on   S >= kRaise: more than one window must agree
//   on  -> off  S <= kClear
//
// One window often holds too few turns of CO to be sure. Therefore each window is judged a second
// time as one record with the window before it. S becomes at least kRaise, so the condition comes
// on after two full windows, if
//
//   that record shows a valve effect of grade seen; or likely stiction, with PV standing during
//   more than diagnosis::kStandsFrom of CO's moves, while neither window speaks against it (p <
//   0.5) and all of the record can be judged (CO is not at a limit), and the specialists do not
//   speak against it (w >= 0)
//
//   p  probability of a valve effect, of diagnose(), at its stated prior; where it can't tell or has not enough
//      data, S stays. A band below kHealthyBand is what a healthy valve has: the surer it is, the better the valve (1 - p)
//   w  what the specialists think of the same stretch: half the logit of the mean probability that they give to
//      stiction, backlash and hysteresis, within kMostFromSpecialists; 0 without them
//   S  nats, one for each level
//
// Where the source may report on change alone (WindowSettings::on_change), what it keeps of PV and CO is learned from the
// finest level's newest window that shows it, and forgotten when PV and CO come anew in more than half of the samples. Of
// one that came anew less than 20 times nothing is known. What it hides is not told (diagnosis/archive_rule.hpp): S stays.
//
// Levels: samples of 1, 4, 16 and 64 s (a whole number of cycles, at least one), kSamples of each: 12 minutes to 13
// hours. Windows of one level share no sample, so that their logits may be added. Time in manual, with a PV that is not
// good, or without cycles is left out; kLongestBreak samples of it or more, and the level's window begins again. In manual the valve may be
// worked on, so S begins again as well; a condition that is on stays until a window speaks against it.
//
// Memory: 72 kB per loop, held from the start. add() allocates only where a window is full. Nothing
// of it outlives the program: after a restart the first window of each level must fill again.
//
// Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954), for the sum; kDrift and
// kRaise are set so that one window at diagnose()'s highest probability is not enough and two are.
// tests/model/watch/routine_evidence_test.cpp measures this rule on simulated loops.
// Errors: none.
// What it can't do: see a dead band in less than one full window, or in a loop that nothing moves; tell valve
// effects apart better than diagnose() does.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/watch/window_builder.hpp"
#include "model/alarm/window_judge.hpp"

namespace loopwarden::watch {

class RoutineWatch {
 public:
  static constexpr std::size_t kLevels = 4;
  static constexpr std::array<double, kLevels> kSampleTimes{1.0, 4.0, 16.0, 64.0};  // s
  static constexpr std::size_t kSamples = 750;
  static constexpr std::size_t kLongestBreak = 4;      // samples
  static constexpr double kDrift = 0.3;                // nats a window
  static constexpr double kRaise = 3.0;                // nats
  static constexpr double kClear = 0.5;                // nats
  static constexpr double kMost = 6.0;                 // nats
  static constexpr double kMostFromSpecialists = 1.5;  // nats
  // Digital positioners state dead bands of 0.1 to 0.3 % of span; of a smaller one nobody opens a valve.
  static constexpr double kHealthyBand = 0.3;  // % of the CO span

  // The result of a window, or of two windows as one record.
  struct Judgement {
    double window_s = 0.0;  // the length
    bool whole = true;      // all of it was judged; false: a part, away from CO's limits
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    diagnosis::Grade grade = diagnosis::Grade::none;
    double probability = 0.5;  // of a valve effect
    diagnosis::ValveEvidence evidence;
    double sum_before = 0.0;        // nats, S before it
    double from_specialists = 0.0;  // nats, w
    double sum = 0.0;               // nats, S after it
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;
    double severity_percent = 0.0;   // % of the CO span
    diagnosis::Archived source{};    // what it keeps of PV and CO
    double sees_from_percent = 0.0;  // % of the CO span; 0: all is seen, infinite: not known
  };

  // The present state of one level.
  struct Progress {
    double window_s = 0.0;     // the length of one window
    double filled_s = 0.0;     // of the next one
    std::size_t windows = 0;   // judged since the start
    double sum = 0.0;          // nats, S
    double probability = 0.5;  // of a valve effect, by the newest judgement
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;  // if the verdict is a valve effect
    double severity_percent = 0.0;                        // % of the CO span, the same
  };
  using Levels = std::array<Progress, kLevels>;

  // The samples that a judgement is on.
  struct Samples {
    double sample_time_s = 1.0;
    std::span<const float> sp, pv, co;  // sp: NaN throughout where it is not known
  };

  explicit RoutineWatch(const WindowSettings& settings);

  // True if a window was judged; judgement() and conditions() then speak of it.
  bool add(const Cycle& cycle);
  // A condition from before a restart: stays until a window speaks against it.
  void restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept;
  // A window of the specialists that was judged, for the weighing.
  void specialists(const alarm::WindowJudgement& judgement) noexcept;

  const Judgement& judgement() const noexcept { return judgement_; }
  // Of judgement(), where the last add() judged; until the next one.
  Samples samples() const noexcept;
  const alarm::AlarmConditions& conditions() const noexcept { return conditions_; }
  // From the finest level on; a level that a slow loop does not have has a window of 0 s.
  Levels levels() const noexcept;

 private:
  struct Level {
    std::size_t decimation = 1;  // cycles to a sample
    double sample_time_s = 1.0;
    std::vector<float> sp, pv, co;  // 2 kSamples places: the window before, then the one that fills
    bool has_before = false;        // the window before, without a break between
    bool full =
        false;  // the second window was judged, and is the one before from the next sample on
    std::size_t count = 0;      // samples of the window that fills
    std::size_t in_sample = 0;  // cycles in the sums
    std::size_t left_out = 0;   // cycles since the last that could be used
    double sum_sp = 0.0;
    double sum_pv = 0.0;
    double sum_co = 0.0;
    double from_specialists = 0.0;  // sum of probabilities since the level's last window
    std::size_t specialist_windows = 0;
    std::size_t windows = 0;   // judged
    double probability = 0.5;  // of the newest window by itself
    Judgement newest;
    double sum = 0.0;  // nats, S
    bool on = false;
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;
    double severity_percent = 0.0;
  };
  void leave_out(Level& level, std::uint64_t cycles, bool manual) noexcept;
  bool take(Level& level, const Cycle& cycle) noexcept;  // true if it is full
  Samples samples_of(const Level& level, std::size_t count) const noexcept;
  Judgement judge_newest(const Level& level, std::size_t count) const;
  Judgement judge(Level& level);
  void learn(const Level& level);
  void settle_conditions() noexcept;

  std::vector<Level> levels_;
  bool has_set_point_;
  bool on_change_;
  diagnosis::Archived source_;
  double co_low_;
  double co_high_;
  std::uint64_t last_period_ = 0;
  bool any_ = false;
  Judgement judgement_;
  std::size_t judged_ = 0;          // level that it is of
  std::size_t judged_samples_ = 0;  // the newest of it
  alarm::AlarmConditions restored_{};
  alarm::AlarmConditions conditions_{};
};

// What diagnose() says of these samples, with nothing gathered before or by specialists.
RoutineWatch::Judgement judge_routine(const diagnosis::RoutineRecord& record,
                                      const diagnosis::Archived& source = {});

}  // namespace loopwarden::watch
