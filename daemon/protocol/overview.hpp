// SPDX-License-Identifier: Apache-2.0
// The most frequent answer: a summary of all loops, in columns. This answer and the registers are
// written as text directly, without a JSON document in between.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::protocol {

enum class Column : std::uint8_t {
  period,
  pv,
  sp,
  co,
  stem,
  mode,
  requested_mode,
  fault,
  quality,
  flags,
  pv_age_ms,
  ne107,
  alarm,
  alarm_kind,
  alarms_unacknowledged,
  condition,
  not_in_file,  // gains
  commissioned
};
inline constexpr std::size_t kColumns = 18;

struct Overview {
  std::int64_t now_ms = 0;
  std::uint32_t config_hash = 0;
  std::array<std::vector<double>, kColumns> columns{};  // one value per loop; kNone: unknown

  std::vector<double>& operator[](Column c) { return columns[static_cast<std::size_t>(c)]; }
  const std::vector<double>& operator[](Column c) const {
    return columns[static_cast<std::size_t>(c)];
  }
};

// Return the answers as JSON text, with "ok". Numbers have six digits, those of registers nine.
std::string to_text(const Overview& overview);
std::string to_text(const Registers& registers);

// Returns whether the values are equal. NaN equals NaN.
bool same(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace loopwarden::protocol
