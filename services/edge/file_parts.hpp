// SPDX-License-Identifier: Apache-2.0
// Evidence on request: the files of one folder, part after part.
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

  // Queues what the folder holds of evidence_files(), as the answer to what `request` asked for. Returns what there is to
  // say: empty, "refused: ..." where no file will come, "left out: ..." where some won't, "not now: ...".
  std::string add(const std::string& device, const std::string& request,
                  const std::filesystem::path& folder);

  struct Part {
    std::string device;
    sparkplug::Metric metric;  // file/NAME, of type File
  };
  // The next part, the same again until it is gone(); nullopt if there is none. A file that can't be read any further ends.
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
    std::uint64_t files = 0;  // of the folder, that come
    std::uint64_t sent_parts = 0;
  };
  std::uint64_t parts_of(const File& file) const noexcept;

  std::uint64_t most_file_bytes_;
  std::size_t part_bytes_;
  std::deque<File> waiting_;
};

}  // namespace loopwarden::edge
