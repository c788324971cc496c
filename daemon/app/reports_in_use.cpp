// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reports_in_use.hpp"

#include <algorithm>
#include <string>
#include <system_error>

#include "config/config_reader.hpp"

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;

// Returns the canonical path, because one folder may have several names (relative paths, links).
fs::path place_of(const fs::path& path) {
  std::error_code error;
  const fs::path found = fs::weakly_canonical(path, error);
  return error ? path.lexically_normal() : found;
}

bool lies_in(const std::string& named, const fs::path& folder) {
  if (named.empty()) return false;
  const fs::path path = place_of(named);
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace

bool needed_by_loops(const fs::path& folder, const std::vector<LoopRuntime>& loops,
                     const fs::path& configuration) {
  const fs::path place = place_of(folder);
  const auto names_it = [&](const config::LoopConfig& loop) {
    return lies_in(loop.monitor.twin, place) || lies_in(loop.monitor.specialists, place);
  };
  if (std::any_of(loops.begin(), loops.end(),
                  [&](const LoopRuntime& loop) { return names_it(loop.config); })) {
    return true;
  }
  const auto files = config::read_configuration(configuration);
  return !files || std::any_of(files->loops.begin(), files->loops.end(), names_it);
}

}  // namespace loopwarden::daemon
