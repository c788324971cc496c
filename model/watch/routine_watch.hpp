// SPDX-License-Identifier: Apache-2.0
// Routine evidence on a running loop: diagnose() judges the last minutes and hours. It needs no
// model and no specialists, and detects a slow and wide dead band that no window of 96 s shows.
//
//   cycles -> kLevels of samples, each four times as long -> full: diagnose() -> logit -> CUSUM
//          -> condition
//
//   S <- min(kMost, max(0, S + ln(p / (1 - p)) + w - kDrift))   once per full window of a level
//   off -> on   S >= kRaise: more than one window must agree
//   on  -> off  S <= kClear
//
// One window often holds too few turns of CO to be sure. Therefore each window is judged a second
// time as one record with the window before it. S becomes at least kRaise, so the condition is
// raised after two full windows, in two cases:
//
//   - The record shows a valve effect of grade seen.
//   - The record shows likely stiction, and PV rests during more than diagnosis::kStandsFrom of
//     CO's moves, and neither window contradicts it (p < 0.5).
//
// In both cases all of the record must be judged (CO is not at a limit), and the specialists must
// not contradict it (w >= 0).
//
//   p  probability of a valve effect, from diagnose(), at its stated prior. With a verdict of
//      "can't tell" or "not enough data", S keeps its value. A band below kHealthyBand is that of a
//      healthy valve: it counts with 1 - p
//   w  the specialists' opinion of the same stretch: half the logit of the mean probability that
//      they give to stiction, backlash and hysteresis, within kMostFromSpecialists; 0 without
//      specialists
//   S  nats, one per level
//
// A source may report on change only (WindowSettings::on_change). Its rule for PV and CO is learned
// from the finest level's newest window that shows it. The rule is forgotten when PV and CO have
// new values in more than half of the samples. With fewer than 20 new values the rule is unknown.
// An effect that such a source hides gives no verdict (diagnosis/archive_rule.hpp), and S keeps its
// value.
//
// Levels: samples of 1, 4, 16 and 64 s (a whole number of cycles, at least one), kSamples of each:
// 12 minutes to 13 hours. Windows of one level share no sample, so their logits may be added. Time
// in manual, with a PV that is not good, or without cycles is left out. If that is kLongestBreak
// samples or more, the level's window begins again. In manual the valve may be under repair, so S
// begins again too. An active condition stays until a window contradicts it.
//
// Memory: 72 kB per loop, held from the start. add() allocates only for a full window. Routine
// evidence doesn't survive the program: after a restart the first window of each level must fill
// again.
//
// Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954), for the sum; kDrift and
// kRaise are set so that one window at diagnose()'s highest probability is not enough and two are.
// tests/model/watch/routine_evidence_test.cpp measures this rule on simulated loops.
// No errors.
// Limits: it can't see a dead band in less than one full window, or in a loop without movement. It
// distinguishes valve effects no better than diagnose().
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
  // Digital positioners state dead bands of 0.1 to 0.3 % of span. A smaller band is no reason for a
  // repair.
  static constexpr double kHealthyBand = 0.3;  // % of the CO span

  // The result of a window, or of two windows as one record.
  struct Judgement {
    double window_s = 0.0;  // the length of the judged samples
    bool whole = true;      // all samples were judged; false: a part, away from CO's limits
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    diagnosis::Grade grade = diagnosis::Grade::none;
    double probability = 0.5;  // of a valve effect
    diagnosis::ValveEvidence evidence;
    double sum_before = 0.0;        // nats, S before this judgement
    double from_specialists = 0.0;  // nats, w
    double sum = 0.0;               // nats, S after this judgement
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;
    double severity_percent = 0.0;  // % of the CO span
    diagnosis::Archived source{};   // the source's rule for PV and CO
    double sees_from_percent =
        0.0;  // detection limit, % of the CO span; 0: no limit, infinite: unknown
  };

  // The present state of one level.
  struct Progress {
    double window_s = 0.0;     // the length of one window
    double filled_s = 0.0;     // part of the next one
    std::size_t windows = 0;   // judged since the start
    double sum = 0.0;          // nats, S
    double probability = 0.5;  // of a valve effect, by the newest judgement
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;  // if the verdict is a valve effect
    double severity_percent = 0.0;                        // % of the CO span, the same
  };
  using Levels = std::array<Progress, kLevels>;

  // The samples of a judgement.
  struct Samples {
    double period_s = 1.0;
    std::span<const float> pv, sp, co;  // sp: all NaN if unknown
  };

  explicit RoutineWatch(const WindowSettings& settings);

  // Adds a cycle. Returns true if a window was judged; judgement() and conditions() are then of
  // that window.
  bool add(const Cycle& cycle);
  // Restores a condition from before a restart. It stays until a window contradicts it.
  void restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept;
  // Adds a judged window of the specialists, for w.
  void specialists(const alarm::WindowJudgement& judgement) noexcept;

  const Judgement& judgement() const noexcept { return judgement_; }
  // Returns the samples of judgement(), if the last add() judged; valid until the next add().
  Samples samples() const noexcept;
  const alarm::AlarmConditions& conditions() const noexcept { return conditions_; }
  // Returns the levels, the finest first. A level that a slow loop lacks has a window of 0 s.
  Levels levels() const noexcept;

 private:
  struct Level {
    std::size_t decimation = 1;  // cycles per sample
    double sample_time_s = 1.0;
    std::vector<float> sp, pv,
        co;                   // 2 kSamples places: the window before, then the window in progress
    bool has_before = false;  // the window before is valid, without a break in between
    bool full =
        false;  // the second window was judged, and becomes the one before with the next sample
    std::size_t count = 0;      // samples of the window in progress
    std::size_t in_sample = 0;  // cycles in the sums
    std::size_t left_out = 0;   // cycles since the last usable one
    double sum_sp = 0.0;
    double sum_pv = 0.0;
    double sum_co = 0.0;
    double from_specialists = 0.0;  // sum of probabilities since the level's last window
    std::size_t specialist_windows = 0;
    std::size_t windows = 0;   // judged
    double probability = 0.5;  // of the newest window only
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
  std::size_t judged_ = 0;          // its level
  std::size_t judged_samples_ = 0;  // its newest samples
  alarm::AlarmConditions restored_{};
  alarm::AlarmConditions conditions_{};
};

// Returns the judgement of diagnose() for these samples, without earlier evidence and without
// specialists.
RoutineWatch::Judgement judge_routine(const numeric::LoopView& record,
                                      const diagnosis::Archived& source = {});

}  // namespace loopwarden::watch
