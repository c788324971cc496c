// SPDX-License-Identifier: Apache-2.0
#include "studies/diagnose/diagnosis_cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::studies {
namespace {

using diagnosis::Cause;
using numeric::chance;
using numeric::log_uniform;
using numeric::Random;

constexpr double kPi = std::numbers::pi;

std::size_t choice(Random& random, std::size_t count) {
  return std::min(count - 1,
                  static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}

// Share of the other loops up to which the controller leans on its gain: of the healthy loops measured CO moves in step
// with PV (`--compare`, phase).
constexpr double kProportionalTo = 0.65;
// CO of a valve that is called sticky moves no farther than this about its mean, in bands (`--compare`, travel): where a load moves CO
// much farther, the band is no matter to anyone.
constexpr double kFarthest = 1.5;

// Times in units of the logging interval.
struct ProcessDraw {
  bool integrating = false;
  double gain = 1.0;  // PV % per CO %, per time unit where integrating
  double tau1 = 1.0;
  double tau2 = 0.0;
  double dead_time = 0.0;
};

struct ControllerDraw {
  double gain = 1.0;
  double integral_time = 1.0;
  double derivative_time = 0.0;
};

std::complex<double> loop_gain(const ProcessDraw& p, const ControllerDraw& c, double interval,
                               double w) {
  const std::complex<double> s(0.0, w);
  const std::complex<double> lag =
      p.integrating ? s * (p.tau2 * s + 1.0) : (p.tau1 * s + 1.0) * (p.tau2 * s + 1.0);
  const std::complex<double> process = p.gain * std::exp(-s * (p.dead_time + 0.5 * interval)) / lag;
  return process * c.gain *
         (1.0 + 1.0 / (c.integral_time * s) +
          c.derivative_time * s / (0.1 * c.derivative_time * s + 1.0));
}

// Largest sensitivity 1/|1 + L|; infinite where L encircles -1.
double sensitivity(const ProcessDraw& p, const ControllerDraw& c, double interval) {
  const double scale = p.dead_time + p.tau1 + p.tau2 + c.integral_time + interval;
  double worst = 0.0;
  std::complex<double> before = 0.0;
  for (double w = 1e-3 / scale; w < 300.0 / (p.dead_time + p.tau2 + interval + 0.02 * scale);
       w *= 1.04) {
    const std::complex<double> l = loop_gain(p, c, interval, w);
    worst = std::max(worst, 1.0 / std::abs(1.0 + l));
    // Crossing the negative real axis beyond -1 from above to below: an encirclement here.
    if (w > 1e-3 / scale && before.imag() < 0.0 && l.imag() >= 0.0 && l.real() < -1.0) {
      return std::numeric_limits<double>::infinity();
    }
    before = l;
  }
  return worst;
}

// What sticks. Truths differ from the laws that are fitted: friction differs from slip to slip, and a slip
// takes time.
class Friction {
 public:
  enum class Law { none, choudhury, he, play, creeping };
  Friction(Law law, double s, double j, double scatter, Random random)
      : law_(law), fs_((s + j) / 2.0), fd_((s - j) / 2.0), scatter_(scatter), random_(random) {
    draw();
  }
  void reset(double u) { x_ = last_ = u; }
  std::size_t slips() const { return slips_; }

  double step(double u) {
    const double before = x_;
    const double r = u - x_;
    switch (law_) {
      case Law::none: x_ = u; break;
      case Law::play: x_ = std::clamp(x_, u - fs_ * draw_, u + fs_ * draw_); break;
      case Law::he:
        if (std::abs(r) > fs_ * draw_) x_ = u - std::copysign(fd_ * draw_, r);
        break;
      case Law::choudhury: {
        const double change = u - last_;
        if (direction_ != 0.0 && change * direction_ <= 0.0) direction_ = 0.0;
        if (direction_ == 0.0 && std::abs(r) > fs_ * draw_) direction_ = std::copysign(1.0, r);
        if (direction_ != 0.0) x_ = u - direction_ * fd_ * draw_;
        break;
      }
      case Law::creeping:  // slips, but creeps under force before
        if (std::abs(r) > fs_ * draw_) {
          x_ = u - std::copysign(fd_ * draw_, r);
        } else if (std::abs(r) > fd_ * draw_) {
          x_ += 0.003 * r;
        }
        break;
    }
    last_ = u;
    if (law_ != Law::play && std::abs(x_ - before) > 0.4 * (fs_ - fd_) && direction_ == 0.0) slip();
    if (law_ == Law::choudhury && direction_ != 0.0 && moved_ != direction_) slip();
    moved_ = direction_;
    if (law_ == Law::play && (x_ - before) * travel_ < 0.0) ++slips_;
    if (x_ != before) travel_ = x_ - before;
    return x_;
  }

 private:
  void slip() {
    ++slips_;
    draw();
  }
  void draw() { draw_ = std::clamp(1.0 + scatter_ * random_.normal(), 0.3, 2.0); }

  Law law_;
  double fs_;
  double fd_;
  double scatter_;
  Random random_;
  double draw_ = 1.0;
  double x_ = 0.0;
  double last_ = 0.0;
  double direction_ = 0.0;
  double moved_ = 0.0;
  double travel_ = 0.0;
  std::size_t slips_ = 0;
};

// An oscillation from elsewhere: not sinusoidal, and neither its period nor its size is constant.
class Oscillator {
 public:
  enum class Shape { sine, harmonics, square, triangle, sawtooth, pulses };
  Oscillator(Shape shape, double amplitude, double period, double jitter, double swelling,
             double smoothing, Random random)
      : shape_(shape),
        amplitude_(amplitude),
        period_(period),
        jitter_(jitter),
        swelling_(swelling),
        smoothing_(smoothing),
        random_(random),
        phase_(random_.uniform()),
        second_(random_.uniform(0.0, 0.35)),
        third_(random_.uniform(-0.2, 0.2)),
        duty_(random_.uniform(0.3, 0.7)) {}

  double step(double dt) {
    if (amplitude_ <= 0.0) return 0.0;
    phase_ += dt / period_ + jitter_ * std::sqrt(dt / period_) * random_.normal();
    phase_ -= std::floor(phase_);
    const double forget = std::exp(-dt / (4.0 * period_));
    swell_ = forget * swell_ + std::sqrt(1.0 - forget * forget) * swelling_ * random_.normal();
    const double angle = 2.0 * kPi * phase_;
    double value = 0.0;
    switch (shape_) {
      case Shape::sine: value = std::sin(angle); break;
      case Shape::harmonics:
        value = std::sin(angle) + second_ * std::sin(2.0 * angle + 1.0) +
                third_ * std::sin(3.0 * angle);
        break;
      case Shape::square: value = phase_ < duty_ ? 1.0 : -1.0; break;
      case Shape::triangle: value = phase_ < 0.5 ? 4.0 * phase_ - 1.0 : 3.0 - 4.0 * phase_; break;
      case Shape::sawtooth: value = 2.0 * phase_ - 1.0; break;
      case Shape::pulses: value = phase_ < 0.2 * duty_ + 0.05 ? 2.0 : -0.3; break;
    }
    const double b = smoothing_ > 0.0 ? 1.0 - std::exp(-dt / (smoothing_ * period_)) : 1.0;
    first_ += b * (value - first_);
    smooth_ += b * (first_ - smooth_);
    return amplitude_ * std::max(0.0, 1.0 + swell_) * smooth_;
  }

 private:
  Shape shape_;
  double amplitude_, period_, jitter_, swelling_, smoothing_;
  Random random_;
  double phase_, second_, third_, duty_;
  double swell_ = 0.0, first_ = 0.0, smooth_ = 0.0;
};

// First-order noise of given standard deviation and correlation time.
class Wander {
 public:
  Wander(double deviation, double time, double dt, Random random)
      : forget_(std::exp(-dt / time)),
        drive_(deviation * std::sqrt(1.0 - forget_ * forget_)),
        random_(random),
        state_(deviation * random_.normal()) {}
  double step() { return state_ = forget_ * state_ + drive_ * random_.normal(); }

 private:
  double forget_, drive_;
  Random random_;
  double state_;
};

constexpr std::array<const char*, 6> kShapeNames{"sine",     "harmonics", "square",
                                                 "triangle", "sawtooth",  "pulses"};

struct Draw {
  ProcessDraw process;
  ControllerDraw controller;
  double interval = 1.0;  // of the controller
};

// A process and a controller with margins (largest sensitivity 1.1 to 2.5), or at the edge of stability.
enum class Weight { balanced, integral, proportional };  // what the controller leans on

Draw draw_loop(Random& random, bool integrating, bool tight, Weight weight, double time_scale) {
  Draw d;
  ProcessDraw& p = d.process;
  p.integrating = integrating;
  const double dead_share = random.uniform(0.03, 0.75);
  p.dead_time = time_scale * dead_share;
  p.tau1 = time_scale * (1.0 - dead_share);
  p.tau2 = p.tau1 * random.uniform(0.0, 0.6);
  p.gain = log_uniform(random, 0.3, 3.0);
  if (integrating) {
    p.tau2 = p.tau1 * random.uniform(0.1, 1.0);
    p.tau1 = 0.0;
    p.gain = log_uniform(random, 0.002, 0.2) / time_scale;
  }
  ControllerDraw& c = d.controller;
  const double theta = p.dead_time + 0.5 * p.tau2;
  const double closed = theta * log_uniform(random, 0.6, 6.0);
  if (integrating) {
    c.gain = 1.0 / (p.gain * (closed + theta));
    c.integral_time = 4.0 * (closed + theta) * log_uniform(random, 0.3, 4.0);
  } else {
    c.gain = p.tau1 / (p.gain * (closed + theta));
    c.integral_time = std::min(p.tau1, 4.0 * (closed + theta)) * log_uniform(random, 0.4, 2.0);
    if (weight == Weight::integral) {
      const double weaker = log_uniform(random, 0.1, 0.8);
      c.gain *= weaker;
      c.integral_time *= weaker * log_uniform(random, 0.6, 1.6);
    }
  }
  if (weight == Weight::proportional) c.integral_time *= log_uniform(random, 3.0, 30.0);
  if (chance(random, 0.12)) c.derivative_time = 0.2 * c.integral_time * random.uniform();
  d.interval = std::min(1.0, time_scale / 15.0);
  const auto at = [&](double factor, bool by_gain) {
    ControllerDraw changed = c;
    if (by_gain) {
      changed.gain *= factor;
    } else {
      changed.integral_time /= factor;
      changed.gain *= integrating ? 1.0 / std::sqrt(factor) : 1.0;
    }
    return changed;
  };
  const double wanted = tight ? log_uniform(random, 8.0, 60.0) : random.uniform(1.15, 2.5);
  const bool by_gain = tight ? chance(random, 0.5) : true;
  // Up to the wanted sensitivity where tight; down to it where the draw has less margin than wanted.
  double factor = 1.0;
  if (tight) {
    double low = 1.0;
    double high = 1.0;
    while (sensitivity(p, at(high, by_gain), d.interval) < wanted && high < 1e4) high *= 1.5;
    low = high / 1.5;
    for (int i = 0; i < 20; ++i) {
      const double middle = std::sqrt(low * high);
      (sensitivity(p, at(middle, by_gain), d.interval) < wanted ? low : high) = middle;
    }
    factor = low;
  } else {
    while (sensitivity(p, at(factor, by_gain), d.interval) > wanted && factor > 1e-4)
      factor *= 0.85;
  }
  c = at(factor, by_gain);
  return d;
}

// Straight lines between the points that a historian would keep.
void compress(std::vector<double>& x, double deviation) {
  std::size_t kept = 0;
  double low_slope = -std::numeric_limits<double>::infinity();
  double high_slope = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < x.size(); ++k) {
    const double length = static_cast<double>(k - kept);
    low_slope = std::max(low_slope, (x[k] - deviation - x[kept]) / length);
    high_slope = std::min(high_slope, (x[k] + deviation - x[kept]) / length);
    if (low_slope <= high_slope && k + 1 < x.size()) continue;
    const std::size_t to = low_slope <= high_slope ? k : k - 1;
    if (to > kept) {
      for (std::size_t j = kept + 1; j < to; ++j) {
        const double share = static_cast<double>(j - kept) / static_cast<double>(to - kept);
        x[j] = x[kept] + share * (x[to] - x[kept]);
      }
      kept = to;
    }
    low_slope = -std::numeric_limits<double>::infinity();
    high_slope = std::numeric_limits<double>::infinity();
    if (kept < k) {
      low_slope = x[k] - deviation - x[kept];
      high_slope = x[k] + deviation - x[kept];
    }
  }
}

// Exception reporting: a value is kept until it has moved by more than the dead band.
void hold_last(std::vector<double>& x, double dead_band) {
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (std::abs(x[k] - x[k - 1]) <= dead_band) x[k] = x[k - 1];
  }
}

void round_to(std::vector<double>& x, double step) {
  if (step <= 0.0) return;
  for (double& v : x) v = std::round(v / step) * step;
}

// Kinds differ in time scale against logging interval.
struct Kind {
  const char* name;
  double share, integrating, fastest, slowest;
};
constexpr std::array<Kind, 5> kKinds{{{"flow", 0.40, 0.0, 0.1, 15.0},
                                      {"pressure", 0.20, 0.25, 1.0, 40.0},
                                      {"level", 0.25, 0.95, 0.5, 25.0},
                                      {"temperature", 0.10, 0.15, 3.0, 60.0},
                                      {"analyser", 0.05, 0.0, 3.0, 30.0}}};
constexpr double kNever = 1e300;

// One case: its numbers are drawn in the order of the functions, then the loop is run and logged.
class CaseMaker {
 public:
  CaseMaker(Random& random, DiagnosisCase& out) : random_(random), out_(out) { out = {}; }

  // False where the case does not show what its cause says.
  bool make() {
    draw_cause();
    draw_kind();
    draw_loads();
    draw_oscillation();
    draw_valve();
    draw_set_point();
    draw_limits();
    draw_interruptions();
    draw_measurement();
    return run() && shows_its_cause() && log();
  }

 private:
  void draw_cause() {
    const double of_cause = random_.uniform();
    out_.cause = of_cause < 0.30   ? Cause::stiction
                 : of_cause < 0.37 ? Cause::backlash
                 : of_cause < 0.47 ? Cause::tuning
                 : of_cause < 0.64 ? Cause::disturbance
                 : of_cause < 0.68 ? Cause::saturation
                                   : Cause::none;
    valve_ = out_.cause == Cause::stiction || out_.cause == Cause::backlash;
    tight_ = out_.cause == Cause::tuning;
  }

  void draw_kind() {
    double of_kind = random_.uniform();
    std::size_t k = 0;
    while (k + 1 < kKinds.size() && of_kind > kKinds[k].share) of_kind -= kKinds[k++].share;
    out_.kind = kKinds[k].name;
    out_.integrating = chance(random_, kKinds[k].integrating);
    time_scale_ = log_uniform(random_, kKinds[k].fastest, kKinds[k].slowest);
    // Controllers that lean on integral action let a sticking valve cycle; most that behave well do not.
    const double of_weight = random_.uniform();
    const Weight weight = of_weight < (valve_ ? 0.6 : 0.15)                   ? Weight::integral
                          : !valve_ && !tight_ && of_weight < kProportionalTo ? Weight::proportional
                                                                              : Weight::balanced;
    loop_ = draw_loop(random_, out_.integrating, tight_, weight, time_scale_);
    samples_ = static_cast<std::size_t>(log_uniform(random_, 200.0, 3000.0));
    steps_per_sample_ = static_cast<std::size_t>(std::ceil(1.0 / loop_.interval - 1e-9));
    dt_ = 1.0 / static_cast<double>(steps_per_sample_);
  }

  // Sizes in % of span of CO; loads act at the input of the process, in the same unit.
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
    } else if (out_.cause == Cause::saturation) {
      swing = chance(random_, 0.5) ? reach_ : 0.0;
    }
    const double longest = std::max(8.0, static_cast<double>(samples_) / 5.0);
    const double period = std::clamp(time_scale_ * log_uniform(random_, 1.0, 40.0), 5.0, longest);
    oscillator_ = Oscillator(
        shape, swing, period, chance(random_, 0.6) ? random_.uniform(0.0, 0.12) : 0.0,
        chance(random_, 0.6) ? random_.uniform(0.0, 0.5) : 0.0,
        chance(random_, 0.7) ? log_uniform(random_, 0.01, 0.25) : 0.0, Random(random_.bits()));
    load_at_output_ = chance(random_, 0.3) && !loop_.process.integrating;
  }

  // A healthy valve has a little friction too.
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

  // SP: constant, an operator's steps and ramps, or the output of a master; where it moves it is often what moves the
  // loop most.
  void draw_set_point() {
    const ProcessDraw& p = loop_.process;
    const double of_sp = random_.uniform();
    pv_swing_ = reach_ * (p.integrating ? p.gain * time_scale_ * 3.0 : p.gain);
    const bool steps = of_sp < 0.15;
    ramps_ = of_sp >= 0.15 && of_sp < 0.22;
    const bool mastered = of_sp >= 0.22 && of_sp < 0.42;
    const bool set_point_leads = of_sp < 0.42 && !valve_ && chance(random_, 0.7);
    lead_ = set_point_leads ? log_uniform(random_, 1.0, 6.0) : 1.0;
    master_ = Wander(mastered ? lead_ * pv_swing_ * log_uniform(random_, 0.1, 1.5) : 0.0,
                     time_scale_ * log_uniform(random_, 2.0, 100.0), dt_, Random(random_.bits()));
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
    if (out_.cause != Cause::saturation) return;
    // The valve would have to go beyond its end a good part of the time.
    const double room = reach_ * random_.uniform(0.0, 0.5);
    chance(random_, 0.5) ? (high_ = u0_ + room) : (low_ = u0_ - room);
  }

  // An analyser that holds its values, an upset of the plant, and a stretch in manual.
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
    filter_ = chance(random_, 0.35) ? random_.uniform(0.0, 0.3) * time_scale_ : 0.0;
    noise_ = pv_swing_ * (chance(random_, 0.25) ? 0.0 : log_uniform(random_, 0.002, 0.2));
    averaged_ = chance(random_, 0.3);
    leak_ = loop_.process.integrating ? 1.0 / (process_memory_ * log_uniform(random_, 20.0, 400.0))
                                      : 0.0;
    noise_source_ = Random(random_.bits());
  }

  // Share of the way that a lag of `time` goes in a step.
  double follow(double time) const { return time > dt_ ? 1.0 - std::exp(-dt_ / time) : 1.0; }

  double set_point(double t, bool logging) {
    if (logging && t >= next_step_) {
      step_level_ += lead_ * pv_swing_ * random_.uniform(-2.0, 2.0);
      next_step_ += log_uniform(random_, 0.2, 1.0) * static_cast<double>(samples_);
    }
    const double most = ramp_rate_ * dt_;
    sp_level_ = ramps_ ? std::clamp(step_level_, sp_level_ - most, sp_level_ + most) : step_level_;
    return sp_level_ + master_->step();
  }

  // CO of the next step.
  void control(double sp, bool manual) {
    const ControllerDraw& c = loop_.controller;
    const double error = sp - measured_;
    double now = c.gain * error;
    if (c.derivative_time > 0.0) {
      const double slow_before = derivative_state_;
      derivative_state_ += follow(0.1 * c.derivative_time + dt_) * (measured_ - derivative_state_);
      now -= c.gain * c.derivative_time * (derivative_state_ - slow_before) / dt_;
    }
    if (manual) integral_ = u_ - now;
    const double wish = now + integral_;
    u_ = std::clamp(wish, low_, high_);
    if (!manual && (wish == u_ || (wish - u_) * error < 0.0)) {
      integral_ += c.gain * error * dt_ / c.integral_time;
    }
  }

  // False where the loop runs away.
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
    std::size_t slips_before = 0;
    double pv_sum = 0.0, co_sum = 0.0, sp_sum = 0.0;
    const std::size_t total = warm_up + samples_ * steps_per_sample_;
    for (std::size_t n = 0; n < total; ++n) {
      const bool logging = n >= warm_up;
      const double t = logging ? static_cast<double>(n - warm_up) * dt_ : 0.0;
      const double sp = set_point(t, logging);
      // Controller on the filtered measurement, a sample of its own each step.
      if (n % hold_ == 0) measured_ = transmitter + noise_ * noise_source_->normal();
      control(sp, t >= manual_from_ && t < manual_to_);
      actuator += b_actuator * (u_ - actuator);
      const double stem = friction_->step(actuator);
      const double opened = stem - u0_;
      flow += b_flow * (opened * (1.0 + bend_ * opened) - flow);
      const double disturbance = wander_->step() + flutter_->step() + oscillator_->step(dt_) +
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
      transmitter += b_filter * (value - transmitter);
      if (!std::isfinite(value) || std::abs(value) > 1e6) return false;
      if (!logging) {
        slips_before = friction_->slips();
        continue;
      }
      pv_sum += measured_;
      co_sum += u_;
      sp_sum += sp;
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

  bool shows_its_cause() const {
    const double co_deviation = numeric::deviation(out_.co);
    if (co_deviation < 0.02) return false;
    if (valve_ && (slips_ < 2 || co_deviation > kFarthest * band_)) return false;
    const auto at_limit = std::count_if(out_.co.begin(), out_.co.end(),
                                        [&](double v) { return v <= low_ || v >= high_; });
    const double share = static_cast<double>(at_limit) / static_cast<double>(out_.co.size());
    return out_.cause == Cause::saturation ? share >= 0.1 && share <= 0.95 : share <= 0.02;
  }

  // As a plant logs: rounded, compressed, held, in any unit and with any action.
  bool log() {
    const double co_deviation = numeric::deviation(out_.co);
    const double pv_deviation = numeric::deviation(out_.pv);
    if (pv_deviation <= 0.0) return false;
    if (chance(random_, 0.3)) round_to(out_.pv, pv_deviation * log_uniform(random_, 0.02, 1.0));
    if (chance(random_, 0.4)) round_to(out_.co, co_deviation * log_uniform(random_, 0.01, 0.3));
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
    out_.sample_time_s = log_uniform(random_, 0.2, 60.0);
    return true;
  }

  Random& random_;
  DiagnosisCase& out_;
  bool valve_ = false;
  bool tight_ = false;
  Draw loop_;
  double time_scale_ = 1.0;
  std::size_t samples_ = 0;
  std::size_t steps_per_sample_ = 1;
  double dt_ = 1.0;
  double reach_ = 0.0, process_memory_ = 0.0, load_ = 0.0;
  std::optional<Wander> wander_, flutter_, master_;
  std::optional<Oscillator> oscillator_;
  bool load_at_output_ = false;
  std::optional<Friction> friction_;
  double band_ = 0.0;  // of the friction
  double before_valve_ = 0.0, behind_valve_ = 0.0;
  double bend_ = 0.0;  // of the characteristic, per % of CO
  double pv_swing_ = 0.0, lead_ = 1.0, next_step_ = kNever, ramp_rate_ = 0.0;
  bool ramps_ = false;
  double u0_ = 50.0, low_ = 0.0, high_ = 100.0;
  std::size_t hold_ = 1;
  double upset_from_ = kNever, upset_to_ = kNever, upset_ = 0.0;
  double manual_from_ = kNever, manual_to_ = kNever;
  double filter_ = 0.0, noise_ = 0.0, leak_ = 0.0;
  bool averaged_ = false;
  std::optional<Random> noise_source_;
  // While it runs.
  double step_level_ = 0.0, sp_level_ = 0.0, measured_ = 0.0;
  double integral_ = 0.0, derivative_state_ = 0.0, u_ = 0.0;
  std::size_t slips_ = 0;
};

}  // namespace

DiagnosisCase diagnosis_case(std::uint64_t seed, std::size_t index) {
  // The generator mixes its seed well enough for neighbouring numbers.
  Random random(seed * 0x9e3779b97f4a7c15ULL + index);
  DiagnosisCase drawn;
  while (!CaseMaker(random, drawn).make()) {
  }
  return drawn;
}

}  // namespace loopwarden::studies
