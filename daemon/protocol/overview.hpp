// SPDX-License-Identifier: Apache-2.0
// The answer that is asked for most: every loop at a glance, in columns. Written without a document of JSON in between, as are the
// registers.
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
  std::array<std::vector<double>, kColumns> columns{};  // a value a loop; kNone: not known

  std::vector<double>& operator[](Column c) { return columns[static_cast<std::size_t>(c)]; }
  const std::vector<double>& operator[](Column c) const {
    return columns[static_cast<std::size_t>(c)];
  }
};

// The answers, with "ok": six digits, nine of a register.
std::string to_text(const Overview& overview);
std::string to_text(const Registers& registers);

// Whether they are the same; what is no number is like itself.
bool same(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace loopwarden::protocol
