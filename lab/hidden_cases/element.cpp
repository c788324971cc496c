// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/element.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

namespace loopwarden::hidden_cases {
namespace {

double sign_of(double x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }

class Lag final : public Element {
 public:
  explicit Lag(double lag_s) : share_(1.0 - std::exp(-kStep_s / lag_s)) {}
  double reset(double input) override { return x_ = input; }
  double step(double input, double /*time_s*/) override { return x_ += share_ * (input - x_); }

 private:
  double share_;
  double x_ = 0.0;
};

constexpr double kTravel = 10.0;  // CO units; the stem stops at both ends

class Positioner final : public Element {
 public:
  Positioner(double natural_frequency_rad_s, double damping, double lag_s)
      : w_(natural_frequency_rad_s),
        damping_(damping),
        lag_(std::max(lag_s, kStep_s)),
        third_pole_(lag_s > 0.0) {}

  double reset(double input) override {
    v_ = 0.0;
    lag_.reset(input);
    return x_ = input;
  }
  double step(double input, double time_s) override {
    const double u = third_pole_ ? lag_.step(input, time_s) : input;
    v_ += kStep_s * (w_ * w_ * (u - x_) - 2.0 * damping_ * w_ * v_);
    x_ += kStep_s * v_;
    if (x_ < 0.0 || x_ > kTravel) {
      x_ = std::clamp(x_, 0.0, kTravel);
      v_ = 0.0;
    }
    return x_;
  }

 private:
  double w_;
  double damping_;
  Lag lag_;
  bool third_pole_;
  double x_ = 0.0;
  double v_ = 0.0;
};

class Air final : public Element {
 public:
  explicit Air(const AirSupply& air) : air_(air) {}
  double reset(double input) override { return p_ = std::min(input, air_.supply); }
  double step(double input, double /*time_s*/) override {
    const double left = (air_.supply - p_) / air_.supply;
    const double fill = air_.choked ? 2.0 * air_.fill_per_s * left : air_.fill_per_s;
    const double wanted = (std::min(input, air_.supply) - p_) / air_.lag_s;
    return p_ += kStep_s * std::clamp(wanted, -air_.vent_per_s, std::max(fill, 0.0));
  }

 private:
  AirSupply air_;
  double p_ = 0.0;
};

class KarnoppStem final : public Element {
 public:
  explicit KarnoppStem(Stem stem) : stem_(std::move(stem)) {}

  double reset(double input) override {
    v_ = 0.0;
    return x_ = input;
  }

  double step(double input, double time_s) override {
    const double force = input - x_;
    const bool gripped = is_gripped(time_s);
    const double way = v_ < 0.0 || (v_ == 0.0 && force < 0.0) ? stem_.closing_friction : 1.0;
    const double most = gripped ? way * stem_.static_friction : 0.0;
    double friction = 0.0;
    if (v_ == 0.0) {
      if (std::abs(force) <= most) return x_;
      friction = sign_of(force) * most;
    } else if (gripped) {
      friction = sign_of(v_) * way * moving_friction();
    }
    const double w2 = stem_.frequency_rad_s * stem_.frequency_rad_s;
    const double v =
        (v_ + kStep_s * w2 * (force - friction)) / (1.0 + kStep_s * w2 * stem_.damping_s);
    // Friction stops a stem but never drives it back; without friction it may oscillate.
    v_ = gripped && v * v_ < 0.0 ? 0.0 : v;
    return x_ += kStep_s * v_;
  }

 private:
  bool is_gripped(double time_s) const {
    return stem_.gripped.empty() ||
           std::any_of(stem_.gripped.begin(), stem_.gripped.end(), [time_s](const auto& span) {
             return time_s >= span.first && time_s < span.second;
           });
  }
  double moving_friction() const {
    if (stem_.stribeck_per_s <= 0.0) return stem_.dynamic_friction;
    const double ratio = v_ / stem_.stribeck_per_s;
    return stem_.dynamic_friction +
           (stem_.static_friction - stem_.dynamic_friction) * std::exp(-ratio * ratio);
  }

  Stem stem_;
  double x_ = 0.0;
  double v_ = 0.0;
};

class LugreStem final : public Element {
 public:
  LugreStem(const Stem& stem, double stiffness)
      : stem_(stem),
        stiffness_(stiffness),
        bristle_damping_(std::sqrt(stiffness) / stem.frequency_rad_s) {}

  double reset(double input) override {
    v_ = 0.0;
    z_ = 0.0;
    return x_ = input;
  }

  double step(double input, double /*time_s*/) override {
    const double ratio = v_ / stem_.stribeck_per_s;
    const double g = (stem_.dynamic_friction +
                      (stem_.static_friction - stem_.dynamic_friction) * std::exp(-ratio * ratio)) /
                     stiffness_;
    const double z = (z_ + kStep_s * v_) / (1.0 + kStep_s * std::abs(v_) / g);
    const double friction = stiffness_ * z + bristle_damping_ * (z - z_) / kStep_s;
    z_ = z;
    const double w2 = stem_.frequency_rad_s * stem_.frequency_rad_s;
    v_ = (v_ + kStep_s * w2 * (input - x_ - friction)) / (1.0 + kStep_s * w2 * stem_.damping_s);
    return x_ += kStep_s * v_;
  }

 private:
  Stem stem_;
  double stiffness_;
  double bristle_damping_;
  double x_ = 0.0;
  double v_ = 0.0;
  double z_ = 0.0;
};

class LinkagePlay final : public Element {
 public:
  LinkagePlay(double width, double contact_lag_s)
      : half_(0.5 * width), share_(1.0 - std::exp(-kStep_s / contact_lag_s)) {}
  double reset(double input) override { return x_ = input; }
  double step(double input, double /*time_s*/) override {
    const double pulled = std::max(input - half_ - x_, 0.0);
    const double pushed = std::min(input + half_ - x_, 0.0);
    return x_ += share_ * (pulled + pushed);
  }

 private:
  double half_;
  double share_;
  double x_ = 0.0;
};

class BoucWenElement final : public Element {
 public:
  explicit BoucWenElement(const BoucWen& hysteresis) : p_(hysteresis) {}
  double reset(double input) override {
    h_ = 0.0;
    return u_ = input;
  }
  double step(double input, double /*time_s*/) override {
    const double du = input - u_;
    u_ = input;
    const double turn = p_.shape * sign_of(du * h_) + 1.0 - p_.shape;
    h_ += du / p_.scale * (1.0 - std::pow(std::abs(h_), p_.exponent) * turn);
    h_ = std::clamp(h_, -1.0, 1.0);
    return input - 0.5 * p_.width * h_;
  }

 private:
  BoucWen p_;
  double u_ = 0.0;
  double h_ = 0.0;
};

class PlayStackElement final : public Element {
 public:
  explicit PlayStackElement(PlayStack stack)
      : stack_(std::move(stack)), state_(stack_.half_widths.size(), 0.0) {}
  double reset(double input) override {
    std::fill(state_.begin(), state_.end(), input);
    return input;
  }
  double step(double input, double /*time_s*/) override {
    double output = 0.0;
    for (std::size_t i = 0; i < state_.size(); ++i) {
      const double half = stack_.half_widths[i];
      state_[i] = std::clamp(state_[i], input - half, input + half);
      output += stack_.weights[i] * state_[i];
    }
    return output;
  }

 private:
  PlayStack stack_;
  std::vector<double> state_;
};

class Curve final : public Element {
 public:
  explicit Curve(std::function<double(double)> curve) : curve_(std::move(curve)) {}
  double reset(double input) override { return curve_(input); }
  double step(double input, double /*time_s*/) override { return curve_(input); }

 private:
  std::function<double(double)> curve_;
};

class Gain final : public Element {
 public:
  explicit Gain(std::function<double(double)> gain_at) : gain_at_(std::move(gain_at)) {}
  double reset(double input) override { return gain_at_(0.0) * input; }
  double step(double input, double time_s) override { return gain_at_(time_s) * input; }

 private:
  std::function<double(double)> gain_at_;
};

class DeadTime final : public Element {
 public:
  explicit DeadTime(double dead_time_s)
      : line_(std::max<std::size_t>(
            1, static_cast<std::size_t>(std::lround(dead_time_s / kStep_s)))) {}
  double reset(double input) override {
    std::fill(line_.begin(), line_.end(), input);
    return input;
  }
  double step(double input, double /*time_s*/) override {
    const double output = line_[next_];
    line_[next_] = input;
    next_ = (next_ + 1) % line_.size();
    return output;
  }

 private:
  std::vector<double> line_;
  std::size_t next_ = 0;
};

class PlugFlow final : public Element {
 public:
  explicit PlugFlow(double volume) : volume_(volume) {}
  double reset(double input) override {
    pipe_.clear();
    stored_ = 0.0;
    return output_ = input;
  }
  double step(double input, double /*time_s*/) override {
    const double flow = std::max(input, kLeastFlow);
    pipe_.push_back({input, flow * kStep_s});
    stored_ += flow * kStep_s;
    while (!pipe_.empty() && stored_ > volume_) {
      output_ = pipe_.front().value;
      stored_ -= pipe_.front().volume;
      pipe_.pop_front();
    }
    return output_;
  }

 private:
  // A small flow remains if the valve is shut, so that the dead time is finite.
  static constexpr double kLeastFlow = 0.5;
  struct Plug {
    double value;
    double volume;
  };
  double volume_;
  double stored_ = 0.0;
  double output_ = 0.0;
  std::deque<Plug> pipe_;
};

class TwoWayLag final : public Element {
 public:
  TwoWayLag(double up_s, double down_s) : up_s_(up_s), down_s_(down_s) {}
  double reset(double input) override { return x_ = input; }
  double step(double input, double /*time_s*/) override {
    return x_ += kStep_s * (input - x_) / (input > x_ ? up_s_ : down_s_);
  }

 private:
  double up_s_;
  double down_s_;
  double x_ = 0.0;
};

class InverseResponse final : public Element {
 public:
  InverseResponse(double beta_s, double lag_s, double second_lag_s)
      : ratio_(beta_s / lag_s), lag_(lag_s), second_(second_lag_s) {}
  double reset(double input) override {
    lag_.reset(input);
    return second_.reset(input);
  }
  double step(double input, double time_s) override {
    // (1 - beta s) / (lag s + 1) = (1 + ratio) / (lag s + 1) - ratio.
    const double first = (1.0 + ratio_) * lag_.step(input, time_s) - ratio_ * input;
    return second_.step(first, time_s);
  }

 private:
  double ratio_;
  Lag lag_;
  Lag second_;
};

class SteppingDrive final : public Element {
 public:
  SteppingDrive(double step, double margin, double pulse_s)
      : step_(step), reach_(step * (0.5 + margin)), pulse_s_(pulse_s) {}
  double reset(double input) override {
    wait_s_ = 0.0;
    return x_ = step_ * std::round(input / step_);
  }
  double step(double input, double /*time_s*/) override {
    wait_s_ = std::max(0.0, wait_s_ - kStep_s);
    if (wait_s_ <= 0.0 && std::abs(input - x_) > reach_) {
      x_ += sign_of(input - x_) * step_;
      wait_s_ = pulse_s_;
    }
    return x_;
  }

 private:
  double step_;
  double reach_;
  double pulse_s_;
  double wait_s_ = 0.0;
  double x_ = 0.0;
};

class OpposingLags final : public Element {
 public:
  OpposingLags(double weaker_gain, double slow_s, double fast_s)
      : weaker_gain_(weaker_gain), slow_(slow_s), fast_(fast_s) {}
  double reset(double input) override {
    slow_.reset(input);
    fast_.reset(input);
    return input;
  }
  double step(double input, double time_s) override {
    return (1.0 + weaker_gain_) * slow_.step(input, time_s) -
           weaker_gain_ * fast_.step(input, time_s);
  }

 private:
  double weaker_gain_;
  Lag slow_;
  Lag fast_;
};

class ConnectedTanks final : public Element {
 public:
  ConnectedTanks(double natural_frequency_rad_s, double damping, double turbulent_per_s)
      : w_(natural_frequency_rad_s), damping_(damping), turbulent_per_s_(turbulent_per_s) {}
  double reset(double input) override {
    v_ = 0.0;
    return h_ = input;
  }
  double step(double input, double /*time_s*/) override {
    const double drag = 2.0 * damping_ * w_ * (1.0 + std::abs(v_) / turbulent_per_s_);
    v_ += kStep_s * (w_ * w_ * (input - h_) - drag * v_);
    return h_ += kStep_s * v_;
  }

 private:
  double w_;
  double damping_;
  double turbulent_per_s_;
  double h_ = 0.0;
  double v_ = 0.0;
};

class Recycle final : public Element {
 public:
  Recycle(double share, double delay_s) : share_(share), line_(delay_s) {}
  double reset(double input) override {
    line_.reset(input);
    return output_ = input;
  }
  double step(double input, double time_s) override {
    return output_ = (1.0 - share_) * input + share_ * line_.step(output_, time_s);
  }

 private:
  double share_;
  DeadTime line_;
  double output_ = 0.0;
};

class SlowTail final : public Element {
 public:
  SlowTail(double share, double lag_s) : share_(share), slow_(lag_s) {}
  double reset(double input) override { return slow_.reset(input); }
  double step(double input, double time_s) override {
    return (1.0 - share_) * input + share_ * slow_.step(input, time_s);
  }

 private:
  double share_;
  Lag slow_;
};

class Onset final : public Element {
 public:
  Onset(Chain before, Chain after, double at_s)
      : before_(std::move(before)), after_(std::move(after)), at_s_(at_s) {}
  double reset(double input) override {
    begun_ = false;
    return hidden_cases::reset(before_, input);
  }
  double step(double input, double time_s) override {
    if (time_s < at_s_) return hidden_cases::step(before_, input, time_s);
    if (!begun_) hidden_cases::reset(after_, input);
    begun_ = true;
    return hidden_cases::step(after_, input, time_s);
  }

 private:
  Chain before_;
  Chain after_;
  double at_s_;
  bool begun_ = false;
};

}  // namespace

double reset(Chain& chain, double input) {
  for (const auto& element : chain) input = element->reset(input);
  return input;
}

double step(Chain& chain, double input, double time_s) {
  for (const auto& element : chain) input = element->step(input, time_s);
  return input;
}

std::unique_ptr<Element> make_lag(double lag_s) { return std::make_unique<Lag>(lag_s); }

std::unique_ptr<Element> make_positioner(double natural_frequency_rad_s, double damping,
                                         double lag_s) {
  return std::make_unique<Positioner>(natural_frequency_rad_s, damping, lag_s);
}

std::unique_ptr<Element> make_air_supply(const AirSupply& air) {
  return std::make_unique<Air>(air);
}

std::unique_ptr<Element> make_karnopp_stem(Stem stem) {
  return std::make_unique<KarnoppStem>(std::move(stem));
}

std::unique_ptr<Element> make_lugre_stem(const Stem& stem, double bristle_stiffness) {
  return std::make_unique<LugreStem>(stem, bristle_stiffness);
}

std::unique_ptr<Element> make_linkage_play(double width, double contact_lag_s) {
  return std::make_unique<LinkagePlay>(width, contact_lag_s);
}

std::unique_ptr<Element> make_bouc_wen(const BoucWen& hysteresis) {
  return std::make_unique<BoucWenElement>(hysteresis);
}

std::unique_ptr<Element> make_play_stack(PlayStack stack) {
  return std::make_unique<PlayStackElement>(std::move(stack));
}

std::unique_ptr<Element> make_onset(Chain before, Chain after, double at_s) {
  return std::make_unique<Onset>(std::move(before), std::move(after), at_s);
}

std::unique_ptr<Element> make_curve(std::function<double(double)> curve) {
  return std::make_unique<Curve>(std::move(curve));
}

std::unique_ptr<Element> make_gain(std::function<double(double)> gain_at) {
  return std::make_unique<Gain>(std::move(gain_at));
}

std::unique_ptr<Element> make_dead_time(double dead_time_s) {
  return std::make_unique<DeadTime>(dead_time_s);
}

std::unique_ptr<Element> make_plug_flow(double volume) {
  return std::make_unique<PlugFlow>(volume);
}

std::unique_ptr<Element> make_two_way_lag(double up_s, double down_s) {
  return std::make_unique<TwoWayLag>(up_s, down_s);
}

std::unique_ptr<Element> make_inverse_response(double beta_s, double lag_s, double second_lag_s) {
  return std::make_unique<InverseResponse>(beta_s, lag_s, second_lag_s);
}

std::unique_ptr<Element> make_stepping_drive(double step, double margin, double pulse_s) {
  return std::make_unique<SteppingDrive>(step, margin, pulse_s);
}

std::unique_ptr<Element> make_opposing_lags(double weaker_gain, double slow_s, double fast_s) {
  return std::make_unique<OpposingLags>(weaker_gain, slow_s, fast_s);
}

std::unique_ptr<Element> make_connected_tanks(double natural_frequency_rad_s, double damping,
                                              double turbulent_per_s) {
  return std::make_unique<ConnectedTanks>(natural_frequency_rad_s, damping, turbulent_per_s);
}

std::unique_ptr<Element> make_recycle(double share, double delay_s) {
  return std::make_unique<Recycle>(share, delay_s);
}

std::unique_ptr<Element> make_slow_tail(double share, double lag_s) {
  return std::make_unique<SlowTail>(share, lag_s);
}

}  // namespace loopwarden::hidden_cases
