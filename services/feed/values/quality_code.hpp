// SPDX-License-Identifier: Apache-2.0
// Qualities as numbers.
#pragma once

#include <cstdint>

#include "daemon/protocol/feed_line.hpp"

namespace loopwarden::feed {

enum class QualityCodes : std::uint8_t {
  opc,    // 192 to 255 good, 64 to 127 uncertain, others bad; includes Sparkplug's 0, 192 and 500
  opc_ua  // status codes of OPC UA: the two highest of 32 bits, 0 good, 1 uncertain, others bad
};

inline protocol::FedValue::Quality quality_of_code(double code, QualityCodes codes) noexcept {
  using Quality = protocol::FedValue::Quality;
  if (codes == QualityCodes::opc_ua) {
    if (code >= 0.0 && code < 1073741824.0) return Quality::good;
    return code >= 1073741824.0 && code < 2147483648.0 ? Quality::uncertain : Quality::bad;
  }
  if (code >= 192.0 && code <= 255.0) return Quality::good;
  return code >= 64.0 && code <= 127.0 ? Quality::uncertain : Quality::bad;
}

}  // namespace loopwarden::feed
