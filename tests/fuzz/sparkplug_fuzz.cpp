// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a Sparkplug payload from a broker with public write access. The payload is
// decoded or refused. A decoded payload passes through the host's ingest and an edge's commands
// without harm.
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/edge/command.hpp"
#include "services/fleet/host/ingest.hpp"
#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/topic.hpp"
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

// Uses the bytes as each message of a node's life.
void live(const std::string& bytes) {
  fleet::Ingest ingest;
  std::vector<fleet::Arrival> arrivals;
  const auto say = [&](MessageType type, const char* device) {
    arrivals.push_back({to_text(sparkplug::Topic{"g", type, "e", device}), bytes, 0, false});
  };
  say(MessageType::nbirth, "");
  say(MessageType::dbirth, "d");
  say(MessageType::ddata, "d");
  say(MessageType::ndata, "");
  say(MessageType::ndeath, "");
  fleet::Batch batch = ingest.prepare(arrivals, 0);
  require(batch.counts.messages == arrivals.size(), "each is looked at");
  for (const fleet::ValueRow& row : batch.rows.values) {
    require(row.metric < row.book->metrics.size(), "a metric of the birth");
  }
  ingest.commit(std::move(batch));
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
  } catch (const sparkplug::BadPayload&) {
  }
  live(std::string(bytes));
  return 0;
}
