// SPDX-License-Identifier: Apache-2.0
#include "base/device_name.hpp"

#include <arpa/inet.h>

#include <array>
#include <filesystem>
#include <system_error>

#include "base/text.hpp"

namespace loopwarden::base {

std::string address_name(const std::string& name) {
  const std::string host = lower_case(name);
  std::array<char, INET6_ADDRSTRLEN> text{};
  in_addr four{};
  if (host == "localhost") return "127.0.0.1";
  if (::inet_pton(AF_INET, host.c_str(), &four) == 1) {
    return four.s_addr == INADDR_ANY ? "127.0.0.1" : host;
  }
  in6_addr six{};
  if (::inet_pton(AF_INET6, host.c_str(), &six) != 1) return host;
  if (IN6_IS_ADDR_UNSPECIFIED(&six)) six = in6addr_loopback;
  ::inet_ntop(AF_INET6, &six, text.data(), text.size());
  if (!IN6_IS_ADDR_V4MAPPED(&six)) return text.data();
  return address_name(std::string(text.data()).substr(std::string("::ffff:").size()));
}

std::string device_name(const std::string& path) {
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40;  // as Linux follows
  std::error_code error;
  fs::path name(path);
  for (int i = 0; i < kMostLinks && fs::is_symlink(name, error); ++i) {
    const fs::path target = fs::read_symlink(name, error);
    if (error) break;
    name = name.parent_path() / target;  // operator/ keeps an absolute path as it is
  }
  const fs::path real = fs::weakly_canonical(name, error);
  return error || real.empty() ? name.string() : real.string();
}

}  // namespace loopwarden::base
