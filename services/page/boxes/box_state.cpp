// SPDX-License-Identifier: Apache-2.0
#include "services/page/boxes/box_state.hpp"

#include "daemon/protocol/ask.hpp"

namespace loopwarden::page {

std::shared_ptr<const BoxState> box_state_of(const nlohmann::json& answer) {
  auto state = std::make_shared<BoxState>();
  state->text = answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  state->about = protocol::read_answer<protocol::Description>(answer);
  for (std::size_t i = 0; i < state->about.loops.size(); ++i) {
    state->index[state->about.loops[i].tag] = i;
  }
  return state;
}

}  // namespace loopwarden::page
