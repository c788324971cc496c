// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>

#include "services/page/settings/page_settings.hpp"

namespace loopwarden::page {

// Exit code 78.
class BadConfiguration : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// That certificate, key, users file and what the directory takes can be used. Throws BadConfiguration.
void check_files(const PageSettings& settings);

// Serves the page until SIGTERM or SIGINT; SIGHUP reads certificate and key again.
// `site`: a folder in place of the built-in files, for work on them; empty: none. Returns the exit code; throws
// BadConfiguration, or std::runtime_error if it can't begin.
int serve(PageSettings settings, const std::filesystem::path& site);

}  // namespace loopwarden::page
