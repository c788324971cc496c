// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

#include "workbench/command_line/background.hpp"

namespace loopwarden::workbench {
namespace {
constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::size_t kLongRecord = 50'000;  // rows
constexpr int kBarWidth = 30;
}  // namespace

Progress::Progress(std::string what, std::uint64_t total, Clock now)
    : what_(std::move(what)),
      total_(total),
      now_(now),
      visible_(isatty(STDERR_FILENO) == 1),
      started_(now_()),
      drawn_at_(started_) {}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");
}

void Progress::update(std::uint64_t done) {
  if (in_background()) {
    tell(done);
    return;
  }
  const auto now = now_();
  if (!visible_ || total_ == 0 || now - drawn_at_ < kRedraw) return;
  drawn_at_ = now;
  const double share = static_cast<double>(done) / static_cast<double>(total_);
  const double spent_s = std::chrono::duration<double>(now - started_).count();
  const double left_s = share > 0.0 ? spent_s * (1.0 - share) / share : 0.0;
  drawn_ = true;
  const int filled = static_cast<int>(share * kBarWidth);
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3.0f} %  {:.0f} s left \x1b[K", what_, "", filled, "",
             kBarWidth - filled, share * 100.0, left_s);
}

// Prints one line per percent.
void Progress::tell(std::uint64_t done) {
  if (total_ == 0) return;
  const int percent =
      static_cast<int>(100.0 * static_cast<double>(done) / static_cast<double>(total_));
  if (percent <= told_percent_) return;
  told_percent_ = percent;
  fmt::print(stderr, "progress: {} {} %\n", what_, percent);
}

void Progress::update_share(double share) {
  update(static_cast<std::uint64_t>(share * static_cast<double>(total_)));
}

void say_if_long(const std::string& record, std::size_t rows) {
  if (rows < kLongRecord) return;
  fmt::print(stderr, "{}: {} rows: this may take minutes; a stretch of the record takes less\n",
             record, rows);
}

}  // namespace loopwarden::workbench
