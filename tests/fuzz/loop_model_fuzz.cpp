// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a loop model. The reader must not crash. An accepted model is written back
// equal and can be simulated.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "config/loop_model_reader.hpp"
#include "config/loop_model_writer.hpp"
#include "model/plant/simulated_loop.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace loopwarden;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto model = config::read_model_text("fuzz.yaml", text);
  if (!model) {
    if (config::to_text(model.diagnostics).empty()) std::abort();
    return 0;
  }
  const auto again = config::read_model_text("again.yaml", config::write_model(*model));
  if (!again || *again != *model) std::abort();
  constexpr std::size_t kMostEffects = 50;  // a longer chain only costs time
  if (model->valve_effects.size() + model->process_effects.size() > kMostEffects) return 0;
  plant::SimulatedLoop loop(*model);
  for (int i = 0; i < 10; ++i) loop.step();
  return 0;
}
