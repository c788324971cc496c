// SPDX-License-Identifier: Apache-2.0
#include "services/edge/file_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "base/digest/digest.hpp"
#include "services/edge/box_model.hpp"

namespace loopwarden::edge {
namespace {

namespace fs = std::filesystem;
using sparkplug::DataType;

const char* content_type(const std::string& extension) {
  if (extension == ".json") return "application/json";
  if (extension == ".csv") return "text/csv";
  if (extension == ".html") return "text/html";
  return "application/yaml";
}

}  // namespace

std::string FileParts::add(const std::string& device, const std::string& request,
                           const fs::path& folder) {
  if (waiting_.size() >= kMostFolders * evidence_files().size()) {
    return "not now: too many files wait";
  }
  std::string left_out;
  std::vector<File> added;
  for (const std::string& name : evidence_files()) {
    std::error_code error;
    const fs::path path = folder / name;
    if (!fs::is_regular_file(path, error) || error) continue;
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) continue;
    if (size > most_file_bytes_) {
      left_out += fmt::format("{} is larger than {} bytes; ", name, most_file_bytes_);
      continue;
    }
    try {
      added.push_back({device, request, path, size, base::sha256_hex_of_file(path), 0, 0});
    } catch (const std::runtime_error& e) {
      left_out += fmt::format("{}; ", e.what());
    }
  }
  for (File& file : added) {
    file.files = added.size();
    waiting_.push_back(std::move(file));
  }
  if (added.empty() && left_out.empty()) {
    return "refused: no file exists, or the service has no permission to read it";
  }
  if (left_out.empty()) return "";
  return (added.empty() ? "refused: " : "left out: ") + left_out.substr(0, left_out.size() - 2);
}

std::uint64_t FileParts::parts_of(const File& file) const noexcept {
  return std::max<std::uint64_t>(1, (file.size + part_bytes_ - 1) / part_bytes_);
}

std::optional<FileParts::Part> FileParts::next() {
  while (!waiting_.empty()) {
    File& file = waiting_.front();
    const std::uint64_t part = file.sent_parts;
    const std::uint64_t start = part * part_bytes_;
    std::string bytes(std::min<std::uint64_t>(part_bytes_, file.size - start), '\0');
    std::ifstream stream(file.path, std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(start));
    stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const bool whole = stream && static_cast<std::size_t>(stream.gcount()) == bytes.size();
    const std::string folder = file.path.parent_path().filename().string();
    Part out{file.device, {}};
    sparkplug::Metric& metric = out.metric;
    metric.name = "file/" + file.path.filename().string();
    metric.type = DataType::file;
    metric.value = sparkplug::Bytes{std::move(bytes)};
    metric.metadata =
        sparkplug::MetaData{.multi_part = true,
                            .content_type = content_type(file.path.extension().string()),
                            .size = file.size,
                            .part = part,
                            .file_name = file.path.filename().string(),
                            .file_type = file.path.extension().string().substr(1),
                            .md5 = {},
                            .description = folder};
    metric.properties = {
        {"part", DataType::uint64, part},          {"parts", DataType::uint64, parts_of(file)},
        {"sha256", DataType::string, file.sha256}, {"folder", DataType::string, folder},
        {"files", DataType::uint64, file.files},   {"request", DataType::string, file.request}};
    if (whole) return out;
    waiting_.pop_front();
  }
  return std::nullopt;
}

void FileParts::gone() {
  File& file = waiting_.front();
  if (++file.sent_parts == parts_of(file)) waiting_.pop_front();
}

}  // namespace loopwarden::edge
