// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/log_queue.hpp"

#include <poll.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <utility>

namespace loopwarden::daemon {
namespace {

void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      pollfd room{fd, POLLOUT, 0};
      ::poll(&room, 1, -1);
    } else if (errno != EINTR) {
      return;  // a failed log can't be reported
    }
  }
}

}  // namespace

LogQueue::LogQueue(int fd, std::size_t most_lines) : fd_(fd), most_lines_(most_lines) {
  thread_.start({.name = "lw-log"}, [this] { run(); });
}

LogQueue::~LogQueue() {
  base::ask_to_end(lines_mutex_, quit_, changed_);
  thread_.join();
}

bool LogQueue::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(lines_mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

void LogQueue::sink_it_(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t text;
  formatter_->format(message, text);
  {
    const std::lock_guard lock(lines_mutex_);
    if (lines_.size() >= most_lines_) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    lines_.emplace_back(text.data(), text.size());
  }
  changed_.notify_all();
}

void LogQueue::run() {
  std::uint64_t told = 0;
  for (;;) {
    std::string line;
    {
      std::unique_lock lock(lines_mutex_);
      changed_.wait(lock, [&] { return quit_ || !lines_.empty(); });
      if (lines_.empty()) return;
      line = std::move(lines_.front());
      lines_.pop_front();
    }
    write_all(fd_, line);
    const std::uint64_t lost_now = lost();
    if (lost_now == told) continue;
    write_all(fd_,
              fmt::format("{} lines of the log were lost: its queue was full\n", lost_now - told));
    told = lost_now;
  }
}

}  // namespace loopwarden::daemon
