// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "hal/iio/gpio_lines.hpp"

namespace loopwarden::tests {

// The state of one line, for the test to read and set.
struct FakeLine {
  std::atomic<bool> exists{true};
  std::atomic<bool> refuses{false};
  std::atomic<bool> hangs{false};  // a reader waits
  std::atomic<bool> active{false};
  std::atomic<bool> requested{false};
  std::atomic<int> edges{0};
};

class FakeGpio final : public hal::iio::GpioChips {
 public:
  using Lines = std::map<std::string, FakeLine>;
  explicit FakeGpio(std::shared_ptr<Lines> lines) : lines_(std::move(lines)) {}

  std::unique_ptr<hal::iio::GpioLine> request_input(const hal::iio::LineSettings& line) override {
    return request(line);
  }
  std::unique_ptr<hal::iio::GpioLine> request_output(const hal::iio::LineSettings& line,
                                                     bool active) override {
    auto requested = request(line);
    lines_->at(line.line).active = active;
    return requested;
  }

 private:
  class Line final : public hal::iio::GpioLine {
   public:
    explicit Line(FakeLine& line) : line_(line) { line_.requested = true; }
    ~Line() override { line_.requested = false; }
    std::optional<bool> read() noexcept override {
      while (line_.hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return line_.refuses ? std::nullopt : std::optional(line_.active.load());
    }
    bool write(bool active) noexcept override {
      if (line_.refuses) return false;
      if (line_.active.exchange(active) != active) ++line_.edges;
      return true;
    }

   private:
    FakeLine& line_;
  };

  std::unique_ptr<hal::iio::GpioLine> request(const hal::iio::LineSettings& line) {
    const auto found = lines_->find(line.line);
    if (found == lines_->end() || !found->second.exists) throw std::runtime_error("no such line");
    return std::make_unique<Line>(found->second);
  }

  std::shared_ptr<Lines> lines_;
};

}  // namespace loopwarden::tests
