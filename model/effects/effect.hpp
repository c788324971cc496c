// SPDX-License-Identifier: Apache-2.0
// One physical effect in the signal path of the loop, and a chain of effects.
//
// Each effect is a law: a class in a separate file with three functions:
//   double reset(double in) noexcept
//       Sets the steady state at this input. Returns the output without the parts that depend on
//       time or chance.
//   double step(double in [, double time_s]) noexcept
//       Steps one period. Returns the output.
//   void set_severity(double severity) noexcept
//       0: absent, 1: as configured, between: partly.
// A law that acts on the flow instead of the stem has `static constexpr bool kActsOnFlow = true`. A
// law that acts on the output of the transmitter, after its noise, has `static constexpr bool
// kActsOnReading = true`. model/effects defines the name and the parameters of each law.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace loopwarden::effects {

// The time during which an effect is present. Severity rises from 0 at `from_s` to 1 at `from_s +
// ramp_s`, and drops to 0 at `to_s`.
struct Schedule {
  double from_s = -std::numeric_limits<double>::infinity();  // s, time of the record
  double to_s = std::numeric_limits<double>::infinity();     // s
  double ramp_s = 0.0;                                       // s, >= 0

  friend bool operator==(const Schedule&, const Schedule&) = default;

  bool always() const noexcept { return *this == Schedule{}; }
  double severity(double time_s) const noexcept {
    if (time_s < from_s || time_s >= to_s) return 0.0;
    return ramp_s > 0.0 ? std::min(1.0, (time_s - from_s) / ramp_s) : 1.0;
  }
};

// Stores any law in place. Stepping, resetting and moving never allocate. Copying allocates only if
// the law owns memory (a delay line).
class Effect {
 public:
  // Implicit, so that a function that makes an effect can return its law.
  template <class Law>
  requires(!std::same_as<std::remove_cvref_t<Law>, Effect>) Effect(Law law)
  noexcept {  // NOLINT(google-explicit-constructor)
    static_assert(sizeof(Held<Law>) <= kRoom && alignof(Held<Law>) <= alignof(std::max_align_t),
                  "the law is too large to be held in place: raise kRoom, or let it own memory");
    static_assert(std::is_nothrow_move_constructible_v<Law>);
    ::new (static_cast<void*>(room_)) Held<Law>(std::move(law));
  }
  Effect(const Effect& other) { other.held().copy_to(room_); }
  Effect(Effect&& other) noexcept { other.held().move_to(room_); }
  Effect& operator=(const Effect& other) {
    if (this != &other) *this = Effect(other);
    return *this;
  }
  Effect& operator=(Effect&& other) noexcept {
    if (this == &other) return *this;
    held().~Interface();
    other.held().move_to(room_);
    return *this;
  }
  ~Effect() { held().~Interface(); }

  double reset(double in) noexcept { return held().reset(in); }
  double step(double in, double time_s) noexcept { return held().step(in, time_s); }
  void set_severity(double severity) noexcept { held().set_severity(severity); }
  // Steps all of `signal` in place; sample k is at `first_s` + k `period_s`. A null `schedule`
  // means always.
  void run(std::span<double> signal, double first_s, double period_s,
           const Schedule* schedule) noexcept {
    held().run(signal, first_s, period_s, schedule);
  }
  bool acts_on_flow() const noexcept { return held().acts_on_flow(); }
  bool acts_on_reading() const noexcept { return held().acts_on_reading(); }

 private:
  static constexpr std::size_t kRoom = 384;  // bytes

  struct Interface {
    virtual ~Interface() = default;
    virtual double reset(double in) noexcept = 0;
    virtual double step(double in, double time_s) noexcept = 0;
    virtual void set_severity(double severity) noexcept = 0;
    virtual void run(std::span<double> signal, double first_s, double period_s,
                     const Schedule* schedule) noexcept = 0;
    virtual bool acts_on_flow() const noexcept = 0;
    virtual bool acts_on_reading() const noexcept = 0;
    virtual void copy_to(void* room) const = 0;
    virtual void move_to(void* room) noexcept = 0;
  };

  template <class Law>
  struct Held final : Interface {
    explicit Held(Law given) noexcept : law(std::move(given)) {}

    double reset(double in) noexcept override { return law.reset(in); }
    double step(double in, double time_s) noexcept override {
      if constexpr (requires { law.step(in, time_s); }) {
        return law.step(in, time_s);
      } else {
        return law.step(in);
      }
    }
    void set_severity(double severity) noexcept override { law.set_severity(severity); }
    void run(std::span<double> signal, double first_s, double period_s,
             const Schedule* schedule) noexcept override {
      for (std::size_t k = 0; k < signal.size(); ++k) {
        const double time_s = first_s + static_cast<double>(k) * period_s;
        if (schedule != nullptr) law.set_severity(schedule->severity(time_s));
        signal[k] = Held::step(signal[k], time_s);
      }
    }
    bool acts_on_flow() const noexcept override {
      if constexpr (requires { Law::kActsOnFlow; }) {
        return Law::kActsOnFlow;
      } else {
        return false;
      }
    }
    bool acts_on_reading() const noexcept override {
      if constexpr (requires { Law::kActsOnReading; }) {
        return Law::kActsOnReading;
      } else {
        return false;
      }
    }
    void copy_to(void* room) const override { ::new (room) Held(*this); }
    void move_to(void* room) noexcept override { ::new (room) Held(std::move(*this)); }

    Law law;
  };

  Interface& held() noexcept { return *std::launder(reinterpret_cast<Interface*>(room_)); }
  const Interface& held() const noexcept {
    return *std::launder(reinterpret_cast<const Interface*>(room_));
  }

  alignas(std::max_align_t) std::byte room_[kRoom];
};

// Effects in the order in which the signal meets them.
class EffectChain {
 public:
  // Adds an effect at the end. Allocates; the other functions don't.
  void add(Effect effect, const Schedule& schedule = {});

  double reset(double in, double time_s) noexcept;
  double step(double in, double time_s) noexcept;
  // As above. `travel` receives the input of the first effect that acts on the flow, or the output
  // if no effect acts on the flow. In the chain of a valve this is the stem travel.
  double reset(double in, double time_s, double& travel) noexcept;
  double step(double in, double time_s, double& travel) noexcept;

  // Steps all of `signal` in place; sample k is at `first_s` + k `period_s`. The result has the
  // same bits as stepping sample by sample, and it is several times as fast.
  void run(std::span<double> signal, double first_s, double period_s) noexcept;

  bool empty() const noexcept { return links_.empty(); }
  // Returns the largest severity of the effects with a schedule, 0 if no effect has one.
  double scheduled_severity(double time_s) const noexcept;

 private:
  struct Link {
    Effect effect;
    Schedule schedule;
    bool scheduled;
    bool acts_on_flow;
  };
  // Passes the signal through all effects; `advance(effect, in)` returns the output of one effect.
  template <class Advance>
  double pass(double in, double time_s, double& travel, Advance advance) noexcept;

  std::vector<Link> links_;
};

}  // namespace loopwarden::effects
