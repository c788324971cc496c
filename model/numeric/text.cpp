// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/text.hpp"

#include <array>
#include <cstdarg>
#include <cstdio>

namespace loopwarden::numeric {

// NOLINTNEXTLINE(cert-dcl50-cpp): checked against its format by the compiler
std::string text(const char* format, ...) {
  std::array<char, 512> out{};
  va_list values;
  va_start(values, format);
  std::vsnprintf(out.data(), out.size(), format, values);
  va_end(values);
  return out.data();
}

}  // namespace loopwarden::numeric
