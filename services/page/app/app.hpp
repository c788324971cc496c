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

// Checks that certificate, key, users file and directory files are usable. Throws BadConfiguration.
void check_files(const PageSettings& settings);

// Serves the page until SIGTERM or SIGINT; SIGHUP reads certificate and key again. `site`: a folder
// that replaces the built-in files during development; empty: not used. Returns the exit code.
// Throws BadConfiguration, or std::runtime_error if it can't begin.
int serve(PageSettings settings, const std::filesystem::path& site);

}  // namespace loopwarden::page
