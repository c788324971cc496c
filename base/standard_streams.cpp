// SPDX-License-Identifier: Apache-2.0
#include "base/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>

#include "base/exit_code.hpp"

namespace loopwarden::base {
namespace {

int output_error = 0;  // errno of the first failure

// Writes all bytes. Returns false, with errno, if that fails.
bool write_all(int fd, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

// write_output() and write_error() always report success: otherwise fmt::print would throw in the
// middle of a command.
ssize_t write_output(void*, const char* data, std::size_t size) {
  if (output_error == 0 && !write_all(STDOUT_FILENO, data, size)) output_error = errno;
  return static_cast<ssize_t>(size);
}

ssize_t write_error(void*, const char* data, std::size_t size) {
  static_cast<void>(write_all(STDERR_FILENO, data, size));
  return static_cast<ssize_t>(size);
}

// Opens the place of a closed stream in the wrong direction, so that its use still fails.
void hold_place(int fd) {
  if (fcntl(fd, F_GETFD) >= 0 || errno != EBADF) return;
  static_cast<void>(::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY));
}

}  // namespace

StandardStreams::StandardStreams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) hold_place(fd);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // treat a file-size limit as a full disk, don't end
  if (FILE* const out = fopencookie(
          nullptr, "w",
          {.read = nullptr, .write = write_output, .seek = nullptr, .close = nullptr})) {
    std::setvbuf(out, nullptr, isatty(STDOUT_FILENO) == 1 ? _IOLBF : _IOFBF, BUFSIZ);
    stdout = out;
  }
  if (FILE* const error =
          fopencookie(nullptr, "w",
                      {.read = nullptr, .write = write_error, .seek = nullptr, .close = nullptr})) {
    std::setvbuf(error, nullptr, _IONBF, 0);
    stderr = error;
  }
}

int StandardStreams::finish(int exit_code) {
  std::fflush(stdout);
  if (output_error == 0 || output_error == EPIPE) return exit_code;
  const std::string reason = std::string("standard output: ") + std::strerror(output_error) + "\n";
  std::fputs(reason.c_str(), stderr);
  return exit_code == kExitOk ? kExitIo : exit_code;
}

}  // namespace loopwarden::base
