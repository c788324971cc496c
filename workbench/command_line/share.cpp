// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/share.hpp"

#include <charconv>

#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

std::uint64_t stable_hash(const std::string& text) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  // Shares use the low bits, which FNV-1a mixes badly. This is the finaliser of MurmurHash3.
  hash = (hash ^ (hash >> 33U)) * 0xff51afd7ed558ccdULL;
  return hash ^ (hash >> 33U);
}

Share share_from(const std::string& text) {
  if (text.empty()) return {};
  constexpr std::size_t kMost = 100000;
  Share share;
  const char* end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, share.share);
  if (first == std::errc{} && slash != end && *slash == '/') {
    const auto [rest, second] = std::from_chars(slash + 1, end, share.of);
    if (second == std::errc{} && rest == end && share.share >= 1 && share.share <= share.of &&
        share.of <= kMost) {
      return share;
    }
  }
  throw CommandError(kExitUsage, "--shard: k/N with k from 1 to N, as 2/8");
}

}  // namespace loopwarden::workbench
