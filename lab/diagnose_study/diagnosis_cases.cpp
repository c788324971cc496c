// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/diagnosis_cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"
#include "lab/diagnose_study/loop_draw.hpp"
#include "lab/diagnose_study/loop_logging.hpp"
#include "lab/diagnose_study/loop_parts.hpp"

namespace loopwarden::lab {
namespace {

using diagnosis::Cause;
using numeric::chance;
using numeric::log_uniform;

std::size_t choice(Random& random, std::size_t count) {
  return std::min(count - 1,
                  static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}

// Upper end of the random number that gives the other loops a dominant gain. Chosen because CO of
// the measured healthy loops moves in step with PV (`--compare`, phase).
constexpr double kProportionalTo = 0.65;
// Largest travel of CO about its mean, in bands, for a valve that is called sticky (`--compare`,
// travel). If a load moves CO much farther, the band has no practical effect.
constexpr double kFarthest = 1.5;

// Kinds of loops differ in time scale (dead time and lags), in logging intervals or in s, and in
// the share with a master.
struct Kind {
  const char* name;
  double share, integrating, fastest, slowest;
  double fastest_s, slowest_s;
  double mastered;
};
constexpr std::array<Kind, 5> kKinds{{{"flow", 0.40, 0.0, 0.1, 15.0, 1.0, 15.0, 0.5},
                                      {"pressure", 0.20, 0.25, 1.0, 40.0, 1.0, 200.0, 0.2},
                                      {"level", 0.25, 0.95, 0.5, 25.0, 2.0, 60.0, 0.1},
                                      {"temperature", 0.10, 0.15, 3.0, 60.0, 30.0, 1500.0, 0.1},
                                      {"analyser", 0.05, 0.0, 3.0, 30.0, 60.0, 2000.0, 0.1}}};
constexpr std::array kLoggedEach{1.0, 1.0, 2.0, 5.0, 10.0, 10.0, 30.0, 60.0};  // s
constexpr std::array kScannedEach{0.1, 0.25, 0.5, 1.0, 1.0, 2.0, 5.0};         // s
constexpr std::array kResolutions{0.024, 0.1, 0.39, 1.0};                      // % of span
constexpr double kShortestScale = 0.05;                                        // log intervals
constexpr double kLongestScale = 60.0;
constexpr double kFast = 200.0;  // s, slowest process of the kinds with rule-of-thumb tuning
constexpr double kFastestOfThumb = 5.0;  // s, closed loop
constexpr double kSlowestOfThumb = 300.0;
constexpr double kNever = 1e300;
// Conditions under which an observer labels a valve as sticking.
constexpr double kNoticedOver = 1.5;
constexpr double kNoticedNoise = 0.3;
constexpr std::size_t kNoticedSlips = 4;
constexpr std::size_t kSamplesPerSlip = 3;  // with fewer, the shape is not visible

struct Spread {
  double count = 0.0, sum = 0.0, squares = 0.0;
  void add(double x) {
    count += 1.0;
    sum += x;
    squares += x * x;
  }
  double deviation() const {
    const double mean = sum / count;
    return std::sqrt(std::max(0.0, squares / count - mean * mean));
  }
};

Cause draw_cause(Random& random) {
  const double of_cause = random.uniform();
  return of_cause < 0.30   ? Cause::stiction
         : of_cause < 0.37 ? Cause::backlash
         : of_cause < 0.47 ? Cause::tuning
         : of_cause < 0.64 ? Cause::disturbance
         : of_cause < 0.68 ? Cause::saturation
                           : Cause::none;
}

// One case: its values are drawn in the order of the functions; then the loop is run and logged.
class CaseMaker {
 public:
  CaseMaker(Random& random, Cause cause, DiagnosisCase& out, const Ingredients& ingredients)
      : random_(random), out_(out), ingredients_(ingredients) {
    out = {};
    out.cause = cause;
  }

  // Returns false if the case does not show its cause.
  bool make() {
    draw_end();
    draw_times();
    draw_tuning();
    draw_loads();
    draw_oscillation();
    draw_neighbour();
    draw_valve();
    draw_set_point();
    draw_limits();
    draw_interruptions();
    draw_measurement();
    return run() && shows_its_cause() && log();
  }

 private:
  bool has(Ingredient i) const { return ingredients_.test(static_cast<std::size_t>(i)); }
  bool has(Ingredient i, double share) { return has(i) && chance(random_, share); }
  bool is(Cause cause) const { return out_.cause == cause; }

  void draw_end() {
    valve_ = out_.cause == Cause::stiction || out_.cause == Cause::backlash;
    if (is(Cause::saturation)) {
      const double of_end = random_.uniform();
      hits_limits_ = has(Ingredient::limits) && of_end < 0.4;
      winds_up_ = has(Ingredient::windup) && of_end > 0.6;
    }
    tight_ = is(Cause::tuning) || hits_limits_;
  }

  void draw_times() {
    double of_kind = random_.uniform();
    std::size_t k = 0;
    while (k + 1 < kKinds.size() && of_kind > kKinds[k].share) of_kind -= kKinds[k++].share;
    kind_ = &kKinds[k];
    out_.kind = kind_->name;
    out_.integrating = chance(random_, kind_->integrating);
    if (has(Ingredient::seconds)) {
      out_.sample_time_s = kLoggedEach[choice(random_, kLoggedEach.size())];
      time_scale_ =
          std::clamp(log_uniform(random_, kind_->fastest_s, kind_->slowest_s) / out_.sample_time_s,
                     kShortestScale, kLongestScale);
    } else {
      out_.sample_time_s = log_uniform(random_, 0.2, 60.0);
      time_scale_ = log_uniform(random_, kind_->fastest, kind_->slowest);
    }
    samples_ = static_cast<std::size_t>(log_uniform(random_, 200.0, 3000.0));
    steps_per_sample_ =
        static_cast<std::size_t>(std::ceil(1.0 / std::min(1.0, time_scale_ / 15.0) - 1e-9));
    dt_ = 1.0 / static_cast<double>(steps_per_sample_);
    if (has(Ingredient::scan)) {
      const double scan = kScannedEach[choice(random_, kScannedEach.size())] / out_.sample_time_s;
      scan_steps_ = std::max<std::size_t>(1, static_cast<std::size_t>(scan / dt_ + 0.5));
    }
    if (has(Ingredient::filter)) {
      const double most = 3.0 * time_scale_;
      const auto lag = [&](double low, double high) {
        return std::min(most, log_uniform(random_, low, high) / out_.sample_time_s);
      };
      filter_ = chance(random_, 0.6) ? lag(0.4, 16.0) : 0.0;
      second_filter_ = chance(random_, 0.3) ? lag(0.5, 10.0) : 0.0;
    } else {
      filter_ = chance(random_, 0.35) ? random_.uniform(0.0, 0.3) * time_scale_ : 0.0;
    }
  }

  void draw_tuning() {
    // Controllers with dominant integral action let a sticking valve cycle; most well-behaved ones
    // do not.
    const double of_weight = random_.uniform();
    LoopWish wish{.integrating = out_.integrating,
                  .tight = tight_,
                  .time_scale = time_scale_,
                  .interval = dt_ * static_cast<double>(scan_steps_),
                  .filter = has(Ingredient::filter) ? filter_ + second_filter_ : 0.0};
    if (of_weight < (valve_ ? 0.6 : 0.15)) {
      wish.weight = Weight::integral;
    } else if (has(Ingredient::proportional) && !valve_ && !tight_ && of_weight < kProportionalTo) {
      wish.weight = Weight::proportional;
    }
    if (out_.integrating && !tight_ && has(Ingredient::averaging, 0.5)) {
      wish.weight = Weight::averaging;
    }
    if (kind_->slowest_s <= kFast && !tight_ && has(Ingredient::sluggish, 0.7)) {
      wish.closed_loop =
          log_uniform(random_, kFastestOfThumb, kSlowestOfThumb) / out_.sample_time_s;
    }
    loop_ = draw_loop(random_, wish);
    // Beyond the stability limit the loop oscillates within CO's limits.
    if (hits_limits_) loop_.controller.gain *= log_uniform(random_, 1.3, 4.0);
  }

  // Sizes in % of span of CO; loads act at the process input in the same unit.
  void draw_loads() {
    const ProcessDraw& p = loop_.process;
    reach_ = log_uniform(random_, 0.5, 25.0);
    process_memory_ = p.integrating ? 2.0 * p.tau2 + p.dead_time : p.tau1 + p.dead_time;
    const double load_time = process_memory_ * log_uniform(random_, 0.3, 60.0);
    load_ = reach_ * log_uniform(random_, 0.01, 0.4);
    if (!valve_) load_ = reach_ * log_uniform(random_, 0.003, 1.0);
    if (out_.cause == Cause::disturbance || tight_) {
      load_ = reach_ * log_uniform(random_, 0.01, 0.4);
    }
    wander_ = Wander(load_, std::max(load_time, 2.0 * dt_), dt_, Random(random_.bits()));
    double fast_load = chance(random_, 0.45) ? load_ * random_.uniform(0.0, 1.0) : 0.0;
    if (tight_) fast_load = std::max(fast_load, 0.1 * load_);
    flutter_ = Wander(fast_load, std::max(time_scale_ * log_uniform(random_, 0.02, 0.5), 0.5 * dt_),
                      dt_, Random(random_.bits()));
  }

  void draw_oscillation() {
    double swing = 0.0;
    const auto shape = static_cast<Oscillator::Shape>(
        chance(random_, 0.45) ? 0 : 1 + choice(random_, kShapeNames.size() - 1));
    if (out_.cause == Cause::disturbance) {
      swing = reach_;
      out_.detail = kShapeNames[static_cast<std::size_t>(shape)];
    } else if (valve_ && chance(random_, 0.15)) {
      swing = reach_ * log_uniform(random_, 0.03, 0.3);
    } else if (is(Cause::saturation) && !hits_limits_) {
      swing = chance(random_, 0.5) ? reach_ : 0.0;
    }
    if (is(Cause::disturbance) && has(Ingredient::regular, 0.35)) {
      draw_regular(swing);
      return;
    }
    const double longest = std::max(8.0, static_cast<double>(samples_) / 5.0);
    const double period = std::clamp(time_scale_ * log_uniform(random_, 1.0, 40.0), 5.0, longest);
    oscillator_ = Oscillator(
        shape, swing, period, chance(random_, 0.6) ? random_.uniform(0.0, 0.12) : 0.0,
        chance(random_, 0.6) ? random_.uniform(0.0, 0.5) : 0.0,
        chance(random_, 0.7) ? log_uniform(random_, 0.01, 0.25) : 0.0, Random(random_.bits()));
    load_at_output_ = chance(random_, 0.3) && !loop_.process.integrating;
  }

  // Draws a disturbance that is much slower than the loop and equal in all periods.
  void draw_regular(double swing) {
    using Shape = Oscillator::Shape;
    constexpr std::array kSlow{Shape::sine, Shape::triangle, Shape::sawtooth};
    const Shape shape = kSlow[choice(random_, kSlow.size())];
    out_.detail = kShapeNames[static_cast<std::size_t>(shape)];
    const double slow = std::max(8.0, time_scale_ * log_uniform(random_, 10.0, 200.0));
    const double period = std::min(slow, static_cast<double>(samples_) / 3.0);
    oscillator_ = Oscillator(shape, swing, period, 0.0, 0.0, 0.0, Random(random_.bits()));
  }

  // Flows on one header disturb each other, sticking ones too.
  void draw_neighbour() {
    const bool header = kind_->slowest_s <= kFast && !out_.integrating;
    const bool pushed = header && (is(Cause::disturbance) || valve_) &&
                        has(Ingredient::neighbour, valve_ ? 0.1 : 0.2);
    const double coupling = log_uniform(random_, 0.1, 0.6);
    const double band =
        (is(Cause::disturbance) ? reach_ / coupling : reach_) * log_uniform(random_, 0.3, 2.0);
    const ControllerDraw& c = loop_.controller;
    const double closed = c.integral_time / (c.gain * loop_.process.gain);
    neighbour_ = Neighbour(pushed ? coupling : 0.0, band, closed * log_uniform(random_, 0.3, 3.0),
                           dt_, Random(random_.bits()));
    if (pushed && is(Cause::disturbance)) {
      out_.detail = "neighbour";
      oscillator_->stop();
    }
  }

  // A healthy valve also has a little friction.
  void draw_valve() {
    Friction::Law law = Friction::Law::play;
    band_ = reach_ * random_.uniform(0.0, 0.04);
    double j = 0.0;
    if (out_.cause == Cause::stiction) {
      constexpr std::array<Friction::Law, 4> kLaws{Friction::Law::choudhury, Friction::Law::he,
                                                   Friction::Law::creeping,
                                                   Friction::Law::choudhury};
      constexpr std::array<const char*, 4> kLawNames{"choudhury", "he", "creeping", "choudhury"};
      const std::size_t i = choice(random_, kLaws.size());
      law = kLaws[i];
      out_.detail = kLawNames[i];
      band_ = reach_;
      j = band_ * (chance(random_, 0.3) ? random_.uniform(0.05, 0.3) : random_.uniform(0.3, 1.0));
      out_.size = band_;
    } else if (out_.cause == Cause::backlash) {
      band_ = reach_;
      out_.detail = "play";
      out_.size = band_;
    } else if (chance(random_, 0.3)) {
      law = Friction::Law::none;
    }
    friction_ =
        Friction(law, band_, j, valve_ ? random_.uniform(0.0, 0.25) : 0.0, Random(random_.bits()));
    before_valve_ = chance(random_, 0.5) ? random_.uniform(0.0, 0.3) * time_scale_ : 0.0;
    behind_valve_ = chance(random_, 0.4) ? random_.uniform(0.0, 0.25) * time_scale_ : 0.0;
    bend_ = random_.uniform(-0.012, 0.02);
  }

  // Draws SP: constant, an operator's steps and ramps, or the output of a master. If it moves, it
  // often moves the loop more than all other inputs.
  void draw_set_point() {
    const ProcessDraw& p = loop_.process;
    const double of_sp = random_.uniform();
    pv_swing_ = reach_ * (p.integrating ? p.gain * time_scale_ * 3.0 : p.gain);
    const bool steps = of_sp < 0.15;
    ramps_ = of_sp >= 0.15 && of_sp < 0.22;
    const double mastered_to = 0.22 + (has(Ingredient::master) ? kind_->mastered : 0.20);
    const bool mastered = of_sp >= 0.22 && of_sp < mastered_to;
    const double leads = mastered && has(Ingredient::master) ? 1.0 : 0.7;
    const bool set_point_leads = of_sp < mastered_to && !valve_ && chance(random_, leads);
    lead_ = set_point_leads ? log_uniform(random_, 1.0, 6.0) : 1.0;
    const double least = has(Ingredient::master) && set_point_leads ? 0.5 : 0.1;
    const double swing = mastered ? lead_ * pv_swing_ * log_uniform(random_, least, 1.5) : 0.0;
    master_ =
        Wander(swing, time_scale_ * log_uniform(random_, 2.0, 100.0), dt_, Random(random_.bits()));
    if (mastered && has(Ingredient::master)) {
      master_noise_ = swing * log_uniform(random_, 0.02, 1.0);
      master_steps_ = scan_steps_ * (1 + choice(random_, 5));
      master_source_ = Random(random_.bits());
    }
    next_step_ =
        steps || ramps_ ? random_.uniform(0.0, 0.7) * static_cast<double>(samples_) : kNever;
    ramp_rate_ = lead_ * pv_swing_ / (time_scale_ * log_uniform(random_, 3.0, 60.0));
    out_.mover = out_.cause == Cause::disturbance ? "oscillation"
                 : tight_                         ? "tuning"
                 : steps || ramps_ || mastered    ? "set point"
                 : valve_ && load_ < 0.1 * reach_ ? "valve"
                                                  : "load";
  }

  void draw_limits() {
    u0_ = 50.0 + random_.uniform(-25.0, 25.0);
    if (!is(Cause::saturation) || hits_limits_) return;
    // The valve would exceed its limit during much of the record.
    const double room = reach_ * random_.uniform(0.0, 0.5);
    if (winds_up_) {
      chance(random_, 0.5) ? (valve_high_ = u0_ + room) : (valve_low_ = u0_ - room);
    } else {
      chance(random_, 0.5) ? (high_ = u0_ + room) : (low_ = u0_ - room);
    }
  }

  // Draws an analyser that holds its values, an upset of the plant, and a stretch in manual.
  void draw_interruptions() {
    if (out_.kind == std::string("analyser")) {
      hold_ = steps_per_sample_ * static_cast<std::size_t>(std::clamp(
                                      time_scale_ * random_.uniform(0.1, 0.5), 2.0, 20.0));
    }
    const double length = static_cast<double>(samples_);
    upset_from_ = chance(random_, 0.12) ? random_.uniform() * length : kNever;
    upset_to_ = upset_from_ + time_scale_ * log_uniform(random_, 0.5, 8.0);
    upset_ = reach_ * random_.uniform(-4.0, 4.0);
    manual_from_ = chance(random_, 0.06) ? random_.uniform(0.0, 0.8) * length : kNever;
    manual_to_ = manual_from_ + length * random_.uniform(0.03, 0.2);
  }

  void draw_measurement() {
    noise_ = pv_swing_ * (chance(random_, 0.25) ? 0.0 : log_uniform(random_, 0.002, 0.2));
    averaged_ = chance(random_, 0.3);
    leak_ = loop_.process.integrating ? 1.0 / (process_memory_ * log_uniform(random_, 20.0, 400.0))
                                      : 0.0;
    noise_source_ = Random(random_.bits());
  }

  // Returns the share of a step to which a lag of `time` responds in one time step.
  double follow(double time) const { return time > dt_ ? 1.0 - std::exp(-dt_ / time) : 1.0; }

  double set_point(double t, bool logging) {
    if (logging && t >= next_step_) {
      step_level_ += lead_ * pv_swing_ * random_.uniform(-2.0, 2.0);
      next_step_ += log_uniform(random_, 0.2, 1.0) * static_cast<double>(samples_);
    }
    const double most = ramp_rate_ * dt_;
    sp_level_ = ramps_ ? std::clamp(step_level_, sp_level_ - most, sp_level_ + most) : step_level_;
    const double wanted = master_->step();
    // A master with its own scan and with the noise of its PV.
    if (master_noise_ <= 0.0) return sp_level_ + wanted;
    if (until_master_ == 0) {
      until_master_ = master_steps_;
      from_master_ = wanted + master_noise_ * master_source_->normal();
    }
    --until_master_;
    return sp_level_ + from_master_;
  }

  // Computes CO until the next scan.
  void control(double sp, bool manual) {
    const ControllerDraw& c = loop_.controller;
    const double scan = dt_ * static_cast<double>(scan_steps_);
    const double error = sp - measured_;
    double now = c.gain * error;
    if (c.derivative_time > 0.0) {
      const double slow_before = derivative_state_;
      const double lag = 0.1 * c.derivative_time + scan;
      derivative_state_ += (1.0 - std::exp(-scan / lag)) * (measured_ - derivative_state_);
      now -= c.gain * c.derivative_time * (derivative_state_ - slow_before) / scan;
    }
    if (manual) integral_ = u_ - now;
    const double wish = now + integral_;
    u_ = std::clamp(wish, low_, high_);
    if (!manual && (wish == u_ || (wish - u_) * error < 0.0)) {
      integral_ += c.gain * error * scan / c.integral_time;
    }
  }

  // Returns false if the loop diverges.
  bool run() {
    const ProcessDraw& p = loop_.process;
    std::vector<double> line(static_cast<std::size_t>(p.dead_time / dt_ + 0.5) + 1, 0.0);
    std::size_t line_at = 0;
    friction_->reset(u0_);
    double actuator = u0_, flow = 0.0, x1 = 0.0, x2 = 0.0, transmitter = 0.0;
    u_ = integral_ = u0_;
    const auto warm_up = static_cast<std::size_t>(
        std::min(20.0 * (process_memory_ + loop_.controller.integral_time), 3000.0 * dt_ * 10.0) /
        dt_);
    const double b_actuator = follow(before_valve_);
    const double b_flow = follow(behind_valve_);
    const double b1 = follow(p.tau1);
    const double b2 = follow(p.tau2);
    const double b_filter = follow(filter_);
    const double b_second = follow(second_filter_);
    const bool noise_passes_filter = has(Ingredient::filter);
    double filtered = 0.0;
    std::size_t slips_before = 0;
    double pv_sum = 0.0, co_sum = 0.0, sp_sum = 0.0;
    const std::size_t total = warm_up + samples_ * steps_per_sample_;
    for (std::size_t n = 0; n < total; ++n) {
      const bool logging = n >= warm_up;
      const double t = logging ? static_cast<double>(n - warm_up) * dt_ : 0.0;
      const double sp = set_point(t, logging);
      // The controller uses the filtered measurement, with a new noise value in each step.
      const double noise = noise_ * noise_source_->normal();
      if (n % hold_ == 0) measured_ = filtered + (noise_passes_filter ? 0.0 : noise);
      if (n % scan_steps_ == 0) control(sp, t >= manual_from_ && t < manual_to_);
      actuator += b_actuator * (std::clamp(u_, valve_low_, valve_high_) - actuator);
      const double stem = friction_->step(actuator);
      const double opened = stem - u0_;
      flow += b_flow * (opened * (1.0 + bend_ * opened) - flow);
      const double disturbance = wander_->step() + flutter_->step() + oscillator_->step(dt_) +
                                 neighbour_->step(opened) +
                                 (t >= upset_from_ && t < upset_to_ ? upset_ : 0.0);
      line[line_at] = flow + (load_at_output_ ? 0.0 : disturbance);
      line_at = (line_at + 1) % line.size();
      const double arrived = line[line_at];
      if (p.integrating) {
        x2 += b2 * (arrived - x2);
        x1 += dt_ * (p.gain * x2 - leak_ * x1);
      } else {
        x1 += b1 * (arrived - x1);
        x2 += b2 * (x1 - x2);
      }
      const double value =
          p.integrating ? x1 : p.gain * (x2 + (load_at_output_ ? disturbance : 0.0));
      transmitter += b_filter * (value + (noise_passes_filter ? noise : 0.0) - transmitter);
      filtered += b_second * (transmitter - filtered);
      if (!std::isfinite(value) || std::abs(value) > 1e6) return false;
      if (!logging) {
        slips_before = friction_->slips();
        continue;
      }
      opened_.add(opened);
      loads_.add(disturbance);
      pv_sum += measured_;
      co_sum += u_;
      sp_sum += sp;
      beyond_end_ += u_ < valve_low_ || u_ > valve_high_ ? 1U : 0U;
      if ((n - warm_up) % steps_per_sample_ + 1 < steps_per_sample_) continue;
      const double share = 1.0 / static_cast<double>(steps_per_sample_);
      out_.pv.push_back(averaged_ ? pv_sum * share : measured_);
      out_.co.push_back(averaged_ ? co_sum * share : u_);
      out_.sp.push_back(averaged_ ? sp_sum * share : sp);
      pv_sum = co_sum = sp_sum = 0.0;
    }
    slips_ = friction_->slips() - slips_before;
    return true;
  }

  // Returns whether the stem causes most of the movement of PV, more than loads, SP and noise.
  bool is_noticed() const {
    const ProcessDraw& p = loop_.process;
    const double asked = p.integrating ? 0.0 : numeric::deviation(out_.sp) / p.gain;
    return opened_.deviation() > kNoticedOver * std::max(loads_.deviation(), asked) &&
           noise_ < kNoticedNoise * numeric::deviation(out_.pv) && slips_ >= kNoticedSlips &&
           samples_ >= kSamplesPerSlip * slips_;
  }

  bool shows_its_cause() const {
    const double co_deviation = numeric::deviation(out_.co);
    if (co_deviation < 0.02) return false;
    if (valve_ && (slips_ < 2 || co_deviation > kFarthest * band_)) return false;
    if (valve_ && has(Ingredient::noticed) && !is_noticed()) return false;
    const auto at_limit = std::count_if(out_.co.begin(), out_.co.end(),
                                        [&](double v) { return v <= low_ || v >= high_; });
    const auto length = static_cast<double>(out_.co.size());
    const double share = static_cast<double>(at_limit) / length;
    if (!is(Cause::saturation)) return share <= 0.02;
    if (!winds_up_) return share >= 0.1 && share <= 0.95;
    return share <= 0.02 && static_cast<double>(beyond_end_) >=
                                0.1 * length * static_cast<double>(steps_per_sample_);
  }

  // Logs as a plant does: rounded, compressed, held, in any unit and with either action.
  bool log() {
    const double co_deviation = numeric::deviation(out_.co);
    const double pv_deviation = numeric::deviation(out_.pv);
    if (pv_deviation <= 0.0) return false;
    if (has(Ingredient::steps, 0.6)) {
      round_to(out_.pv, kResolutions[choice(random_, kResolutions.size() - 1)]);
      round_to(out_.co, kResolutions[choice(random_, kResolutions.size())]);
    } else {
      if (chance(random_, 0.3)) round_to(out_.pv, pv_deviation * log_uniform(random_, 0.02, 1.0));
      if (chance(random_, 0.4)) round_to(out_.co, co_deviation * log_uniform(random_, 0.01, 0.3));
    }
    if (has(Ingredient::stale, 0.12)) {
      const std::vector<char> stale =
          stale_samples(random_, out_.pv.size(), log_uniform(random_, 0.02, 0.3),
                        log_uniform(random_, 3.0, 30.0));
      for (auto* signal : {&out_.pv, &out_.co, &out_.sp}) repeat_last(*signal, stale);
    }
    if (chance(random_, 0.1)) {
      compress(out_.pv, pv_deviation * log_uniform(random_, 0.02, 0.3));
      compress(out_.co, co_deviation * log_uniform(random_, 0.02, 0.2));
    }
    if (chance(random_, 0.12)) {
      hold_last(out_.pv, pv_deviation * log_uniform(random_, 0.02, 0.3));
      hold_last(out_.co, co_deviation * log_uniform(random_, 0.02, 0.2));
    }
    const double pv_unit = log_uniform(random_, 0.01, 100.0);
    const double pv_zero = pv_unit * random_.uniform(-10.0, 100.0);
    for (double& v : out_.pv) v = pv_zero + pv_unit * v;
    for (double& v : out_.sp) v = pv_zero + pv_unit * v;
    if (chance(random_, 0.4)) {
      for (double& v : out_.co) v = 100.0 - v;
    }
    if (chance(random_, 0.25)) out_.sp.clear();
    return true;
  }

  Random& random_;
  DiagnosisCase& out_;
  const Ingredients& ingredients_;
  const Kind* kind_ = kKinds.data();
  bool valve_ = false;
  bool tight_ = false;
  bool hits_limits_ = false, winds_up_ = false;
  Draw loop_;
  double time_scale_ = 1.0;
  std::size_t samples_ = 0;
  std::size_t steps_per_sample_ = 1;
  double dt_ = 1.0;
  std::size_t scan_steps_ = 1;
  double reach_ = 0.0, process_memory_ = 0.0, load_ = 0.0;
  std::optional<Wander> wander_, flutter_, master_;
  std::optional<Oscillator> oscillator_;
  std::optional<Neighbour> neighbour_;
  bool load_at_output_ = false;
  std::optional<Friction> friction_;
  double band_ = 0.0;  // of the friction
  double before_valve_ = 0.0, behind_valve_ = 0.0;
  double bend_ = 0.0;  // of the characteristic, per % of CO
  double pv_swing_ = 0.0, lead_ = 1.0, next_step_ = kNever, ramp_rate_ = 0.0;
  bool ramps_ = false;
  double master_noise_ = 0.0, from_master_ = 0.0;
  std::size_t master_steps_ = 1, until_master_ = 0;
  std::optional<Random> master_source_;
  double u0_ = 50.0, low_ = 0.0, high_ = 100.0;
  double valve_low_ = -kNever, valve_high_ = kNever;
  std::size_t hold_ = 1;
  double upset_from_ = kNever, upset_to_ = kNever, upset_ = 0.0;
  double manual_from_ = kNever, manual_to_ = kNever;
  double filter_ = 0.0, second_filter_ = 0.0, noise_ = 0.0, leak_ = 0.0;
  bool averaged_ = false;
  std::optional<Random> noise_source_;
  // State during the run.
  double step_level_ = 0.0, sp_level_ = 0.0, measured_ = 0.0;
  double integral_ = 0.0, derivative_state_ = 0.0, u_ = 0.0;
  std::size_t slips_ = 0, beyond_end_ = 0;
  Spread opened_, loads_;
};

}  // namespace

DiagnosisCase diagnosis_case(std::uint64_t seed, std::size_t index,
                             const Ingredients& ingredients) {
  // The generator mixes its seed enough, so neighbouring numbers give independent streams.
  Random random(seed * 0x9e3779b97f4a7c15ULL + index);
  const Cause cause = draw_cause(random);
  DiagnosisCase drawn;
  while (!CaseMaker(random, cause, drawn, ingredients).make()) {
  }
  return drawn;
}

}  // namespace loopwarden::lab
