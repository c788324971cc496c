// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/mman.h>
#include <sysexits.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

#include "services/notify/channels/email_channel.hpp"
#include "services/notify/channels/mail_text.hpp"
#include "services/notify/text/one_line.hpp"
#include "base/child_process.hpp"

namespace loopwarden::notify {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPause{10};

// A file in memory. The child reads its input from one and writes its output to another, so neither
// process waits for the other.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("loopwarden-notify", MFD_CLOEXEC)) {
    if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(fd_); }

  void write(std::string_view text) {
    while (!text.empty()) {
      const ssize_t n = ::write(fd_, text.data(), text.size());
      if (n < 0) throw std::system_error(errno, std::generic_category(), "memfd");
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    lseek(fd_, 0, SEEK_SET);
  }
  std::string first_line() const {
    std::array<char, 300> buffer{};
    const ssize_t n = pread(fd_, buffer.data(), buffer.size(), 0);
    const std::string_view text(buffer.data(), static_cast<std::size_t>(n > 0 ? n : 0));
    return one_line(text.substr(0, text.find('\n')), 200);
  }
  int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

// Returns whether a new attempt would fail in the same way.
bool is_final(int exit_code) {
  return exit_code == EX_USAGE || exit_code == EX_DATAERR || exit_code == EX_NOUSER ||
         exit_code == EX_NOHOST;
}

}  // namespace

SendmailChannel::SendmailChannel(EmailSettings settings, Sender sender)
    : settings_(std::move(settings)), sender_(std::move(sender)) {}

Delivery SendmailChannel::send(const Message& message, const std::atomic<bool>& quit) {
  try {
    MemoryFile input;
    MemoryFile output;
    input.write(mail_text(message, sender_, settings_));
    base::ChildProcess child(settings_.sendmail, {"-t", "-i"},
                             {.input = input.fd(), .output = output.fd(), .idle = false});
    const Clock::time_point until =
        Clock::now() + std::chrono::milliseconds(settings_.time_outs.all_ms);
    while (!child.ended() && !quit && Clock::now() < until) std::this_thread::sleep_for(kPause);
    const std::optional<int> code = child.ended();
    if (!code) return later(fmt::format("{} does not end in time", settings_.sendmail));
    if (*code == 0) return sent(fmt::format("taken by {}", settings_.sendmail));
    const std::string why =
        fmt::format("{} ended with {}: {}", settings_.sendmail, *code, output.first_line());
    return is_final(*code) ? refused(why) : later(why);
  } catch (const std::system_error& e) {
    return later(e.what());
  }
}

}  // namespace loopwarden::notify
