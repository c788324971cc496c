// SPDX-License-Identifier: Apache-2.0
// What may be asked of a running loop, and whether it can act: one rule for the command line, the Modbus server and
// the cycle that takes the order.
//
// All parts of an order take effect in one cycle, in the order in which they stand in it: jacket, planned moves, gains,
// mode, set point, output. Set point and output are judged by the mode that the order itself asks for. One part that can't act
// refuses the whole order.
//
// Who orders may say what he believes to be in force. Only the cycle judges that, with what is so at the moment at
// which the order would take effect: nothing can change behind his back.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "daemon/rt/loop_settings.hpp"
#include "base/spsc_ring.hpp"

namespace loopwarden::daemon::rt {

enum class JacketWish : std::uint8_t { off, shadow, on };
// Planned moves in the place of the compensator of the loop's file, which has none; off: as the file has it.
enum class MovesWish : std::uint8_t { off, shadow, on };

// What the sender of an order has seen; what is not given does not matter to him.
struct Expectation {
  std::optional<control::Mode> mode{};     // asked for: manual or automatic
  std::optional<double> set_point{};       // PV units, where a ramp goes
  std::optional<double> output{};          // CO units, or kOutputNotKnown
  std::optional<double> kp{}, ki{}, kd{};  // of the parallel form
};
inline constexpr double kOutputNotKnown = std::numeric_limits<double>::quiet_NaN();

struct Order {
  std::uint64_t number = 0;  // of its sender, from 1; for the answer
  std::optional<JacketWish> jacket{};
  std::optional<MovesWish> moves{};  // with LoopChannels::moves_settings
  std::optional<double> kp{};  // of the parallel form, as the two below; until the next reload
  std::optional<double> ki{};
  std::optional<double> kd{};
  std::optional<control::Mode> mode{};  // manual or automatic
  std::optional<double> set_point{};    // PV units
  std::optional<double> output{};       // CO units, for manual
  Expectation expected{};
  // Ends the loop's commissioning once the cycle has taken the order; for its sender, the cycle
  // ignores it.
  bool ends_commissioning = false;

  // It asks for nothing: the cycle judges what is expected, and changes nothing.
  bool empty() const noexcept {
    return !(jacket || moves || kp || ki || kd || mode || set_point || output);
  }
};
static_assert(std::is_trivially_copyable_v<Order>);

enum class Refusal : std::uint8_t {
  none,
  set_point_out_of_limits,
  output_out_of_limits,
  gain_out_of_limits,
  no_jacket,
  jacket_may_not_act,
  compensator_acts,
  moves_may_not_act,
  jacket_acts,
  compensator_of_file,
  moves_of_other_sign,
  output_unknown,
  output_in_automatic,
  output_in_fault,
  manual_after_fault,
  set_point_tracks,
  mode_changed,
  set_point_changed,
  output_changed,
  gains_changed
};

constexpr const char* to_text(Refusal refusal) noexcept {
  switch (refusal) {
    case Refusal::none: return "not refused";
    case Refusal::set_point_out_of_limits: return "the set point is outside its limits";
    case Refusal::output_out_of_limits: return "the output is outside its limits";
    case Refusal::gain_out_of_limits: return "a gain must be a number of at least 0";
    case Refusal::no_jacket: return "the loop has no jacket configured";
    case Refusal::jacket_may_not_act:
      return "the jacket acts in form bounded or dwell only, on hardware with max_mean_error";
    case Refusal::compensator_acts:
      return "the compensator acts, and the jacket can't act beside it";
    case Refusal::moves_may_not_act:
      return "planned moves act where monitor.corrective_action has that form, with what it asks "
             "for on hardware";
    case Refusal::jacket_acts: return "the jacket acts, and planned moves can't act beside it";
    case Refusal::compensator_of_file:
      return "the loop's file has a compensator of its own, which planned moves don't replace";
    case Refusal::moves_of_other_sign:
      return "the process gain of the planned moves contradicts controller.action: check action "
             "and "
             "monitor.twin";
    case Refusal::output_unknown:
      return "where the output stands is not known; in manual, set an output first";
    case Refusal::output_in_automatic:
      return "in automatic the controller has the output; order manual first, or with it";
    case Refusal::output_in_fault:
      return "the loop has a fault, whose action has the output; order it when the fault is over";
    case Refusal::manual_after_fault:
      return "the loop has a fault and is to wait in manual after it; order automatic then";
    case Refusal::set_point_tracks:
      return "in manual the set point follows PV; order automatic first, or with it";
    case Refusal::mode_changed: return "the mode is not the expected one";
    case Refusal::set_point_changed: return "the set point is not the expected one";
    case Refusal::output_changed: return "the output is not the expected one";
    case Refusal::gains_changed: break;
  }
  return "the gains are not the expected ones";
}

// No mode helps: the value itself can't be.
constexpr bool is_out_of_limits(Refusal refusal) noexcept {
  return refusal == Refusal::set_point_out_of_limits || refusal == Refusal::output_out_of_limits ||
         refusal == Refusal::gain_out_of_limits;
}

// What an order finds when it is taken.
struct Standing {
  control::Mode mode = control::Mode::manual;  // asked for: manual or automatic
  bool output_known = false;                   // where the valve stands
  bool output_in_fault = false;                // a fault's action has the output
  bool manual_after_fault = false;             // a fault is there that ends in manual

  friend bool operator==(const Standing&, const Standing&) = default;
};
// As one number, for an atomic.
constexpr std::uint8_t packed(const Standing& standing) noexcept {
  return static_cast<std::uint8_t>(
      (standing.mode == control::Mode::automatic ? 1U : 0U) | (standing.output_known ? 2U : 0U) |
      (standing.output_in_fault ? 4U : 0U) | (standing.manual_after_fault ? 8U : 0U));
}
constexpr Standing unpacked(std::uint8_t bits) noexcept {
  return {.mode = (bits & 1U) != 0 ? control::Mode::automatic : control::Mode::manual,
          .output_known = (bits & 2U) != 0,
          .output_in_fault = (bits & 4U) != 0,
          .manual_after_fault = (bits & 8U) != 0};
}

// `jacket`: the form that is configured, whatever the operator has done with it.
Refusal judge(const Order& order, const Standing& standing, const LoopSettings& settings,
              control::JacketForm jacket) noexcept;

// What is so as the order would take effect.
struct InForce {
  control::Mode mode = control::Mode::manual;  // asked for
  double set_point = 0.0;                      // PV units, where a ramp goes
  double output = kOutputNotKnown;             // CO units
  double kp = 0.0, ki = 0.0, kd = 0.0;         // of the parallel form
};

// Numbers count as the same up to this share of their range, gains of themselves: they came as text.
inline constexpr double kSameShare = 1e-6;

Refusal judge(const Expectation& expected, const InForce& now,
              const LoopSettings& settings) noexcept;

// Whether `value` is `is`, for numbers of the range `low` to `high`; false if one is not known.
bool is_same(double value, double is, double low, double high) noexcept;

// Takes the parts out of an order that ask for the value in force: they are no command. `now` and
// `standing` are those that the order will find. Values that only the new mode keeps in force stay:
// the set point on the way to automatic, the output on the way to manual.
void leave_out_in_force(Order& order, const InForce& now, const Standing& standing,
                        const LoopSettings& settings) noexcept;

// The gains that an order asks for, put into those in force.
constexpr void set_gains(const Order& order, control::PidGains& gains) noexcept {
  gains.kp = order.kp.value_or(gains.kp);
  gains.ki = order.ki.value_or(gains.ki);
  gains.kd = order.kd.value_or(gains.kd);
}

struct OrderAnswer {
  std::uint64_t number = 0;
  Refusal refusal = Refusal::none;
  InForce now{};  // when the order was taken
};

// One sender's way to a loop and back. No answer is ever lost: who sends keeps to as many orders that are
// not answered yet as there is room.
struct OrderBox {
  static constexpr std::size_t kRoom = 32;
  explicit OrderBox(std::size_t room = kRoom) : orders(room), answers(room) {}
  base::SpscRing<Order> orders;         // sender -> cycle
  base::SpscRing<OrderAnswer> answers;  // cycle -> sender
};

}  // namespace loopwarden::daemon::rt
