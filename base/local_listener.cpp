// SPDX-License-Identifier: Apache-2.0
#include "base/local_listener.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "base/group_access.hpp"
#include "base/local_address.hpp"

namespace loopwarden::base {
namespace {

// Only the owner may connect until the permissions are set. The umask is not used for this: it
// applies to the whole process.
void bind_to(int fd, const std::string& path, std::optional<unsigned> group,
             std::size_t most_waiting) {
  const sockaddr_un address = local_address(path);
  if (fchmod(fd, S_IRUSR | S_IWUSR) != 0 ||
      bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      chmod(path.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0) {
    throw socket_failure("can't listen at " + path);
  }
  if (group) {
    admit_group(path, *group, {.read = true, .write = true});
    admit_group(std::filesystem::path(path).parent_path(), *group, {.execute = true});
  }
  if (::listen(fd, static_cast<int>(most_waiting)) != 0) {
    throw socket_failure("can't listen at " + path);
  }
}

}  // namespace

std::string other_listener(const std::string& path) {
  const int other = try_local_connection(path);
  const int error = errno;
  if (other >= 0) close(other);
  // A full queue also means that a process listens, even if it hangs.
  if (other >= 0 || error == EAGAIN) return "another daemon already listens at " + path;
  if (error == EACCES) {
    return "another daemon may already listen at " + path + ": no permission to connect to it";
  }
  return {};
}

int local_listener(const std::string& path, std::optional<unsigned> group,
                   std::size_t most_waiting) {
  const std::string other = other_listener(path);
  if (!other.empty()) throw std::runtime_error(other);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error("can't create " + folder.string() + ": " + error.message());
  unlink(path.c_str());
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) throw socket_failure("socket");
  try {
    bind_to(fd, path, group, most_waiting);
  } catch (...) {
    close(fd);
    throw;
  }
  return fd;
}

}  // namespace loopwarden::base
