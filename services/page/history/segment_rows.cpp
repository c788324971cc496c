// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/segment_rows.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <span>
#include <vector>

#include "record/record_csv.hpp"

namespace loopwarden::page::history {
namespace {

using record::RecordError;

constexpr std::uint32_t kRowsAtATime = 1024;
// Limit of damaged rows that a search skips.
constexpr std::uint32_t kMostSteps = 4096;
constexpr std::int64_t kNanosecondsPerMillisecond = 1'000'000;

[[noreturn]] void fail(const std::filesystem::path& path, RecordError::Kind kind,
                       const std::string& what) {
  throw RecordError(kind, 0, 0, path.string() + ": " + what);
}

// Reads up to the span's size; fewer bytes at the end of the file.
std::size_t read_at(int fd, std::span<char> bytes, std::size_t offset) {
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t n =
        ::pread(fd, bytes.data() + got, bytes.size() - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
  }
  return got;
}

}  // namespace

SegmentRows::SegmentRows(const std::filesystem::path& path)
    : path_(path), file_(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK) {
  struct stat status {};
  if (!file_.is_open() || ::fstat(file_.fd(), &status) != 0) {
    fail(path, RecordError::Kind::io, base::error_text(errno));
  }
  if (!S_ISREG(status.st_mode)) fail(path, RecordError::Kind::data, "not a segment");
  std::array<char, record::kSegmentHeaderBytes> head{};
  const std::size_t got = read_at(file_.fd(), head, 0);
  decoded_ = record::decode_header(std::span(head).first(got));
  if (decoded_.problem != nullptr) fail(path, RecordError::Kind::data, decoded_.problem);
  const auto size = static_cast<std::size_t>(status.st_size);
  const std::size_t places = size <= head.size() ? 0 : (size - head.size()) / decoded_.row_bytes;
  places_ = static_cast<std::uint32_t>(
      std::min<std::size_t>(places, std::numeric_limits<std::uint32_t>::max()));
}

void SegmentRows::read(std::uint32_t first, std::uint32_t last, const Each& each) const {
  const std::size_t row_bytes = decoded_.row_bytes;
  last = std::min(last, places_);
  std::vector<char> bytes(row_bytes * std::min(kRowsAtATime, last - std::min(first, last)));
  for (std::uint32_t place = first; place < last;) {
    const std::uint32_t wanted = std::min(kRowsAtATime, last - place);
    const std::size_t got = read_at(file_.fd(), std::span(bytes).first(wanted * row_bytes),
                                    record::kSegmentHeaderBytes + place * row_bytes) /
                            row_bytes;
    for (std::uint32_t i = 0; i < got; ++i) {
      const auto row = record::decode_row(std::span(bytes).subspan(i * row_bytes, row_bytes),
                                          place + i, decoded_.crc);
      if (!row) continue;
      const std::int64_t utc_ms =
          record::utc_ns(decoded_.header, *row) / kNanosecondsPerMillisecond;
      if (!each(*row, utc_ms, place + i)) return;
    }
    if (got < wanted) return;  // cut off meanwhile
    place += wanted;
  }
}

std::optional<std::int64_t> SegmentRows::time_at(std::uint32_t place) const {
  std::optional<std::int64_t> found;
  for (std::uint32_t step = 1; !found && place < places_ && step <= kMostSteps; step *= 8) {
    const std::uint32_t end = place + std::min(step, places_ - place);
    read(place, end, [&](const record::RecordRow&, std::int64_t utc_ms, std::uint32_t) {
      found = utc_ms;
      return false;
    });
    place = end;
  }
  return found;
}

std::uint32_t SegmentRows::place_of(std::int64_t utc_ms) const {
  std::uint32_t low = 0;
  std::uint32_t high = places_;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    const std::optional<std::int64_t> time = time_at(middle);
    // If only damaged rows follow, the row is not in the upper half.
    if (time && *time < utc_ms) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

std::optional<Block> SegmentRows::last() const {
  std::optional<Block> last;
  for (std::uint32_t step = 1; !last && step <= kMostSteps * 8; step *= 8) {
    read(places_ - std::min(step, places_), places_,
         [&](const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t place) {
           last = block_of(row, utc_ms, decoded_.header.run, place);
           return true;
         });
    if (step >= places_) break;
  }
  return last;
}

}  // namespace loopwarden::page::history
