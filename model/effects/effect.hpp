// SPDX-License-Identifier: Apache-2.0
// One physical effect in the signal path of the loop, and a chain of them.
//
// Each effect is a law: a class in a file of its own with three functions:
//   double reset(double in) noexcept               steady state at this input; returns the output,
//                                                  what depends on time or chance left out
//   double step(double in [, double time_s]) noexcept   one period; returns the output
//   void set_severity(double severity) noexcept    0: absent, 1: as configured, between: partly
// A law of the flow rather than of the stem says `static constexpr bool kActsOnFlow = true`; one of what
// the transmitter puts out, behind its noise, `static constexpr bool kActsOnReading = true`.
// model/effects says by which name and with which parameters each is made.
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

// When an effect is present. Severity rises from 0 at `from_s` to 1 at `from_s + ramp_s`, and drops
// to 0 at `to_s`.
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

// Any law, held in place: stepping, resetting and moving never allocate; copying does only where the
// law itself has memory of its own (a delay line).
class Effect {
 public:
  // Implicit, so that what makes an effect returns its law.
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
  // Steps the whole of `signal`, sample k at `first_s` + k `period_s`, in place. `schedule` null: always.
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
  // Allocates; everything below does not.
  void add(Effect effect, const Schedule& schedule = {});

  double reset(double in, double time_s) noexcept;
  double step(double in, double time_s) noexcept;
  // The same; `travel` receives the signal as it enters the first effect that acts on the flow, or the
  // output if there is none: the stem travel, where the chain is a valve's.
  double reset(double in, double time_s, double& travel) noexcept;
  double step(double in, double time_s, double& travel) noexcept;

  // Steps the whole of `signal`, sample k at `first_s` + k `period_s`, in place: the same bits as sample
  // by sample, several times as fast.
  void run(std::span<double> signal, double first_s, double period_s) noexcept;

  bool empty() const noexcept { return links_.empty(); }
  // Largest severity of the effects on a schedule, 0 if there is none.
  double scheduled_severity(double time_s) const noexcept;

 private:
  struct Link {
    Effect effect;
    Schedule schedule;
    bool scheduled;
    bool acts_on_flow;
  };
  // `advance(effect, in)` gives the effect's output.
  template <class Advance>
  double pass(double in, double time_s, double& travel, Advance advance) noexcept;

  std::vector<Link> links_;
};

}  // namespace loopwarden::effects
