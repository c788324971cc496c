// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/configuration_files.hpp"

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>

#include "config/validation/validation.hpp"

namespace loopwarden::daemon {

ConfigurationFiles::ConfigurationFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

bool ConfigurationFiles::begin() {
  auto reading = std::make_shared<Reading>();
  const bool begun = reader_.begin([reading, path = folder_] {
    try {
      reading->files = config::validate_all(path);
    } catch (const std::exception& e) {
      reading->error = e.what();
    }
    reading->there.store(true, std::memory_order_release);
  });
  if (!begun) return false;
  now_ = std::move(reading);
  slow_reported_ = false;
  return true;
}

std::shared_ptr<const ReadFiles> ConfigurationFiles::fetch() {
  constexpr double kSlow = 10.0;  // s
  if (!now_) return nullptr;
  if (now_->there.load(std::memory_order_acquire)) return std::exchange(now_, nullptr);
  if (reader_.seconds() > kSlow && !slow_reported_) {
    slow_reported_ = true;
    spdlog::error("reload: the disk has not answered for {:.0f} s; the loops run on as before",
                  reader_.seconds());
  }
  return nullptr;
}

}  // namespace loopwarden::daemon
