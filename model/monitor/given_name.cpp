// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/given_name.hpp"

#include <algorithm>
#include <array>

#include "model/effects/catalogue.hpp"

namespace loopwarden::monitor {
namespace {

constexpr std::array kStickAlarms{AlarmKind::stiction, AlarmKind::backlash, AlarmKind::hysteresis};

bool agrees_with_stick(std::string_view effect) noexcept {
  const effects::Descriptor* info = effects::find_word(effect);
  return info != nullptr &&
         std::any_of(kStickAlarms.begin(), kStickAlarms.end(),
                     [&](AlarmKind kind) { return effects::agrees(*info, to_text(kind)); });
}

}  // namespace

bool stick_alarm_on(const LoopAlarms& alarms) noexcept {
  return std::any_of(kStickAlarms.begin(), kStickAlarms.end(),
                     [&](AlarmKind kind) { return alarms.alarm(kind).active(); });
}

bool gives_name(std::string_view effect, double confidence, double gap_closed,
                StickSeen stick) noexcept {
  if (effect.empty() || !(confidence >= kSureName) || gap_closed < kSureClosed) return false;
  if (!stick.by_read_back) return true;
  return stick.alarm_on ? agrees_with_stick(effect) : effect != "learned";
}

}  // namespace loopwarden::monitor
