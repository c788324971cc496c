// SPDX-License-Identifier: Apache-2.0
// Commands to a running loop, and the rules for accepting them. The command line, the Modbus server
// and the cycle use the same rules.
//
// All parts of a command take effect in one cycle, in this sequence: jacket, planned moves, gains,
// mode, set point, output. Set point and output must fit the mode that the command requests. If one
// part can't act, the whole command is refused.
//
// A sender may add the values that it expects to be in force. The cycle compares them when it takes
// the command, so that no change in between remains unnoticed.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "daemon/rt/loop_settings.hpp"
#include "base/spsc_ring.hpp"

namespace loopwarden::daemon::rt {

enum class JacketMode : std::uint8_t { off, shadow, on };
// Planned moves instead of a compensator, for a loop without a compensator in its file. off: as in
// the file.
enum class MovesMode : std::uint8_t { off, shadow, on };

// Values that the sender of a command expects to be in force; values that are not given match any.
struct Expectation {
  std::optional<control::Mode> mode{};     // requested: manual or automatic
  std::optional<double> set_point{};       // PV units, the end of a ramp
  std::optional<double> output{};          // CO units, or kOutputNotKnown
  std::optional<double> kp{}, ki{}, kd{};  // of the parallel form
};
inline constexpr double kOutputNotKnown = std::numeric_limits<double>::quiet_NaN();

struct Command {
  std::uint64_t number = 0;  // counted per sender from 1; repeated in the answer
  std::optional<JacketMode> jacket{};
  std::optional<MovesMode> moves{};  // with LoopChannels::moves_settings
  std::optional<double> kp{};  // of the parallel form, as the two below; until the next reload
  std::optional<double> ki{};
  std::optional<double> kd{};
  std::optional<control::Mode> mode{};  // manual or automatic
  std::optional<double> set_point{};    // PV units
  std::optional<double> output{};       // CO units, for manual
  Expectation expected{};
  // The sender ends the loop's commissioning once the cycle has taken the command. The cycle itself
  // ignores this.
  bool ends_commissioning = false;

  // True if the command changes no value: the cycle only checks the expected values.
  bool empty() const noexcept {
    return !(jacket || moves || kp || ki || kd || mode || set_point || output);
  }
};
static_assert(std::is_trivially_copyable_v<Command>);

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
      return "the compensator acts, and the jacket can't act at the same time";
    case Refusal::moves_may_not_act:
      return "planned moves require monitor.corrective_action with that form, and on hardware its "
             "required keys";
    case Refusal::jacket_acts:
      return "the jacket acts, and planned moves can't act at the same time";
    case Refusal::compensator_of_file:
      return "the loop's file has a compensator, which planned moves don't replace";
    case Refusal::moves_of_other_sign:
      return "the process gain of the planned moves contradicts controller.action. Check action "
             "and monitor.twin";
    case Refusal::output_unknown: return "output position unknown. Set an output in manual first";
    case Refusal::output_in_automatic:
      return "in automatic the controller has the output. Set --mode man first, or in the same "
             "command";
    case Refusal::output_in_fault:
      return "the loop has a fault, whose action sets the output. Set it after the fault has "
             "cleared";
    case Refusal::manual_after_fault:
      return "the loop has a fault and must wait in manual after it. Set automatic then";
    case Refusal::set_point_tracks:
      return "in manual the set point follows PV. Set --mode auto first, or in the same command";
    case Refusal::mode_changed: return "the mode is not the expected one";
    case Refusal::set_point_changed: return "the set point is not the expected one";
    case Refusal::output_changed: return "the output is not the expected one";
    case Refusal::gains_changed: break;
  }
  return "the gains are not the expected ones";
}

// Returns true if the value is outside its limits, in any mode.
constexpr bool is_out_of_limits(Refusal refusal) noexcept {
  return refusal == Refusal::set_point_out_of_limits || refusal == Refusal::output_out_of_limits ||
         refusal == Refusal::gain_out_of_limits;
}

// State of a loop that decides whether it accepts a command.
struct LoopAvailability {
  control::Mode mode = control::Mode::manual;  // requested: manual or automatic
  bool output_known = false;                   // the position of the output is valid
  bool output_in_fault = false;                // the action of a fault has the output
  bool manual_after_fault = false;             // the present fault ends in manual

  friend bool operator==(const LoopAvailability&, const LoopAvailability&) = default;
};
// Converts to and from one number, for an atomic.
constexpr std::uint8_t packed(const LoopAvailability& availability) noexcept {
  return static_cast<std::uint8_t>((availability.mode == control::Mode::automatic ? 1U : 0U) |
                                   (availability.output_known ? 2U : 0U) |
                                   (availability.output_in_fault ? 4U : 0U) |
                                   (availability.manual_after_fault ? 8U : 0U));
}
constexpr LoopAvailability unpacked(std::uint8_t bits) noexcept {
  return {.mode = (bits & 1U) != 0 ? control::Mode::automatic : control::Mode::manual,
          .output_known = (bits & 2U) != 0,
          .output_in_fault = (bits & 4U) != 0,
          .manual_after_fault = (bits & 8U) != 0};
}

// Returns the reason of a refusal. `jacket`: the form in the loop's file.
Refusal judge(const Command& command, const LoopAvailability& availability,
              const LoopSettings& settings, control::JacketForm jacket) noexcept;

// Values in force when the cycle takes a command.
struct InForce {
  control::Mode mode = control::Mode::manual;  // requested
  double set_point = 0.0;                      // PV units, the end of a ramp
  double output = kOutputNotKnown;             // CO units
  double kp = 0.0, ki = 0.0, kd = 0.0;         // of the parallel form
};

// Numbers are equal up to this share of their range, gains up to this share of their value, because
// they were transferred as text.
inline constexpr double kSameShare = 1e-6;

// Returns the refusal for the first expected value that is not in force.
Refusal judge(const Expectation& expected, const InForce& now,
              const LoopSettings& settings) noexcept;

// Returns true if both numbers of the range `low` to `high` are equal; false if one is unknown.
bool is_same(double value, double is, double low, double high) noexcept;

// Removes the parts of a command that request the value in force. `now` and `availability` are
// those that the command will meet. Two parts stay, because only the new mode keeps them in force:
// the set point on a change to automatic, and the output on a change to manual.
void leave_out_in_force(Command& command, const InForce& now, const LoopAvailability& availability,
                        const LoopSettings& settings) noexcept;

// Replaces the gains that a command sets.
constexpr void set_gains(const Command& command, control::PidGains& gains) noexcept {
  gains.kp = command.kp.value_or(gains.kp);
  gains.ki = command.ki.value_or(gains.ki);
  gains.kd = command.kd.value_or(gains.kd);
}

struct CommandAnswer {
  std::uint64_t number = 0;
  Refusal refusal = Refusal::none;
  InForce now{};  // when the cycle took the command
};

// Channel between one sender and one loop, with an answer to each command. No answer is lost,
// because a sender has at most as many commands without an answer as there is room.
struct CommandMailbox {
  static constexpr std::size_t kRoom = 32;
  explicit CommandMailbox(std::size_t room = kRoom) : commands(room), answers(room) {}
  base::SpscRing<Command> commands;       // sender -> cycle
  base::SpscRing<CommandAnswer> answers;  // cycle -> sender
};

}  // namespace loopwarden::daemon::rt
