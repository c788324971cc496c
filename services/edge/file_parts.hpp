// SPDX-License-Identifier: Apache-2.0
// Sends evidence on request: the files of one folder, part by part.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "services/net/sparkplug/payload.hpp"

namespace loopwarden::edge {

class FileParts {
 public:
  static constexpr std::size_t kMostFolders = 16;

  FileParts(std::uint64_t most_file_bytes, std::size_t part_bytes)
      : most_file_bytes_(most_file_bytes), part_bytes_(part_bytes) {}

  // Queues the evidence_files() of the folder as the answer to `request`. Returns an empty string
  // if all are queued, otherwise "refused: ..." (no file is sent), "left out: ..." (some files are
  // missing) or "not now: ...".
  std::string add(const std::string& device, const std::string& request,
                  const std::filesystem::path& folder);

  struct Part {
    std::string device;
    sparkplug::Metric metric;  // file/NAME, of type File
  };
  // Returns the next part, and the same part again until gone() is called; nullopt if no file
  // waits. A file that can't be read any further is dropped.
  std::optional<Part> next();
  void gone();
  bool empty() const noexcept { return waiting_.empty(); }

 private:
  struct File {
    std::string device;
    std::string request;
    std::filesystem::path path;
    std::uint64_t size = 0;
    std::string sha256;
    std::uint64_t files = 0;  // files of the folder that are sent
    std::uint64_t sent_parts = 0;
  };
  std::uint64_t parts_of(const File& file) const noexcept;

  std::uint64_t most_file_bytes_;
  std::size_t part_bytes_;
  std::deque<File> waiting_;
};

}  // namespace loopwarden::edge
