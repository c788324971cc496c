// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/write_meter.hpp"

#include <charconv>
#include <string>
#include <string_view>

#include "base/file.hpp"

namespace loopwarden::daemon::host {

std::optional<std::uint64_t> bytes_written() {
  constexpr std::string_view kName = "\nwrite_bytes: ";
  const std::optional<std::string> text = base::read_file("/proc/self/io", 4096);
  if (!text) return std::nullopt;
  const std::size_t at = text->find(kName);
  if (at == std::string::npos) return std::nullopt;
  std::uint64_t bytes = 0;
  const char* const digits = text->data() + at + kName.size();
  const auto [end, error] = std::from_chars(digits, text->data() + text->size(), bytes);
  return error == std::errc() ? std::optional(bytes) : std::nullopt;
}

WriteRate WriteMeter::add(std::int64_t monotonic_ms, std::uint64_t bytes) {
  samples_.push_back({monotonic_ms, bytes});
  while (samples_.size() > 2 && monotonic_ms - samples_[1].at_ms >= kWindow_ms) {
    samples_.pop_front();
  }
  const Sample& oldest = samples_.front();
  const std::int64_t passed_ms = monotonic_ms - oldest.at_ms;
  WriteRate rate{.bytes = bytes, .per_day_b = {}, .full_hour = passed_ms >= kWindow_ms};
  if (passed_ms >= kShortest_ms) {
    constexpr double kDay_ms = 24.0 * 3'600'000.0;
    rate.per_day_b =
        static_cast<double>(bytes - oldest.bytes) * kDay_ms / static_cast<double>(passed_ms);
  }
  return rate;
}

}  // namespace loopwarden::daemon::host
