// SPDX-License-Identifier: Apache-2.0
#include "services/notify/text/one_line.hpp"

#include <utf8.h>

#include <cstdint>

namespace loopwarden::notify {
namespace {

bool may_stand(std::uint32_t code) {
  const bool control = code < 0x20 || (code >= 0x7F && code <= 0x9F);
  const bool separator = code == 0x2028 || code == 0x2029;
  const bool direction = (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) ||
                         code == 0x200E || code == 0x200F;
  return !control && !separator && !direction && code != 0xFEFF;
}

}  // namespace

std::string one_line(std::string_view text, std::size_t most_bytes) {
  std::string line;
  const char* const end = text.data() + text.size();
  for (const char* at = text.data(); at != end;) {
    const char* const start = at;
    bool stands = false;
    try {
      stands = may_stand(static_cast<std::uint32_t>(utf8::next(at, end)));
    } catch (const utf8::exception&) {
      ++at;
    }
    const std::string_view shown = stands ? std::string_view(start, at) : std::string_view("?");
    if (line.size() + shown.size() > most_bytes) break;
    line += shown;
  }
  return line;
}

}  // namespace loopwarden::notify
