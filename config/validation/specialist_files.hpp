// SPDX-License-Identifier: Apache-2.0
// The specialists and twins that the loops' files name, loaded once each.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "config/loop_reader.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "model/watch/window_builder.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

struct Specialists {
  struct Folder {
    SpecialistFolder content;  // with a team; without the signature form
    std::uint32_t hash = 0;    // CRC-32 of its manifest, which has the digests of its weights
  };
  std::map<std::string, Folder> folders;            // by name
  std::uint32_t hash = 0;                           // CRC-32 of all manifests; 0: none
  std::map<std::string, plant::LoopModel> twins{};  // by file
};

// How a loop is cut into windows.
watch::WindowSettings window_of(const LoopConfig& loop);

// Loads them as loops name them, and refuses what the daemon can't work with: folders that can't be
// trusted, specialists of another sample time than the loop's windows, and twins of another sample
// time or other ranges than the loop.
class SpecialistFiles {
 public:
  // As LoopCheck (config_reader.hpp).
  void check(const LoopFile& file, Report& report, std::vector<Diagnostic>& of_named_files);
  // What loaded.
  Specialists take() { return std::move(read_); }

 private:
  void check_twin(const LoopFile& loop, Report& report, std::vector<Diagnostic>& of_named_files);
  void check_specialists(const LoopFile& loop, Report& report,
                         std::vector<Diagnostic>& of_named_files);

  Specialists read_;
  std::set<std::string> failed_;  // files and folders
};

}  // namespace loopwarden::config
