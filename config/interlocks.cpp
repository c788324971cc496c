// SPDX-License-Identifier: Apache-2.0
#include "config/interlocks.hpp"

#include <fmt/format.h>

#include <cmath>

namespace loopwarden::config {

Backing backing_of(const Io& io) noexcept {
  // A backend counts as hardware unless it is known to move no valve.
  return {.hardware = !std::holds_alternative<SimIo>(io) &&
                      !std::holds_alternative<hal::replay::ReplaySettings>(io)};
}

JacketInterlocks interlocks_of(const control::JacketSettings& jacket, Backing backing) noexcept {
  return {.paper = jacket.form == control::JacketForm::paper,
          .max_mean_error = backing.hardware && !std::isfinite(jacket.max_mean_error)};
}

namespace {
bool acts_on_hardware(const control::CompensatorSettings& compensator, Backing backing) noexcept {
  return compensator.kind != control::CompensatorKind::none && !compensator.shadow &&
         backing.hardware;
}
}  // namespace

const char* lacks(const control::CompensatorSettings& compensator, Backing backing) noexcept {
  if (!acts_on_hardware(compensator, backing)) return nullptr;
  if (compensator.kind != control::CompensatorKind::planned_moves) {
    return std::isfinite(compensator.limit) ? nullptr : "limit";
  }
  const control::PlannedMovesSettings& planned = compensator.planned;
  if (!std::isfinite(planned.max_move)) return "max_move";
  if (!std::isfinite(planned.max_moves_per_hour)) return "max_moves_per_hour";
  if (planned.s_high <= planned.s_low) return "s_interval";
  return nullptr;
}

bool too_wide(const control::CompensatorSettings& compensator, Backing backing) noexcept {
  return acts_on_hardware(compensator, backing) &&
         compensator.kind == control::CompensatorKind::planned_moves &&
         compensator.planned.s_high > compensator.planned.s_low &&
         !control::within_factor_two(compensator.planned.s_low, compensator.planned.s_high);
}

bool moves_may_act(const alarm::CorrectiveSettings& corrective, Backing backing) noexcept {
  const bool bounded =
      std::isfinite(corrective.max_move) && std::isfinite(corrective.max_moves_per_hour);
  return corrective.enabled && corrective.form == alarm::CorrectiveForm::planned_moves &&
         (bounded || !backing.hardware);
}

std::string connection_of(const Io& io) {
  const auto text = [](const hal::modbus::LinkSettings& link) {
    return link.transport == hal::modbus::Transport::tcp
               ? fmt::format("link {} (Modbus {}:{})", link.name, link.host, link.port)
               : fmt::format("link {} (Modbus {})", link.name, link.device);
  };
  if (const auto* feed = std::get_if<hal::feed::FeedSettings>(&io)) {
    return feed->process_variable.name.feeder;
  }
  if (const auto* loop = std::get_if<hal::modbus::LoopModbusSettings>(&io)) {
    return text(loop->transmitter_link);
  }
  const auto* source = std::get_if<hal::modbus::ModbusSourceSettings>(&io);
  return source == nullptr ? std::string() : text(source->process_variable.link);
}

}  // namespace loopwarden::config
