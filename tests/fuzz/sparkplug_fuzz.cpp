// SPDX-License-Identifier: Apache-2.0
// Any bytes as a Sparkplug payload, from a broker that anybody may write to: decoded or refused, and what was decoded
// goes through a host's view and an edge's commands without harm.
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "fleet/edge/command.hpp"
#include "fleet/sparkplug/host_state.hpp"
#include "fleet/sparkplug/node_view.hpp"
#include "fleet/sparkplug/payload.hpp"
#include "fleet/sparkplug/topic.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace loopwarden;
using sparkplug::MessageType;
using tests::fuzz::require;

bool has_opaque(const sparkplug::Payload& payload) {
  for (const sparkplug::Metric& metric : payload.metrics) {
    if (std::holds_alternative<sparkplug::Opaque>(metric.value)) return true;
    for (const sparkplug::Property& property : metric.properties) {
      if (std::holds_alternative<sparkplug::Opaque>(property.value)) return true;
    }
  }
  return false;
}

// NaN is not equal to itself, so the bytes are compared.
void check_again(const sparkplug::Payload& payload) {
  if (has_opaque(payload)) return;
  const std::string once = sparkplug::encode(payload, sparkplug::Types::sent);
  require(sparkplug::encode(sparkplug::decode(once), sparkplug::Types::sent) == once,
          "what was decoded is encoded and decoded the same");
}

void take(sparkplug::NodeView& view, MessageType type, const char* device,
          sparkplug::Payload payload) {
  try {
    const sparkplug::Verdict verdict = view.take({"g", type, "e", device}, payload);
    require(verdict.usable || *verdict.why != '\0', "a reason");
  } catch (const sparkplug::BadPayload&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto topic = sparkplug::parse_topic(bytes))
    require(to_text(*topic) == bytes, "a topic");
  if (const auto state = sparkplug::parse_host_state(bytes)) {
    require(sparkplug::parse_host_state(to_text(*state)) == state, "a state");
  }
  try {
    const sparkplug::Payload payload = sparkplug::decode(bytes);
    check_again(payload);
    for (const bool of_device : {false, true}) edge::read_command(payload.metrics, of_device);
    sparkplug::NodeView view;
    take(view, MessageType::nbirth, "", payload);
    take(view, MessageType::dbirth, "d", payload);
    take(view, MessageType::ddata, "d", payload);
    take(view, MessageType::ndeath, "", payload);
  } catch (const sparkplug::BadPayload&) {
  }
  return 0;
}
