// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "services/notify/channels/channel_settings.hpp"

namespace loopwarden::notify {
namespace {

constexpr std::size_t kMostBytes = 4096;

std::filesystem::path file_of(const Secret& secret) {
  if (secret.credential.empty()) return secret.file;
  const char* directory = std::getenv("CREDENTIALS_DIRECTORY");
  if (directory == nullptr) {
    throw std::runtime_error(
        fmt::format("credential '{}': the service manager gives none (LoadCredential= of the unit)",
                    secret.credential));
  }
  return std::filesystem::path(directory) / secret.credential;
}

}  // namespace

std::string read_secret(const Secret& secret) {
  const std::filesystem::path path = file_of(secret);
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  while (text.ends_with('\n') || text.ends_with('\r')) text.pop_back();
  const bool control =
      std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; });
  const char* why = text.empty()               ? "is missing, not readable or empty"
                    : text.size() > kMostBytes ? "is longer than 4 KiB"
                    : control                  ? "holds a control character"
                                               : nullptr;
  if (why != nullptr) throw std::runtime_error(fmt::format("secret {} {}", path.string(), why));
  return text;
}

}  // namespace loopwarden::notify
