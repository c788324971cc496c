// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/restart_pause.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <optional>
#include <sstream>
#include <string>
#include <system_error>

#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

struct Starts {
  long long count = 0;
  long long last_ns = 0;  // monotonic
};

Starts read(const std::filesystem::path& file) {
  Starts starts;
  const std::optional<std::string> text = base::read_file(file, 100);
  if (!text) return {};
  std::istringstream in(*text);
  in >> starts.count >> starts.last_ns;
  return in ? starts : Starts{};
}

}  // namespace

std::chrono::milliseconds RestartPause::count_start(std::chrono::nanoseconds now,
                                                    double chance) const {
  const Starts before = read(file_);
  const std::chrono::nanoseconds passed = now - std::chrono::nanoseconds(before.last_ns);
  const bool follows = passed >= passed.zero() && passed < kHealthy && before.count > 0;
  const long long count = follows ? before.count + 1 : 1;
  std::error_code error;
  std::filesystem::create_directories(file_.parent_path(), error);
  const auto failure = base::replace_file(file_, fmt::format("{} {}\n", count, now.count()),
                                          {.wait_for_disk = false});
  if (failure) spdlog::warn("starts can't be counted: {}", failure->text());
  if (count <= kAtOnce) return {};
  return kBackOff.pause(count - kAtOnce, chance);
}

void RestartPause::forget() const noexcept {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace loopwarden::daemon
