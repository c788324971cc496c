// SPDX-License-Identifier: Apache-2.0
#include "record/segment_ring.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <new>
#include <system_error>
#include <utility>

#include "record/record_csv.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::record {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kSmallestLimit = 64UL * 1024UL;
constexpr std::size_t kSmallestSegment = 8UL * 1024UL;
constexpr std::size_t kLargestSegment = 4UL * 1024UL * 1024UL;
constexpr std::size_t kSegmentsPerLimit = 16;

std::int64_t clock_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

// Returns when a row was taken. Rows wait before they are written. Rows of an
// accelerated simulation have another clock, so the present time is used for them.
std::int64_t utc_of(const RecordRow& row) noexcept {
  constexpr std::int64_t kLongestWait = 300'000'000'000;  // longer than the capacity of a queue
  const std::int64_t waited = clock_ns(CLOCK_MONOTONIC) - row.time_ns;
  return clock_ns(CLOCK_REALTIME) - (waited >= 0 && waited < kLongestWait ? waited : 0);
}

// Returns 0 if its header can't be read.
std::int64_t start_utc_ms(const std::filesystem::path& path) noexcept {
  const base::File file(path, O_RDONLY);
  std::array<char, kSegmentHeaderBytes> bytes{};
  if (!file.is_open() ||
      ::pread(file.fd(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return 0;
  }
  try {
    const DecodedHeader decoded = decode_header(bytes);
    return decoded.problem == nullptr ? decoded.header.start_utc_ns / 1'000'000 : 0;
  } catch (const std::bad_alloc&) {
    return 0;
  }
}

// Releases the allocated space after `bytes`. Without success the space stays allocated until the
// segment is deleted.
void release_rest(int fd, std::size_t bytes) noexcept {
  (void)!::ftruncate(fd, static_cast<off_t>(bytes));
}

// After a crash the newest segment still has its allocated space.
void release_rest(const SegmentFile& segment) noexcept {
  const base::File file(segment.path, O_WRONLY);
  struct stat status {};
  if (!file.is_open() || ::fstat(file.fd(), &status) != 0) return;
  const auto bytes = static_cast<std::size_t>(status.st_size);
  constexpr std::size_t kBlock = 512;  // of st_blocks
  if (static_cast<std::size_t>(status.st_blocks) * kBlock > disk_bytes(bytes)) {
    release_rest(file.fd(), bytes);
  }
}

bool disk_is_full(int error) noexcept { return error == ENOSPC || error == EDQUOT; }

}  // namespace

SegmentWriter::SegmentWriter(SegmentSettings settings) : settings_(std::move(settings)) {
  if (!std::isfinite(settings_.period_s) || settings_.period_s <= 0.0) {
    throw RecordError(RecordError::Kind::data, 0, 0,
                      settings_.folder.string() + ": the period must be above 0 s");
  }
  settings_.limit_bytes = std::max(settings_.limit_bytes, kSmallestLimit);
  const std::size_t segment_bytes =
      std::clamp(settings_.limit_bytes / kSegmentsPerLimit, kSmallestSegment, kLargestSegment);
  rows_per_segment_ =
      static_cast<std::uint32_t>((segment_bytes - kSegmentHeaderBytes) / kSegmentRowBytes);
  for (SegmentFile& segment : list_segments(settings_.folder)) {
    next_sequence_ = std::max(next_sequence_, segment.sequence + 1);
    ended_.push_back(std::move(segment));
  }
  if (!ended_.empty()) release_rest(ended_.back());
  look_for_oldest();
}

SegmentWriter::~SegmentWriter() {
  write_pending();
  end_segment();
}

void SegmentWriter::append(std::span<const RecordRow> rows) noexcept {
  try {
    pending_.insert(pending_.end(), rows.begin(), rows.end());
  } catch (const std::exception&) {
    failed("memory for the recording", ENOMEM);
    status_.rows_lost += rows.size();
  }
  if (pending_.size() >= settings_.most_pending) write_pending();
}

void SegmentWriter::write_pending() noexcept {
  const std::uint64_t written_before = status_.rows;
  try {
    write_all(pending_);
  } catch (const std::exception&) {
    failed("memory for the recording", ENOMEM);
  }
  status_.rows_lost += pending_.size() - (status_.rows - written_before);
  pending_.clear();
}

void SegmentWriter::write_all(std::span<const RecordRow> rows) {
  if (retry_at_ && Clock::now() < *retry_at_) return;
  retry_at_.reset();
  while (!rows.empty()) {
    if (!file_.is_open() && !begin_segment(rows.front())) return;
    const auto some =
        rows.first(std::min<std::size_t>(rows.size(), rows_per_segment_ - rows_in_segment_));
    if (!write_rows(some)) {
      end_segment();
      return;
    }
    rows = rows.subspan(some.size());
    if (rows_in_segment_ == rows_per_segment_) {
      end_segment();
      may_make_room_ = true;
    }
  }
}

// A failure is reported by the sync that follows.
void SegmentWriter::start_writing(unsigned flags) const noexcept {
  if (unsynced_) ::sync_file_range(file_.fd(), 0, 0, flags);
}

void SegmentWriter::sync_all(std::span<SegmentWriter* const> writers) noexcept {
  // The data of all files are on their way, and the blocks for them chosen, before the first sync.
  // It therefore stores the metadata of all files, and the others find nothing left to store.
  for (SegmentWriter* writer : writers) {
    writer->write_pending();
    writer->start_writing(SYNC_FILE_RANGE_WRITE);
  }
  for (const SegmentWriter* writer : writers) {
    writer->start_writing(SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE |
                          SYNC_FILE_RANGE_WAIT_AFTER);
  }
  for (SegmentWriter* writer : writers) {
    if (writer->unsynced_ && !writer->sync()) writer->end_segment();
  }
}

bool SegmentWriter::write_rows(std::span<const RecordRow> rows) {
  std::vector<char> bytes(rows.size() * kSegmentRowBytes);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    encode(rows[i], rows_in_segment_ + static_cast<std::uint32_t>(i), header_crc_,
           std::span(bytes).subspan(i * kSegmentRowBytes, kSegmentRowBytes));
  }
  const std::size_t offset = kSegmentHeaderBytes + rows_in_segment_ * kSegmentRowBytes;
  bool written = file_.write_at(bytes.data(), bytes.size(), offset);
  if (!written && disk_is_full(errno) && make_room()) {
    written = file_.write_at(bytes.data(), bytes.size(), offset);
  }
  if (!written) {
    failed("writing a segment", errno);
    // A torn tail would be recognised; cutting it releases the space.
    if (::ftruncate(file_.fd(), static_cast<off_t>(offset)) != 0)
      failed("cutting a segment", errno);
    return false;
  }
  rows_in_segment_ += static_cast<std::uint32_t>(rows.size());
  status_.rows += rows.size();
  unsynced_ = true;
  return true;
}

bool SegmentWriter::begin_segment(const RecordRow& first) {
  std::error_code error;
  std::filesystem::create_directories(settings_.folder, error);
  if (error) {
    failed("creating the folder of segments", error.value());
    return false;
  }
  const std::size_t full = disk_bytes(kSegmentHeaderBytes + rows_per_segment_ * kSegmentRowBytes);
  while (!ended_.empty() && bytes_of_all() + full > settings_.limit_bytes) {
    if (!drop_oldest()) return false;
  }
  if (create_segment(first)) return true;
  if (disk_is_full(errno) && make_room() && create_segment(first)) return true;
  failed("creating a segment", errno);
  return false;
}

// Returns false, with the reason in errno and without leaving a file, if the disk refuses.
bool SegmentWriter::create_segment(const RecordRow& first) {
  sequence_ = next_sequence_++;
  path_ = settings_.folder / segment_name(sequence_);
  const std::int64_t start_utc_ns = utc_of(first);
  const EncodedHeader header = encode(SegmentHeader{.sequence = sequence_,
                                                    .run = run_ == 0 ? sequence_ : run_,
                                                    .loop = settings_.loop,
                                                    .period_s = settings_.period_s,
                                                    .start_utc_ns = start_utc_ns,
                                                    .start_monotonic_ns = first.time_ns});
  base::File file(path_, O_WRONLY | O_CREAT | O_EXCL);
  if (!file.is_open()) return false;
  const auto all = static_cast<off_t>(kSegmentHeaderBytes + rows_per_segment_ * kSegmentRowBytes);
  // A file system without this function is used without it.
  const bool no_room =
      ::fallocate(file.fd(), FALLOC_FL_KEEP_SIZE, 0, all) != 0 && disk_is_full(errno);
  if (no_room || !file.write(header.bytes.data(), header.bytes.size())) {
    const int error = errno;
    file.close();
    ::unlink(path_.c_str());
    errno = error;
    return false;
  }
  base::sync_folder(settings_.folder);
  file_ = std::move(file);
  header_crc_ = header.crc;
  rows_in_segment_ = 0;
  unsynced_ = true;
  if (run_ == 0) run_ = sequence_;
  if (status_.oldest_utc_ms == 0) status_.oldest_utc_ms = start_utc_ns / 1'000'000;
  return true;
}

void SegmentWriter::end_segment() noexcept {
  if (!file_.is_open()) return;
  if (rows_in_segment_ < rows_per_segment_) release_rest(file_.fd(), bytes_of_rows());
  if (unsynced_) sync();
  const std::size_t bytes = bytes_of_open();
  if (!file_.close()) failed("closing a segment", errno);
  try {
    ended_.push_back({std::move(path_), sequence_, bytes});
  } catch (const std::bad_alloc&) {
    // This segment is not tracked until the next start, which finds it in the folder.
    failed("memory for the recording", ENOMEM);
  }
}

bool SegmentWriter::sync() noexcept {
  unsynced_ = false;
  if (!file_.sync()) {
    failed("waiting for the disk", errno);
    return false;
  }
  ++status_.syncs;
  return true;
}

bool SegmentWriter::make_room() noexcept {
  return std::exchange(may_make_room_, false) && drop_oldest();
}

// Deletes the oldest segment. If it can't be deleted, it stays, still counts for the limit, and the
// next one is deleted.
bool SegmentWriter::drop_oldest() noexcept {
  for (auto segment = ended_.begin(); segment != ended_.end(); ++segment) {
    if (::unlink(segment->path.c_str()) == 0 || errno == ENOENT) {
      ended_.erase(segment);
      ++status_.segments_dropped;
      look_for_oldest();
      return true;
    }
    failed_step_ = "deleting the oldest segment";
    failed_errno_ = errno;
  }
  if (!ended_.empty()) failed(failed_step_, failed_errno_);
  return false;
}

void SegmentWriter::look_for_oldest() noexcept {
  status_.oldest_utc_ms = 0;
  for (const SegmentFile& segment : ended_) {
    if ((status_.oldest_utc_ms = start_utc_ms(segment.path)) != 0) return;
  }
  if (file_.is_open()) status_.oldest_utc_ms = start_utc_ms(path_);
}

std::size_t SegmentWriter::bytes_of_rows() const noexcept {
  return kSegmentHeaderBytes + rows_in_segment_ * kSegmentRowBytes;
}

std::size_t SegmentWriter::bytes_of_open() const noexcept {
  return file_.is_open() ? disk_bytes(bytes_of_rows()) : 0;
}

std::size_t SegmentWriter::bytes_of_all() const noexcept {
  std::size_t bytes = bytes_of_open();
  for (const SegmentFile& segment : ended_) bytes += segment.disk_bytes;
  return bytes;
}

void SegmentWriter::failed(const char* step, int error) noexcept {
  ++status_.disk_errors;
  failed_step_ = step;
  failed_errno_ = error;
  retry_at_ = Clock::now() + settings_.retry_interval;
}

SegmentStatus SegmentWriter::status() const {
  SegmentStatus status = status_;
  status.bytes = bytes_of_all();
  status.pending = pending_.size();
  if (failed_step_ != nullptr) {
    status.last_error =
        settings_.folder.string() + ": " + failed_step_ + ": " + base::error_text(failed_errno_);
  }
  return status;
}

}  // namespace loopwarden::record
