// SPDX-License-Identifier: Apache-2.0
#include "model/control/planned_moves.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/control/compensator_contract.hpp"

namespace loopwarden::control {
namespace {

constexpr double kModelError = 0.15;     // of a move that the model has still to go
constexpr double kGainError = 0.1;       // of a move, for good
constexpr double kSingle = 1.08;         // of j: what one move can do
constexpr double kDetour = 1.15;         // of j
constexpr double kProbe = 0.35;          // of s
constexpr double kProbeAgain = 10.0;     // cycles
constexpr double kLate_s = 10.0;         // after a move that did not move the stem
constexpr double kProbe_s = 4.0;         // for the stem to follow, beside the actuator's time
constexpr double kFollows = 0.4;         // of a probe
constexpr std::uint32_t kConfirmed = 3;  // samples in a row
constexpr double kReadBack_s = 1.0;      // between two of its values, until two are seen
constexpr double kShown = 0.4;           // of L + T
constexpr double kTravel = 0.95;         // of that without
constexpr double kActuator = 1.0;        // s, lag of an actuator that was not told, at first
constexpr double kDoubt = 4.0;           // z^2 of P
constexpr std::uint32_t kCycles = 4;     // of a window
constexpr double kSure = 0.15;           // of v0, its standard error
constexpr double kMostError = 3.0;       // of sqrt(v0): no h is larger
constexpr double kDebt = 2.0;            // cycles of v0 that the squared error may exceed v0 by
constexpr double kCredit = 1.0;          // cycles of v0 that may be saved against that
constexpr double kMostSquares = 16.0;    // of v0: what a squared error counts at most
constexpr double kProbeCost = 0.5;       // of the debt allowed
constexpr double kNoGain = 1.1;          // mean RMS of the windows over that without
constexpr double kWindowWeight = 0.4;    // of the newest window in that mean
constexpr std::uint32_t kWindows = 4;    // before it is judged
constexpr std::uint32_t kStands = 2;     // moves in a row that did not move the stem
constexpr std::uint32_t kThresholds = 60;
constexpr double kNever = std::numeric_limits<double>::infinity();

double sign_of(double x) noexcept { return x < 0.0 ? -1.0 : 1.0; }
double squared(double x) noexcept { return x * x; }
double low_of(double low, double value) noexcept { return low > 0.0 ? low : value; }

}  // namespace

// ---- process

void PlannedMoves::Process::set(const PlannedMovesSettings& settings, double period_s) noexcept {
  gain_ = settings.gain;
  approach_ =
      settings.time_constant_s > 0.0 ? -std::expm1(-period_s / settings.time_constant_s) : 1.0;
  const double periods = std::min(settings.dead_time_s / period_s, 1e9);
  stride_ = 1 + static_cast<std::size_t>(periods / 250.0);
  back_ = std::min(kSlots - 1,
                   static_cast<std::size_t>(std::lround(periods / static_cast<double>(stride_))));
}

void PlannedMoves::Process::reset(double stem) noexcept {
  stems_.fill(static_cast<float>(stem));
  y_ = gain_ * stem;
  phase_ = 0;
}

void PlannedMoves::Process::step(double stem) noexcept {
  if (phase_ == 0) newest_ = (newest_ + 1) % kSlots;
  stems_[newest_] = static_cast<float>(stem);
  phase_ = (phase_ + 1) % stride_;
  const double delayed = static_cast<double>(stems_[(newest_ + kSlots - back_) % kSlots]);
  y_ += approach_ * (gain_ * delayed - y_);
}

// ---- the last hour

PlannedMoves::LastHour::LastHour(double max_per_hour) noexcept
    : part_s_(60.0 / std::min(1.0, max_per_hour)), most_(std::max(1.0, std::floor(max_per_hour))) {}

void PlannedMoves::LastHour::pass(double period_s) noexcept {
  for (since_s_ += period_s; since_s_ >= part_s_; since_s_ -= part_s_) {
    newest_ = (newest_ + 1) % parts_.size();
    made_ -= static_cast<double>(parts_[newest_]);
    parts_[newest_] = 0.0F;
  }
}

void PlannedMoves::LastHour::add() noexcept {
  made_ += 1.0;
  parts_[newest_] += 1.0F;
}

void PlannedMoves::LastHour::take_over(const LastHour& other) noexcept {
  const LastHour limit = *this;
  *this = other;
  most_ = limit.most_;
  if (part_s_ == limit.part_s_) return;
  // Of parts of another length nothing is known but how many: they count as new.
  part_s_ = limit.part_s_;
  parts_.fill(0.0F);
  parts_[newest_] = static_cast<float>(made_);
  since_s_ = 0.0;
}

// ---- what is there

PlannedMoves::PlannedMoves(const PlannedMovesSettings& settings, bool shadow,
                           double period_s) noexcept
    : settings_(settings),
      shadow_(shadow),
      period_s_(period_s),
      answer_s_(settings.dead_time_s + settings.time_constant_s),
      hour_(settings.max_moves_per_hour),
      acted_(settings.max_moves_per_hour) {
  process_.set(settings, period_s);
  virtual_process_.set(settings, period_s);
}

void PlannedMoves::reset(double output) noexcept {
  const PlannedMoves before = *this;
  *this = PlannedMoves(settings_, shadow_, period_s_);
  continue_hour(before);
  const double fs = 0.5 * (settings_.s + settings_.j);
  const double fd = 0.5 * (settings_.s - settings_.j);
  ways_[0] = {.breaks = -fs, .stands = -fd};
  ways_[1] = {.breaks = fs, .stands = fd};
  read_back_variance_ = squared(0.05 * settings_.j);
  load_variance_ = squared(settings_.gain * settings_.s);
  landing_variance_ = squared(0.03 * settings_.j +
                              0.1 * (settings_.j_high - low_of(settings_.j_low, settings_.j_high)));
  actuator_s_ = settings_.actuator_lag_s > 0.0 || !seen() ? settings_.actuator_lag_s : kActuator;
  output_ = output;
  if (settings_.read_back)
    renewal_ = static_cast<std::size_t>(std::max(1.0, kReadBack_s / period_s_));
  best_cost_ = kNever;
}

double PlannedMoves::jump() const noexcept {
  const double learnt =
      0.5 * ((ways_[1].breaks - ways_[1].stands) + (ways_[0].stands - ways_[0].breaks));
  return std::clamp(learnt, 0.6 * low_of(settings_.j_low, settings_.j),
                    1.6 * std::max(settings_.j_high, settings_.j));
}

double PlannedMoves::band() const noexcept {
  const double learnt =
      0.5 * ((ways_[1].breaks - ways_[0].stands) + (ways_[1].stands - ways_[0].breaks));
  return std::clamp(learnt, 0.6 * low_of(settings_.s_low, settings_.s),
                    1.6 * std::max(settings_.s_high, settings_.s));
}

// Without a read-back nothing tells of a stem that did not move.
double PlannedMoves::sure_jump() const noexcept {
  return seen() ? jump() : reach_ * std::max(jump(), settings_.j_high);
}

double PlannedMoves::sure_force(double sign) const noexcept {
  const double force = std::abs(way(sign).breaks - middle());
  if (seen()) return force;
  return reach_ * std::max(force, 0.5 * (std::max(settings_.s, settings_.s_high) +
                                         std::max(settings_.j, settings_.j_high)));
}

double PlannedMoves::zone() const noexcept {
  // A slip is no step of the converter.
  const double step = read_back_step_ < 0.2 * settings_.j ? 1.5 * read_back_step_ : 0.0;
  return std::max({4.5 * std::sqrt(read_back_variance_), step, 1e-3 * settings_.s});
}

double PlannedMoves::settle_s() const noexcept {
  return std::max(3.0 * sample_s(), 5.0 * actuator_s_);
}

double PlannedMoves::push_per_period(const CompensatorInputs& in) const noexcept {
  const double time_s = std::max({3.0, 10.0 * sample_s(), 5.0 * actuator_s_});
  return std::min(band() / time_s, 0.5 * in.limits.rate_per_s) * period_s_;
}

double PlannedMoves::ramp_s(double way) const noexcept { return way / rate_per_s_; }

void PlannedMoves::moved_to(Stem& stem, double place) noexcept {
  // In shadow the real stem goes on under the law alone.
  if (&stem == (shadow_ && active() ? &virtual_stem_ : &stem_))
    travel_ += std::abs(place - stem.place);
  stem.before = stem.place;
  stem.place = place;
  stem.averaged = 1.0;
  stem.off = 0;
  stem.stood_s = 0.0;
  stem.moved = true;
}

void PlannedMoves::follow_law(Stem& stem, double output) noexcept {
  if (!stem.known) stem = {.known = true, .place = output - middle(), .output = output};
  stem.moved = false;
  stem.stood_s += period_s_;
  const double change = output - stem.output;
  stem.output = output;
  const double force = output - stem.place;
  if (change * stem.going <= 0.0) stem.going = 0.0;
  if (force > ways_[1].breaks) stem.going = 1.0;
  if (force < ways_[0].breaks) stem.going = -1.0;
  if (stem.going != 0.0) moved_to(stem, output - way(stem.going).stands);
}

// A read-back that a gateway holds is renewed where it changes, and where it could have changed
// and did not.
bool PlannedMoves::renewed(bool changed) noexcept {
  ++since_renewal_;
  if (changed) {
    if (changed_before_) renewal_ = std::min(renewal_, since_change_ + 1);
    changed_before_ = true;
    since_change_ = 0;
  } else {
    ++since_change_;
  }
  const bool due = 2 * since_renewal_ + 1 >= 3 * renewal_;
  if (!changed && !due) return false;
  since_renewal_ = 0;
  return true;
}

void PlannedMoves::follow_read_back(double position, double output) noexcept {
  Stem& stem = stem_;
  if (!stem.known) {
    stem = {
        .known = true, .place = position, .before = position, .last = position, .averaged = 1.0};
  }
  stem.moved = false;
  stem.stood_s += period_s_;
  const double change = position - stem.last;
  renewed_ = renewed(std::abs(change) > 1e-6 * settings_.s);
  if (!renewed_) return;
  const double zone_now = zone();
  if (std::abs(change) < 1.5 * zone_now)
    read_back_variance_ += 0.02 * (0.5 * squared(change) - read_back_variance_);
  if (change != 0.0) read_back_step_ = std::min(read_back_step_, std::abs(change));
  stem.off = std::abs(position - stem.place) > zone_now ? stem.off + 1 : 0;
  if (stem.off == 1) output_at_slip_ = output;
  if (stem.off >= 2) {
    const double sign = sign_of(position - stem.place);
    const bool stood = stem.stood_s >= 8.0 * sample_s();
    if (phase_ == MovePhase::watching && stood && settings_.j > 2.5 * zone_now) {
      Direction& way_now = way(sign);
      const double broke = output_at_slip_ - stem.place;
      const double stands = output_at_slip_ - stem.last;
      way_now.break_weight = std::max(0.25, way_now.break_weight / (1.0 + way_now.break_weight));
      way_now.stand_weight = std::max(0.25, way_now.stand_weight / (1.0 + way_now.stand_weight));
      way_now.breaks += way_now.break_weight * (broke - way_now.breaks);
      way_now.stands += way_now.stand_weight * (stands - way_now.stands);
    }
    moved_to(stem, position);
  } else if (stem.off == 0) {
    stem.averaged = std::min(stem.averaged + 1.0, 200.0);
    stem.place += (position - stem.place) / stem.averaged;
  }
  stem.last = position;
}

void PlannedMoves::watch_load(double process_variable) noexcept {
  if (!process_variable_known_) {
    process_variable_known_ = true;
    last_process_variable_ = process_variable;
    process_.reset(stem_.place);
    load_ = process_variable - process_.value();
  }
  const double change = process_variable - last_process_variable_;
  last_process_variable_ = process_variable;
  noise_variance_ += 0.01 * (0.5 * squared(change) - noise_variance_);

  process_.step(stem_.place);
  const double to_go = settings_.gain * stem_.place - process_.value();
  const double samples = std::max(1.0, answer_s_ / period_s_);
  const double unsure = squared(kModelError * to_go);
  const double least_load =
      0.002 * std::abs(settings_.gain) * settings_.j / std::sqrt(std::max(answer_s_, period_s_));
  load_variance_ += squared(std::max(settings_.load, least_load)) * period_s_;
  const double innovation = process_variable - process_.value() - load_;
  const double weight = std::min(1.0, period_s_ / std::max(answer_s_, period_s_));
  one_sided_ += weight * (innovation - one_sided_);
  const double expected = 0.5 * noise_variance_ * weight + load_variance_ + 4.0 * unsure;
  if (squared(one_sided_) > 9.0 * expected) load_variance_ += weight * squared(one_sided_);
  const double share =
      load_variance_ / (load_variance_ + noise_variance_ +
                        1e-12 * squared(settings_.gain * settings_.s) + samples * unsure);
  load_ += share * innovation;
  load_variance_ *= 1.0 - share;
}

void PlannedMoves::observe(const CompensatorInputs& in) noexcept {
  now_s_ += period_s_;
  applied_ = in.applied;
  low_ = in.limits.low;
  high_ = in.limits.high;
  rate_per_s_ = in.limits.rate_per_s;
  set_point_ = in.set_point;
  if (settings_.read_back) {
    if (in.valve_position_valid && std::isfinite(in.valve_position)) {
      lost_ = 0;
      follow_read_back(in.valve_position, in.applied);
    } else {
      ++lost_;
      stem_.moved = false;
    }
  } else {
    follow_law(stem_, in.applied);
  }
  watch_load(in.process_variable);
  error_ = in.set_point - in.process_variable;
  if (shadow_ && active()) {
    virtual_output_ = limit_output(in.limits, output_, virtual_output_, period_s_).output;
    follow_law(virtual_stem_, virtual_output_);
    virtual_process_.step(virtual_stem_.place);
    error_ += process_.value() - virtual_process_.value();
  }
}

// ---- the loop without compensator

// What is more than noise of PV, and no slip, PV units.
double PlannedMoves::margin() const noexcept {
  return std::max(4.0 * std::sqrt(noise_variance_), 0.1 * std::abs(settings_.gain) * settings_.j);
}

void PlannedMoves::follow_set_point(const CompensatorInputs& in) noexcept {
  const double change = std::abs(in.set_point - set_point_seen_);
  if (change <= margin()) return;
  set_point_seen_ = in.set_point;
  const double way = std::min(change / std::abs(settings_.gain), high_ - low_) + band();
  skip_until_s_ = now_s_ + settings_.dead_time_s + 2.0 * answer_s_ + ramp_s(way);
}

void PlannedMoves::watch(const CompensatorInputs& in) noexcept {
  follow_set_point(in);
  const double margin = this->margin();
  const int side = error_ > margin ? 1 : error_ < -margin ? -1 : 0;
  if (side != 0 && side != side_) {
    if (side_ != 0 && ++flips_ % 2 == 1) end_cycle();
    side_ = side;
  }
  cycle_lasts_s_ += period_s_;
  if (now_s_ >= skip_until_s_) {
    cycle_squares_ += squared(error_) * period_s_;
    cycle_counted_s_ += period_s_;
  }
  if (engage_ || resume_ || cycles_ < kLeastCyclesWatched || lost_ > 0 ||
      cycle_lasts_s_ > period_s_)
    return;
  // A read-back in which nothing slips while the loop cycles is none, where slips can be seen at all.
  const bool shows_slips = cycles_travel_ > 0.3 * jump() * cycles_;
  if (seen() && !shows_slips && settings_.j > 2.0 * zone()) return;
  const double error = std::sqrt(cycles_spread_ / (cycles_ * std::max(1.0, cycles_ - 1.0)));
  if (cycles_ < kMostCyclesWatched && error > kSure * cycles_mean_) return;
  variance_without_ =
      std::max(cycles_squares_ / cycles_counted_s_ - noise_variance_,
               std::max(squared(0.1 * settings_.gain * settings_.j), 0.01 * noise_variance_));
  travel_rate_without_ = std::max(cycles_travel_, jump() * cycles_) / cycles_s_;
  cycle_s_ = cycles_s_ / cycles_;
  engage_ = true;
}

// PV has come to the same side again. What a set point's change makes of a cycle does not count.
void PlannedMoves::end_cycle() noexcept {
  if (flips_ > 1 && cycle_counted_s_ > 0.5 * cycle_lasts_s_) {
    cycles_ += 1.0;
    const double mean = cycle_squares_ / cycle_counted_s_;
    const double off = mean - cycles_mean_;
    cycles_mean_ += off / cycles_;
    cycles_spread_ += off * (mean - cycles_mean_);
    cycles_squares_ += cycle_squares_;
    cycles_counted_s_ += cycle_counted_s_;
    cycles_s_ += cycle_lasts_s_;
    cycles_travel_ += travel_;
  }
  cycle_squares_ = cycle_counted_s_ = cycle_lasts_s_ = travel_ = 0.0;
}

// CO and the stem as they are.
void PlannedMoves::take_over(const CompensatorInputs& in) noexcept {
  engage_ = resume_ = false;
  output_ = in.applied;
  virtual_output_ = output_;
  virtual_stem_ = stem_;
  virtual_stem_.output = output_;
  virtual_process_ = process_;
  from_ = leg_to_ = stem_.place;
  answer_due_ = slipped_ = false;
  planned_for_ = in.set_point;
}

void PlannedMoves::engage(const CompensatorInputs& in) noexcept {
  take_over(in);
  window_squares_ = window_s_ = 0.0;
  gain_ = debt_ = 0.0;
  windows_ = unanswered_ = stands_ = suspicious_ = moves_ = 0;
  since_stood_s_ = kNever;
  tokens_ = 2.0;
  budget_ = 8.0 * jump();
  candidate_ = 0;
  best_cost_ = kNever;
  threshold_ = 0.5 * std::abs(settings_.gain) * jump();
  left_ = 0.0;
  reason_ = GivenBack::no;
  if (!seen()) load_variance_ = squared(settings_.gain * jump());
  begin_probe(in);
}

void PlannedMoves::supervise(const CompensatorInputs& in) noexcept {
  if (settings_.read_back &&
      static_cast<double>(lost_) * period_s_ > std::max(3.0 * period_s_, 0.25 * answer_s_))
    return give_back(GivenBack::read_back_lost);
  follow_set_point(in);
  const bool counts = now_s_ >= skip_until_s_;
  if (counts) {
    window_squares_ += squared(error_) * period_s_;
    window_s_ += period_s_;
  }
  if (window_s_ >= kCycles * cycle_s_) {
    const double variance =
        std::max(1e-4 * variance_without_, window_squares_ / window_s_ - noise_variance_);
    ++windows_;
    const double weight = std::max(kWindowWeight, 1.0 / windows_);
    gain_ = std::sqrt(squared(gain_) + weight * (variance / variance_without_ - squared(gain_)));
    window_squares_ = window_s_ = 0.0;
    if (windows_ >= kWindows && gain_ > kNoGain) return give_back(GivenBack::no_gain);
  }
  if (!counts) return;
  const double excess =
      std::min(squared(error_) - noise_variance_, kMostSquares * variance_without_) -
      variance_without_;
  debt_ = std::max(debt_ + excess * period_s_, -kCredit * cycle_s_ * variance_without_);
  if (debt_ > kDebt * cycle_s_ * variance_without_) give_back(GivenBack::error_too_large);
}

// At a new set point: no move may be made that is long enough, or the law's first step is longer.
bool PlannedMoves::law_is_better(const CompensatorInputs& in, double error) const noexcept {
  const double way = std::abs(error / settings_.gain);
  return !may_move(1.0) || way > settings_.max_move || std::abs(in.output - law_before_) > way;
}

// The law goes on until a move may be made and PV is to settle near the set point.
void PlannedMoves::hand_over() noexcept {
  phase_ = MovePhase::watching;
  release_ = resume_ = true;
}

void PlannedMoves::resume(const CompensatorInputs& in) noexcept {
  take_over(in);
  phase_ = MovePhase::resting;
  rested_s_ = 0.0;
}

void PlannedMoves::give_back(GivenBack reason) noexcept {
  ++given_back_;
  const bool for_good = reason == GivenBack::valve_follows || reason == GivenBack::no_gain ||
                        reason == GivenBack::moved_late || given_back_ >= 3;
  phase_ = MovePhase::given_back;
  reason_ = reason;
  release_ = true;
  again_s_ = for_good ? kNever : now_s_ + 10.0 * cycle_s_;
}

// ---- when a move pays

// q^2 as told, and as the times between moves have it: a walk leaves (-h, h) from m after (h^2 - m^2) / q^2.
double PlannedMoves::walk() const noexcept {
  const double told = std::max(squared(settings_.load), 1e-12 * squared(settings_.gain * jump()));
  const double room = 3.0 * squared(threshold_);
  return (room + passed_room_) / (room / told + passed_s_);
}

// E of a detour from where PV settles off by `error`.
double PlannedMoves::pulse(double detour, double error) const noexcept {
  const double away_s = 2.0 * settle_s() + ramp_s(band() + detour);
  const double lag_s = settings_.time_constant_s;
  const double filled_s = away_s + (lag_s > 0.0 ? lag_s * std::expm1(-away_s / lag_s) : 0.0);
  return squared(std::abs(settings_.gain) * detour + std::abs(error)) * filled_s;
}

// What the squared error may still exceed that of the loop without compensator by.
double PlannedMoves::allowance() const noexcept {
  return kDebt * cycle_s_ * variance_without_ - std::max(0.0, debt_);
}

void PlannedMoves::look_at_a_threshold() noexcept {
  const double gain = std::abs(settings_.gain);
  const double j = jump();
  const double landing = std::max(gain * std::sqrt(landing_variance_), 1e-3 * gain * j);
  const double least = 1.5 * landing;
  const double most = kMostError * std::sqrt(variance_without_);
  if (most < least) return give_back(GivenBack::no_gain);
  const double h =
      least * std::pow(most / least, static_cast<double>(candidate_) / (kThresholds - 1));
  const double walk = this->walk();
  const double detour = kDetour * j;
  const double pulse = this->pulse(detour, h);
  for (const double share : {0.0, -0.3, -0.6, -0.85}) {
    const double m = share * h;
    const double room = squared(h) - squared(m);
    const double rate = 1.0 / (room / walk + kShown * answer_s_);
    const double way = (h - m) / gain;
    const bool single = way >= kSingle * j;
    if (!single && (detour + way > settings_.max_move || pulse > allowance())) continue;
    const double travel = rate * (single ? way : way + 2.0 * detour);
    const double variance =
        (squared(h) + squared(m)) / 6.0 + squared(landing) +
        rate * ((settings_.dead_time_s + 0.5 * settings_.time_constant_s + ramp_s(0.5 * band())) *
                    room +
                (single ? 0.0 : pulse));
    const double over_travel = travel / (kTravel * travel_rate_without_) - 1.0;
    const double over_moves = rate * 3600.0 / settings_.max_moves_per_hour - 1.0;
    const double cost = variance / variance_without_ + 0.05 * travel / travel_rate_without_ +
                        10.0 * std::max(0.0, over_travel) + 10.0 * std::max(0.0, over_moves);
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_variance_ = variance;
      best_threshold_ = h;
      best_left_ = m;
    }
  }
  if (++candidate_ < kThresholds) return;
  candidate_ = 0;
  const bool any = std::exchange(best_cost_, kNever) < kNever;
  if (!any || best_variance_ > squared(kNoGain) * variance_without_)
    return give_back(GivenBack::no_gain);
  threshold_ = best_threshold_;
  left_ = best_left_;
}

// ---- phases

// CO stands while the stem is probed: what PV settles off by must not cost more than can be made
// good.
bool PlannedMoves::may_probe(const CompensatorInputs& in) const noexcept {
  const double settles_off = in.set_point - settings_.gain * stem().place - load_;
  const double probe_s = 2.0 * settle_s() + 5.0 * sample_s() + kProbe_s + ramp_s(kProbe * band());
  const double off =
      squared(std::max(std::abs(settles_off), std::abs(error_))) + kDoubt * load_variance_;
  return (off - variance_without_) * probe_s < kProbeCost * kDebt * cycle_s_ * variance_without_;
}

void PlannedMoves::begin_probe(const CompensatorInputs& in) noexcept {
  phase_ = MovePhase::probing;
  leg_s_ = 0.0;
  followed_ = 0;
  moves_since_probe_ = 0;
  since_probe_s_ = 0.0;
  pushed_ = 0.0;
  planned_for_ = in.set_point;
  output_ = std::clamp(output_, in.limits.low, in.limits.high);
}

void PlannedMoves::probe() noexcept {
  if (shadow_) {
    phase_ = MovePhase::resting;
    return;
  }
  const double wait_s =
      seen() ? kProbe_s + settle_s() : settings_.dead_time_s + 3.0 * settings_.time_constant_s;
  if (pushed_ == 0.0) {
    // What the stem still has to go of the law's own moves is not to count.
    if (leg_s_ < settle_s() + 5.0 * sample_s() || lost_ > 0) return;
    leg_s_ = 0.0;
    from_ = stem().place;
    load_before_ = load_;
    const double side = output_ - from_ > middle() ? -1.0 : 1.0;
    pushed_ = side * kProbe * band();
    if (output_ + pushed_ > high_ || output_ + pushed_ < low_) pushed_ = -pushed_;
    output_ += pushed_;
    return;
  }
  if (followed_ > kConfirmed) return give_back(GivenBack::valve_follows);
  if (seen() && !renewed_) return;
  const double followed = seen() ? stem_.last - from_ : (load_ - load_before_) / settings_.gain;
  const bool follows = followed * sign_of(pushed_) > kFollows * std::abs(pushed_);
  followed_ = follows ? followed_ + 1 : 0;
  if (seen() ? followed_ == kConfirmed : follows && leg_s_ >= wait_s) {
    output_ -= pushed_;  // given back in the next period
    followed_ = kConfirmed + 1;
    return;
  }
  if (leg_s_ < wait_s) return;
  phase_ = MovePhase::resting;
  rested_s_ = answer_s_;
}

bool PlannedMoves::new_set_point(const CompensatorInputs& in) const noexcept {
  return std::abs(in.set_point - planned_for_) > threshold_;
}

// What a new set point asks for waits for no end of a move or a probe.
void PlannedMoves::stop(const CompensatorInputs& in) noexcept {
  if (phase_ == MovePhase::probing) suspicious_ = 2;
  phase_ = MovePhase::resting;
  output_ = shadow_ ? virtual_output_ : in.commanded;
}

void PlannedMoves::rest(const CompensatorInputs& in) noexcept {
  rested_s_ += period_s_;
  since_stood_s_ += period_s_;
  const bool may_be_late = since_stood_s_ < std::max(kLate_s, answer_s_);
  if (may_be_late && (stem_.place - from_) * sign_of(leg_to_ - from_) > 0.3 * jump())
    return give_back(GivenBack::moved_late);
  if (seen() && stem_.moved && rested_s_ > settle_s()) {
    slipped_ = true;
    rested_s_ = 0.0;
    load_before_ = load_;
    stood_at_ = stem_.before;
    doubt_before_ = load_variance_;
    answer_due_ = true;
  }
  if (answer_due_ && rested_s_ > settings_.dead_time_s + 3.0 * settings_.time_constant_s)
    judge_answer();
  if (phase_ != MovePhase::resting) return;
  // What a set point asks for waits for neither.
  const bool new_set_point = this->new_set_point(in);
  const bool waits = may_be_late || (slipped_ && answer_due_);
  if (waits && !new_set_point) return;
  const bool long_ago = seen() && !answer_due_ && since_probe_s_ > kProbeAgain * cycle_s_;
  const bool doubtful = slipped_ || suspicious_ >= 2 || moves_since_probe_ >= 25 || long_ago;
  const double error = in.set_point - settings_.gain * stem().place - load_;
  const double strained = budget_ < 0.0 && !new_set_point ? 1.0 - budget_ / (4.0 * jump()) : 1.0;
  const double pays = std::sqrt(squared(threshold_ * strained) + kDoubt * load_variance_);
  const bool shown = rested_s_ > kShown * answer_s_ + settle_s();
  const bool asked = new_set_point && std::abs(error) > pays;
  if (doubtful && !waits && !asked && may_probe(in)) {
    slipped_ = false;
    suspicious_ = 0;
    return begin_probe(in);
  }
  if (std::abs(error) <= pays || lost_ > 0) return;
  if (new_set_point && law_is_better(in, error)) return hand_over();
  if (!shown && !new_set_point) return;
  may_move(1.0) ? plan(in, error) : hand_over();
}

void PlannedMoves::start_leg(double to, double output) noexcept {
  leg_s_ = 0.0;
  since_stood_s_ = kNever;
  from_ = stem().place;
  leg_to_ = to;
  pushed_ = 0.0;
  output_ = std::clamp(output, low_, high_);
}

void PlannedMoves::plan(const CompensatorInputs& in, double error) noexcept {
  const double place = stem().place;
  const double j = jump();
  double delta = (error - left_ * sign_of(error)) / settings_.gain;
  delta = std::clamp(delta, -settings_.max_move, settings_.max_move);
  const double sign = sign_of(delta);
  // Where the stem can get to within the output's limits.
  const double lowest = in.limits.low - way(-1.0).stands;
  const double highest = in.limits.high - way(1.0).stands;
  if (lowest > highest) return;
  wanted_ = std::clamp(place + delta, lowest, highest);
  delta = wanted_ - place;
  if (delta * sign <= 0.0) return;
  const double detour = kDetour * (seen() ? j : sure_jump());
  const bool single = delta * sign > kSingle * sure_jump();
  // There and back are two moves of the stem, the longer one by the detour longer than the way.
  const bool detour_pays = pulse(detour, error) < allowance() && may_move(2.0);
  if (!single && (detour + delta * sign > settings_.max_move || !detour_pays)) return;
  if (single) {
    phase_ = MovePhase::moving;
    start_leg(wanted_, wanted_ + way(sign).stands);
  } else {
    const double back = place - sign * detour;
    const double back_output = place +
                               (-sign) * std::max(std::abs(way(-sign).stands - middle()) + detour,
                                                  1.05 * sure_force(-sign)) +
                               middle();
    if (back_output >= in.limits.low && back_output <= in.limits.high) {
      phase_ = MovePhase::backing_off;
      start_leg(back, back_output);
    } else {
      const double past = wanted_ + sign * detour;
      const double past_output = past + way(sign).stands;
      if (past_output < in.limits.low || past_output > in.limits.high) return;
      phase_ = MovePhase::backing_off;
      start_leg(past, past_output);
    }
  }
  for_set_point_ = std::abs(in.set_point - planned_for_) > threshold_;
  if (!for_set_point_) {
    passed_room_ = 0.9 * passed_room_ + std::max(0.0, squared(error) - squared(left_));
    passed_s_ = 0.9 * passed_s_ + since_plan_s_;
  }
  since_plan_s_ = 0.0;
  planned_for_ = in.set_point;
  stood_at_ = place;
  load_before_ = load_;
  doubt_before_ = load_variance_;
  answer_due_ = false;
  travel_ = 0.0;
  tokens_ -= single ? 1.0 : 2.0;
  count_move();
  ++moves_;
  ++moves_since_probe_;
}

// It has stood as long as it took to get there. How long that was tells of the actuator.
bool PlannedMoves::stands_now(double samples) noexcept {
  const double took_s = leg_s_ - stem_.stood_s;
  if (stem_.stood_s < std::max(samples * sample_s(), 0.7 * took_s)) return false;
  if (pushed_ <= 0.0)
    actuator_s_ += 0.5 * (std::max(0.0, took_s - 2.0 * sample_s()) / 4.0 - actuator_s_);
  return true;
}

// Without a read-back nobody knows whether the stem has moved: CO stays until it is back, or the loop is given back.
bool PlannedMoves::waits_for_read_back() noexcept {
  if (!seen() || lost_ == 0) return false;
  leg_s_ -= period_s_;
  return true;
}

void PlannedMoves::back_off(const CompensatorInputs& in) noexcept {
  if (waits_for_read_back()) return;
  const double sign = sign_of(leg_to_ - from_);
  if (!seen()) {
    if (leg_s_ < std::max(period_s_, 5.0 * actuator_s_)) return;
  } else {
    const double gone = (stem_.place - from_) * sign;
    const bool moved = gone > 0.3 * jump();
    if (moved) {
      const double on = sign_of(wanted_ - stem_.place);
      const bool far_enough = (wanted_ - stem_.place) * on > kSingle * sure_jump();
      if (leg_s_ > 0.0 ? !stands_now(2.0) : !far_enough) return;
    } else {
      if (leg_s_ < settle_s()) return;
      const double step = push_per_period(in);
      pushed_ += step;
      if (pushed_ > band()) return stood();
      output_ = std::clamp(output_ + sign * step, low_, high_);
      return;
    }
  }
  count_move();
  const double on = sign_of(wanted_ - stem().place);
  phase_ = MovePhase::moving;
  start_leg(wanted_, wanted_ + way(on).stands);
}

void PlannedMoves::move(const CompensatorInputs& in) noexcept {
  if (waits_for_read_back()) return;
  const double sign = sign_of(leg_to_ - from_);
  if (!seen()) {
    if (leg_s_ < settle_s()) return;
    return landed();
  }
  const double gone = (stem_.place - from_) * sign;
  if (gone > 0.3 * std::abs(leg_to_ - from_)) {
    if (leg_s_ <= 0.0 || !stands_now(4.0)) return;
    return landed();
  }
  if (leg_s_ < settle_s()) return;
  const double step = push_per_period(in);
  pushed_ += step;
  output_ = std::clamp(output_ + sign * step, low_, high_);
  if (pushed_ > band()) stood();
}

void PlannedMoves::stood() noexcept {
  if (++stands_ >= kStands) return give_back(GivenBack::stem_stands);
  phase_ = MovePhase::resting;
  rested_s_ = since_stood_s_ = 0.0;
}

void PlannedMoves::landed() noexcept {
  const double sign = sign_of(leg_to_ - from_);
  const double place = stem().place;
  phase_ = MovePhase::resting;
  rested_s_ = 0.0;
  stands_ = 0;
  const double moved = settings_.gain * (place - stood_at_);
  load_variance_ += squared(kGainError * moved);
  // What follows the set point is not what calm costs.
  const bool after_set_point = for_set_point_ || now_s_ < skip_until_s_;
  if (!after_set_point) budget_ = std::max(budget_ - travel_, -8.0 * jump());
  answer_due_ = !shadow_;
  if (!seen()) return;
  Direction& way_now = way(sign);
  const double stands = applied_ - place;
  if (std::abs(stands - middle()) < 0.3 * std::abs(way_now.stands - middle()) &&
      std::abs(way_now.stands - middle()) > 2.0 * zone()) {
    ++suspicious_;
  } else {
    suspicious_ = 0;
  }
  const double missed = pushed_ > 0.0 ? 0.0 : place - leg_to_;
  landing_variance_ += 0.2 * (squared(missed) - landing_variance_);
  way_now.stands += 0.5 * (stands - way_now.stands);
}

void PlannedMoves::judge_answer() noexcept {
  answer_due_ = false;
  const double expected = settings_.gain * (stem_.place - stood_at_);
  // PV that stood still shows as a load that took back the whole move.
  const double change = load_ - load_before_;
  const double doubt = doubt_before_ + load_variance_ + squared(settings_.load) * rested_s_;
  const bool tells = squared(expected) > 25.0 * doubt;
  if (!tells) return;
  if (std::abs(change + expected) < 0.4 * std::abs(expected)) {
    if (!settings_.read_back) reach_ = std::min(2.0, 1.15 * reach_);
    if (slipped_ || ++unanswered_ >= (settings_.read_back ? 2U : 6U))
      give_back(GivenBack::contradiction);
  } else {
    unanswered_ = 0;
  }
}

// CO comes no nearer to what was asked for: a leg's clock begins only then.
bool PlannedMoves::arrived(const CompensatorInputs& in) const noexcept {
  return has_arrived(in.limits, output_, shadow_ ? virtual_output_ : in.commanded, period_s_);
}

Correction PlannedMoves::step(const CompensatorInputs& in) noexcept {
  observe(in);
  release_ = false;
  leg_s_ = arrived(in) ? leg_s_ + period_s_ : 0.0;
  since_plan_s_ += period_s_;
  since_probe_s_ += period_s_;
  tokens_ = std::min(tokens_ + settings_.max_moves_per_hour * period_s_ / 3600.0,
                     std::max(2.0, settings_.max_moves_per_hour / 6.0));
  hour_.pass(period_s_);
  acted_.pass(period_s_);
  const bool may_begin = engage_ || (resume_ && may_move(1.0));
  if (may_begin && now_s_ >= skip_until_s_ && may_probe(in)) {
    engage_ ? engage(in) : resume(in);
  } else if (phase_ == MovePhase::given_back) {
    if (now_s_ > again_s_ && lost_ == 0) {
      phase_ = MovePhase::watching;
      flips_ = 0;
      side_ = 0;
      cycles_ = cycles_mean_ = cycles_spread_ = cycles_squares_ = cycles_counted_s_ = 0.0;
      cycles_s_ = cycles_travel_ = 0.0;
    }
  } else if (phase_ == MovePhase::watching) {
    watch(in);
  } else {
    supervise(in);
    if (active()) look_at_a_threshold();
    budget_ = std::min(budget_ + kTravel * travel_rate_without_ * period_s_, 15.0 * jump());
    if (active() && phase_ != MovePhase::resting && new_set_point(in)) stop(in);
    switch (phase_) {
      case MovePhase::probing: probe(); break;
      case MovePhase::resting: rest(in); break;
      case MovePhase::backing_off: back_off(in); break;
      case MovePhase::moving: move(in); break;
      case MovePhase::watching:
      case MovePhase::given_back: break;
    }
  }
  law_before_ = in.output;
  if (!active()) return {.release = release_};
  output_ = std::clamp(output_, in.limits.low, in.limits.high);
  return {.added = output_ - in.output, .hold_integral = true};
}

void PlannedMoves::count_move() noexcept {
  hour_.add();
  if (!shadow_) acted_.add();
}

void PlannedMoves::continue_hour(const PlannedMoves& before) noexcept {
  acted_.take_over(before.acted_);
  if (!shadow_) hour_ = acted_;
}

void PlannedMoves::act() noexcept {
  if (!shadow_) return;
  shadow_ = false;
  given_back_ = 0;
  reason_ = GivenBack::no;
  again_s_ = 0.0;
  hour_ = acted_;
  if (settings_.actuator_lag_s <= 0.0 && seen()) actuator_s_ = kActuator;
  engage_ = variance_without_ > 0.0;
  resume_ = false;
  phase_ = MovePhase::watching;
}

MovesState PlannedMoves::state() const noexcept {
  return {.phase = phase_,
          .reason = reason_,
          .settles_off = set_point_ - settings_.gain * stem().place - load_,
          .pays_from = std::sqrt(squared(threshold_) + kDoubt * load_variance_),
          .output = output_,
          .gain = gain_,
          .s = band(),
          .j = jump(),
          .moves = moves_,
          .cycles_watched = static_cast<std::uint8_t>(std::min(cycles_, 255.0)),
          .waits = phase_ == MovePhase::watching && (engage_ || resume_),
          .for_good = phase_ == MovePhase::given_back && again_s_ == kNever,
          .shadow = shadow_};
}

}  // namespace loopwarden::control
