// SPDX-License-Identifier: Apache-2.0
#include "record/import/archive.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <utility>

#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

constexpr std::uint64_t kMostMembers = 10'000;
constexpr std::uint64_t kMostBytes = 4'000'000'000;
constexpr std::uint64_t kMostTimes = 200;  // unpacked bytes per packed byte

class MemberBytes : public ByteSource {
 public:
  MemberBytes(std::shared_ptr<zip> archive, std::size_t member, std::uint64_t bytes,
              std::uint64_t archive_bytes, std::string name)
      : archive_(std::move(archive)),
        file_(zip_fopen_index(archive_.get(), member, 0)),
        bytes_(bytes),
        archive_bytes_(archive_bytes),
        name_(std::move(name)) {
    if (file_ == nullptr) {
      refuse(name_, fmt::format("can't be unpacked: {}", zip_strerror(archive_.get())));
    }
  }
  MemberBytes(const MemberBytes&) = delete;
  MemberBytes& operator=(const MemberBytes&) = delete;
  ~MemberBytes() override {
    if (file_ != nullptr) zip_fclose(file_);
  }

  std::size_t read(char* to, std::size_t most) override {
    const zip_int64_t got = zip_fread(file_, to, most);
    if (got < 0) refuse(name_, fmt::format("can't be unpacked: {}", zip_file_strerror(file_)));
    read_ += static_cast<std::uint64_t>(got);
    if (read_ > bytes_) refuse(name_, "is longer than stated in the directory of its archive");
    if (got == 0 && read_ < bytes_)
      refuse(name_, "is shorter than stated in the directory of its archive");
    return static_cast<std::size_t>(got);
  }
  double share_read() const noexcept override {
    return bytes_ == 0 ? 0.0 : static_cast<double>(read_) / static_cast<double>(bytes_);
  }
  std::uint64_t unpacked_bytes() const noexcept override {
    return believable_bytes(bytes_, archive_bytes_);
  }
  const char* packing() const noexcept override { return "zip"; }

 private:
  std::shared_ptr<zip> archive_;
  zip_file_t* file_;
  std::uint64_t bytes_;
  std::uint64_t archive_bytes_;
  std::string name_;
  std::uint64_t read_ = 0;
};

}  // namespace

Archive::Archive(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code problem;
  file_bytes_ = std::filesystem::file_size(path, problem);
  int code = 0;
  zip_t* opened = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (opened == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    const bool by_system = zip_error_system_type(&error) == ZIP_ET_SYS || code == ZIP_ER_NOENT;
    zip_error_fini(&error);
    if (by_system) refuse(name, "can't be opened: " + why, RecordError::Kind::io);
    refuse(name, "is a damaged archive: " + why);
  }
  zip_ = std::shared_ptr<zip>(opened, [](zip* archive) { zip_discard(archive); });
  const auto count =
      static_cast<std::uint64_t>(std::max<zip_int64_t>(0, zip_get_num_entries(opened, 0)));
  if (count > kMostMembers)
    refuse(name, fmt::format("has {} members, more than {}", count, kMostMembers));
  std::uint64_t all = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    zip_stat_t about;
    zip_stat_init(&about);
    if (zip_stat_index(opened, k, 0, &about) != 0)
      refuse(name, fmt::format("is a damaged archive: {}", zip_strerror(opened)));
    ArchiveMember member;
    member.name = plain_name((about.valid & ZIP_STAT_NAME) != 0 ? about.name : "",
                             fmt::format("member {}", k + 1));
    if ((about.valid & ZIP_STAT_SIZE) != 0) member.bytes = about.size;
    member.encrypted =
        (about.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && about.encryption_method != ZIP_EM_NONE;
    // The archive states these sizes; a sum of two may overflow 64 bits.
    all = member.bytes > kMostBytes ? kMostBytes + 1 : all + member.bytes;
    if (all > kMostBytes)
      refuse(name, fmt::format("has more than {} GB when unpacked", kMostBytes / 1'000'000'000));
    members_.push_back(std::move(member));
  }
  if (all > kMostTimes * file_bytes_) {
    refuse(name, fmt::format("is {} bytes, and {} when unpacked: more than {} times as much",
                             file_bytes_, all, kMostTimes));
  }
}

std::size_t Archive::find(std::string_view name, bool any_case) const {
  const std::string wanted = any_case ? base::lower_case(name) : std::string(name);
  const auto at = std::find_if(members_.begin(), members_.end(), [&](const ArchiveMember& member) {
    return any_case ? base::lower_case(member.name) == wanted : member.name == wanted;
  });
  return static_cast<std::size_t>(at - members_.begin());
}

std::unique_ptr<ByteSource> Archive::open(std::size_t member, std::string name) const {
  const ArchiveMember& about = members_.at(member);
  if (about.encrypted) refuse(name, "is encrypted, which is not read");
  return std::make_unique<MemberBytes>(zip_, member, about.bytes, file_bytes_, std::move(name));
}

}  // namespace loopwarden::record
