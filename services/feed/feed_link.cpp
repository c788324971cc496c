// SPDX-License-Identifier: Apache-2.0
#include "services/feed/feed_link.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "base/local_address.hpp"

namespace loopwarden::feed {

bool FeedLink::connect(Clock::time_point now) {
  if (connected() || now < next_try_) return false;
  fd_ = base::try_local_connection(path_);
  if (fd_ < 0) {
    lost(now, path_ + ": " + std::generic_category().message(errno));
    return false;
  }
  since_ = now;
  why_.clear();
  return true;
}

void FeedLink::send(std::string_view line) {
  if (!connected()) return;
  waiting_ += line;
  waiting_ += '\n';
}

void FeedLink::flush(Clock::time_point now) {
  if (!connected()) return;
  std::size_t sent = 0;
  while (sent < waiting_.size()) {
    const ssize_t n = ::send(fd_, waiting_.data() + sent, waiting_.size() - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<std::size_t>(n);
    } else if (errno == EAGAIN) {
      break;
    } else if (errno != EINTR) {
      return lost(now, path_ + ": " + std::generic_category().message(errno));
    }
  }
  waiting_.erase(0, sent);
  if (waiting_.size() > kMostWaiting) return lost(now, path_ + ": the daemon does not read");
  // Lines without an id get no answer, so a readable socket means its end.
  std::array<char, 256> end{};
  const ssize_t n = ::recv(fd_, end.data(), end.size(), MSG_DONTWAIT);
  if (n == 0) {
    return lost(now, path_ +
                         ": closed by the daemon; is this program's user a feeder of "
                         "loopwardend.yaml, and no other process its own?");
  }
  if (n < 0 && errno != EAGAIN && errno != EINTR) {
    return lost(now, path_ + ": " + std::generic_category().message(errno));
  }
}

// A connection that breaks at once is no success: the daemon may not know this user.
void FeedLink::lost(Clock::time_point now, std::string why) {
  if (connected() && now - since_ > back_off_.longest) failures_ = 0;
  close();
  why_ = std::move(why);
  const double chance = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
  next_try_ = now + back_off_.pause(++failures_, chance);
}

void FeedLink::close() noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  waiting_.clear();
}

}  // namespace loopwarden::feed
