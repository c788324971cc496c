// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/spool.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "base/digest/digest.hpp"

namespace loopwarden::fleet {
namespace {

namespace fs = std::filesystem;

// Precedes each record. The check sum covers the bytes after it.
struct Head {
  std::uint32_t crc = 0;
  std::uint32_t topic_bytes = 0;
  std::uint32_t payload_bytes = 0;
  std::int64_t received_ms = 0;
};
constexpr std::size_t kHeadBytes = 20;
constexpr std::uint32_t kMostRecordBytes = 16U * 1024U * 1024U;
constexpr const char* kSuffix = ".spool";

std::array<char, kHeadBytes> bytes_of(const Head& head) {
  std::array<char, kHeadBytes> bytes{};
  std::memcpy(bytes.data(), &head.crc, 4);
  std::memcpy(bytes.data() + 4, &head.topic_bytes, 4);
  std::memcpy(bytes.data() + 8, &head.payload_bytes, 4);
  std::memcpy(bytes.data() + 12, &head.received_ms, 8);
  return bytes;
}

Head head_of(const std::array<char, kHeadBytes>& bytes) {
  Head head;
  std::memcpy(&head.crc, bytes.data(), 4);
  std::memcpy(&head.topic_bytes, bytes.data() + 4, 4);
  std::memcpy(&head.payload_bytes, bytes.data() + 8, 4);
  std::memcpy(&head.received_ms, bytes.data() + 12, 8);
  return head;
}

std::uint32_t crc_of(const std::array<char, kHeadBytes>& head, const std::string& topic,
                     const std::string& payload) {
  const std::uint32_t of_head = base::crc32(std::span(head).subspan(4));
  return base::crc32(payload, base::crc32(topic, of_head));
}

std::size_t size_of(const Arrival& arrival) {
  return kHeadBytes + arrival.topic.size() + arrival.payload.size();
}

// Returns the next record, or nullopt at the end of the file or at damaged data.
std::optional<Arrival> read_record(std::istream& in) {
  std::array<char, kHeadBytes> bytes{};
  if (!in.read(bytes.data(), kHeadBytes)) return std::nullopt;
  const Head head = head_of(bytes);
  if (head.topic_bytes > kMostRecordBytes || head.payload_bytes > kMostRecordBytes) {
    return std::nullopt;
  }
  Arrival arrival{std::string(head.topic_bytes, '\0'), std::string(head.payload_bytes, '\0'),
                  head.received_ms, false};
  in.read(arrival.topic.data(), head.topic_bytes);
  if (!in.read(arrival.payload.data(), head.payload_bytes)) return std::nullopt;
  return crc_of(bytes, arrival.topic, arrival.payload) == head.crc ? std::optional(arrival)
                                                                   : std::nullopt;
}

}  // namespace

Spool::Spool(SpoolSettings settings) : settings_(std::move(settings)) {
  std::error_code error;
  fs::create_directories(settings_.folder, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: {}", settings_.folder.string(), error.message()));
  }
  take_over_files();
}

void Spool::take_over_files() {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(settings_.folder)) {
    if (entry.path().extension() == kSuffix) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  for (const fs::path& path : paths) {
    File file{.path = path, .left_over = true};
    std::ifstream in(path, std::ios::binary);
    while (const std::optional<Arrival> arrival = read_record(in)) {
      file.bytes += size_of(*arrival);
      ++file.messages;
    }
    const std::uint64_t number = std::strtoull(path.stem().c_str(), nullptr, 10);
    next_number_ = std::max(next_number_, number + 1);
    files_.push_back(file);
  }
}

void Spool::push(Arrival arrival) {
  const std::lock_guard lock(mutex_);
  const std::size_t bytes = size_of(arrival);
  const bool on_disk = !files_.empty() || memory_bytes_ + bytes > settings_.memory_bytes;
  if (on_disk && spill() && append(arrival)) return;
  if (memory_bytes_ + bytes > settings_.memory_bytes) {
    ++dropped_;
    return;
  }
  memory_bytes_ += bytes;
  memory_.push_back(std::move(arrival));
}

void Spool::to_disk() {
  const std::lock_guard lock(mutex_);
  spill();
}

// Writes the messages in memory to the disk. Returns false if that fails.
bool Spool::spill() {
  while (!memory_.empty()) {
    if (!append(memory_.front())) return false;
    memory_bytes_ -= size_of(memory_.front());
    memory_.pop_front();
  }
  return true;
}

bool Spool::append(const Arrival& arrival) {
  while (!files_.empty() && bytes_on_disk() >= settings_.limit_bytes) drop_oldest();
  const bool room =
      !files_.empty() && writer_.is_open() && files_.back().bytes < settings_.file_bytes;
  if (!room && !open_file()) return false;
  Head head{.topic_bytes = static_cast<std::uint32_t>(arrival.topic.size()),
            .payload_bytes = static_cast<std::uint32_t>(arrival.payload.size()),
            .received_ms = arrival.received_ms};
  head.crc = crc_of(bytes_of(head), arrival.topic, arrival.payload);
  writer_.write(bytes_of(head).data(), kHeadBytes);
  writer_.write(arrival.topic.data(), static_cast<std::streamsize>(arrival.topic.size()));
  writer_.write(arrival.payload.data(), static_cast<std::streamsize>(arrival.payload.size()));
  // Hands the data to the kernel at once, so that a kill of the process does not lose it.
  if (!writer_.flush()) {
    writer_.close();  // a truncated record ends its file
    writer_.clear();
    return false;
  }
  files_.back().bytes += size_of(arrival);
  ++files_.back().messages;
  return true;
}

bool Spool::open_file() {
  sync_file();
  writer_.close();
  writer_.clear();
  const fs::path path = settings_.folder / fmt::format("{:012}{}", next_number_, kSuffix);
  writer_.open(path, std::ios::binary | std::ios::trunc);
  if (!writer_) return false;
  ++next_number_;
  files_.push_back({.path = path});
  return true;
}

void Spool::sync() {
  const std::lock_guard lock(mutex_);
  sync_file();
}

void Spool::sync_file() {
  if (!writer_.is_open() || files_.empty()) return;
  const int fd = ::open(files_.back().path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  ::fdatasync(fd);
  ::close(fd);
}

void Spool::drop_oldest() {
  dropped_ += files_.front().messages;
  remove_front();
}

void Spool::remove_front() {
  if (files_.size() == 1) writer_.close();
  std::error_code ignored;
  fs::remove(files_.front().path, ignored);
  files_.pop_front();
}

std::vector<Arrival> Spool::peek(std::size_t most) {
  const std::lock_guard lock(mutex_);
  // Removes files that are read completely or are unreadable.
  for (;;) {
    peeked_disk_ = !files_.empty();
    if (!peeked_disk_) break;
    std::vector<Arrival> arrivals = peek_disk(most);
    if (!arrivals.empty()) return arrivals;
    dropped_ += files_.front().messages;
    remove_front();
  }
  peeked_ = 0;
  std::size_t bytes = 0;
  while (peeked_ < std::min(most, memory_.size()) && bytes < kMostPeekedBytes) {
    bytes += size_of(memory_[peeked_++]);
  }
  return {memory_.begin(), memory_.begin() + static_cast<std::ptrdiff_t>(peeked_)};
}

std::vector<Arrival> Spool::peek_disk(std::size_t most) {
  const File& file = files_.front();
  std::vector<Arrival> arrivals;
  peeked_file_ = file.path;
  peeked_to_ = file.read;
  std::ifstream in(file.path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(file.read));
  const std::uint64_t end = std::min(file.bytes, file.read + kMostPeekedBytes);
  while (arrivals.size() < most && peeked_to_ < end) {
    std::optional<Arrival> arrival = read_record(in);
    if (!arrival) break;
    arrival->left_over = file.left_over;
    peeked_to_ += size_of(*arrival);
    arrivals.push_back(std::move(*arrival));
  }
  peeked_ = arrivals.size();
  return arrivals;
}

void Spool::pop() {
  const std::lock_guard lock(mutex_);
  if (!peeked_disk_) {
    // Messages seen by peek() may have been moved to the disk since. They are then read again from
    // there.
    for (std::size_t i = 0; i < peeked_ && !memory_.empty() && files_.empty(); ++i) {
      memory_bytes_ -= size_of(memory_.front());
      memory_.pop_front();
    }
  } else if (!files_.empty() && files_.front().path == peeked_file_) {
    File& file = files_.front();
    file.read = peeked_to_;
    file.messages -= peeked_;
    if (file.read >= file.bytes) remove_front();
  }
  peeked_ = 0;
}

bool Spool::empty() const {
  const std::lock_guard lock(mutex_);
  return files_.empty() && memory_.empty();
}

std::uint64_t Spool::bytes_on_disk() const {
  std::uint64_t bytes = 0;
  for (const File& file : files_) bytes += file.bytes;
  return bytes;
}

std::uint64_t Spool::disk_bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_on_disk();
}

std::uint64_t Spool::waiting() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t messages = memory_.size();
  for (const File& file : files_) messages += file.messages;
  return messages;
}

std::uint64_t Spool::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

double Spool::fill() const {
  return static_cast<double>(disk_bytes()) / static_cast<double>(settings_.limit_bytes);
}

}  // namespace loopwarden::fleet
