// SPDX-License-Identifier: Apache-2.0
#include "record/import/byte_source.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

class GzipFile : public ByteSource {
 public:
  GzipFile(const std::filesystem::path& path, std::string name) : name_(std::move(name)) {
    base::File file = path == "-" ? base::File(::dup(STDIN_FILENO)) : base::File(path, O_RDONLY);
    if (!file.is_open())
      refuse(name_, "can't be opened: " + base::error_text(errno), RecordError::Kind::io);
    struct stat about {};
    if (::fstat(file.fd(), &about) == 0) {
      if (S_ISDIR(about.st_mode)) refuse(name_, "is a folder", RecordError::Kind::io);
      if (S_ISREG(about.st_mode)) file_bytes_ = static_cast<std::uint64_t>(about.st_size);
    }
    if (file_bytes_ > 20) {
      // RFC 1952: a gzip file ends with its unpacked size, modulo 4 GiB.
      std::array<unsigned char, 4> tail{};
      std::array<unsigned char, 2> head{};
      unpacked_bytes_ = file_bytes_;
      if (::pread(file.fd(), head.data(), 2, 0) == 2 && head[0] == 0x1F && head[1] == 0x8B &&
          ::pread(file.fd(), tail.data(), 4, about.st_size - 4) == 4) {
        std::uint64_t stated = 0;
        for (std::size_t k = 4; k-- > 0;) stated = stated << 8U | tail[k];
        unpacked_bytes_ = believable_bytes(stated, file_bytes_);
      }
    }
    file_ = gzdopen(file.fd(), "rb");
    if (file_ == nullptr) refuse(name_, "can't be read: no memory", RecordError::Kind::io);
    file.release();
    gzbuffer(file_, 128U * 1024U);
  }
  GzipFile(const GzipFile&) = delete;
  GzipFile& operator=(const GzipFile&) = delete;
  ~GzipFile() override {
    if (file_ != nullptr) gzclose(file_);
  }

  std::size_t read(char* to, std::size_t most) override {
    const int got = gzread(file_, to, static_cast<unsigned>(most));
    int code = 0;
    if (got < 0) {
      const char* what = gzerror(file_, &code);
      if (code == Z_ERRNO)
        refuse(name_, "can't be read: " + base::error_text(errno), RecordError::Kind::io);
      refuse(name_, fmt::format("is a damaged gzip file ({})", what));
    }
    if (got > 0) return static_cast<std::size_t>(got);
    // zlib reports only here that the last block was cut.
    gzerror(file_, &code);
    if (code == Z_BUF_ERROR) refuse(name_, "is a gzip file that ends too early");
    return 0;
  }
  double share_read() const noexcept override {
    const auto at = gzoffset(file_);
    return at > 0 && file_bytes_ > 0 ? static_cast<double>(at) / static_cast<double>(file_bytes_)
                                     : 0.0;
  }
  std::uint64_t unpacked_bytes() const noexcept override { return unpacked_bytes_; }
  const char* packing() const noexcept override { return gzdirect(file_) == 0 ? "gzip" : ""; }

 private:
  std::string name_;
  gzFile file_ = nullptr;
  std::uint64_t file_bytes_ = 0;
  std::uint64_t unpacked_bytes_ = 0;
};

}  // namespace

std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, std::string name) {
  return std::make_unique<GzipFile>(path, std::move(name));
}

std::string read_all(ByteSource& source, std::size_t most, const std::string& name) {
  constexpr std::size_t kBlock = 64UL * 1024UL;
  std::string all;
  while (true) {
    const std::size_t before = all.size();
    all.resize(before + kBlock);
    const std::size_t got = source.read(all.data() + before, kBlock);
    all.resize(before + got);
    if (got == 0) return all;
    if (all.size() > most) refuse(name, fmt::format("is larger than {} MiB", most >> 20U));
  }
}

std::string plain_name(std::string_view name, const std::string& other) {
  if (name.empty() || !base::is_utf8(name)) return other;
  std::string plain(name);
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const auto byte = static_cast<unsigned char>(plain[k]);
    const bool of_two =
        byte == 0xC2 && static_cast<unsigned char>(plain[k + 1]) < 0xA0;  // U+0080 to 9F
    if (of_two) plain.erase(k, 1);
    if (byte < 0x20 || byte == 0x7F || of_two) plain[k] = '?';
  }
  return plain;
}

std::uint64_t believable_bytes(std::uint64_t stated, std::uint64_t on_disk) noexcept {
  constexpr std::uint64_t kTimes = 40;
  return std::min(stated, kTimes * on_disk);
}

}  // namespace loopwarden::record
