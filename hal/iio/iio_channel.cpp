// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/iio_channel.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace loopwarden::hal::iio {
namespace {

namespace fs = std::filesystem;
using Kind = ChannelError::Kind;

[[noreturn]] void fail_errno(const fs::path& file, const char* what, int error) {
  // Errors of a device that was unplugged or unbound.
  const bool gone = error == ENODEV || error == ENXIO || error == ENOENT;
  throw ChannelError(
      gone ? Kind::absent : Kind::refused,
      fmt::format("{}: {}: {}", file.string(), what, std::generic_category().message(error)));
}

std::string first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

double number(std::string_view text, const fs::path& file) {
  text = text.substr(0, text.find('\n'));
  while (text.ends_with(' ')) text.remove_suffix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    throw ChannelError(Kind::garbage,
                       fmt::format("{}: '{}' is not a number", file.string(), text.substr(0, 40)));
  }
  return value;
}

// A driver has scale and offset for one channel, or shares them: "in_voltage0_scale",
// "in_voltage_scale" for the type, "in_scale" for the direction, "scale" for the device.
std::optional<double> attribute(const fs::path& device, std::string_view direction,
                                const std::string& channel, std::string_view what) {
  std::string type = channel;  // "voltage0-voltage1" is of type "voltage-voltage"
  std::erase_if(type, [](char c) { return c >= '0' && c <= '9'; });
  for (const std::string& name : {fmt::format("{}_{}_{}", direction, channel, what),
                                  fmt::format("{}_{}_{}", direction, type, what),
                                  fmt::format("{}_{}", direction, what), std::string(what)}) {
    const fs::path file = device / name;
    std::error_code error;
    if (fs::exists(file, error)) return number(first_line(file), file);
  }
  return std::nullopt;
}

}  // namespace

fs::path find_device(const fs::path& root, const std::string& device) {
  std::vector<fs::path> found;
  std::vector<std::string> others;
  std::error_code error;
  for (fs::directory_iterator entry(root, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string name = first_line(path / "name");
    const std::string label = first_line(path / "label");
    if (name == device || label == device) {
      found.push_back(path);
    } else if (!name.empty()) {
      others.push_back(label.empty() ? name : label);
    }
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    std::sort(others.begin(), others.end());
    throw ChannelError(
        Kind::absent,
        fmt::format("no IIO device in {} has the name or label '{}'; {}", root.string(), device,
                    others.empty() ? "there is none at all"
                                   : fmt::format("there: {}", fmt::join(others, ", "))));
  }
  // The numbers of the two devices change from boot to boot.
  throw ChannelError(
      Kind::absent,
      fmt::format("{} IIO devices in {} have the name or label '{}'; give them labels",
                  found.size(), root.string(), device));
}

IioChannel::IioChannel(const fs::path& root, const ChannelSettings& settings, Direction direction) {
  if (settings.channel.empty() || settings.channel.find('/') != std::string::npos) {
    throw ChannelError(Kind::absent, fmt::format("'{}' can't be a channel", settings.channel));
  }
  const fs::path device = find_device(root, settings.device);
  const std::string_view prefix = direction == Direction::in ? "in" : "out";
  value_file_ = device / fmt::format("{}_{}_raw", prefix, settings.channel);
  scale_ = settings.scale ? *settings.scale
                          : attribute(device, prefix, settings.channel, "scale").value_or(1.0);
  offset_ = settings.offset ? *settings.offset
                            : attribute(device, prefix, settings.channel, "offset").value_or(0.0);
  if (scale_ == 0.0) {
    throw ChannelError(Kind::garbage, fmt::format("{}: its scale is 0", value_file_.string()));
  }
  const int flags = direction == Direction::in ? O_RDONLY : O_RDWR;
  fd_ = ::open(value_file_.c_str(), flags | O_CLOEXEC);
  if (fd_ < 0 && direction == Direction::out && errno != ENOENT) {
    // Some converters can't report their present value.
    readable_ = false;
    fd_ = ::open(value_file_.c_str(), O_WRONLY | O_CLOEXEC);
  }
  if (fd_ < 0) fail_errno(value_file_, "can't be opened", errno);
}

IioChannel::IioChannel(IioChannel&& other) noexcept
    : value_file_(std::move(other.value_file_)),
      fd_(std::exchange(other.fd_, -1)),
      readable_(other.readable_),
      scale_(other.scale_),
      offset_(other.offset_) {}

IioChannel& IioChannel::operator=(IioChannel&& other) noexcept {
  std::swap(value_file_, other.value_file_);
  std::swap(fd_, other.fd_);
  readable_ = other.readable_;
  scale_ = other.scale_;
  offset_ = other.offset_;
  return *this;
}

IioChannel::~IioChannel() {
  if (fd_ >= 0) ::close(fd_);
}

double IioChannel::read_raw() const {
  // Reading from the start makes sysfs ask the driver again.
  std::array<char, 64> text;
  const ssize_t got = ::pread(fd_, text.data(), text.size(), 0);
  if (got < 0) fail_errno(value_file_, "can't be read", errno);
  return number({text.data(), static_cast<std::size_t>(got)}, value_file_);
}

void IioChannel::write_raw(std::int64_t raw) const {
  const std::string text = std::to_string(raw) + "\n";
  const ssize_t written = ::pwrite(fd_, text.data(), text.size(), 0);
  if (written < 0) fail_errno(value_file_, "can't be written", errno);
  if (static_cast<std::size_t>(written) != text.size()) {
    throw ChannelError(Kind::refused, value_file_.string() + ": written in part only");
  }
}

}  // namespace loopwarden::hal::iio
