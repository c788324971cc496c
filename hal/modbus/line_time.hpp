// SPDX-License-Identifier: Apache-2.0
// Returns the time of one transaction on a serial line.
//
//   time = bytes * 11 / baud + 2 * silence + turnaround + pause
//
//   bytes       request and reply, including address and CRC; 11 bits each on the line
//   silence     3.5 characters, 1.75 ms above 19200 baud, before each of the two frames
//   turnaround  until the device answers; 5 ms are assumed
//   pause       configured for the link, s
//
// Source: Modbus over Serial Line V1.02, section 2.5.1 (frames and silent intervals).
#pragma once

#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/pdu.hpp"

namespace loopwarden::hal::modbus {

// Returns s for `bytes` of request and reply together.
inline double transaction_s(const LinkSettings& line, int bytes) noexcept {
  constexpr double kTurnaround = 0.005;  // s
  constexpr int kBitsPerByte = 11;
  constexpr int kFixedSilenceAbove = 19200;  // baud
  constexpr double kFixedSilence = 0.00175;  // s
  const double byte_s = kBitsPerByte / static_cast<double>(line.baud);
  const double silence_s = line.baud > kFixedSilenceAbove ? kFixedSilence : 3.5 * byte_s;
  return bytes * byte_s + 2.0 * silence_s + kTurnaround + line.pause_ms / 1000.0;
}

inline double read_s(const LinkSettings& line, int registers) noexcept {
  constexpr int kRequest = 8;      // unit, function, address, count, CRC
  constexpr int kReplyAround = 5;  // unit, function, byte count, CRC
  return transaction_s(line, kRequest + kReplyAround + 2 * registers);
}

// Returns the number of registers, 1 to 117, that a merged read on the line may have. The remaining
// 8 registers of a request make lengths distinct. The read occupies the line for at most a fifth of
// `period_s`, the shortest poll period of the controlled loops on this line. `period_s` is infinite
// if there are no such loops.
inline int most_registers_together(const LinkSettings& line, double period_s) noexcept {
  constexpr double kPartOfPeriod = 0.2;
  int most = static_cast<int>(kMaxReadRegisters) - kMostExtra;
  while (most > 1 && read_s(line, most) > kPartOfPeriod * period_s) --most;
  return most;
}

}  // namespace loopwarden::hal::modbus
