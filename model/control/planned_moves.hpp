// SPDX-License-Identifier: Apache-2.0
// Planned moves: a sticking valve follows badly and stands well. So it stands, until a model of the loop says
// that standing costs more than a move; then it gets one move that lands where it should (kind `planned_moves`).
//
//   y' = (K x(t - L) - y) / T               PV without load       d   load: PV - y, a random walk of intensity q
//   err = SP - (K x + d)                    what PV will be off by if the stem stays
//   a move when err^2 > h^2 + 4 P           P  variance of the estimate of d
//   w = x + (err - m sign(err)) / K         where the stem is to stand; m, |m| < h, the error left on purpose
//   |w - x| > 1.08 j:  one move, u = w + b  b  u - x when a stem that went this way stands: + or - (s - j)/2
//   else:              first away from w by 1.15 j, then there; near an output limit first past w, then back
//
//   x, w, u, s, j, b  CO units: stem, stem wanted, CO, stick band with dead band, slip jump, half band
//   K  PV units/CO unit, signed    T, L  s    q  PV units/sqrt(s)    SP, PV, y, d, err, h, m  PV units
//
// h and m: of sixty h up to 3 sqrt(v0) and four m those with the least
//   ((h^2 + m^2)/6 + (L + T/2 + c) r (h^2 - m^2) + r E) / v0 + 0.05 p r / p0
//     + 10 (p r / (0.95 p0) - 1)+ + 10 (r / r0 - 1)+
//   r = q^2 / (h^2 - m^2)  moves/s: a random walk from m leaves (-h, h) that often, with variance (h^2 + m^2)/6
//   E = (K B + h)^2 (t - T (1 - exp(-t/T)))  of the pulse of a detour of B for t, the output's
//   ramp included
//   c  s, half of the stick band at the output's rate limit     p  the pulse's travel, CO units
//   v0, p0  variance of SP - PV and travel per second of the loop without compensator     r0  moves allowed
// One h per cycle is tried. If no h leaves less than 1.21 v0, the law disengages for good.
//
// The output's limits: a leg's clock begins when CO has arrived, as the limiter says
// (CompensatorInputs::commanded). In
// shadow a virtual output goes through the same limiter.
// The read-back: a value that a gateway renews every few seconds counts once. The interval is the
// least time between two
// changes; a value that stays counts again after 1.5 intervals.
//
// d and P: Kalman filter on PV - y, which weighs PV less while the model has 15 % or more of a move to go; P is
// raised where PV - y - d stays on one side, and by what a move's gain may be wrong.
// Learnt while it runs: noise of PV and read-back, the force at which the stem breaks loose and the half band for
// each direction (read-back only; s = sum of one's break-away and the other's half band, j = their difference),
// the actuator's time, and how far a move lands from where it should.
//
// Phases: watching (PI runs, three to ten cycles: v0, p0, s, j), probing (CO moved by 0.35 s
// towards the middle of the
// band: a stem that follows is healthy), resting, backing off, moving, given back. It probes only
// if PV settles so near
// to SP that the time costs at most one cycle of v0. It disengages without a bump:
//   the stem follows the probe (for good)
//   the read-back is lost; when it is back, the loop is watched again
//   PV and read-back contradict each other
//   two moves in a row did not move the stem
//   windows of four cycles have an RMS of 1.1 times v0's (for good)
//   the sum of (SP - PV)^2 - v0 exceeds two cycles of v0; a square counts 16 v0 at most, and one
//   cycle may be saved
//   the stem is read to move after its move was given up: it, or the read-back, is late (for good)
// It watches again after ten cycles if not for good; after the third time it is for good. Reset
// starts afresh.
// A set point that changes by more than h is followed at once, in a move or a probe as well. The
// law follows it alone if no move may be made that is long enough, or if its own first step is
// longer. Planned moves resume when a move may be made and PV is to settle near SP.
// Probed again: the stem moved by itself, two moves landed as without friction, 25 moves, ten cycles (read-back only).
//
// `read_back` false: x is the stiction law's (Choudhury et al. 2005) stepped with CO. `shadow`: the same on a valve and a process
// in numbers beside the real ones, the load being the real one; gain is then what it would have gained. act() goes on
// from there with what was watched and learnt.
// max_move bounds |w - x| of one move; what is longer goes in several moves, and a detour whose way back is longer is not
// made. No hour has more moves than max_moves_per_hour (below 1: no 1/max_moves_per_hour hours more than one); a
// detour is two.
//
// Limits: self-regulating processes with one lag. A loop that does not cycle is left alone. A move is no finer than
// what a stem scatters. j within the read-back's noise is not seen; a load that wanders by more than K j in a cycle
// gains little. Without a read-back an actuator's lag has to be given. At an output limit it rests.
// What it does over random loops: `loopwarden-study calm`, docs/compensators.md.
//
// Sources: grown from the two moves of Srinivasan and Rengaswamy, Comput. Chem. Eng. 32 (2008) 2218-2229, and
// stiction of Choudhury, Thornhill and Shah (2005); variance of a walk between two barriers: Karatzas and Shreve,
// Brownian Motion and Stochastic Calculus (1991), 2.8. Planning, probe and learning are this project's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::control {

struct PlannedMovesSettings {
  double gain = 0.0;                                          // K, PV units / CO unit, not 0
  double time_constant_s = 0.0;                               // T, s, >= 0
  double dead_time_s = 0.0;                                   // L, s, >= 0
  double actuator_lag_s = 0.0;                                // s, >= 0
  double load = 0.0;                                          // q, PV units / sqrt(s), >= 0
  double s = 0.0;                                             // CO units, > 0
  double j = 0.0;                                             // CO units, 0 < j <= s
  double s_low = 0.0;                                         // CO units, interval of s; 0: s
  double s_high = 0.0;                                        // CO units; 0: s
  double j_low = 0.0;                                         // CO units, interval of j; 0: j
  double j_high = 0.0;                                        // CO units; 0: j
  double max_move = std::numeric_limits<double>::infinity();  // CO units
  double max_moves_per_hour = std::numeric_limits<double>::infinity();  // 1/h
  bool read_back = true;

  friend bool operator==(const PlannedMovesSettings&, const PlannedMovesSettings&) = default;
};

// What planned moves ask of the interval of s before they act on hardware.
constexpr bool within_factor_two(double s_low, double s_high) noexcept {
  return s_low > 0.0 && s_high <= 2.0 * s_low;
}

enum class MovePhase : std::uint8_t { watching, probing, resting, backing_off, moving, given_back };
enum class GivenBack : std::uint8_t {
  no,
  valve_follows,
  read_back_lost,
  contradiction,
  stem_stands,
  no_gain,
  error_too_large,
  moved_late
};

constexpr const char* to_text(MovePhase phase) noexcept {
  return numeric::enum_name<MovePhase::given_back>(
      phase, {"watching", "probing", "resting", "backing off", "moving", "given back"});
}
constexpr const char* to_text(GivenBack reason) noexcept {
  return numeric::enum_name<GivenBack::moved_late>(
      reason, {"no", "the stem follows a probe", "the read-back is lost",
               "PV and read-back contradict each other", "the stem does not move",
               "RMS of SP - PV does not fall", "SP - PV is too large",
               "the stem is read to move after its move was given up"});
}

// Cycles of the loop without it that are watched before it engages.
inline constexpr int kLeastCyclesWatched = 3;
inline constexpr int kMostCyclesWatched = 10;

// State of planned moves, with the reason for the last disengagement.
struct MovesState {
  MovePhase phase = MovePhase::watching;
  GivenBack reason = GivenBack::no;
  double settles_off = 0.0;  // err, PV units
  double pays_from = 0.0;    // |err| from which a move pays, PV units
  double output = 0.0;       // CO units, where it holds CO
  double gain = 0.0;         // RMS of SP - PV over that without compensator; 0: not known yet
  double s = 0.0;            // CO units, as learnt
  double j = 0.0;            // CO units, as learnt
  std::uint32_t moves = 0;   // since it engaged
  std::uint8_t cycles_watched = 0;  // while watching: of kLeastCyclesWatched to kMostCyclesWatched
  bool waits = false;               // watching has ended; it engages when PV is to settle near SP
  bool for_good = false;            // given back, and not watched again
  bool shadow = false;
};

struct CompensatorInputs;
struct Correction;

class PlannedMoves {
 public:
  PlannedMoves(const PlannedMovesSettings& settings, bool shadow, double period_s) noexcept;

  void reset(double output) noexcept;
  Correction step(const CompensatorInputs& in) noexcept;
  // What `before` has moved the stem in the last hour counts here, too.
  void continue_hour(const PlannedMoves& before) noexcept;
  void act() noexcept;
  MovesState state() const noexcept;

 private:
  // Process without load. The dead time is kept in slots, at most L/250 s long each.
  class Process {
   public:
    void set(const PlannedMovesSettings& settings, double period_s) noexcept;
    void reset(double stem) noexcept;
    void step(double stem) noexcept;
    double value() const noexcept { return y_; }

   private:
    static constexpr std::size_t kSlots = 256;
    double gain_ = 1.0;
    double approach_ = 1.0;
    std::size_t stride_ = 1;  // periods a slot
    std::size_t back_ = 0;    // slots
    std::size_t phase_ = 0;
    std::size_t newest_ = 0;
    double y_ = 0.0;
    std::array<float, kSlots> stems_{};
  };

  // What the stem does: read back, or by the law.
  struct Stem {
    bool known = false;
    double place = 0.0;     // CO units, mean while it stands
    double before = 0.0;    // CO units, where it stood before it moved last
    double last = 0.0;      // CO units, newest value
    double averaged = 0.0;  // samples in `place`
    std::uint32_t off = 0;  // samples in a row away from `place`
    double stood_s = 0.0;   // since it moved last
    bool moved = false;     // in this period
    double output = 0.0;    // CO units, of the period before: by the law only
    double going = 0.0;     // direction, 0: stuck: by the law only
  };

  struct Direction {
    double breaks = 0.0;  // CO units, u - x at which the stem breaks loose this way
    double stands = 0.0;  // CO units, u - x when it stands after it went this way
    double break_weight = 1.0;
    double stand_weight = 1.0;
  };

  // Moves of the stem in the last hour, in parts of a minute.
  class LastHour {
   public:
    explicit LastHour(double max_per_hour) noexcept;
    void pass(double period_s) noexcept;
    bool has_room(double moves) const noexcept { return made_ + moves <= most_; }
    void add() noexcept;
    // As many as `other` has, within the limit of this one.
    void take_over(const LastHour& other) noexcept;

   private:
    double part_s_;
    double most_;
    double made_ = 0.0;
    double since_s_ = 0.0;  // of the newest part
    std::size_t newest_ = 0;
    std::array<float, 61> parts_{};
  };

  void observe(const CompensatorInputs& in) noexcept;
  void follow_read_back(double position, double output) noexcept;
  void follow_law(Stem& stem, double output) noexcept;
  void moved_to(Stem& stem, double place) noexcept;
  void watch_load(double process_variable) noexcept;
  void watch(const CompensatorInputs& in) noexcept;
  void supervise(const CompensatorInputs& in) noexcept;
  void look_at_a_threshold() noexcept;
  void engage(const CompensatorInputs& in) noexcept;
  void begin_probe(const CompensatorInputs& in) noexcept;
  void probe() noexcept;
  void rest(const CompensatorInputs& in) noexcept;
  void plan(const CompensatorInputs& in, double error) noexcept;
  bool may_move(double moves) const noexcept { return tokens_ >= moves && hour_.has_room(moves); }
  bool stands_now(double samples) noexcept;
  bool waits_for_read_back() noexcept;
  void back_off(const CompensatorInputs& in) noexcept;
  void count_move() noexcept;
  void move(const CompensatorInputs& in) noexcept;
  void start_leg(double to, double output) noexcept;
  void landed() noexcept;
  void judge_answer() noexcept;
  void stood() noexcept;
  void give_back(GivenBack reason) noexcept;

  bool seen() const noexcept { return settings_.read_back && !shadow_; }
  bool active() const noexcept {
    return phase_ != MovePhase::watching && phase_ != MovePhase::given_back;
  }
  Direction& way(double sign) noexcept { return ways_[sign > 0.0 ? 1 : 0]; }
  const Direction& way(double sign) const noexcept { return ways_[sign > 0.0 ? 1 : 0]; }
  double middle() const noexcept { return 0.5 * (ways_[0].stands + ways_[1].stands); }
  double jump() const noexcept;
  double band() const noexcept;
  double sure_jump() const noexcept;              // no jump is longer
  double sure_force(double sign) const noexcept;  // CO units, breaks the stem loose for sure
  double zone() const noexcept;
  double pulse(double detour, double error) const noexcept;
  double allowance() const noexcept;
  void end_cycle() noexcept;
  double margin() const noexcept;
  void follow_set_point(const CompensatorInputs& in) noexcept;
  bool law_is_better(const CompensatorInputs& in, double error) const noexcept;
  void hand_over() noexcept;
  void take_over(const CompensatorInputs& in) noexcept;
  void resume(const CompensatorInputs& in) noexcept;
  void stop(const CompensatorInputs& in) noexcept;
  bool may_probe(const CompensatorInputs& in) const noexcept;
  bool new_set_point(const CompensatorInputs& in) const noexcept;
  double settle_s() const noexcept;
  double sample_s() const noexcept { return static_cast<double>(renewal_) * period_s_; }
  double push_per_period(const CompensatorInputs& in) const noexcept;
  double ramp_s(double way) const noexcept;
  bool arrived(const CompensatorInputs& in) const noexcept;
  bool renewed(bool changed) noexcept;
  const Stem& stem() const noexcept { return shadow_ && active() ? virtual_stem_ : stem_; }
  const Process& process() const noexcept { return shadow_ ? virtual_process_ : process_; }

  PlannedMovesSettings settings_;
  bool shadow_;
  double period_s_;
  double answer_s_;  // L + T

  // Observed.
  double walk() const noexcept;

  Process process_;
  Process virtual_process_;
  Stem stem_;
  Stem virtual_stem_;
  std::array<Direction, 2> ways_{};  // down, up
  double read_back_variance_ = 0.0;
  double read_back_step_ = std::numeric_limits<double>::infinity();  // least change seen
  double reach_ = 1.0;  // without read-back: factor on the force that breaks the stem loose
  double last_process_variable_ = 0.0;
  bool process_variable_known_ = false;
  double noise_variance_ = 0.0;  // of PV
  double load_ = 0.0;            // d
  double load_variance_ = 0.0;   // P
  double one_sided_ = 0.0;       // mean of PV - y - d
  double output_at_slip_ = 0.0;  // CO that moved the stem where it was first seen to have moved
  double actuator_s_ = 0.0;
  std::size_t renewal_ = 1;  // periods between two values of the read-back
  std::size_t since_renewal_ = 0;
  std::size_t since_change_ = 0;
  bool changed_before_ = false;
  bool renewed_ = false;     // in this period
  double applied_ = 0.0;     // CO units
  double law_before_ = 0.0;  // the law's result one period ago, CO units
  std::uint32_t lost_ = 0;   // samples without a read-back
  double set_point_ = 0.0;
  double rate_per_s_ = std::numeric_limits<double>::infinity();
  double low_ = 0.0;
  double high_ = 0.0;
  double error_ = 0.0;  // SP - PV of the loop that is judged

  // The loop without compensator.
  double now_s_ = 0.0;
  double set_point_seen_ = 0.0;
  double skip_until_s_ = 0.0;
  int side_ = 0;
  std::uint32_t flips_ = 0;
  double travel_ = 0.0;
  double cycle_squares_ = 0.0;  // of the cycle that runs
  double cycle_lasts_s_ = 0.0;
  double cycle_counted_s_ = 0.0;  // of that, without what a set point's change takes
  double cycles_ = 0.0;
  double cycles_squares_ = 0.0;
  double cycles_counted_s_ = 0.0;
  double cycles_s_ = 0.0;
  double cycles_travel_ = 0.0;
  double cycles_mean_ = 0.0;          // of the cycles' mean squares
  double cycles_spread_ = 0.0;        // sum of squared differences from it
  double variance_without_ = 0.0;     // v0
  double travel_rate_without_ = 0.0;  // p0
  double cycle_s_ = 0.0;

  // The window that the supervisor looks at.
  double window_squares_ = 0.0;
  double window_s_ = 0.0;
  std::uint32_t windows_ = 0;
  double gain_ = 0.0;
  double debt_ = 0.0;  // squared error over v0, summed, PV units^2 s

  // The threshold.
  std::size_t candidate_ = 0;
  double best_cost_ = 0.0;
  double best_variance_ = 0.0;
  double best_threshold_ = 0.0;
  double best_left_ = 0.0;
  double threshold_ = 0.0;  // h
  double left_ = 0.0;       // m
  double landing_variance_ = 0.0;
  double tokens_ = 0.0;  // moves
  LastHour hour_;        // of what it does or would do
  LastHour acted_;       // of the stem's, over shadow and settings
  double budget_ = 0.0;  // CO units of travel

  // The move.
  MovePhase phase_ = MovePhase::watching;
  GivenBack reason_ = GivenBack::no;
  bool release_ = false;
  bool engage_ = false;          // as soon as may_probe
  bool resume_ = false;          // the same, after a hand-over
  double output_ = 0.0;          // CO while active
  double virtual_output_ = 0.0;  // CO in shadow
  double leg_s_ = 0.0;           // since the leg began
  double from_ = 0.0;            // stem when the leg began
  double leg_to_ = 0.0;          // where it is to end
  double wanted_ = 0.0;          // w
  double pushed_ = 0.0;          // CO units that CO was pushed on in this leg
  double planned_for_ = 0.0;     // SP of the last plan
  bool for_set_point_ = false;   // the last plan followed the set point
  double since_plan_s_ = 0.0;
  double passed_room_ = 0.0;   // h^2 - m^2 of the moves so far, forgetting
  double passed_s_ = 0.0;      // the time that they took
  double rested_s_ = 0.0;      // since the last landing
  double stood_at_ = 0.0;      // stem before the move
  double load_before_ = 0.0;   // d before the move
  double doubt_before_ = 0.0;  // P before the move
  bool answer_due_ = false;
  bool slipped_ = false;        // the stem moved by itself
  std::uint32_t followed_ = 0;  // samples in a row in which the stem has followed the probe
  std::uint32_t unanswered_ = 0;
  std::uint32_t stands_ = 0;  // moves in a row that did not move the stem
  // since the last of them, until the next move
  double since_stood_s_ = std::numeric_limits<double>::infinity();
  std::uint32_t suspicious_ = 0;  // landings as of a valve without friction
  std::uint32_t moves_ = 0;
  std::uint32_t moves_since_probe_ = 0;
  double since_probe_s_ = 0.0;
  std::uint32_t given_back_ = 0;  // times
  double again_s_ = 0.0;          // when to watch again
};

}  // namespace loopwarden::control
