// SPDX-License-Identifier: Apache-2.0
#include "workbench/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace loopwarden::workbench {
namespace {
constexpr std::chrono::milliseconds kRedraw{100};
constexpr int kBarWidth = 30;
}  // namespace

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(total),
      visible_(isatty(STDERR_FILENO) == 1),
      started_(std::chrono::steady_clock::now()),
      drawn_at_(started_) {}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");
}

void Progress::update(std::uint64_t done) {
  const auto now = std::chrono::steady_clock::now();
  if (!visible_ || total_ == 0 || now - drawn_at_ < kRedraw) return;
  drawn_at_ = now;
  drawn_ = true;
  const double share = static_cast<double>(done) / static_cast<double>(total_);
  const double spent_s = std::chrono::duration<double>(now - started_).count();
  const int filled = static_cast<int>(share * kBarWidth);
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3.0f} %  {:.0f} s left \x1b[K", what_, "", filled, "",
             kBarWidth - filled, share * 100.0,
             share > 0.0 ? spent_s * (1.0 - share) / share : 0.0);
  std::fflush(stderr);
}

}  // namespace loopwarden::workbench
