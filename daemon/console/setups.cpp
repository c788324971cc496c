// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/setups.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "base/file.hpp"
#include "base/text.hpp"
#include "config/loop_reader.hpp"

namespace loopwarden::daemon::console {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostEntries = 1000;  // of the folder
constexpr std::size_t kMostSetups = 32;
constexpr std::size_t kMostBytes = 65'536;  // of a file

std::string command_for(const std::string& tag, const fs::path& configuration) {
  std::string command = "loopwarden setup " + tag;
  if (configuration == "/etc/loopwardend") return command;
  return command + " --config " + base::as_shell_word(configuration.string());
}

// The program that writes the file holds a write lock while it runs.
bool is_held(const base::File& file) {
  struct flock lock {};
  lock.l_type = F_RDLCK;
  lock.l_whence = SEEK_SET;
  return ::fcntl(file.fd(), F_OFD_GETLK, &lock) == 0 && lock.l_type == F_WRLCK;
}

std::optional<std::int64_t> time_in(const json& all, const char* key) {
  const auto found = all.find(key);
  if (found == all.end() || !found->is_number_integer()) return std::nullopt;
  return found->get<std::int64_t>();
}

// Returns nullopt if the file is not from a setup, or if the setup is complete.
std::optional<protocol::SetupUnderWay> setup_in(const fs::path& path) {
  const base::File file(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK);
  struct stat status {};
  if (!file.is_open() || ::fstat(file.fd(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  const bool held = is_held(file);
  const std::optional<std::string> text = file.read(kMostBytes + 1);
  if (!text || text->size() > kMostBytes) return std::nullopt;
  const json all = json::parse(*text, nullptr, false);
  if (!all.is_object() || !all.contains("steps")) return std::nullopt;
  try {
    const auto states = all.at("steps").get<std::map<std::string, std::string>>();
    const auto now_at = all.value("now_at", std::string());
    protocol::SetupUnderWay setup{.loop = path.stem().string(),
                                  .begun_ms = time_in(all, "begun_ms")};
    bool is_done = true;
    for (const auto& [name, title] : protocol::kSetupSteps) {
      protocol::SetupStep step{.name = name, .title = title, .state = "open"};
      const auto state = states.find(name);
      if (held && now_at == name) {
        step.state = "running";
        step.since_ms = time_in(all, "now_at_since_ms");
      } else if (state != states.end() && state->second == "done") {
        step.state = "done";
      }
      is_done = is_done && step.state == "done";
      setup.steps.push_back(std::move(step));
    }
    return is_done ? std::nullopt : std::optional(std::move(setup));
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

protocol::Setups setups_in(const fs::path& configuration) {
  std::error_code error;
  std::vector<fs::path> files;
  fs::directory_iterator entry(configuration / "setup", error);
  for (std::size_t i = 0; !error && entry != fs::directory_iterator() && i < kMostEntries; ++i) {
    const fs::path& path = entry->path();
    if (path.extension() == ".json" && config::is_usable_tag(path.stem().string()))
      files.push_back(path);
    entry.increment(error);
  }
  std::sort(files.begin(), files.end());
  protocol::Setups all;
  for (const fs::path& file : files) {
    if (all.setups.size() == kMostSetups) break;
    std::optional<protocol::SetupUnderWay> setup = setup_in(file);
    if (!setup) continue;
    setup->command = command_for(setup->loop, configuration);
    all.setups.push_back(std::move(*setup));
  }
  return all;
}

}  // namespace loopwarden::daemon::console
