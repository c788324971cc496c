// SPDX-License-Identifier: Apache-2.0
#include "services/page/app/load_fleet.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

namespace loopwarden::fleet {

std::unique_ptr<Fleet> load_fleet(const DatabaseSettings& settings) {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  const std::filesystem::path file =
      program.parent_path().parent_path() / "lib/loopwarden/loopwarden-page-fleet.so";
  // It stays loaded until the program ends.
  void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* symbol = module == nullptr ? nullptr : dlsym(module, kMakeFleet);
  if (symbol == nullptr) {
    throw std::runtime_error(
        fmt::format("the page of a fleet needs the package loopwarden-fleet: apt install "
                    "loopwarden-fleet ({})",
                    dlerror()));
  }
  return std::unique_ptr<Fleet>(reinterpret_cast<MakeFleet*>(symbol)(settings));
}

}  // namespace loopwarden::fleet
