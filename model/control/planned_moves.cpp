// SPDX-License-Identifier: Apache-2.0
#include "model/control/planned_moves.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/compensator_contract.hpp"

namespace loopwarden::control {
namespace {

constexpr double kModelError = 0.15;        // of a move that the model has still to go
constexpr double kGainError = 0.1;          // of a move, for good
constexpr double kSingle = 1.08;            // of j: what one move can do
constexpr double kDetour = 1.15;            // of j
constexpr double kProbe = 0.35;             // of s
constexpr double kProbeAgain = 10.0;        // cycles
constexpr double kLate_s = 10.0;            // after a move that did not move the stem
constexpr double kFollows = 0.4;            // of a probe
constexpr std::uint32_t kConfirmed = 3;     // samples in a row
constexpr double kShown = 0.4;              // of L + T
constexpr double kTravel = 0.95;            // of that without
constexpr double kActuator = 1.0;           // s, lag of an actuator that was not told, at first
constexpr double kDoubt = 4.0;              // z^2 of P
constexpr std::uint32_t kCycles = 4;        // of a window
constexpr double kLeastWatched = 3.0;       // cycles
constexpr std::uint32_t kMostWatched = 10;  // cycles
constexpr double kSure = 0.15;              // of v0, its standard error
constexpr double kNoGain = 1.1;             // mean RMS of the windows over that without
constexpr double kWindowWeight = 0.4;       // of the newest window in that mean
constexpr std::uint32_t kWindows = 4;       // before it is judged
constexpr std::uint32_t kStands = 2;        // moves in a row that did not move the stem
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
  output_before_ = output;
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
  return std::max(3.0 * period_s_, 5.0 * actuator_s_);
}

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

void PlannedMoves::follow_read_back(double position, double output) noexcept {
  Stem& stem = stem_;
  if (!stem.known) {
    stem = {
        .known = true, .place = position, .before = position, .last = position, .averaged = 1.0};
  }
  const double change = position - stem.last;
  const double zone_now = zone();
  if (std::abs(change) < 1.5 * zone_now)
    read_back_variance_ += 0.02 * (0.5 * squared(change) - read_back_variance_);
  if (change != 0.0) read_back_step_ = std::min(read_back_step_, std::abs(change));
  stem.moved = false;
  stem.stood_s += period_s_;
  stem.off = std::abs(position - stem.place) > zone_now ? stem.off + 1 : 0;
  if (stem.off >= 2) {
    const double sign = sign_of(position - stem.place);
    const bool stood = stem.stood_s >= 8.0 * period_s_;
    // It moved a period ago, of the command before.
    if (phase_ == MovePhase::watching && stood && settings_.j > 2.5 * zone_now) {
      Direction& way_now = way(sign);
      const double broke = output_before_ - stem.place;
      const double stands = output_before_ - stem.last;
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
  output_before_ = output;
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
  low_ = in.output_low;
  high_ = in.output_high;
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
    follow_law(virtual_stem_, output_);
    virtual_process_.step(virtual_stem_.place);
    error_ += process_.value() - virtual_process_.value();
  }
}

// ---- the loop without compensator

void PlannedMoves::watch(const CompensatorInputs& in) noexcept {
  const double margin =
      std::max(4.0 * std::sqrt(noise_variance_), 0.1 * std::abs(settings_.gain) * settings_.j);
  if (std::abs(in.set_point - set_point_seen_) > margin) {
    set_point_seen_ = in.set_point;
    skip_until_s_ = now_s_ + settings_.dead_time_s + 2.0 * answer_s_;
  }
  const int side = error_ > margin ? 1 : error_ < -margin ? -1 : 0;
  if (side != 0 && side != side_) {
    if (side_ != 0) ++flips_;
    side_ = side;
    if (flips_ == 1) {
      first_flip_s_ = now_s_;
      travel_ = squares_ = counted_s_ = cycles_mean_ = cycles_spread_ = 0.0;
    } else if (flips_ % 2 == 1 && cycle_counted_s_ > 0.0) {
      const double mean = cycle_squares_ / cycle_counted_s_;
      const double off = mean - cycles_mean_;
      const auto cycles = flips_ / 2;
      cycles_mean_ += off / static_cast<double>(cycles);
      cycles_spread_ += off * (mean - cycles_mean_);
    }
    if (flips_ % 2 == 1) cycle_squares_ = cycle_counted_s_ = 0.0;
  }
  if (flips_ == 0) return;
  if (now_s_ >= skip_until_s_) {
    squares_ += squared(error_) * period_s_;
    counted_s_ += period_s_;
    cycle_squares_ += squared(error_) * period_s_;
    cycle_counted_s_ += period_s_;
  }
  const double cycles = 0.5 * (flips_ - 1.0);
  if (cycles < kLeastWatched || counted_s_ <= 0.0 || lost_ > 0) return;
  // A read-back in which nothing slips while the loop cycles is none, where slips can be seen at all.
  const bool shows_slips = travel_ > 0.3 * jump() * cycles;
  if (seen() && !shows_slips && settings_.j > 2.0 * zone()) return;
  const double error = std::sqrt(cycles_spread_ / (cycles * std::max(1.0, cycles - 1.0)));
  if (cycles < kMostWatched && error > kSure * cycles_mean_) return;
  const double watched_s = now_s_ - first_flip_s_;
  variance_without_ =
      std::max(squares_ / counted_s_ - noise_variance_,
               std::max(squared(0.1 * settings_.gain * settings_.j), 0.01 * noise_variance_));
  travel_rate_without_ = std::max(travel_, jump() * cycles) / watched_s;
  cycle_s_ = watched_s / cycles;
  engage(in);
}

void PlannedMoves::engage(const CompensatorInputs& in) noexcept {
  output_ = in.applied;
  virtual_stem_ = stem_;
  virtual_stem_.output = output_;
  virtual_process_ = process_;
  window_squares_ = window_s_ = too_large_s_ = 0.0;
  gain_ = 0.0;
  windows_ = unanswered_ = stands_ = suspicious_ = moves_ = 0;
  since_stood_s_ = kNever;
  tokens_ = 2.0;
  budget_ = 8.0 * jump();
  candidate_ = 0;
  best_cost_ = kNever;
  threshold_ = 0.5 * std::abs(settings_.gain) * jump();
  left_ = 0.0;
  answer_due_ = slipped_ = false;
  planned_for_ = in.set_point;
  reason_ = GivenBack::no;
  if (!seen()) load_variance_ = squared(settings_.gain * jump());
  begin_probe(in);
}

void PlannedMoves::supervise(const CompensatorInputs& in) noexcept {
  if (settings_.read_back &&
      static_cast<double>(lost_) * period_s_ > std::max(3.0 * period_s_, 0.25 * answer_s_))
    return give_back(GivenBack::read_back_lost);
  const double margin =
      std::max(4.0 * std::sqrt(noise_variance_), 0.1 * std::abs(settings_.gain) * settings_.j);
  if (std::abs(in.set_point - set_point_seen_) > margin) {
    set_point_seen_ = in.set_point;
    skip_until_s_ = now_s_ + settings_.dead_time_s + 2.0 * answer_s_;
  }
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
  const double largest =
      5.0 * std::sqrt(variance_without_) + std::abs(settings_.gain) * settings_.s;
  too_large_s_ = counts && std::abs(error_) > largest ? too_large_s_ + period_s_ : 0.0;
  if (too_large_s_ > 3.0 * settings_.dead_time_s + 5.0 * settings_.time_constant_s)
    give_back(GivenBack::error_too_large);
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

void PlannedMoves::look_at_a_threshold() noexcept {
  const double gain = std::abs(settings_.gain);
  const double j = jump();
  const double landing = std::max(gain * std::sqrt(landing_variance_), 1e-3 * gain * j);
  const double least = 1.5 * landing;
  const double most = std::max(2.0 * least, 3.0 * gain * j + 2.0 * std::sqrt(variance_without_));
  const double h =
      least * std::pow(most / least, static_cast<double>(candidate_) / (kThresholds - 1));
  const double walk = this->walk();
  const double detour = kDetour * j;
  const double pulse = settings_.time_constant_s > 0.0
                           ? squared(gain * detour * 2.0 * settle_s() / settings_.time_constant_s) *
                                 settings_.time_constant_s / 2.0
                           : squared(gain * detour) * 2.0 * settle_s();
  for (const double share : {0.0, -0.3, -0.6, -0.85}) {
    const double m = share * h;
    const double room = squared(h) - squared(m);
    const double rate = 1.0 / (room / walk + kShown * answer_s_);
    const double way = (h - m) / gain;
    const bool single = way >= kSingle * j;
    const double travel = rate * (single ? way : way + 2.0 * detour);
    const double variance =
        (squared(h) + squared(m)) / 6.0 + squared(landing) +
        rate * ((settings_.dead_time_s + 0.5 * settings_.time_constant_s) * room +
                (single ? 0.0 : pulse));
    const double over_travel = travel / (kTravel * travel_rate_without_) - 1.0;
    const double over_moves = rate * 3600.0 / settings_.max_moves_per_hour - 1.0;
    const double cost = variance / variance_without_ + 0.05 * travel / travel_rate_without_ +
                        10.0 * std::max(0.0, over_travel) + 10.0 * std::max(0.0, over_moves);
    if (cost < best_cost_) {
      best_cost_ = cost;
      best_threshold_ = h;
      best_left_ = m;
    }
  }
  if (++candidate_ < kThresholds) return;
  threshold_ = best_threshold_;
  left_ = best_left_;
  candidate_ = 0;
  best_cost_ = kNever;
}

// ---- phases

void PlannedMoves::begin_probe(const CompensatorInputs& in) noexcept {
  phase_ = MovePhase::probing;
  leg_s_ = 0.0;
  followed_ = 0;
  moves_since_probe_ = 0;
  since_probe_s_ = 0.0;
  pushed_ = 0.0;
  output_ = std::clamp(output_, in.output_low, in.output_high);
}

void PlannedMoves::probe() noexcept {
  if (shadow_) {
    phase_ = MovePhase::resting;
    return;
  }
  const double wait_s = seen() ? std::max(4.0, answer_s_) + settle_s()
                               : settings_.dead_time_s + 3.0 * settings_.time_constant_s;
  if (pushed_ == 0.0) {
    // What the stem still has to go of the law's own moves is not to count.
    if (leg_s_ < settle_s() + 5.0 * period_s_ || lost_ > 0) return;
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
  const bool new_set_point = std::abs(in.set_point - planned_for_) > threshold_;
  const bool waits = may_be_late || (slipped_ && answer_due_);
  if (waits && !new_set_point) return;
  const bool long_ago = seen() && !answer_due_ && since_probe_s_ > kProbeAgain * cycle_s_;
  const bool doubtful = slipped_ || suspicious_ >= 2 || moves_since_probe_ >= 25 || long_ago;
  if (doubtful && !waits) {
    slipped_ = false;
    suspicious_ = 0;
    return begin_probe(in);
  }
  const double error = in.set_point - settings_.gain * stem().place - load_;
  const double strained = budget_ < 0.0 && !new_set_point ? 1.0 - budget_ / (4.0 * jump()) : 1.0;
  const double pays = std::sqrt(squared(threshold_ * strained) + kDoubt * load_variance_);
  const bool shown = rested_s_ > kShown * answer_s_ + settle_s();
  if (std::abs(error) > pays && (shown || new_set_point) && may_move(1.0) && lost_ == 0)
    plan(in, error);
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
  const double lowest = in.output_low - way(-1.0).stands;
  const double highest = in.output_high - way(1.0).stands;
  wanted_ = std::clamp(place + delta, lowest, highest);
  delta = wanted_ - place;
  if (delta * sign <= 0.0) return;
  const double detour = kDetour * (seen() ? j : sure_jump());
  const bool single = delta * sign > kSingle * sure_jump();
  // There and back are two moves of the stem, the longer one by the detour longer than the way.
  if (!single && (detour + delta * sign > settings_.max_move || !may_move(2.0))) return;
  if (single) {
    phase_ = MovePhase::moving;
    start_leg(wanted_, wanted_ + way(sign).stands);
  } else {
    const double back = place - sign * detour;
    const double back_output = place +
                               (-sign) * std::max(std::abs(way(-sign).stands - middle()) + detour,
                                                  1.05 * sure_force(-sign)) +
                               middle();
    if (back_output >= in.output_low && back_output <= in.output_high) {
      phase_ = MovePhase::backing_off;
      start_leg(back, back_output);
    } else {
      const double past = wanted_ + sign * detour;
      const double past_output = past + way(sign).stands;
      if (past_output < in.output_low || past_output > in.output_high) return;
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
  if (stem_.stood_s < std::max(samples * period_s_, 0.7 * took_s)) return false;
  if (pushed_ <= 0.0)
    actuator_s_ += 0.5 * (std::max(0.0, took_s - 2.0 * period_s_) / 4.0 - actuator_s_);
  return true;
}

// Without a read-back nobody knows whether the stem has moved: CO stays until it is back, or the loop is given back.
bool PlannedMoves::waits_for_read_back() noexcept {
  if (!seen() || lost_ == 0) return false;
  leg_s_ -= period_s_;
  return true;
}

void PlannedMoves::back_off() noexcept {
  if (waits_for_read_back()) return;
  const double sign = sign_of(leg_to_ - from_);
  if (!seen()) {
    if (leg_s_ < std::max(period_s_, 5.0 * actuator_s_)) return;
  } else {
    const double gone = (stem_.place - from_) * sign;
    const bool moved = gone > 0.3 * jump();
    if (moved) {
      if (!stands_now(2.0)) return;
    } else {
      if (leg_s_ < settle_s()) return;
      const double step = band() * period_s_ / std::max({3.0, 10.0 * period_s_, 5.0 * actuator_s_});
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

void PlannedMoves::move() noexcept {
  if (waits_for_read_back()) return;
  const double sign = sign_of(leg_to_ - from_);
  if (!seen()) {
    if (leg_s_ < settle_s()) return;
    return landed();
  }
  const double gone = (stem_.place - from_) * sign;
  if (gone > 0.3 * std::abs(leg_to_ - from_)) {
    if (!stands_now(4.0)) return;
    return landed();
  }
  if (leg_s_ < settle_s()) return;
  const double step = band() * period_s_ / std::max({3.0, 10.0 * period_s_, 5.0 * actuator_s_});
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
  const double stands = output_ - place;
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

Correction PlannedMoves::step(const CompensatorInputs& in) noexcept {
  observe(in);
  release_ = false;
  leg_s_ += period_s_;
  since_plan_s_ += period_s_;
  since_probe_s_ += period_s_;
  hour_.pass(period_s_);
  acted_.pass(period_s_);
  if (engage_) {
    engage_ = false;
    engage(in);
  } else if (phase_ == MovePhase::given_back) {
    if (now_s_ > again_s_ && lost_ == 0) {
      phase_ = MovePhase::watching;
      flips_ = 0;
      side_ = 0;
    }
  } else if (phase_ == MovePhase::watching) {
    watch(in);
  } else {
    supervise(in);
    look_at_a_threshold();
    tokens_ = std::min(tokens_ + settings_.max_moves_per_hour * period_s_ / 3600.0,
                       std::max(2.0, settings_.max_moves_per_hour / 6.0));
    budget_ = std::min(budget_ + kTravel * travel_rate_without_ * period_s_, 15.0 * jump());
    switch (phase_) {
      case MovePhase::probing: probe(); break;
      case MovePhase::resting: rest(in); break;
      case MovePhase::backing_off: back_off(); break;
      case MovePhase::moving: move(); break;
      case MovePhase::watching:
      case MovePhase::given_back: break;
    }
  }
  if (!active()) return {.release = release_};
  output_ = std::clamp(output_, in.output_low, in.output_high);
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
          .for_good = phase_ == MovePhase::given_back && again_s_ == kNever,
          .shadow = shadow_};
}

}  // namespace loopwarden::control
