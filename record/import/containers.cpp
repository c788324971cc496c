// SPDX-License-Identifier: Apache-2.0
#include "record/import/containers.hpp"

#include <fcntl.h>

#include <algorithm>
#include <utility>

#include "base/file.hpp"
#include "base/text.hpp"
#include "record/import/archive.hpp"
#include "record/import/line_protocol.hpp"
#include "record/import/workbook.hpp"

namespace loopwarden::record {
namespace {

namespace fs = std::filesystem;

constexpr const char* kContentTypes = "[Content_Types].xml";  // present in all workbooks

}  // namespace

bool is_container(const fs::path& path) {
  std::error_code none;
  if (!fs::is_regular_file(path, none)) return false;
  const base::File file(path, O_RDONLY);
  const auto head = file.is_open() ? file.read(100) : std::nullopt;
  return head && (head->starts_with("PK\x03\x04") || head->starts_with("PK\x05\x06")) &&
         head->find("application/vnd.oasis") == head->npos;
}

std::optional<fs::path> container_of(const fs::path& path) {
  const std::string whole = path.string();
  for (std::size_t slash = whole.find('/', 1); slash != whole.npos && slash + 1 < whole.size();
       slash = whole.find('/', slash + 1)) {
    fs::path before = whole.substr(0, slash);
    std::error_code none;
    if (fs::is_directory(before, none)) continue;
    if (is_container(before)) return before;
    return std::nullopt;
  }
  return std::nullopt;
}

struct Containers::Opened {
  fs::path path;
  std::shared_ptr<Archive> archive;
  std::unique_ptr<Workbook> book;  // null: an archive of files
};

Containers::Containers() = default;
Containers::~Containers() = default;

const Containers::Opened& Containers::opened(const fs::path& container) {
  if (last_ && last_->path == container) return *last_;
  auto opened = std::make_unique<Opened>();
  opened->path = container;
  opened->archive = std::make_shared<Archive>(container);
  const Archive& archive = *opened->archive;
  if (archive.find(kContentTypes) < archive.members().size()) {
    opened->book = std::make_unique<Workbook>(
        [parts = opened->archive,
         name = container.string()](const std::string& part) -> std::unique_ptr<ByteSource> {
          const std::size_t member = parts->find(part, true);
          if (member == parts->members().size()) return nullptr;
          return parts->open(member, name + "/" + part);
        },
        container.string());
  }
  last_ = std::move(opened);
  return *last_;
}

std::vector<ContainerMember> Containers::members(const fs::path& container) {
  const Opened& from = opened(container);
  std::vector<ContainerMember> members;
  // operator/ of fs::path would treat a name that begins with '/' as absolute.
  const auto path_of = [&](const std::string& name) {
    return fs::path(container.string() + "/" + name);
  };
  if (from.book) {
    const auto& sheets = from.book->sheets();
    for (const Workbook::Sheet& sheet : sheets) {
      members.push_back(
          {path_of(sheet.name), sheets.size() == 1 ? container.stem().string() : sheet.name, true});
    }
    return members;
  }
  for (const ArchiveMember& member : from.archive->members()) {
    if (member.name.ends_with('/')) continue;
    members.push_back({path_of(member.name), fs::path(member.name).stem().string(), false});
  }
  return members;
}

namespace {

std::unique_ptr<TextSource> as_table(std::unique_ptr<TextSource> text) {
  constexpr std::size_t kLooked = 20;  // lines
  return is_line_protocol(text->peek(kLooked)) ? protocol_table(std::move(text)) : std::move(text);
}

}  // namespace

std::unique_ptr<TextSource> Containers::open(const fs::path& path, Encoding encoding) {
  const std::string name = path == "-" ? "standard input" : path.string();
  const auto container = path == "-" ? std::nullopt : container_of(path);
  if (!container)
    return as_table(std::make_unique<TextSource>(open_file(path, name), name, encoding));
  const Opened& from = opened(*container);
  const std::string inside = path.string().substr(container->string().size() + 1);
  if (!from.book) {
    const std::size_t member = from.archive->find(inside);
    if (member == from.archive->members().size())
      refuse(name, "the archive has no such member", RecordError::Kind::io);
    return as_table(std::make_unique<TextSource>(from.archive->open(member, name), name, encoding));
  }
  const auto& sheets = from.book->sheets();
  const auto sheet = std::find_if(sheets.begin(), sheets.end(),
                                  [&](const Workbook::Sheet& one) { return one.name == inside; });
  if (sheet == sheets.end()) refuse(name, "the workbook has no such sheet", RecordError::Kind::io);
  // `from` may close: a sheet keeps its archive open.
  return std::make_unique<TextSource>(
      last_->book->open(static_cast<std::size_t>(sheet - sheets.begin()), name), name,
      Encoding::utf8);
}

}  // namespace loopwarden::record
