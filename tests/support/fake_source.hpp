// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/contract/loop_source.hpp"

namespace loopwarden::tests {

// A source with values set by the test.
class FakeSource final : public hal::LoopSource {
 public:
  void open() override {}
  void close() noexcept override {}
  void read(hal::SourceInputs& out) noexcept override { out = inputs; }
  hal::IoCounters counters() const noexcept override { return {}; }

  // Returns a good value, taken now by a live source.
  static void set(hal::SourceSample& value, double number, std::int64_t now_ns) {
    value.sample = {.value = number,
                    .time_ns = now_ns,
                    .sequence = value.sample.sequence + 1,
                    .quality = hal::Quality::good,
                    .reason = hal::Reason::none};
    value.alive_ns = now_ns;
  }

  hal::SourceInputs inputs;
};

}  // namespace loopwarden::tests
